"""A way past what traps plans: where it leads, how long it is kept; backing out of a dead end."""

from __future__ import annotations

import numpy as np
import pytest
from harmony_scenes import DISCS, costmap_with, straight
from harmony_worlds import ERROR_M, drive_among
from test_harmony_controller import seen, setup_for

from drake_navbench import run_trial
from drake_navbench.controller import NO_PLAN
from drake_navbench.controllers.harmony import Harmony, HarmonyParameters
from drake_navbench.controllers.harmony.detour import (
    Keeping,
    find_detour,
    is_good,
    joined,
    still_ahead,
    whole_plan,
)
from drake_navbench.controllers.harmony.memory import HarmonyMemory
from drake_navbench.controllers.harmony.scene import make_start
from drake_navbench.controllers.harmony.way import must_back_up, way_along
from drake_navbench.kernels.distance_field import distance_field, sample_distance
from drake_navbench.kernels.path_geometry import path_from_polyline, path_length
from drake_navbench.logs.outcome import Outcome

HERE, PLAN, CLEARANCE_M = np.zeros(2), straight(2.5), 0.4
# Across the path, and a way past its left end that is 0.4 m long besides the path.
SCREEN = (1.2, -3.0, 1.3, 0.3)
# Three walls around the path's first 1.7 m, wider than the robot but too narrow to turn in.
DEAD_END = ((0.4, 0.5, 1.7, 0.6), (0.4, -0.6, 1.7, -0.5), (1.6, -0.5, 1.7, 0.5))

# Two walls along the path, wider than the robot but too narrow to turn between them.
SIDES = ((-2.0, 0.5, 4.0, 0.6), (-2.0, -0.6, 4.0, -0.5))


def field_with(*boxes):
    return distance_field(costmap_with(*boxes))


def detour_past(*boxes, plan=PLAN, start=HERE, global_plan=NO_PLAN, turning_m=np.inf):
    ahead = whole_plan(plan, global_plan)
    return find_detour(ahead, field_with(*boxes), CLEARANCE_M, start, Keeping(0.3, turning_m))


def test_a_detour_keeps_its_clearance_and_ends_on_the_plan_behind():
    detour = detour_past(SCREEN)
    np.testing.assert_allclose(detour[0, :2], HERE, atol=1e-9)
    assert detour[-1, 0] >= 1.3 + CLEARANCE_M
    assert detour[-1, 1] == 0.0
    field = field_with(SCREEN)
    # Half a cell's diagonal: cells are looked at by their centres.
    room = [sample_distance(field, x, y)[0] for x, y in detour[:, :2]]
    assert min(room) > CLEARANCE_M - 0.5 * np.hypot(0.05, 0.05)
    assert detour[:, 1].max() > 0.3 + CLEARANCE_M - 0.05


@pytest.mark.parametrize(
    "boxes",
    [
        pytest.param(((1.2, -3.0, 1.3, 3.0),), id="nothing is open"),
        pytest.param((), id="nothing is in the way"),
        pytest.param(((1.2, -3.0, 1.3, -0.35), (1.2, 0.35, 1.3, 3.0)), id="a door too narrow"),
    ],
)
def test_there_is_no_detour_where(boxes):
    assert detour_past(*boxes) is None


def test_a_detour_may_end_on_the_global_plan_where_the_local_one_ends_before():
    detour = detour_past(SCREEN, plan=straight(1.0), global_plan=straight(2.5))
    assert detour[-1, 0] >= 1.3 + CLEARANCE_M


@pytest.mark.parametrize(("turning_m", "is_on_plan"), [(1.0, True), (np.inf, False)])
def test_a_detour_keeps_to_the_plan_where_the_robot_can_turn(turning_m, is_on_plan):
    detour = detour_past((1.9, -0.2, 2.1, 0.2), turning_m=turning_m)
    # Up to 1.2 m before the box; smoothing rounds the bend.
    before = detour[detour[:, 0] < 0.7]
    assert bool((np.abs(before[:, 1]) < 0.2).all()) is is_on_plan


def test_a_later_end_is_taken_where_the_first_one_lies_far_back():
    # The plan comes back from behind the screen: its end, beside the start, is near.
    back = np.array([[2.0, 0.05 * k, 0.5 * np.pi] for k in range(1, 41)])
    home = np.array([[2.0 - 0.05 * k, 2.0, np.pi] for k in range(1, 51)])
    plan = np.concatenate([straight(2.0), back, home])
    assert detour_past(SCREEN, plan=plan)[-1, 1] > 1.0


def test_a_detour_is_driven_to_its_end():
    detour = detour_past(SCREEN)
    half = len(detour) // 2
    rest = still_ahead(detour, detour[half, :2], PLAN, NO_PLAN)
    np.testing.assert_array_equal(rest, detour[half:])
    assert len(still_ahead(detour, detour[-1, :2], PLAN, NO_PLAN)) == 0


def test_a_detour_to_a_plan_that_has_changed_is_over():
    detour = detour_past(SCREEN)
    assert len(still_ahead(detour, HERE, straight(2.5, y_m=-1.0), NO_PLAN)) == 0


def test_a_detour_is_good_until_something_comes_into_its_way():
    detour = detour_past(SCREEN)
    assert is_good(detour, HERE, field_with(SCREEN), CLEARANCE_M)
    assert not is_good(detour, HERE, field_with(SCREEN, (1.2, 0.8, 1.3, 3.0)), CLEARANCE_M)


def test_behind_a_detour_the_plan_goes_on():
    detour = detour_past(SCREEN)
    whole = joined(detour, PLAN, NO_PLAN)
    np.testing.assert_array_equal(whole[-1], PLAN[-1])
    assert path_length(whole) == pytest.approx(path_length(detour) + 2.5 - detour[-1, 0], abs=0.06)


