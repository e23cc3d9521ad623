"""Hybrid-A*: paths that a car can drive, by facts that hold for every one of them."""

import numpy as np
import pytest
from planner_requests import answer, random_requests

from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.kernels.footprint import footprint_radii
from drake_navbench.kernels.grid import LETHAL, Costmap
from drake_navbench.kernels.hybrid_heuristics import reached_from
from drake_navbench.kernels.hybrid_motion import FORWARD, REVERSE, motions
from drake_navbench.kernels.inflation import inflate
from drake_navbench.navigation import smac_planner_hybrid
from drake_navbench.navigation.costmaps.built_in_layers import InflationLayerParameters
from drake_navbench.navigation.planner import (
    GoalOccupied,
    GoalOutsideMapBounds,
    NoValidPathCouldBeFound,
    PlannerTimedOut,
    StartOccupied,
)
from drake_navbench.navigation.smac_planner_hybrid import SmacPlannerHybrid
from drake_navbench.navigation.smac_planner_hybrid_parameters import SmacPlannerHybridParameters
from drake_navbench.plugins.releases import Release, defaults_in
from drake_navbench.trial.task_cost import check_cost
from drake_navbench.typed_files.typed_yaml import validate

RESOLUTION_M = 0.05
CAR = np.array([[0.6, 0.25], [0.6, -0.25], [-0.2, -0.25], [-0.2, 0.25]])
INFLATION = InflationLayerParameters(inflation_radius=0.8, cost_scaling_factor=3.0)


def planner(**parameters) -> SmacPlannerHybrid:
    settings = SmacPlannerHybridParameters(**{"minimum_turning_radius": 0.6, **parameters})
    return SmacPlannerHybrid(settings, CAR).with_inflation(INFLATION)


def room(*walls) -> Costmap:
    """6 x 5 m with inflated walls, each (x, y, width, height) m."""
    costs = np.zeros((100, 120), np.uint8)
    for x, y, width, height in np.round(np.array(walls).reshape(-1, 4) / RESOLUTION_M).astype(int):
        costs[y : y + height, x : x + width] = LETHAL
    inscribed_m, _ = footprint_radii(CAR)
    inflated = inflate(
        costs,
        resolution=RESOLUTION_M,
        inscribed_radius=inscribed_m,
        inflation_radius=INFLATION.inflation_radius,
        cost_scaling_factor=INFLATION.cost_scaling_factor,
    )
    return Costmap(inflated, 0.0, 0.0, RESOLUTION_M)


WALL = (3.0, 0.0, 0.1, 3.0)
START, GOAL = (1.0, 1.0, 0.0), (4.8, 1.2, np.radians(-90.0))


def headings_along(path):
    """Returns the heading against the direction of motion at each pose but the last, rad."""
    steps = np.diff(path[:, :2], axis=0)
    direction = np.arctan2(steps[:, 1], steps[:, 0])
    return np.abs((path[:-1, 2] - direction + np.pi) % (2.0 * np.pi) - np.pi)


def turning_radii(path):
    """Returns the radius of the circle through each three successive points, m."""
    a, b, c = path[:-2, :2], path[1:-1, :2], path[2:, :2]
    sides = [np.hypot(*(q - p).T) for p, q in ((a, b), (b, c), (a, c))]
    across = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return np.prod(sides, axis=0) / np.maximum(2.0 * np.abs(across), 1e-12)


def test_the_radius_is_not_below_a_merged_cell_also_where_none_is_merged():
    # Three cells of 0.05 m: 0.15 m, though the map is planned on as it is.
    path = planner(minimum_turning_radius=0.05, downsampling_factor=3).plan(room(), START, GOAL)
    as_wide = planner(minimum_turning_radius=0.15).plan(room(), START, GOAL)
    tighter = planner(minimum_turning_radius=0.05).plan(room(), START, GOAL)
    np.testing.assert_allclose(path, as_wide, atol=1e-12)
    assert np.abs(tighter - as_wide).max() > 0.01


