"""Regulated Pure Pursuit of the releases up to Kilted, with the arithmetic beside the numbers."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from drake_navbench.controller import ControllerError, InvalidPath, NoValidControl
from drake_navbench.controllers.rpp import RegulatedPurePursuitParameters
from drake_navbench.controllers.rpp.controller import plan_cut
from drake_navbench.controllers.rpp.kernels import distance_to_cusp, point_at

OLDER = ("humble", "iron", "jazzy", "kilted")
DIGITS = 1e-6


def decide(controller, observation, memory=None):
    """Returns the decision of a cycle."""
    return controller.step(observation, memory or controller.initial_memory())


def line(first, last, step=0.1, y=0.0, yaw=0.0):
    """Returns poses along x."""
    return [[x, y, yaw] for x in np.arange(first, last + 0.5 * step, step)]


@pytest.mark.parametrize("release", OLDER)
def test_the_carrot_is_at_a_straight_distance(make_controller, observe, release):
    # On the line y = 0.3 at 0.6 m: x = sqrt(0.36 - 0.09) = 0.519615; curvature 0.6 / 0.36 = 5/3.
    # Radius 0.6 of 0.9: v = 0.5 * 0.6 / 0.9 = 1/3, w = 5/9.
    decision = decide(make_controller(nav2_release=release), observe())
    assert decision.command == pytest.approx([1.0 / 3.0, 5.0 / 9.0], abs=DIGITS)


@pytest.mark.parametrize(("release", "x"), [("humble", 0.6), ("iron", 0.6), ("jazzy", 0.519615)])
def test_without_interpolation_it_is_the_farther_pose(make_controller, observe, setup, release, x):
    wanting = make_controller(
        nav2_release=release, use_interpolation=False, use_regulated_linear_velocity_scaling=False
    )
    curvature = 0.6 / (x**2 + 0.09)
    decision = decide(wanting, observe())
    assert decision.command == pytest.approx([0.5, 0.5 * curvature], abs=DIGITS)


@pytest.mark.parametrize(
    ("release", "v", "w"),
    [
        # Not read: as without it.
        ("humble", 1.0 / 3.0, 5.0 / 9.0),
        # At 1 m the curvature is 0.6, which slows nothing down; Iron still steers by the carrot.
        ("iron", 0.5, 0.5 * 5.0 / 3.0),
        ("jazzy", 0.5, 0.3),
    ],
)
def test_what_the_fixed_lookahead_is_for(make_controller, observe, release, v, w):
    fixed = make_controller(
        nav2_release=release, use_fixed_curvature_lookahead=True, curvature_lookahead_dist=1.0
    )
    assert decide(fixed, observe()).command == pytest.approx([v, w], abs=DIGITS)


def test_humble_tells_distances_from_another_cost(make_controller, observe, make_costmap):
    # 0.2254985 + ln(252 / 128) / 3 = 0.451298 m: v = 0.5 * 0.451298 / 0.6; 253 makes 0.452618 m.
    fields = {"use_regulated_linear_velocity_scaling": False}
    observation = observe(costmap=make_costmap(128))
    humble = decide(make_controller(nav2_release="humble", **fields), observation)
    iron = decide(make_controller(nav2_release="iron", **fields), observation)
    assert humble.command[0] == pytest.approx(0.376082, abs=DIGITS)
    assert iron.command[0] == pytest.approx(0.377182, abs=DIGITS)


@pytest.mark.parametrize(
    ("release", "w"), [("humble", 0.138564), ("iron", 0.66), ("jazzy", 0.138564)]
)
def test_iron_turns_too_fast_to_stop_in_time(make_controller, observe, release, w):
    # 0.003 rad to turn, at 0.5 rad/s: within 3.2 * 0.05 of it, or at most sqrt(2 * 3.2 * 0.003).
    plan = [[-0.1, 0.0, 0.003], [0.1, 0.0, 0.003]]
    decision = decide(make_controller(nav2_release=release), observe(plan, twist=(0.0, 0.5)))
    assert decision.diagnostics["branch"] == "rotate_to_goal"
    assert decision.command[1] == pytest.approx(w, abs=DIGITS)


@pytest.mark.parametrize("release", OLDER)
def test_the_carrot_not_the_goal_begins_the_last_turn(make_controller, observe, release):
    near = observe(line(-0.5, 0.2, yaw=1.0), goal_xy_reached=False)
    assert decide(make_controller(nav2_release=release), near).diagnostics["branch"] == (
        "rotate_to_goal"
    )
    far = observe(line(-0.5, 0.3, yaw=1.0), goal_xy_reached=True)
    assert decide(make_controller(nav2_release=release), far).diagnostics["branch"] == "track"


@pytest.mark.parametrize(
    ("release", "fields", "keeps"),
    [
        ("humble", {}, False),
        ("iron", {}, False),
        ("jazzy", {}, True),
        ("kilted", {}, True),
        ("kilted", {"stateful": False}, False),
    ],
)
def test_the_last_turn_goes_on_until_a_new_plan(make_controller, observe, release, fields, keeps):
    controller = make_controller(nav2_release=release, **fields)
    plan = line(-1.0, 0.2, yaw=1.0)
    memory = decide(controller, observe(plan)).memory
    # The robot drifts back to 0.4 m before the end.
    away = observe(plan, pose=(-0.2, 0.0, 0.0))
    branch = "rotate_to_goal" if keeps else "track"
    assert decide(controller, away, memory).diagnostics["branch"] == branch
    assert decide(controller, replace(away, plan_id=2), memory).diagnostics["branch"] == "track"


@pytest.mark.parametrize(("release", "branch"), [("iron", "rotate_to_path"), ("jazzy", "track")])
def test_up_to_iron_who_turns_in_place_does_not_reverse(make_controller, observe, release, branch):
    controller = make_controller(nav2_release=release, allow_reversing=True)
    decision = decide(controller, observe(line(-1.5, 0.0)[::-1]))
    assert decision.diagnostics["branch"] == branch
    assert (decision.command[0] < 0.0) == (branch == "track")


@pytest.mark.parametrize("release", OLDER)
def test_no_carrot_beyond_a_cusp(make_controller, observe, release):
    there_and_back = [*line(0.0, 0.4), *line(0.1, 0.3)[::-1]]
    fields = {"nav2_release": release, "use_rotate_to_heading": False}
    reverses = decide(make_controller(allow_reversing=True, **fields), observe(there_and_back))
    assert reverses.diagnostics["lookahead_distance_m"] == pytest.approx(0.4)
    not_so = decide(make_controller(**fields), observe(there_and_back))
    assert not_so.diagnostics["lookahead_distance_m"] == 0.6


def test_a_turn_in_place_is_a_cusp_since_iron():
    turns = np.array([[0.1, 0.0, 0.0], [0.3, 0.0, 0.0], [0.3, 0.0, 1.0], [0.5, 0.0, 1.0]])
    assert distance_to_cusp(turns, False) == np.inf
    assert distance_to_cusp(turns, True) == pytest.approx(0.3)
    assert distance_to_cusp(turns[:1], True) == np.inf


def test_the_last_segment_goes_on_beyond_the_end():
    poses = np.array([[0.0, 0.3, 0.0], [0.3, 0.3, 0.0]])
    assert point_at(poses, 1.0, True, False) == (0.3, 0.3)
    # sqrt(1 - 0.09) = 0.953939 on the line y = 0.3.
    assert point_at(poses, 1.0, True, True) == pytest.approx((0.953939, 0.3), abs=DIGITS)
    # One pose has no direction.
    assert point_at(poses[:1], 1.0, True, True) == (0.0, 0.3)


def cut(release, plan, make_costmap, *, x=0.0, begin=0, **fields):
    """Returns the first and the last x of the local plan, and where the rest begins."""
    parameters = RegulatedPurePursuitParameters(nav2_release=release, **fields)
    pose = np.array([x, 0.0, 0.0])
    seen = SimpleNamespace(whole_plan=np.array(plan), pose=pose, costmap=make_costmap())
    poses, left = plan_cut(parameters).cut(seen, begin)
    return poses[0, 0], poses[-1, 0], left


def test_the_plan_reaches_to_half_the_costmap(make_costmap):
    # Of 4 m, less half a cell as Nav2 has it: 1.9875 m.
    plan = line(-1.0, 5.0, 0.25)
    assert cut("humble", plan, make_costmap) == (0.0, 1.75, 4)
    # What was passed is gone.
    assert cut("humble", plan, make_costmap, begin=8) == (1.0, 1.75, 8)


def test_of_equally_close_poses(make_costmap):
    plan = line(0.0, 3.0, 1.0)
    far = {"x": 0.5, "max_robot_pose_search_dist": 2.5}
    firsts = [cut(r, plan, make_costmap, **far)[2] for r in ("humble", "iron", "jazzy")]
    assert firsts == [0, 1, 1]


def test_two_poses_are_left_since_jazzy(make_costmap):
    plan = line(0.0, 1.0, 0.5)
    assert [cut(r, plan, make_costmap, x=1.0)[0] for r in ("iron", "jazzy")] == [1.0, 0.5]


def test_how_far_the_closest_pose_is_looked_for(make_costmap):
    plan = line(0.0, 5.0, 0.5)
    fields = {"max_robot_pose_search_dist": 1.0}
    assert cut("iron", plan, make_costmap, x=2.0, **fields)[0] == 1.0
    fields = {"max_robot_pose_search_dist": -1.0}
    assert cut("iron", plan, make_costmap, x=4.0, **fields)[0] == 4.0
    # Humble looks at one pose.
    assert cut("humble", plan, make_costmap, x=1.0, **fields)[0] == 0.0


def test_humbles_errors_are_waited_for(make_controller, observe):
    with pytest.raises(NoValidControl):
        decide(make_controller(nav2_release="humble"), observe([]))
    with pytest.raises(InvalidPath):
        decide(make_controller(nav2_release="iron"), observe([]))
    off_map = observe(line(5.0, 6.0), pose=(5.0, 0.0, 0.0))
    with pytest.raises(NoValidControl, match="lies outside"):
        decide(make_controller(nav2_release="humble"), off_map)
    with pytest.raises(ControllerError, match="lies outside"):
        decide(make_controller(nav2_release="iron"), off_map)


def test_what_a_release_does_not_read_changes_nothing(make_controller, observe):
    values = {"use_dynamic_window": True, "min_distance_to_obstacle": 3.0}
    plain = decide(make_controller(nav2_release="jazzy"), observe())
    given = decide(make_controller(nav2_release="jazzy", **values), observe())
    assert given.command.tolist() == plain.command.tolist()
    model = RegulatedPurePursuitParameters
    assert model.keys_not_read({"nav2_release": "jazzy", **values}) == list(values)
    assert model.keys_not_read({"nav2_release": "lyrical", **values}) == []
    assert model.keys_not_read({"nav2_release": "jazzy", "max_linear_vel": 1.0}) == [
        "max_linear_vel"
    ]
    assert model.is_without_effect("stateful", {"stateful": True})


def test_kilted_looks_longer_but_not_farther(make_controller, observe, make_costmap):
    # At 0.1 m/s a second is 0.1 m; 0.6 m take 6 s, up to the carrot at 0.6 m. The robot's 0.23 m
    # reach the wall at 0.7 m after 0.47 m.
    fields = {"desired_linear_vel": 0.1, "min_distance_to_obstacle": 0.6, "nav2_release": "kilted"}
    fields |= {"regulated_linear_scaling_min_speed": 0.1}
    wall = make_costmap(lethal=[(0.7, 0.0)])
    observation = observe(line(0.0, 2.0), costmap=wall)
    with pytest.raises(NoValidControl, match="collision ahead"):
        decide(make_controller(**fields), observation)
    assert decide(make_controller(**fields | {"nav2_release": "jazzy"}), observation).command[0] > 0
    # A wall beyond the carrot is not looked at in Kilted, however far it is asked to look.
    beyond = observe(line(0.0, 2.0), costmap=make_costmap(lethal=[(1.0, 0.0)]))
    fields |= {"min_distance_to_obstacle": 0.9, "use_velocity_scaled_lookahead_dist": True}
    assert decide(make_controller(**fields), beyond).command[0] > 0
    with pytest.raises(NoValidControl, match="collision ahead"):
        decide(make_controller(**fields | {"nav2_release": "lyrical"}), beyond)
