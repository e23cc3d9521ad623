"""A layer's grid rolls, is filled and merged as Nav2's is."""

import numpy as np
import pytest

from drake_navbench.kernels.grid import FREE, LETHAL, NO_INFORMATION, Grid
from drake_navbench.kernels.layer_grid import (
    MergeRule,
    fill_outline,
    merge_layer,
    moved_cells,
    rolled_origin,
)

L, U = LETHAL, NO_INFORMATION


def numbered(rows=4, columns=5):
    return np.arange(rows * columns, dtype=np.uint8).reshape(rows, columns)


# Rolling window


def test_moved_cells_keep_what_both_grids_share_and_reset_the_others():
    moved = moved_cells(numbered(), (0.0, 0.0), (2.0, 1.0), resolution=1.0, default=NO_INFORMATION)
    np.testing.assert_array_equal(
        moved, [[7, 8, 9, U, U], [12, 13, 14, U, U], [17, 18, 19, U, U], [U, U, U, U, U]]
    )


def test_cells_that_move_left_come_in_on_the_left():
    moved = moved_cells(numbered(), (0.0, 0.0), (-1.0, 0.0), resolution=1.0, default=FREE)
    np.testing.assert_array_equal(moved[:, 0], [0, 0, 0, 0])
    np.testing.assert_array_equal(moved[:, 1:], numbered()[:, :4])


def test_moved_cells_are_a_new_array_even_where_nothing_moves():
    before = numbered()
    moved = moved_cells(before, (0.3, 0.0), (0.3, 0.0), resolution=0.1, default=FREE)
    np.testing.assert_array_equal(moved, before)
    assert not np.shares_memory(moved, before)


def test_moving_beyond_the_window_resets_everything():
    moved = moved_cells(numbered(), (0.0, 0.0), (100.0, 0.0), resolution=0.5, default=3)
    assert np.all(moved == 3)


def corner(origin, x, y, *, resolution=1.0, is_short=False):
    """Where a window of 4 x 6 cells lies once it has followed a robot to (x, y)."""
    pose = np.array([x, y, 0.0])
    return rolled_origin(origin, (4, 6), resolution=resolution, robot_pose=pose, is_short=is_short)


def test_a_window_follows_by_whole_cells_and_lags_by_up_to_one():
    # Wanted: x - 3, y - 2.
    assert corner((0.0, 0.0), 5.3, 3.9) == (2.0, 1.0)
    assert corner((0.0, 0.0), 1.1, 1.1) == (-1.0, 0.0)
    assert corner((0.0, 0.0), 3.99, 2.99) == corner((0.0, 0.0), 2.01, 1.01) == (0.0, 0.0)


def test_up_to_kilted_a_window_lies_a_quarter_of_a_cell_off():
    # Half a cell short: wanted are x - 2.75, y - 1.75.
    assert corner((0.0, 0.0), 3.8, 2.8, is_short=True) == (1.0, 1.0)
    assert corner((0.0, 0.0), 3.8, 2.8) == (0.0, 0.0)


def test_origin_stays_on_the_lattice_of_the_first_one():
    x, y = 0.01, -0.02
    for k in range(50):
        x, y = corner((x, y), 0.013 * k, -0.017 * k, resolution=0.05)
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
