"""Shapes become the cells whose centres they hold; masks become costs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_navbench.kernels.grid import LETHAL, NO_INFORMATION, Grid
from drake_navbench.kernels.rasterize import apply_keepout, mark_polygon, mask_costs

L = LETHAL
TRIANGLE = np.array([[0.5, 0.5], [4.5, 0.5], [4.5, 4.5]])


def polygon_cells(vertices, *, shape=(6, 6), origin=(0.0, 0.0), resolution=1.0):
    costs = np.zeros(shape, dtype=np.uint8)
    mark_polygon(
        Grid(costs, *map(float, origin), float(resolution)), np.array(vertices, dtype=float)
    )
    return costs


def test_box_covers_the_cells_whose_centres_it_holds():
    # Centres lie at 0.5, 1.5, ...: the box from (0.6, 1.4) to (3.4, 2.6) holds x 1.5, 2.5 and
    # y 1.5, 2.5.
    costs = polygon_cells([[0.6, 1.4], [3.4, 1.4], [3.4, 2.6], [0.6, 2.6]])
    expected = np.zeros((6, 6), dtype=np.uint8)
    expected[1:3, 1:3] = L
    np.testing.assert_array_equal(costs, expected)


def test_centres_on_the_edge_and_on_corners_count_as_inside():
    expected = np.array(
        [
            [L, L, L, L, L, 0],
            [0, L, L, L, L, 0],
            [0, 0, L, L, L, 0],
            [0, 0, 0, L, L, 0],
            [0, 0, 0, 0, L, 0],
            [0, 0, 0, 0, 0, 0],
        ]
    )
    np.testing.assert_array_equal(polygon_cells(TRIANGLE), expected)
    np.testing.assert_array_equal(polygon_cells(TRIANGLE[::-1]), expected)


def test_rounding_does_not_decide_about_edges_on_centres():
    # Left and right edge lie on centres of columns 2 and 8 at 0.1 m: 7 columns, 3 rows.
    box = np.array([[0.25, 0.15], [0.85, 0.15], [0.85, 0.35], [0.25, 0.35]])
    for shift in np.arange(0.0, 10.0, 0.7):
        costs = polygon_cells(box + shift, shape=(10, 12), origin=(shift, shift), resolution=0.1)
        assert np.count_nonzero(costs) == 21
        assert np.all(costs[1:4, 2:9] == L)


def test_notch_of_a_concave_polygon_stays_free():
    u_shape = [[0, 0], [5, 0], [5, 4], [3, 4], [3, 2], [2, 2], [2, 4], [0, 4]]
    costs = polygon_cells(u_shape)
    np.testing.assert_array_equal(costs[3], [L, L, 0, L, L, 0])
    np.testing.assert_array_equal(costs[0], [L, L, L, L, L, 0])


def test_parts_off_the_grid_are_ignored():
    everything = polygon_cells([[-9, -9], [99, -9], [99, 99], [-9, 99]])
    assert np.all(everything == L)
    outside = polygon_cells([[-9, 1], [-1, 1], [-1, 3], [-9, 3]])
    assert not outside.any()


def test_polygon_thinner_than_a_cell_between_centres_leaves_no_trace():
    assert not polygon_cells([[0.0, 1.6], [6.0, 1.6], [6.0, 2.4], [0.0, 2.4]]).any()


@settings(deadline=None)
@given(
    corners=st.lists(st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)), min_size=3, max_size=7)
)
def test_mirrored_polygon_marks_mirrored_cells(corners):
    vertices = np.array(corners)
    plain = polygon_cells(vertices, shape=(8, 8), origin=(-4.0, -4.0))
    mirrored = polygon_cells(vertices * [1, -1], shape=(8, 8), origin=(-4.0, -4.0))
    np.testing.assert_array_equal(mirrored, plain[::-1])


def test_polygon_moved_by_whole_cells_marks_moved_cells():
    moved = polygon_cells(TRIANGLE + 1.0)
    np.testing.assert_array_equal(moved[1:, 1:], polygon_cells(TRIANGLE)[:-1, :-1])


def test_marking_leaves_other_cells_alone():
    costs = np.full((6, 6), 7, dtype=np.uint8)
    mark_polygon(Grid(costs, 0.0, 0.0, 1.0), TRIANGLE)
    assert set(np.unique(costs)) == {7, LETHAL}
    assert costs[5, 5] == 7


@pytest.mark.parametrize(
    ("value", "cost"),
    # 254 * 99 / 100 = 251.46, 254 * 1 / 100 = 2.54, 254 * 50 / 100 = 127, 254 * 25 / 100 = 63.5
    [(0, 0), (1, 3), (25, 64), (50, 127), (99, 251), (100, 254), (-1, NO_INFORMATION)],
)
def test_mask_value_scales_to_a_cost(value, cost):
    assert mask_costs(np.array([[value]], dtype=np.int8))[0, 0] == cost


def test_keepout_raises_and_never_lowers():
    costs = np.array([[0, 100, 253, 254, 255]], dtype=np.uint8)
    mask = np.array([[200, 50, 254, 10, 3]], dtype=np.uint8)
    apply_keepout(Grid(costs, 0.0, 0.0, 1.0), Grid(mask, 0.0, 0.0, 1.0), np.zeros(3), -1)
    np.testing.assert_array_equal(costs, [[200, 100, 254, 254, 3]])


def test_unknown_part_of_a_keepout_mask_writes_nothing():
    costs = np.array([[0, 100, 255]], dtype=np.uint8)
    unknown = np.full((1, 3), 255, np.uint8)
    apply_keepout(Grid(costs, 0.0, 0.0, 1.0), Grid(unknown, 0.0, 0.0, 1.0), np.zeros(3), -1)
    np.testing.assert_array_equal(costs, [[0, 100, 255]])


def test_keepout_override_replaces_every_cost_it_would_write():
    costs = np.array([[0, 100, 240]], dtype=np.uint8)
    mask = np.array([[50, 254, 100]], dtype=np.uint8)
    apply_keepout(Grid(costs, 0.0, 0.0, 1.0), Grid(mask, 0.0, 0.0, 1.0), np.zeros(3), 200)
    np.testing.assert_array_equal(costs, [[200, 200, 240]])


def test_keepout_mask_on_another_lattice_is_read_at_the_cell_centres():
    costs = np.zeros((1, 4), dtype=np.uint8)
    # Cells of 2 m from x = 1: centres 0.5 off the mask, 1.5 and 2.5 in its first cell, 3.5 second.
    mask = np.array([[10, 20]], dtype=np.uint8)
    apply_keepout(Grid(costs, 0.0, 0.0, 1.0), Grid(mask, 1.0, 0.0, 2.0), np.zeros(3), -1)
    np.testing.assert_array_equal(costs, [[0, 10, 10, 20]])
