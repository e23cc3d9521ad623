"""Denoising frees small groups of obstacle cells and nothing else."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import label

from drake_navbench.kernels.denoise import denoise
from drake_navbench.kernels.grid import INSCRIBED, LETHAL, NO_INFORMATION

L, I, U = LETHAL, INSCRIBED, NO_INFORMATION  # noqa: E741

# A pair along an edge, a pair at a corner, a single cell, and a cost that is no obstacle.
SPECKS = np.array(
    [
        [L, L, 0, 0, 0, 0, L],
        [0, 0, 0, 0, 0, 0, 0],
        [0, I, 0, 0, 252, 0, 0],
        [L, 0, 0, 0, 0, 0, 0],
    ],
    dtype=np.uint8,
)


def without(costs, *cells):
    expected = costs.copy()
    for row, column in cells:
        expected[row, column] = 0
    return expected


def test_single_cells_go_and_pairs_stay():
    np.testing.assert_array_equal(denoise(SPECKS), without(SPECKS, (0, 6)))


def test_corners_do_not_join_cells_when_four_connected():
    np.testing.assert_array_equal(
        denoise(SPECKS, group_connectivity_type=4), without(SPECKS, (0, 6), (2, 1), (3, 0))
    )


def test_connectivity_other_than_four_counts_as_eight():
    np.testing.assert_array_equal(
        denoise(SPECKS, group_connectivity_type=5), denoise(SPECKS, group_connectivity_type=8)
    )


def test_groups_below_the_minimal_size_go():
    costs = np.zeros((5, 9), dtype=np.uint8)
    costs[0, 0:3] = L
    costs[2, 0:4] = L
    costs[4, 0:5] = L
    expected = costs.copy()
    expected[0] = expected[2] = 0
    np.testing.assert_array_equal(denoise(costs, minimal_group_size=5), expected)


@pytest.mark.parametrize("size", [1, 0, -3])
def test_minimal_size_of_one_removes_nothing(size):
    np.testing.assert_array_equal(denoise(SPECKS, minimal_group_size=size), SPECKS)


def test_graded_costs_neither_go_nor_keep_a_neighbour():
    costs = np.array([[252, L, 252]], dtype=np.uint8)
    np.testing.assert_array_equal(denoise(costs), [[252, 0, 252]])


def test_unknown_cells_count_as_obstacles_only_when_asked():
    costs = np.array([[L, U, 0, 0, U]], dtype=np.uint8)
    np.testing.assert_array_equal(denoise(costs), [[0, U, 0, 0, U]])
    np.testing.assert_array_equal(denoise(costs, unknown_is_obstacle=True), [[L, U, 0, 0, 0]])


@settings(deadline=None)
@given(
    seed=st.integers(0, 1000),
    size=st.integers(2, 9),
    connectivity=st.sampled_from([4, 8]),
    share=st.floats(0.05, 0.6),
)
def test_groups_agree_with_labelled_components(seed, size, connectivity, share):
    generator = np.random.default_rng(seed)
    costs = np.where(generator.random((20, 25)) < share, LETHAL, 0).astype(np.uint8)
    structure = np.ones((3, 3)) if connectivity == 8 else None
    labels, _ = label(costs, structure)
    sizes = np.bincount(labels.ravel())
    expected = np.where(sizes[labels] < size, 0, costs)
    denoised = denoise(costs, minimal_group_size=size, group_connectivity_type=connectivity)
    np.testing.assert_array_equal(denoised, expected)


def test_input_stays_unchanged_and_may_be_read_only():
    costs = SPECKS.copy()
    costs.flags.writeable = False
    denoised = denoise(costs)
    np.testing.assert_array_equal(costs, SPECKS)
    assert denoised is not costs
