"""What every planner that searches promises, and how a robot file chooses one."""

import math

import numpy as np
import pytest
from planner_requests import answer, random_requests

from drake_navbench.errors import InputError
from drake_navbench.inputs.navigation_settings import NavigationSettings
from drake_navbench.kernels.footprint import circle_footprint
from drake_navbench.kernels.grid import Costmap
from drake_navbench.navigation.planner import (
    GoalOutsideMapBounds,
    NoValidPathCouldBeFound,
    StartOutsideMapBounds,
)
from drake_navbench.navigation.planner_settings import PLANNERS, make_planner
from drake_navbench.navigation.smac_planner_2d_parameters import SmacPlanner2DParameters
from drake_navbench.typed_files.typed_yaml import validate

RESOLUTION_M = 0.05
FOOTPRINT = circle_footprint(0.2)
NAVFN, THETA = "nav2_navfn_planner::NavfnPlanner", "nav2_theta_star_planner::ThetaStarPlanner"
HYBRID = "nav2_smac_planner::SmacPlannerHybrid"
START, GOAL = (1.01, 1.02, 0.5), (7.03, 4.04, -1.2)
# The straight line looks at nothing, and promises nothing of what follows.
SEARCHING = sorted({*PLANNERS.names} - {"nav2_straightline_planner::StraightLine"})
every_planner = pytest.mark.parametrize("plugin", SEARCHING)
# Those that look at cells alone, and not at the outline and its heading.
every_grid_planner = pytest.mark.parametrize("plugin", sorted({*SEARCHING} - {HYBRID}))


def planner_of(plugin, **parameters):
    settings = validate(NavigationSettings, {"planner": {"plugin": plugin, **parameters}}, "robot")
    return make_planner(settings.planner, footprint=FOOTPRINT)


def room(*, wall=True, origin=(-1.0, -0.5)):
    """10 x 6 m; a wall at x = 4 m leaves a gap above y = 3.5 m."""
    costs = np.zeros((120, 200), dtype=np.uint8)
    if wall:
        costs[:80, 100] = 254
        costs[:84, 96:100] = costs[:84, 101:105] = 253
        costs[80:84, 100] = 253
    return Costmap(costs, *origin, RESOLUTION_M)


@every_planner
def test_a_plan_leads_from_start_to_goal_around_a_wall(plugin):
    path = planner_of(plugin).plan(room(), START, GOAL)
    half_diagonal = 0.75 * RESOLUTION_M
    assert math.dist(path[0, :2], START[:2]) < half_diagonal
    assert math.dist(path[-1, :2], GOAL[:2]) < half_diagonal
    # Smac Hybrid ends in the middle of a bin of 5 degrees.
    is_exact = plugin != HYBRID
    assert path[-1, 2] == pytest.approx(GOAL[2], abs=0.0 if is_exact else np.radians(2.5))
    # Free are x < 3.8 m, x > 4.25 m and y > 3.7 m; NavFn counts from the cells' corners.
    is_inside_wall = (path[:, 0] > 3.85) & (path[:, 0] < 4.2) & (path[:, 1] < 3.65)
    assert not is_inside_wall.any()
    assert np.hypot(*np.diff(path[:, :2], axis=0).T).max() < 3.0 * RESOLUTION_M


@every_planner
def test_the_same_request_gives_the_same_path(plugin):
    costmap = room()
    before = costmap.costs.copy()
    paths = [planner_of(plugin).plan(costmap, START, GOAL) for _ in range(2)]
    np.testing.assert_array_equal(*paths)
    np.testing.assert_array_equal(costmap.costs, before)


@every_planner
def test_requests_off_the_map_are_refused_start_first(plugin):
    planner = planner_of(plugin)
    with pytest.raises(StartOutsideMapBounds, match="start: found") as caught:
        planner.plan(room(), (-1.01, 0.0, 0.0), (99.0, 0.0, 0.0))
    assert caught.value.code == 203
    with pytest.raises(GoalOutsideMapBounds, match="goal: found") as caught:
        # The upper edge is off the map.
        planner.plan(room(), START, (0.0, 5.5, 0.0))
    assert caught.value.code == 204


@every_planner
@pytest.mark.parametrize("pose", [(math.nan, 0.0, 0.0), (1.0, 1.0)])
def test_what_is_no_pose_is_refused(plugin, pose):
    with pytest.raises(InputError, match="goal: got"):
        planner_of(plugin).plan(room(), START, pose)