def test_on_a_coarser_grid_the_way_round_is_that_of_the_given_costmap(monkeypatch):
    # Nav2 looks up the goal's coarse cell, (12, 12) of 25 x 30, in the costmap of 50 x 60 cells.
    asked = []

    def reached(costs, goal, start, **rules):
        asked.append((costs.shape, goal, start))
        return reached_from(costs, goal, start, **rules)

    monkeypatch.setattr(smac_planner_hybrid, "reached_from", reached)
    costs = np.zeros((50, 60), np.uint8)
    coarse = planner(downsample_costmap=True, downsampling_factor=2, smooth_path=False)
    coarse.plan(Costmap(costs, 0.0, 0.0, RESOLUTION_M), (0.42, 0.82, 0.0), (1.22, 1.22, 0.0))
    assert asked == [((50, 60), (12, 12), (4, 8))]


def test_a_coarse_search_of_headings_counts_only_where_any_heading_does():
    for mode, step in (("DEFAULT", 1), ("BIDIRECTIONAL", 1), ("ALL_DIRECTION", 2)):
        settings = SmacPlannerHybridParameters(goal_heading_mode=mode, coarse_search_resolution=2)
        assert settings.coarse_step == step


def test_the_motions_leave_a_cell_and_turn_by_whole_bins_on_the_tightest_circle():
    table = motions(8.0, 72, reverses=True, interpolates=False)
    chord = np.hypot(table.step_x, table.step_y)
    np.testing.assert_allclose(chord, chord[0, 0], rtol=1e-6)
    assert chord[0, 0] > np.sqrt(2.0)
    # 2 asin(sqrt(2) / 16) = 10.1 degrees: three bins of 5.
    assert sorted(table.turn_bins.tolist()) == [-3.0, -3.0, 0.0, 0.0, 3.0, 3.0]
    turns = ~np.isin(table.directions, (FORWARD, REVERSE))
    np.testing.assert_allclose(table.travel_costs[turns], 8.0 * np.radians(15.0), rtol=1e-6)


@pytest.mark.parametrize("model", ["DUBIN", "REEDS_SHEPP"])
def test_a_path_leads_round_a_wall_and_no_turn_is_tighter_than_the_car_can(model):
    path = planner(motion_model_for_search=model, smooth_path=False).plan(room(WALL), START, GOAL)
    np.testing.assert_allclose(path[0, :2], START[:2], atol=1e-6)
    np.testing.assert_allclose(path[-1], GOAL, atol=1e-6)
    assert path[:, 1].max() > 3.2
    # Chords across a circle, whose ends are rounded to float32 cells.
    assert turning_radii(path).min() > 0.6 * 0.97
    if model == "DUBIN":
        assert headings_along(path).max() < np.radians(20.0)


def test_the_smoother_keeps_both_ends_and_the_direction():
    path = planner().plan(room(WALL), START, GOAL)
    np.testing.assert_allclose(path[0, :2], START[:2], atol=1e-6)
    np.testing.assert_allclose(path[-1], GOAL, atol=1e-6)
    assert headings_along(path).max() < np.radians(30.0)


def test_only_who_can_reverse_gets_out_of_an_alcove():
    alcove = [(2.0, 1.5, 2.5, 0.1), (2.0, 3.0, 2.5, 0.1), (4.4, 1.5, 0.1, 1.6)]
    start, goal = (3.4, 2.3, 0.0), (1.0, 2.3, 0.0)
    with pytest.raises((NoValidPathCouldBeFound, StartOccupied)):
        planner(tolerance=0.1).plan(room(*alcove), start, goal)
    path = planner(motion_model_for_search="REEDS_SHEPP").plan(room(*alcove), start, goal)
    assert headings_along(path)[:5].min() > 2.0
    np.testing.assert_allclose(path[-1], goal, atol=1e-6)


