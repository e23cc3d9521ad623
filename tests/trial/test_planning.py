"""A scenario's plan: given, or from the planner on its map with its smoother."""

import numpy as np
import pytest

from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import Robot, load_robot
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.kernels.grid import LETHAL, cost_at
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.navigation.planner import (
    GoalOccupied,
    GoalOutsideMapBounds,
    PlanningError,
)
from drake_navbench.navigation.planner_settings import PLANNERS
from drake_navbench.trial.planning import global_costmap, make_plan
from drake_navbench.typed_files.typed_yaml import validate

BOX = {"type": "box", "min": [2.0, -1.0], "max": [2.5, 0.3]}
KEEPOUT = {"type": "keepout", "areas": [{"polygon": [[2, -1], [2.5, -1], [2.5, 0.3], [2, 0.3]]}]}
ROBOT = Robot(
    description="round",
    robot_radius=0.2,
    navigation={"global_costmap": {"inflation_layer": {"inflation_radius": 0.5}}},
)


def scenario_of(**changes) -> Scenario:
    data = {"name": "task", "description": "a task", "goal": [5.0, 0.0, 0.0]}
    return validate(Scenario, data | changes, "task.yaml")


def plan_of(robot=ROBOT, **changes) -> np.ndarray:
    return make_plan(scenario_of(**changes), robot, np.zeros(3))


def bend(plan: np.ndarray) -> float:
    """Returns the sharpest change of direction from one step to the next, rad."""
    steps = np.diff(plan[:, :2], axis=0)
    headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    return float(np.abs(np.diff(headings)).max())


def test_without_obstacles_the_plan_is_the_straight_line():
    plan = plan_of()
    np.testing.assert_allclose(plan[:, 1], 0.0, atol=1e-12)
    assert path_length(plan) == pytest.approx(5.0)


def test_a_goal_other_than_the_scenarios_may_be_given():
    plan = make_plan(scenario_of(), ROBOT, np.zeros(3), np.array([0.0, 2.0, 1.0]))
    np.testing.assert_allclose(plan[-1], [0.0, 2.0, 1.0])


@pytest.mark.parametrize("plugin", PLANNERS.names)
def test_a_plan_comes_from_the_planner_that_the_robot_names(plugin):
    robot = ROBOT.model_copy(
        update={"navigation": ROBOT.navigation.model_copy(update={"planner": settings_of(plugin)})}
    )
    scenario = scenario_of(world={"obstacles": [BOX]})
    planner = PLANNERS.load(plugin)(settings_of(plugin), robot.padded_outline)
    expected = planner.plan(global_costmap(scenario, robot), np.zeros(3), np.array(scenario.goal))
    np.testing.assert_array_equal(make_plan(scenario, robot, np.zeros(3)), expected)


def settings_of(plugin):
    return PLANNERS.load(plugin).Parameters()


def test_a_plan_is_made_on_the_costmap_that_is_handed_in():
    blocked = global_costmap(scenario_of(world={"obstacles": [BOX]}), ROBOT)
    plan = make_plan(scenario_of(), ROBOT, np.zeros(3), costmap=blocked)
    assert plan[:, 1].max() > 0.3


def test_a_keepout_is_gone_around_though_nothing_stands_there():
    scenario = scenario_of(filters=[KEEPOUT])
    assert scenario.true_world.obstacles == ()
    plan = plan_of(filters=[KEEPOUT])
    beside = (plan[:, 0] > 2.0) & (plan[:, 0] < 2.5)
    # The filter acts after the inflation: the path may touch the edge, as in Nav2.
    assert 0.3 <= plan[beside, 1].min() < 0.4


def test_a_keepout_before_the_inflation_is_given_as_much_room_as_an_obstacle():
    costmap = {"inflation_layer": {"inflation_radius": 0.5}, "filters": []}
    layers = ["static_layer", "keepout_filter", "inflation_layer"]
    robot = ROBOT.model_copy(
        update={"navigation": type(ROBOT.navigation)(global_costmap=costmap | {"plugins": layers})}
    )
    around_keepout, around_box = (
        plan_of(robot, filters=[KEEPOUT]),
        plan_of(robot, world={"obstacles": [BOX]}),
    )
    assert around_keepout[:, 1].max() == pytest.approx(around_box[:, 1].max(), abs=0.05)
    assert around_keepout[:, 1].max() > 0.3 + 0.2