@every_planner
def test_unknown_cells_are_crossed_where_they_are_allowed(plugin):
    costs = np.zeros((120, 200), dtype=np.uint8)
    costs[:, 100:110] = 255
    costmap = Costmap(costs, -1.0, -0.5, RESOLUTION_M)
    assert planner_of(plugin).plan(costmap, START, GOAL)[-1, 0] > 7.0
    with pytest.raises(NoValidPathCouldBeFound):
        planner_of(plugin, allow_unknown=False).plan(costmap, START, GOAL)


@every_grid_planner
@pytest.mark.parametrize("keeps_start_yaw", [False, True])
def test_a_request_to_stay_is_one_pose(plugin, keeps_start_yaw):
    planner = planner_of(plugin, use_final_approach_orientation=keeps_start_yaw)
    path = planner.plan(room(), START, (*START[:2], 2.0))
    np.testing.assert_array_equal(path, [[*START[:2], 0.5 if keeps_start_yaw else 2.0]])


@every_grid_planner
def test_a_path_may_end_with_its_own_direction(plugin):
    planner = planner_of(plugin, use_final_approach_orientation=True)
    path = planner.plan(room(wall=False), (1.0, 1.0, 0.5), (7.0, 1.0, 2.0))
    assert path[-1, 2] == pytest.approx(0.0, abs=1e-6)


@every_grid_planner
def test_a_goal_behind_walls_is_not_reached(plugin):
    costs = np.zeros((60, 60), dtype=np.uint8)
    costs[20:41, 20:41] = 254
    costs[29:32, 29:32] = 0
    planner = planner_of(plugin, tolerance=0.1) if plugin != THETA else planner_of(plugin)
    code, _ = answer_on(planner, costs, (0.5, 0.5, 0.0), (1.525, 1.525, 0.0))
    assert code == 208


def answer_on(planner, costs, start, goal):
    request = next(random_requests(1))
    costmap = Costmap(costs, 0.0, 0.0, RESOLUTION_M)
    return answer(planner, type(request)(0, costmap, np.array(start), np.array(goal)))


# Settings


def test_without_a_name_the_planner_is_smac_2d():
    for planner in ({}, {"tolerance": 0.3}):
        settings = validate(NavigationSettings, {"planner": planner}, "robot.yaml")
        assert isinstance(settings.planner, SmacPlanner2DParameters)


def test_names_of_earlier_releases_are_understood():
    settings = validate(NavigationSettings, {"planner": {"plugin": NAVFN.replace("::", "/")}}, "r")
    assert settings.planner.plugin == NAVFN


@pytest.mark.parametrize("plugin", PLANNERS.names)
def test_settings_survive_being_written_and_read(plugin):
    settings = NavigationSettings(planner={"plugin": plugin}).planner
    assert NavigationSettings(planner=settings.model_dump()).planner == settings
    assert type(make_planner(settings, footprint=FOOTPRINT)) is PLANNERS.load(plugin)


def test_editors_accept_parameters_that_several_planners_have():
    # In a schema oneOf would refuse {tolerance: 0.3}, which fits two of them.
    planner = NavigationSettings.model_json_schema()["properties"]["planner"]
    assert len(planner["anyOf"]) == len(PLANNERS.names) + 1
    assert "oneOf" not in planner


@pytest.mark.parametrize(
    ("planner", "message"),
    [
        ({"plugin": "nav2_navfn_planner::Navfn"}, f"did you mean '{NAVFN}'"),
        ({"plugin": ["a", "b"]}, "unknown plugin"),
        ({"plugin": NAVFN, "w_euc_cost": 1.0}, "w_euc_cost: unknown field"),
        ({"plugin": NAVFN, "max_cycles_factor": 0}, "max_cycles_factor"),
        ({"plugin": NAVFN, "tolerance": -0.1}, "tolerance"),
        ({"plugin": THETA, "how_many_corners": 6}, "how_many_corners"),
        ({"plugin": THETA, "w_traversal_cost": -1.0}, "w_traversal_cost"),
        ({"use_astar": True}, "use_astar: unknown field"),
    ],
)
def test_wrong_settings_are_one_line(planner, message):
    with pytest.raises(InputError) as caught:
        validate(NavigationSettings, {"planner": planner}, "robot.yaml")
    assert str(caught.value).startswith("robot.yaml: planner")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