def test_headings_at_the_goal_may_be_any():
    free = room()
    own = planner(smooth_path=False).plan(free, START, (4.0, 1.0, np.pi / 2.0))
    other = planner(goal_heading_mode="ALL_DIRECTION", smooth_path=False)
    path = other.plan(free, START, (4.0, 1.0, np.pi / 2.0))
    assert own[-1, 2] == pytest.approx(np.pi / 2.0)
    assert path[-1, 2] == pytest.approx(0.0)
    assert len(path) < len(own)


def test_the_same_request_gives_the_same_path_whatever_was_asked_before():
    first = planner().plan(room(WALL), START, GOAL)
    planner().plan(room(), (1.0, 4.0, 1.0), (5.0, 2.0, -1.0))
    np.testing.assert_array_equal(planner().plan(room(WALL), START, GOAL), first)


@pytest.mark.parametrize(
    ("model", "codes", "poses"),
    [
        ("DUBIN", {0: 23, 203: 3, 204: 3, 205: 27, 206: 7, 208: 27}, 670),
        ("REEDS_SHEPP", {0: 61, 203: 3, 204: 3, 205: 14, 206: 7, 208: 2}, 1199),
    ],
)
def test_random_requests_have_the_same_answers_for_ever(model, codes, poses):
    car = planner(motion_model_for_search=model, minimum_turning_radius=0.3, max_planning_time=0.3)
    answers = [answer(car, request) for request in random_requests(90)]
    found = [code for code, _ in answers]
    assert {code: found.count(code) for code in sorted(set(found))} == codes
    assert sum(len(path) for _, path in answers) == poses


@pytest.mark.parametrize(
    ("goal", "parameters", "error"),
    [
        ((3.05, 1.0, 0.0), {"tolerance": 0.1}, GoalOccupied),
        ((7.0, 1.0, 0.0), {}, GoalOutsideMapBounds),
        (GOAL, {"max_iterations": 20}, PlannerTimedOut),
        (GOAL, {"max_planning_time": 0.0}, NoValidPathCouldBeFound),
    ],
)
def test_a_request_that_cannot_be_met_has_nav2s_error(goal, parameters, error):
    with pytest.raises(error):
        planner(**parameters).plan(room(WALL), START, goal)


def test_a_map_with_a_thousand_million_states_is_refused_in_one_line_before_anything_runs():
    robot = load_robot(
        "ackermann_robot",
        {"navigation": {"planner": {"plugin": SmacPlannerHybrid.nav2_plugin}}},
    )
    far = {"name": "far", "description": "far away", "goal": [185.0, 180.0, 0.0]}
    scenario = validate(Scenario, far | {"timeout_s": 3000.0}, "far.yaml")
    with pytest.raises(InputError, match=r"make 1e\+09 states, expected at most 5e\+08") as caught:
        check_cost(scenario, robot)
    assert "\n" not in str(caught.value)


# Releases before Lyrical

SMALL_CAR = np.array([[0.2, 0.1], [0.2, -0.1], [-0.1, -0.1], [-0.1, 0.1]])
# In these a search looks at the map's upper half row, where Nav2 reads beyond its costmap.
AT_UPPER_EDGE = {0, 6, 12, 18}
# Humble crashes in this one, and its failures have no codes.
CRASHES_HUMBLE, NO_CODE = 16, -1


@pytest.mark.parametrize(
    ("release", "first", "last"),
    [
        # Poses in cells (20, 20) and (80, 24) of 0.05 m; bins of 5 degrees.
        ("humble", (1.025, 1.025, 5.0), (4.025, 1.225, -90.0)),
        ("iron", (0.975, 0.975, 0.0), (3.975, 1.175, -90.0)),
        ("jazzy", (1.01, 1.02, 5.0), (4.03, 1.23, -90.0)),
    ],
)
def test_up_to_iron_a_path_runs_from_cell_to_cell(release, first, last):
    start, goal = (1.01, 1.02, np.radians(4.0)), (4.03, 1.23, np.radians(-90.0))
    path = planner(nav2_release=release, smooth_path=False).plan(room(), start, goal)
    for pose, expected in ((path[0], first), (path[-1], last)):
        np.testing.assert_allclose(pose, [*expected[:2], np.radians(expected[2])], atol=1e-5)


