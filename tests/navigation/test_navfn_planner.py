"""NavFn as a planner: its lattice, its tolerance, the ends of its paths."""

import math

import numpy as np
import pytest
from planner_requests import answer, digest, free, plan_on, random_requests

from drake_navbench.navigation.navfn_planner import NavfnPlanner, NavfnPlannerParameters
from drake_navbench.navigation.planner import (
    GoalOccupied,
    GoalOutsideMapBounds,
    NoValidPathCouldBeFound,
    StartOccupied,
    StartOutsideMapBounds,
)
from drake_navbench.plugins.releases import Release

LETHAL, UNKNOWN = 254, 255
NO_FOOTPRINT = np.empty((0, 2))


def plan(costs, start, goal, **parameters):
    planner = NavfnPlanner(NavfnPlannerParameters(**parameters), NO_FOOTPRINT)
    return plan_on(planner, costs, start, goal)


@pytest.mark.parametrize(
    ("use_astar", "expected"),
    [
        (False, "01e5aefe401832119c103c16c022cf6230fc522812cf424d80cf66fc7439b0ec"),
        (True, "acd60edf10059a53614e98f75d686e8a8b4c8a2a61b5a954104a408b99a199bf"),
    ],
)
def test_answers_are_those_of_nav2(use_astar, expected):
    def planner_for(number):
        return NavfnPlanner(
            NavfnPlannerParameters(
                use_astar=use_astar,
                tolerance=(0.0, 0.2, 0.5)[number % 3],
                allow_unknown=number % 2 == 1,
            ),
            NO_FOOTPRINT,
        )

    answers = (answer(planner_for(r.number), r) for r in random_requests(200))
    assert digest(answers) == expected


def test_path_runs_from_a_corner_of_a_cell_in_steps_of_half_a_cell():
    # (1.04, 2.03) is nearest to the corner of column 10, row 20. Beyond the goal nothing was
    # reached, so that near it the path goes from cell to cell.
    path = plan(free(), (1.04, 2.03, 0.7), (3.0, 2.0, 0.2))
    np.testing.assert_allclose(path[0], [1.0, 2.0, 0.0], atol=1e-12)
    np.testing.assert_array_equal(path[-1], [3.0, 2.0, 0.2])
    np.testing.assert_allclose(np.diff(path[1:-2, 0]), 0.05, atol=1e-6)
    np.testing.assert_allclose(np.diff(path[-3:, 0]), 0.1, atol=1e-6)
    np.testing.assert_array_equal(path[:-1, 2], 0.0)


def test_last_position_is_replaced_by_the_goal_where_it_passes_it():
    # The search ends in column 30, 3.0 m; 2.96 m is nearer to the position before, 2.9 m.
    path = plan(free(), (1.0, 2.0, 0.0), (2.96, 2.0, 0.0))
    np.testing.assert_allclose(path[-2:, 0], [2.9, 2.96], atol=1e-6)
    # 3.04 m lies beyond it and is one position more.
    path = plan(free(), (1.0, 2.0, 0.0), (3.04, 2.0, 0.0))
    np.testing.assert_allclose(path[-3:, 0], [2.9, 3.0, 3.04], atol=1e-6)


def test_a_blocked_goal_is_replaced_by_the_nearest_reached_point_in_the_square():
    costs = free()
    costs[15:26, 25:36] = LETHAL
    goal = (3.0, 2.0, 0.4)
    with pytest.raises(NoValidPathCouldBeFound, match=r"tolerance of 0\.3 m"):
        plan(costs, (1.0, 2.0, 0.0), goal, tolerance=0.3)
    # The square's lattice, from (2.35, 1.35) in steps of 0.1 m, has no point at y = 2.0 m.
    path = plan(costs, (1.0, 2.0, 0.0), goal, tolerance=0.65)
    assert math.dist(path[-1, :2], goal[:2]) == pytest.approx(math.hypot(0.55, 0.05))
    assert path[-1, 2] == 0.4


def test_a_lethal_goal_is_occupied_only_where_there_is_no_tolerance():
    costs = free()
    costs[20, 30] = LETHAL
    with pytest.raises(GoalOccupied, match="lethal") as caught:
        plan(costs, (1.0, 2.0, 0.0), (3.01, 2.01, 0.0), tolerance=0.0)
    assert caught.value.code == 206
    assert len(plan(costs, (1.0, 2.0, 0.0), (3.01, 2.01, 0.0)))


