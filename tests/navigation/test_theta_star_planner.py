"""Theta* as a planner: points along its lines, the ends of its paths, its failures."""

import numpy as np
import pytest
from planner_requests import answer, digest, free, plan_on, random_requests

from drake_navbench.navigation.planner import (
    GoalOccupied,
    NoValidPathCouldBeFound,
    PlanningError,
    StartOccupied,
)
from drake_navbench.navigation.theta_star_planner import (
    ThetaStarPlanner,
    ThetaStarPlannerParameters,
)

RESOLUTION_M = 0.1
INSCRIBED, LETHAL, UNKNOWN = 253, 254, 255
NO_FOOTPRINT = np.empty((0, 2))


def plan(costs, start, goal, **parameters):
    planner = ThetaStarPlanner(ThetaStarPlannerParameters(**parameters), NO_FOOTPRINT)
    return plan_on(planner, costs, start, goal)


def test_answers_are_those_of_nav2():
    def planner_for(number):
        parameters = ThetaStarPlannerParameters(
            how_many_corners=(4, 8)[number % 2], allow_unknown=number % 4 < 2
        )
        return ThetaStarPlanner(parameters, NO_FOOTPRINT)

    answers = (answer(planner_for(r.number), r) for r in random_requests(200))
    assert digest(answers) == "a562af77ef2497505684744be176ae2872ed8b2887cc9a1c60247cfcf3422d53"


def test_path_runs_from_centre_to_centre_of_the_cells():
    path = plan(free(), (1.01, 2.01, 0.7), (3.09, 2.09, 0.2))
    np.testing.assert_allclose(path[[0, -1], :2], [[1.05, 2.05], [3.05, 2.05]])
    np.testing.assert_allclose(path[:, 1], 2.05)
    assert (path[:-1, 2] == 0.0).all()
    assert path[-1, 2] == 0.2


def test_gaps_before_corners_are_at_most_two_cells():
    costs = free()
    costs[:30, 30] = LETHAL
    path = plan(costs, (1.0, 1.0, 0.0), (5.0, 1.0, 0.0))
    gaps = np.hypot(*np.diff(path[:, :2], axis=0).T)
    assert gaps.min() > 0.99 * RESOLUTION_M
    assert gaps.max() < 2.0 * RESOLUTION_M


@pytest.mark.parametrize(
    ("cost", "error", "code"), [(LETHAL, GoalOccupied, 206), (INSCRIBED, PlanningError, 200)]
)
def test_a_blocked_goal_fails(cost, error, code):
    costs = free()
    costs[20, 30] = cost
    with pytest.raises(error) as caught:
        plan(costs, (1.0, 2.0, 0.0), (3.05, 2.05, 0.0))
    assert caught.value.code == code


def test_a_blocked_start_fails_without_a_code_of_its_own():
    costs = free()
    costs[20, 10] = INSCRIBED
    with pytest.raises(PlanningError, match="start: its cell has cost 253") as caught:
        plan(costs, (1.05, 2.05, 0.0), (3.05, 2.05, 0.0))
    assert caught.value.code == 200


def test_the_cell_that_nav2_frees_by_mistake_since_jazzy_is_free():
    costs = free()
    costs[0, 0] = LETHAL
    for release in ("jazzy", "lyrical"):
        assert len(plan(costs, (0.05, 0.05, 0.0), (3.05, 2.05, 0.0), nav2_release=release))
    with pytest.raises(PlanningError, match="start: its cell has cost 254"):
        plan(costs, (0.05, 0.05, 0.0), (3.05, 2.05, 0.0), nav2_release="humble")


def test_iron_refuses_a_lethal_start_before_it_looks_at_the_goal():
    costs = free()
    costs[20, 10] = costs[20, 30] = LETHAL
    with pytest.raises(StartOccupied):
        plan(costs, (1.05, 2.05, 0.0), (3.05, 2.05, 0.0), nav2_release="iron")
    with pytest.raises(GoalOccupied):
        plan(costs, (1.05, 2.05, 0.0), (3.05, 2.05, 0.0), nav2_release="jazzy")


def test_iron_enters_no_cell_of_cost_252():
    costs = free()
    costs[:, 30] = 252
    assert len(plan(costs, (1.0, 2.0, 0.0), (5.0, 2.0, 0.0), nav2_release="jazzy"))
    with pytest.raises(NoValidPathCouldBeFound):
        plan(costs, (1.0, 2.0, 0.0), (5.0, 2.0, 0.0), nav2_release="iron")


def test_up_to_kilted_a_line_may_run_through_a_wall_one_cell_thick():
    costs = free()
    costs[20, 20:30] = LETHAL
    points = {
        release: plan(costs, (1.55, 2.05, 0.0), (3.55, 2.05, 0.0), nav2_release=release)[:, :2]
        for release in ("kilted", "lyrical")
    }
    np.testing.assert_allclose(points["kilted"][:, 1], 2.05)
    columns, rows = (points["lyrical"] / RESOLUTION_M).astype(int).T
    assert (costs[rows, columns] == 0).all()


def test_a_start_in_the_goals_cell_is_not_tested():
    costs = free()
    costs[20, 10] = INSCRIBED
    path = plan(costs, (1.01, 2.01, 0.3), (1.09, 2.09, 0.2))
    np.testing.assert_array_equal(path, [[1.01, 2.01, 0.2]])
