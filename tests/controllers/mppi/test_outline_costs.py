"""Remembered outline costs are those that the outline has."""

import math

import numpy as np
import pytest

from drake_navbench.controllers.mppi.critics import outline_costs
from drake_navbench.controllers.mppi.critics.base import MapView
from drake_navbench.controllers.mppi.critics.outline_costs import (
    OutlineCosts,
    OutlineView,
    outline_cost_row,
)
from drake_navbench.controllers.mppi.lanes import LANES
from drake_navbench.kernels.footprint import circle_footprint, footprint_cost
from drake_navbench.kernels.grid import LETHAL, NO_INFORMATION, Costmap

CHAIR = np.array([[0.5, 0.3], [-0.4, 0.3], [-0.4, -0.3], [0.5, -0.3]])
OUTLINES = {"chair": CHAIR, "16-gon": circle_footprint(0.3), "triangle": CHAIR[:3]}
EVERY_LANE = np.arange(LANES)


def random_view(outline, *, share_free=0.9) -> MapView:
    """A 3 m map, mostly free, with cells of every cost."""
    random = np.random.default_rng(0)
    costs = random.integers(0, 256, (60, 60)).astype(np.uint8)
    costs[random.random(costs.shape) < share_free] = 0
    return MapView.of(Costmap(costs, -1.5, -1.5, 0.05), outline)


def expected_costs(view, poses):
    return [footprint_cost(view.grid, view.footprint, *map(float, pose), True) for pose in poses]


def found_costs(view, remembered, poses):
    """Returns the costs at float32 poses (LANES, 3)."""
    found = np.full(LANES, -1)
    columns = [np.ascontiguousarray(column) for column in poses.T]
    outline_cost_row(view, remembered, EVERY_LANE, *columns, found)
    return found


def random_rows(count):
    random = np.random.default_rng(1)
    low, high = (-1.8, -1.8, -7.0), (1.8, 1.8, 7.0)
    return random.uniform(low, high, (count, LANES, 3)).astype(np.float32)


def one_row(*pose):
    return np.tile(np.float32(pose), (LANES, 1))


@pytest.mark.parametrize("outline", OUTLINES.values(), ids=OUTLINES)
def test_every_pose_has_the_cost_of_its_outline_asked_first_or_again(outline):
    view = random_view(outline)
    remembered = OutlineCosts.of(view)
    rows = random_rows(30)
    for poses in (*rows, *rows, *(rows + np.float32(1e-3))):
        np.testing.assert_array_equal(
            found_costs(view, remembered, poses), expected_costs(view, poses)
        )
    assert remembered.taken[0] > 500


def test_unknown_cells_hide_lethal_ones_as_in_the_footprint_cost():
    view = random_view(CHAIR, share_free=0.99)
    costs = np.zeros((60, 60), np.uint8)
    # The robot at the origin: its left side meets unknown cells, its front or its rear lethal ones.
    costs[36, 30] = NO_INFORMATION
    for column in (40, 22):
        costs[30, column] = LETHAL
        view = MapView.of(Costmap(costs, -1.5, -1.5, 0.05), CHAIR)
        poses = one_row(0.01, 0.01, 0.0)
        found = found_costs(view, OutlineCosts.of(view), poses)
        np.testing.assert_array_equal(found, expected_costs(view, poses))
        costs[30, column] = 0


def test_vertices_on_borders_of_cells_and_beyond_the_map_are_where_they_are():
    view = random_view(CHAIR, share_free=0.0)
    remembered = OutlineCosts.of(view)
    # Whole cells and quarter turns: every vertex lies on a corner of cells, as far as it rounds.
    steps = np.arange(-40, 40)
    corners = np.array(
        [(0.05 * i, 0.05 * (i % 7), 0.5 * math.pi * (i % 9 - 4)) for i in steps[:LANES]]
    )
    for poses in (corners, corners + 1e-7, corners - 1e-7):
        poses = poses.astype(np.float32)
        np.testing.assert_array_equal(
            found_costs(view, remembered, poses), expected_costs(view, poses)
        )


@pytest.mark.parametrize("pose", [(0.0, 0.0, 1e5), (math.nan, 0.0, 0.0), (1e30, 0.0, 0.0)])
def test_a_pose_out_of_reach_costs_what_its_outline_costs(pose):
    view = random_view(CHAIR)
    poses = one_row(*pose)
    found = found_costs(view, OutlineCosts.of(view), poses)
    np.testing.assert_array_equal(found, expected_costs(view, poses))


def test_edges_between_the_same_cells_are_not_walked_again():
    view = random_view(CHAIR)
    remembered = OutlineCosts.of(view)
    found_costs(view, remembered, one_row(0.51, 0.01, 0.0))
    # Vertices at x 1.01 and 0.11, y 0.31 and -0.29; moved by 2 and 3 cm no one leaves its cell.
    found_costs(view, remembered, one_row(0.53, 0.04, 0.0))
    assert remembered.taken[0] <= len(CHAIR)


def test_a_vertex_off_the_map_is_lethal_and_takes_no_place():
    view = random_view(CHAIR)
    remembered = OutlineCosts.of(view)
    assert (found_costs(view, remembered, one_row(1.2, 0.0, 0.0)) == LETHAL).all()
    assert remembered.taken[0] == 0


def test_a_full_memory_still_answers_right():
    view = random_view(CHAIR)
    remembered = OutlineCosts.of(view)
    remembered.taken[0] = outline_costs.MOST_REMEMBERED
    poses = random_rows(1)[0]
    np.testing.assert_array_equal(found_costs(view, remembered, poses), expected_costs(view, poses))
    assert remembered.taken[0] == outline_costs.MOST_REMEMBERED


def test_only_the_lanes_asked_for_are_written():
    view = random_view(CHAIR)
    found = np.full(LANES, -1)
    columns = [np.zeros(LANES, np.float32)] * 3
    outline_cost_row(view, OutlineCosts.of(view), np.array([3, 8]), *columns, found)
    assert np.flatnonzero(found >= 0).tolist() == [3, 8]


def test_what_is_remembered_is_of_the_last_costmap():
    outline_view = OutlineView(CHAIR)
    free, full = (Costmap(np.full((60, 60), cost, np.uint8), -1.5, -1.5, 0.05) for cost in (0, 100))
    poses = one_row(0.0, 0.0, 0.3)
    assert (found_costs(*outline_view.of(free), poses) == 0).all()
    assert outline_view.of(free)[1].taken[0] > 0
    assert (found_costs(*outline_view.of(full), poses) == 100).all()
    assert (found_costs(*outline_view.of(free), poses) == 0).all()