@pytest.mark.parametrize(
    "smoother",
    [
        "nav2_smoother::SimpleSmoother",
        "nav2_constrained_smoother::ConstrainedSmoother",
        "nav2_smoother::SavitzkyGolaySmoother",
        {"plugin": "nav2_constrained_smoother::ConstrainedSmoother", "path_downsampling_factor": 2},
    ],
)
def test_a_smoother_takes_the_kinks_out_of_the_planners_path(smoother):
    robot = Robot(
        description="round",
        robot_radius=0.2,
        navigation={"planner": {"smoother": {"max_iterations": 0}}},
    )
    world = {"obstacles": [BOX]}
    raw = plan_of(robot, world=world, plan={"type": "planner", "smoother": "none"})
    # Eight-connected: every kink is 45 degrees.
    assert bend(raw) == pytest.approx(np.pi / 4, abs=0.02)
    smooth = plan_of(robot, world=world, plan={"type": "planner", "smoother": smoother})
    assert bend(smooth) < 0.6 * bend(raw)
    np.testing.assert_allclose(smooth[[0, -1], :2], raw[[0, -1], :2])


def test_a_robot_given_by_a_radius_gets_a_smooth_plan_where_a_polygon_gets_none():
    # Between walls 0.35 m to either side of the plan the centre of a robot of 0.2 m is free, by
    # 0.15 m. Its outline reaches within 0.15 m of them, into the cells that are inscribed, which is
    # where the planner's smoother stops.
    walls = [([0.5, 0.35], [4.0, 0.6]), ([0.5, -0.6], [4.0, -0.35])]
    task = {
        "world": {"obstacles": [{"type": "box", "min": low, "max": high} for low, high in walls]},
        "goal": [5.0, 1.2, 0.0],
    }
    square = [[0.2, 0.2], [0.2, -0.2], [-0.2, -0.2], [-0.2, 0.2]]
    polygon = Robot(description="square", footprint=square, navigation=ROBOT.navigation)
    assert np.degrees(bend(plan_of(ROBOT, **task))) < 10.0
    assert np.degrees(bend(plan_of(polygon, **task))) == pytest.approx(45.0)


def test_a_misspelt_smoother_or_parameter_is_one_line():
    for smoother in ("nav2_smoother::SimpelSmoother", {"w_dat": 0.2}):
        with pytest.raises(InputError) as caught:
            scenario_of(plan={"type": "planner", "smoother": smoother})
        assert len(str(caught.value).splitlines()) == 1


def test_a_goal_within_the_inflation_is_the_planners_to_refuse():
    with pytest.raises(GoalOccupied):
        plan_of(world={"obstacles": [BOX]}, goal=[2.2, 0.35, 0.0])


def test_planning_errors_are_of_one_family():
    assert issubclass(GoalOccupied, PlanningError)


def test_one_obstacles_keepout_gives_two_straight_legs_close_to_the_published_plan():
    scenario = load_scenario("one_obstacle")
    robot = load_robot("wheelchair", scenario.robot_overrides)
    plan = make_plan(scenario, robot, np.array(scenario.start))
    first_leg = plan[:, 0] < 6.8
    np.testing.assert_allclose(plan[first_leg, 1], 0.0, atol=0.005)
    last_leg = plan[:, 1] > 1.5
    np.testing.assert_allclose(plan[last_leg, 0], 8.342, atol=0.01)
    # 6.922 + 1.3 + 6.922 m and two arcs of 45 degrees and 0.5 m.
    assert path_length(plan) == pytest.approx(15.144 + 2 * 0.5 * np.pi / 4, abs=0.03)


def rolling(width: int) -> Robot:
    window = {"rolling_window": True, "width": width, "height": 6, "resolution": 0.1}
    return Robot(description="round", robot_radius=0.2, navigation={"global_costmap": window})


def test_a_global_costmap_may_be_a_window_around_the_robot():
    scenario = scenario_of(start=[1.0, 2.0, 0.0], world={"obstacles": [BOX]})
    costmap = global_costmap(scenario, rolling(12))
    assert costmap.costs.shape == (60, 120)
    middle = costmap.origin_x + 0.5 * costmap.size_x_m, costmap.origin_y + 0.5 * costmap.size_y_m
    assert middle == pytest.approx((1.0, 2.0), abs=0.1)
    # The box lies 1 to 1.5 m ahead and 1.7 to 3 m to the right.
    assert cost_at(costmap.grid, 2.25, -0.4) == LETHAL


def test_nothing_is_planned_beyond_such_a_window():
    make_plan(scenario_of(), rolling(12), np.zeros(3))
    with pytest.raises(GoalOutsideMapBounds):
        make_plan(scenario_of(), rolling(8), np.zeros(3))