@pytest.mark.parametrize(
    ("yaw", "boxes", "before", "backs_up"),
    [
        pytest.param(0.0, DEAD_END, True, False, id="the way leads ahead"),
        pytest.param(np.pi, (), True, False, id="it leads back and there is room to turn"),
        pytest.param(np.pi, DEAD_END, False, True, id="it leads back and there is none"),
        pytest.param(1.4, DEAD_END, True, True, id="it leads aside and the robot backs up already"),
        pytest.param(1.4, DEAD_END, False, False, id="it leads aside and the robot does not yet"),
    ],
)
def test_the_robot_backs_up_where(yaw, boxes, before, backs_up):
    field, start = field_with(*boxes), make_start(np.array([0.5, 0.0, yaw]), 0.0, 0.0)
    plan = straight(2.5) + np.array([0.5, 0.0, 0.0])
    way = way_along(plan, np.array([8.0, 0.0, 0.0]), 1.5, field, DISCS)
    assert must_back_up(way, start, field, DISCS, 0.05, before) is backs_up


def find_way(*boxes, memory=None, **values):
    """The way that a robot finds at the origin, 0.5 m/s fast, on a plan along x."""
    controller, now = Harmony(HarmonyParameters(), setup_for()), seen(*boxes, **values)
    start = make_start(now.pose, 0.5, 0.0)
    memory = HarmonyMemory() if memory is None else memory
    return controller._way_finder.find(now, memory, start, distance_field(now.costmap), 1.5)


@pytest.mark.parametrize(
    ("yaw", "walls", "is_trapped", "backs_up"),
    [
        pytest.param(np.pi, SIDES, True, True, id="the free plan leads back, no room to turn"),
        pytest.param(np.pi, SIDES, False, False, id="its plans get on all the same"),
        pytest.param(np.pi, (), True, False, id="there is room to turn"),
        pytest.param(0.0, SIDES, True, False, id="the plan leads ahead"),
    ],
)
def test_a_robot_that_is_trapped_on_a_free_plan_backs_up_where(yaw, walls, is_trapped, backs_up):
    memory = HarmonyMemory(is_trapped=is_trapped)
    found = find_way(*walls, memory=memory, pose=(0.0, 0.0, yaw))
    assert (found.is_open, found.detour) == (True, None)
    assert found.way.backs_up is backs_up


@pytest.mark.parametrize(
    ("front_m", "met_s", "backs_up", "is_open"),
    [
        # The robot reaches to 0.86 m, and the wall is as wide as the map.
        pytest.param(1.3, 0.0, False, True, id="something has moved 1 s ago"),
        pytest.param(1.3, -np.inf, False, False, id="nothing has"),
        pytest.param(1.3, -9.1, False, False, id="it was 10.1 s ago"),
        pytest.param(1.8, 0.0, False, False, id="the way is free for 0.9 m"),
        pytest.param(1.8, 0.0, True, True, id="it backs up already, until 1.2 m are free"),
        pytest.param(2.3, 0.0, True, False, id="the way is free for 1.4 m"),
    ],
)
@pytest.mark.parametrize("yaw", [0.0, np.pi])
def test_it_drives_away_where_the_way_is_closed_and(front_m, met_s, backs_up, is_open, yaw):
    memory = HarmonyMemory(met_s=met_s, backs_up=backs_up)
    wall = (front_m, -3.0, front_m + 0.1, 3.0)
    found = find_way(wall, memory=memory, pose=(0.0, 0.0, yaw))
    assert found.is_open is is_open
    if is_open:
        # 3 s at 0.2 m/s away from the wall, backwards if the robot faces it.
        assert found.way.target[:2] == pytest.approx([-0.6, 0.0])
        assert found.way.backs_up is (yaw == 0.0)


def test_a_way_past_a_box_is_found_before_the_local_plan_reaches_it():
    # The local plan ends 0.4 m before the box: more than half the width of the robot, 0.31 m.
    box = (2.4, -0.2, 2.6, 0.2)
    plans = {"plan": straight(2.0), "global_plan": straight(6.0)}
    assert find_way(box, **plans).detour is not None
    assert find_way(**plans).detour is None


@pytest.mark.parametrize(
    ("half_width_m", "is_open"),
    [
        pytest.param(0.5, True, id="the way past what is seen is short"),
        # At least twice the way to (2.05, 2.25): 6.1 m, where 4.8 m are the most.
        pytest.param(1.9, False, id="more of a wall is seen"),
    ],
)
def test_a_detour_that_the_map_closes_is_replaced_only_by_a_short_one(half_width_m, is_open):
    wall = (2.0, -half_width_m, 2.1, half_width_m)
    through = path_from_polyline(np.array([[0.0, 0.0], [2.05, 0.3], [3.5, 0.0]]), 0.05)
    plans = {"plan": straight(2.0), "global_plan": straight(6.0)}
    found = find_way(wall, memory=HarmonyMemory(detour=through), **plans)
    assert found.is_open is is_open
    assert (found.detour is not None) is is_open


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.long)])
def test_it_backs_out_of_a_dead_end_and_drives_around(seed):
    among = {"error_m": ERROR_M, "longest_s": 20.0}
    found = drive_among(np.array(DEAD_END), HarmonyParameters(), seed, **among)
    assert found.end == "arrived"
    assert found.least_gap_m > 0.0


@pytest.mark.long
def test_a_trial_into_a_pocket_succeeds_without_a_contact():
    log = run_trial("pocket", "harmony", seed=1)
    assert log.outcome == Outcome.SUCCEEDED
    assert log.samples["clearance_m"].min() > 0.0
