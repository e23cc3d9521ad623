"""Cells of a costmap: where points fall, how far, and which cells a line visits."""

import copy
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_navbench.kernels.grid import (
    LETHAL,
    Costmap,
    Grid,
    distance_to_cells,
    distances_to_lethal,
    line_max_cost,
    world_to_cell,
)

OUTSIDE = (-1, -1)


def cell(x, y):
    """Cell of a point on a grid of 4 columns and 3 rows of 0.5 m with its corner at (1, -2)."""
    return world_to_cell(x, y, 1.0, -2.0, 0.5, 4, 3)


def visited(start, end, size=12):
    """Cells that a line visits, found by putting a cost on one cell after the other."""
    costs = np.zeros((size, size), dtype=np.uint8)
    cells = set()
    for row, column in np.ndindex(size, size):
        costs[row, column] = 1
        if line_max_cost(costs, *start, *end):
            cells.add((column, row))
        costs[row, column] = 0
    return cells


# Points and cells


def test_point_falls_into_the_cell_that_holds_it():
    assert cell(1.0, -2.0) == (0, 0)
    assert cell(1.49, -1.51) == (0, 0)
    assert cell(1.5, -1.5) == (1, 1)
    assert cell(2.99, -0.51) == (3, 2)


@pytest.mark.parametrize(
    ("x", "y"), [(0.99, -1.0), (2.0, -2.01), (3.0, -1.0), (2.0, -0.5), (99.0, 99.0)]
)
def test_point_off_the_grid_has_no_cell(x, y):
    assert cell(x, y) == OUTSIDE


@pytest.mark.parametrize(
    ("distance", "resolution", "cells"),
    [
        (0.0, 0.05, 0),
        (-1.0, 0.05, 0),
        (0.05, 0.05, 1),
        (0.051, 0.05, 2),
        (0.7, 0.05, 14),
        (0.6, 0.03, 20),
        # A map message holds its resolution as float32: 0.60 / 0.02999999933 = 20.0000004
        (0.6, float(np.float32(0.03)), 21),
    ],
)
def test_distance_in_cells_rounds_up_without_tolerance(distance, resolution, cells):
    assert distance_to_cells(distance, resolution) == cells


# Lines


def test_line_visits_both_ends_and_all_between():
    assert visited((2, 3), (5, 3)) == {(2, 3), (3, 3), (4, 3), (5, 3)}
    assert visited((2, 5), (2, 3)) == {(2, 3), (2, 4), (2, 5)}
    assert visited((7, 7), (7, 7)) == {(7, 7)}
    assert visited((1, 1), (4, 4)) == {(1, 1), (2, 2), (3, 3), (4, 4)}


def test_error_starts_at_half_the_dominant_extent():
    # 5 columns, 2 rows: error 2, then 4, 6 -> step, 1, 3, 5 -> step, 0, 2.
    assert visited((0, 0), (5, 2)) == {(0, 0), (1, 0), (2, 1), (3, 1), (4, 2), (5, 2)}


def test_direction_decides_ties():
    # 4 columns, 2 rows: error 2, then 4 -> step, 0, 2, 4 -> step, 0.
    assert visited((0, 0), (4, 2)) == {(0, 0), (1, 1), (2, 1), (3, 2), (4, 2)}
    assert visited((4, 2), (0, 0)) == {(4, 2), (3, 1), (2, 1), (1, 0), (0, 0)}


def test_line_returns_its_largest_cost():
    costs = np.array([[3, 200, 9, 255, 9]], dtype=np.uint8)
    assert line_max_cost(costs, 0, 0, 2, 0) == 200
    assert line_max_cost(costs, 0, 0, 4, 0) == 255


def test_line_stops_at_the_given_cost():
    costs = np.array([[3, LETHAL, 255]], dtype=np.uint8)
    assert line_max_cost(costs, 0, 0, 2, 0) == LETHAL
    # From the other end the unknown cell comes first, but the line still ends at the lethal one.
    assert line_max_cost(costs, 2, 0, 0, 0) == LETHAL


ends = st.tuples(st.integers(0, 11), st.integers(0, 11))


@settings(deadline=None, max_examples=40)
@given(start=ends, end=ends)
def test_line_is_one_connected_chain_near_the_straight_line(start, end):
    cells = visited(start, end)
    extent = max(abs(end[0] - start[0]), abs(end[1] - start[1]))
    assert len(cells) == extent + 1
    assert {start, end} <= cells
    length = math.hypot(end[0] - start[0], end[1] - start[1]) or 1.0
    for x, y in cells:
        cross = (x - start[0]) * (end[1] - start[1]) - (y - start[1]) * (end[0] - start[0])
        assert abs(cross) / length <= 0.5 * math.sqrt(2.0)


@settings(deadline=None, max_examples=40)
@given(start=ends, end=ends)
def test_mirrored_line_visits_mirrored_cells(start, end):
    mirrored = visited((start[0], 11 - start[1]), (end[0], 11 - end[1]))
    assert mirrored == {(x, 11 - y) for x, y in visited(start, end)}


# Distances


def test_distances_to_lethal_cells_are_those_of_the_nearest_centre_and_the_nearest_corner():
    costs = np.zeros((8, 12), dtype=np.uint8)
    costs[0, 0] = 253
    # Cells of 2 m: centres at (9, 13) m and (21, 1) m, corners at (8, 12) m and (20, 0) m.
    costs[6, 4] = costs[0, 10] = LETHAL
    grid = Grid(costs, 0.0, 0.0, 2.0)
    assert distances_to_lethal(grid, 9.0, 8.0) == (5.0, math.hypot(1.0, 4.0))
    assert distances_to_lethal(grid, 8.0, 7.0) == (math.hypot(1.0, 6.0), 5.0)
    assert distances_to_lethal(grid, 17.0, 4.0) == (5.0, 5.0)
    assert distances_to_lethal(grid._replace(costs=costs[1:6]), 0.0, 0.0) == (math.inf, math.inf)


# Costmap


def test_costmap_is_a_snapshot_that_cannot_change():
    costs = np.zeros((2, 3), dtype=np.uint8)
    costmap = Costmap(costs, 0.0, 0.0, 0.5)
    costs[0, 0] = LETHAL
    assert costmap.costs[0, 0] == 0
    with pytest.raises(ValueError, match="read-only"):
        costmap.costs[0, 0] = 1
    assert copy.deepcopy(costmap) is costmap


def test_costmap_lists_the_centres_of_its_lethal_cells():
    costs = np.array([[0, LETHAL, 253], [LETHAL, 255, 0]], dtype=np.uint8)
    costmap = Costmap(costs, 10.0, -1.0, 0.5)
    np.testing.assert_allclose(costmap.lethal_centres, [[10.75, -0.75], [10.25, -0.25]])


def test_costmap_extends_over_all_its_cells():
    costmap = Costmap(np.zeros((2, 3), dtype=np.uint8), 0.0, 0.0, 0.5)
    assert (costmap.size_x_m, costmap.size_y_m) == (1.5, 1.0)


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e300])
def test_a_coordinate_that_is_no_place_is_outside(value):
    assert world_to_cell(0.5, value, 0.0, 0.0, 0.1, 10, 10) == (-1, -1)
    assert world_to_cell(value, 0.5, 0.0, 0.0, 0.1, 10, 10) == (-1, -1)