def test_humble_does_not_look_at_a_lethal_goal_but_at_the_point_of_the_lattice():
    # The point nearest to (3.06, 2.06) is the corner of the next cell, which is free.
    costs = free()
    costs[20, 30] = LETHAL
    request = {"start": (1.0, 2.0, 0.0), "goal": (3.06, 2.06, 0.0), "tolerance": 0.0}
    assert len(plan(costs, **request, nav2_release="humble"))
    with pytest.raises(GoalOccupied):
        plan(costs, **request, nav2_release="iron")


@pytest.mark.parametrize("release", list(Release))
@pytest.mark.parametrize("goal", [(3.0, 2.0, 0.0), (1.0, 2.0, 0.5)])
def test_iron_plans_nothing_from_a_lethal_cell(release, goal):
    costs, start = free(), (1.0, 2.0, 0.0)
    costs[20, 10] = LETHAL
    is_refused = {Release.IRON: True, Release.HUMBLE: goal[:2] == start[:2]}
    if is_refused.get(release, False):
        with pytest.raises(StartOccupied, match=f"lethal, and {release} plans nothing"):
            plan(costs, start, goal, nav2_release=release)
    else:
        np.testing.assert_array_equal(plan(costs, start, goal, nav2_release=release)[-1], goal)


@pytest.mark.parametrize(("release", "count"), [("humble", 2), ("iron", 2), ("jazzy", 1)])
def test_up_to_iron_a_goal_on_the_last_position_is_a_further_pose(release, count):
    path = plan(free(), (1.0, 2.0, 0.0), (3.0, 2.0, 0.7), nav2_release=release)
    at_goal = path[np.hypot(path[:, 0] - 3.0, path[:, 1] - 2.0) < 1e-9]
    np.testing.assert_allclose(at_goal[:, 2], [0.0, 0.7][-count:])


def test_a_path_of_too_many_steps_is_none():
    # 3.3 m are 66 steps of half a cell; a map of 60 cells allows 60 or 240.
    with pytest.raises(NoValidPathCouldBeFound, match="no path leads back"):
        plan(free(), (1.0, 2.0, 0.0), (4.3, 2.0, 0.0), max_cycles_factor=1)
    assert len(plan(free(), (1.0, 2.0, 0.0), (4.3, 2.0, 0.0))) > 60


def test_astar_gives_a_path_as_well():
    paths = [
        plan(free(), (1.0, 1.0, 0.0), (5.0, 3.0, 0.0), use_astar=flag) for flag in (False, True)
    ]
    lengths = [np.hypot(*np.diff(path[:, :2], axis=0).T).sum() for path in paths]
    assert lengths[1] <= 1.2 * lengths[0]


def test_start_and_goal_within_a_cell_give_two_poses():
    path = plan(free(), (1.01, 2.01, 0.3), (1.03, 2.02, 0.2))
    np.testing.assert_allclose(path, [[1.0, 2.0, 0.0], [1.03, 2.02, 0.2]])


def test_the_direction_of_the_end_overlooks_a_doubled_last_position():
    # 3.00005 m doubles 3.0 m, which is kept; the direction counts from the position before.
    path = plan(free(), (3.0, 1.0, 0.0), (3.0, 3.00005, 1.0), use_final_approach_orientation=True)
    assert path[-1, 2] == pytest.approx(math.pi / 2, abs=1e-3)


def test_in_the_uppermost_half_cell_a_start_is_refused_and_a_goal_not_reached():
    with pytest.raises(StartOutsideMapBounds):
        plan(free(), (1.0, 3.96, 0.0), (3.0, 2.0, 0.0))
    with pytest.raises(NoValidPathCouldBeFound):
        plan(free(), (1.0, 2.0, 0.0), (3.0, 3.96, 0.0), tolerance=0.05)
    with pytest.raises(GoalOutsideMapBounds):
        plan(free(), (1.0, 2.0, 0.0), (3.0, 3.96, 0.0), nav2_release="humble")
    path = plan(free(), (1.0, 2.0, 0.0), (3.0, 3.96, 0.0), tolerance=0.5)
    assert 3.4 < path[-1, 1] < 3.96