def test_a_path_within_one_cell_is_one_pose_but_in_iron():
    start, turned = (1.01, 1.02, 0.0), (1.04, 1.03, np.radians(90.0))
    assert len(planner(nav2_release="jazzy").plan(room(), start, turned)) == 1
    assert len(planner(nav2_release="humble").plan(room(), start, start)) == 1
    with pytest.raises(NoValidPathCouldBeFound):
        planner(nav2_release="iron").plan(room(), start, start)


def test_a_start_that_is_one_of_several_goals_is_no_path():
    # Lyrical's answer where every curve to another heading is too long.
    any_heading = {"goal_heading_mode": "ALL_DIRECTION", "analytic_expansion_max_length": 0.1}
    with pytest.raises(StartOccupied):
        planner(**any_heading).plan(room(), START, (1.01, 1.01, np.radians(90.0)))


def test_up_to_iron_a_blocked_start_is_refused():
    at_wall = (2.95, 1.0, 0.0)
    with pytest.raises(StartOccupied, match="does not fit"):
        planner(nav2_release="iron").plan(room(WALL), at_wall, (1.0, 1.0, 0.0))


def test_before_jazzy_an_arc_costs_its_chord():
    as_chords = motions(8.0, 72, reverses=True, interpolates=False, costs_chords=True)
    np.testing.assert_array_equal(as_chords.travel_costs, np.full(6, as_chords.step_x[0, 0], "f4"))


@pytest.mark.parametrize(
    ("release", "codes", "poses", "total_m"),
    [
        ("humble", {0: 6, NO_CODE: 11}, 145, 451.786049432),
        ("iron", {0: 7, 203: 1, 204: 1, 205: 4, 206: 2, 208: 3}, 174, 601.253689148),
        ("jazzy", {0: 7, 203: 1, 204: 1, 205: 4, 206: 2, 208: 3}, 158, 518.391703137),
        ("kilted", {0: 7, 203: 1, 204: 1, 205: 4, 206: 2, 208: 3}, 160, 522.589453419),
        ("lyrical", {0: 7, 203: 1, 204: 1, 205: 3, 206: 2, 207: 1, 208: 3}, 153, 372.302886234),
    ],
)
def test_answers_are_those_of_nav2_of_each_release(release, codes, poses, total_m):
    def answer_to(request):
        n = request.number
        given = {
            "nav2_release": release,
            "motion_model_for_search": ("DUBIN", "REEDS_SHEPP")[n % 2],
            "minimum_turning_radius": 0.3,
            "max_iterations": 3000,
            "lookup_table_size": 2.0,
            "tolerance": (0.25, 0.0, 0.1)[n % 3],
            "downsample_costmap": n % 5 == 0,
            "downsampling_factor": 2,
            "allow_unknown": n % 4 < 3,
            "smoother": {"refinement_num": 4 if release == "humble" else 2},
        }
        others = defaults_in(SmacPlannerHybridParameters, Release(release))
        settings = SmacPlannerHybridParameters(**others | given)
        code, path = answer(SmacPlannerHybrid(settings, SMALL_CAR if n % 2 else None), request)
        return (NO_CODE if code and release == "humble" else code), path

    undefined = AT_UPPER_EDGE | ({CRASHES_HUMBLE} if release == "humble" else set())
    requests = [r for r in random_requests(22) if r.number not in undefined]
    answers = [answer_to(request) for request in requests]
    found = [code for code, _ in answers]
    assert {code: found.count(code) for code in sorted(set(found))} == codes
    assert sum(len(path) for _, path in answers) == poses
    assert sum(np.abs(path[:, :2]).sum() for _, path in answers) == pytest.approx(total_m, abs=1e-6)
