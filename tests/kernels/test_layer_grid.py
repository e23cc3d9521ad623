"""A layer's grid rolls, is filled and merged as Nav2's is."""

import numpy as np
import pytest

from drake_navbench.kernels.grid import FREE, LETHAL, NO_INFORMATION, Grid
from drake_navbench.kernels.layer_grid import (
    MergeRule,
    fill_outline,
    merge_layer,
    roll_window,
)

L, U = LETHAL, NO_INFORMATION


def numbered(rows=4, columns=5):
    return np.arange(rows * columns, dtype=np.uint8).reshape(rows, columns)


# Rolling window


def test_rolling_keeps_the_shared_cells_and_resets_the_others():
    rolled, x, y = roll_window(
        numbered(), (0.0, 0.0), resolution=1.0, wanted=(2.3, 1.9), default_cost=NO_INFORMATION
    )
    assert (x, y) == (2.0, 1.0)
    np.testing.assert_array_equal(
        rolled, [[7, 8, 9, U, U], [12, 13, 14, U, U], [17, 18, 19, U, U], [U, U, U, U, U]]
    )


def test_rolling_backwards_truncates_toward_zero():
    rolled, x, y = roll_window(
        numbered(), (0.0, 0.0), resolution=1.0, wanted=(-1.9, -0.9), default_cost=FREE
    )
    assert (x, y) == (-1.0, 0.0)
    np.testing.assert_array_equal(rolled[:, 0], [0, 0, 0, 0])
    np.testing.assert_array_equal(rolled[:, 1:], numbered()[:, :4])


def test_window_lags_by_up_to_a_cell_in_either_direction():
    for wanted in (0.99, -0.99):
        _, x, _ = roll_window(
            numbered(), (0.0, 0.0), resolution=1.0, wanted=(wanted, 0.0), default_cost=FREE
        )
        assert x == 0.0


def test_rolling_beyond_the_window_resets_everything():
    rolled, x, _ = roll_window(
        numbered(), (0.0, 0.0), resolution=0.5, wanted=(100.2, 0.0), default_cost=3
    )
    assert x == 100.0
    assert np.all(rolled == 3)


def test_origin_stays_on_the_lattice_of_the_first_one():
    costs, x, y = numbered(), 0.01, -0.02
    for k in range(50):
        costs, x, y = roll_window(
            costs, (x, y), resolution=0.05, wanted=(0.013 * k, -0.017 * k), default_cost=FREE
        )
    assert (x - 0.01) / 0.05 == pytest.approx(round((x - 0.01) / 0.05), abs=1e-9)
    assert (y + 0.02) / 0.05 == pytest.approx(round((y + 0.02) / 0.05), abs=1e-9)


# Footprint


def test_filling_sets_outline_and_inside():
    costs = np.full((6, 7), LETHAL, dtype=np.uint8)
    fill_outline(Grid(costs, 0.0, 0.0, 1.0), np.array([[1.5, 1.5], [5.5, 1.5], [3.5, 4.5]]), FREE)
    # Edge (5, 1) -> (3, 4): error 3 // 2 = 1, then 3 -> step, 2, 4 -> step: columns 5, 4, 4, 3.
    # Edge (3, 4) -> (1, 1): likewise columns 3, 2, 2, 1.
    expected = np.array(
        [
            [L, L, L, L, L, L, L],
            [L, 0, 0, 0, 0, 0, L],
            [L, L, 0, 0, 0, L, L],
            [L, L, 0, 0, 0, L, L],
            [L, L, L, 0, L, L, L],
            [L, L, L, L, L, L, L],
        ]
    )
    np.testing.assert_array_equal(costs, expected)


def test_outline_partly_off_the_grid_fills_nothing():
    costs = np.full((6, 7), LETHAL, dtype=np.uint8)
    fill_outline(Grid(costs, 0.0, 0.0, 1.0), np.array([[1.5, 1.5], [7.0, 1.5], [3.5, 4.5]]), FREE)
    assert np.all(costs == LETHAL)


def test_two_vertices_fill_nothing():
    costs = np.full((6, 7), LETHAL, dtype=np.uint8)
    fill_outline(Grid(costs, 0.0, 0.0, 1.0), np.array([[1.5, 1.5], [5.5, 1.5]]), FREE)
    assert np.all(costs == LETHAL)


# Merging


@pytest.mark.parametrize(
    ("rule", "expected"),
    # master:  10 10 10 255 255 255 254
    # layer:    0 20 255  0  20 255   0
    [
        (MergeRule.OVERWRITE, [0, 20, 10, 0, 20, 255, 0]),
        (MergeRule.MAX, [10, 20, 10, 0, 20, 255, 254]),
        (MergeRule.MAX_KEEP_UNKNOWN, [10, 20, 10, 255, 255, 255, 254]),
        (MergeRule.TRUE_OVERWRITE, [0, 20, 255, 0, 20, 255, 0]),
    ],
)
def test_layer_is_merged_by_the_rule(rule, expected):
    master = np.array([[10, 10, 10, 255, 255, 255, 254]], dtype=np.uint8)
    layer = np.array([[0, 20, 255, 0, 20, 255, 0]], dtype=np.uint8)
    merge_layer(master, layer, rule)
    np.testing.assert_array_equal(master, [expected])
