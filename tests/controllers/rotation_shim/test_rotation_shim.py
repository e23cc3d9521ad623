"""The Rotation Shim: when it turns, how fast, and when it lets its primary controller drive.

Defaults: turn beyond 0.785 rad until 0.3925 rad, 1.8 rad/s, 3.2 rad/s^2, at 20 Hz; within a period
the turn rate changes by 3.2 * 0.05 = 0.16 rad/s.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from controller_scenes import command_of, make_costmap, make_setup, observe, turned_plan

from drake_navbench.controller import (
    CONTROLLERS,
    CollisionAhead,
    GracefulController,
    SpeedLimit,
)
from drake_navbench.controllers.rotation_shim import RotationShim, RotationShimParameters
from drake_navbench.controllers.rotation_shim.releases import RULES
from drake_navbench.kernels.grid import FREE, LETHAL, NO_INFORMATION

RATE_CHANGE = 0.16
LEFT, RIGHT, AHEAD = turned_plan(math.pi / 2), turned_plan(-math.pi / 2), turned_plan(0.1)
# Before the wheelchair's left front corner, where it comes while it turns to the left: it reaches
# 0.901 m, and stands in front of 0.85 m.
LEFT_OF_FRONT = (0.62, 0.62)


def make_shim(primary=None, **parameters):
    """Returns a shim over RPP, which drives at 0.5 m/s where the plan is straight ahead."""
    block = {"plugin": "rpp", "use_rotate_to_heading": False, "use_collision_detection": False}
    block |= primary or {}
    model = RotationShimParameters.model_validate({"primary_controller": block} | parameters)
    return RotationShim(model, make_setup())


def turns(controller, observation, memory=None):
    """Tells whether a cycle is a turn, by what it says of itself."""
    memory = controller.initial_memory() if memory is None else memory
    return controller.step(observation, memory).diagnostics["shim_is_turning"]


@pytest.mark.parametrize(("plan", "w"), [(LEFT, RATE_CHANGE), (RIGHT, -RATE_CHANGE)])
def test_a_turn_begins_with_what_a_period_of_acceleration_gives(plan, w):
    assert command_of(make_shim(), observe(plan)) == (0.0, pytest.approx(w))


def test_a_turn_speeds_up_from_the_measured_rate_to_the_one_asked_for():
    assert command_of(make_shim(), observe(LEFT, twist=(0.0, 1.0)))[1] == pytest.approx(1.16)
    assert command_of(make_shim(), observe(LEFT, twist=(0.0, 1.7)))[1] == pytest.approx(1.8)


def test_a_turn_slows_down_to_stop_within_the_angle_left():
    # At 1 rad: sqrt(2 * 0.5 * 1) = 1, whatever the acceleration from 1.5 rad/s allows.
    shim = make_shim(max_angular_accel=0.5)
    assert command_of(shim, observe(turned_plan(1.0), twist=(0.0, 1.5)))[1] == pytest.approx(1.0)


def test_without_closed_loop_a_turn_speeds_up_from_the_last_command():
    shim = make_shim(closed_loop=False)
    first = shim.step(observe(LEFT, twist=(0.0, 1.0)), shim.initial_memory())
    second = shim.step(observe(LEFT, twist=(0.0, 1.0)), first.memory)
    assert first.command[1] == pytest.approx(RATE_CHANGE)
    assert second.command[1] == pytest.approx(2 * RATE_CHANGE)


def test_the_primary_controllers_command_counts_as_the_last_one():
    shim = make_shim(closed_loop=False)
    driven = shim.step(observe(turned_plan(0.5)), shim.initial_memory())
    assert driven.memory.last_w == driven.command[1] > 0.3
    w = shim.step(observe(LEFT), driven.memory).command[1]
    assert w == pytest.approx(driven.command[1] + RATE_CHANGE)


def test_a_turn_begins_beyond_one_threshold_and_goes_on_to_another():
    shim = make_shim()
    for angle, at_first, in_a_turn in [
        (0.786, True, True),
        (0.784, False, True),
        (0.393, False, True),
        (0.392, False, False),
    ]:
        turning = shim.step(observe(LEFT), shim.initial_memory()).memory
        assert turning.is_turning
        assert turns(shim, observe(turned_plan(angle))) is at_first
        assert turns(shim, observe(turned_plan(angle)), turning) is in_a_turn


def test_within_the_threshold_the_command_is_the_primary_controllers_own():
    shim = make_shim()
    primary = shim.controller = CONTROLLERS.load("rpp")(
        shim._parameters.primary_controller.parameters, make_setup()
    )
    assert command_of(shim, observe(AHEAD)) == command_of(primary, observe(AHEAD))


def test_the_heading_is_that_of_the_plan_at_the_sampling_distance():
    # 0.3 m to the left, then ahead: at 0.5 m from its start it is at (0.4, 0.3), 0.6435 rad.
    plan = np.vstack([turned_plan(math.pi / 2, 0.3), [[0.05 * i, 0.3, 0.0] for i in range(1, 40)]])
    shim = make_shim()
    assert not turns(shim, observe(plan))
    assert turns(make_shim(forward_sampling_distance=0.3), observe(plan))
    decision = make_shim(angular_dist_threshold=0.6).step(observe(plan), shim.initial_memory())
    assert decision.diagnostics["heading_error_rad"] == pytest.approx(math.atan2(0.3, 0.4))


def test_of_a_plan_shorter_than_the_sampling_distance_its_end_counts():
    assert turns(make_shim(), observe(turned_plan(math.pi / 2, 0.2)))


def test_a_single_pose_is_no_heading():
    assert not turns(make_shim(), observe(LEFT[5:6]))


def test_with_path_orientations_the_robot_turns_as_the_pose_faces():
    sideways = turned_plan(0.0)
    sideways[:, 2] = 1.5
    shim = make_shim(use_path_orientations=True)
    decision = shim.step(observe(sideways, pose=(0.0, 0.0, 0.25)), shim.initial_memory())
    assert decision.diagnostics["heading_error_rad"] == pytest.approx(1.25)
    assert not turns(make_shim(), observe(sideways, pose=(0.0, 0.0, 0.25)))


def test_at_the_goal_it_turns_to_the_goals_heading_where_asked_to():
    plan = turned_plan(0.0, 0.1)
    plan[-1, 2] = -0.2
    there = observe(plan, goal_xy_reached=True)
    shim = make_shim(rotate_to_goal_heading=True)
    decision = shim.step(there, shim.initial_memory())
    assert decision.command.tolist() == [0.0, pytest.approx(-RATE_CHANGE)]
    assert decision.diagnostics["branch"] == "rotate_to_goal"
    assert not decision.memory.is_turning
    assert not turns(make_shim(), there)
    assert not turns(shim, observe(plan))


@pytest.mark.parametrize("cost", [LETHAL, NO_INFORMATION])
def test_a_turn_that_would_collide_is_left_to_the_primary_controller(cost):
    blocked = make_costmap(cells=[(*LEFT_OF_FRONT, cost)])
    # Fast enough to come there within the second that is looked ahead.
    assert not turns(make_shim(), observe(LEFT, twist=(0.0, 1.0), costmap=blocked))
    assert turns(make_shim(), observe(LEFT, twist=(0.0, 1.0)))


def test_unknown_space_blocks_a_turn_even_where_the_costmap_tracks_it():
    unknown = make_costmap(cells=[(*LEFT_OF_FRONT, NO_INFORMATION)], tracks_unknown=True)
    shim = make_shim(max_cost_threshold=300.0)
    assert not turns(shim, observe(LEFT, twist=(0.0, 1.0), costmap=unknown))


def test_the_cost_that_blocks_a_turn_can_be_chosen():
    costly = observe(LEFT, twist=(0.0, 1.0), costmap=make_costmap(cells=[(*LEFT_OF_FRONT, 200)]))
    assert turns(make_shim(), costly)
    assert turns(make_shim(max_cost_threshold=201.0), costly)
    assert not turns(make_shim(max_cost_threshold=200.0), costly)


def test_a_turn_is_checked_for_the_time_given():
    # At 1.16 rad/s the outline comes there after more than 0.2 s.
    blocked = observe(
        LEFT, twist=(0.0, 1.0), costmap=make_costmap(cells=[(*LEFT_OF_FRONT, LETHAL)])
    )
    assert turns(make_shim(simulate_ahead_time=0.1), blocked)
    assert not turns(make_shim(simulate_ahead_time=1.0), blocked)


def test_a_turn_to_the_right_is_checked_as_far_as_it_goes_and_one_to_the_left_beyond():
    # 0.8 rad to go: 0.015 rad of them before the hand-over, which the first step of 0.058 passes.
    def blocked(side):
        cells = [(LEFT_OF_FRONT[0], side * LEFT_OF_FRONT[1], LETHAL)]
        return observe(
            turned_plan(0.8 * side), twist=(0.0, side), costmap=make_costmap(cells=cells)
        )

    assert turns(make_shim(), blocked(-1.0))
    assert not turns(make_shim(), blocked(1.0))


def test_what_the_primary_controller_raises_goes_through_with_a_memory_of_both():
    wall = make_costmap(cells=[(0.95, 0.02, LETHAL)])
    shim = make_shim({"use_collision_detection": True}, closed_loop=False)
    turning = shim.step(observe(LEFT), shim.initial_memory()).memory
    with pytest.raises(CollisionAhead) as raised:
        shim.step(observe(AHEAD, twist=(0.4, 0.0), costmap=wall), turning)
    assert not raised.value.memory.is_turning
    assert raised.value.memory.last_w == pytest.approx(RATE_CHANGE)
    assert raised.value.memory.primary == turning.primary


def test_a_speed_limit_is_the_primary_controllers_alone():
    limit = SpeedLimit(50.0, is_percentage=True)
    assert command_of(make_shim(), observe(AHEAD, speed_limit=limit))[0] == pytest.approx(0.25)
    turning = observe(LEFT, twist=(0.0, 1.8), speed_limit=limit)
    assert command_of(make_shim(), turning)[1] == pytest.approx(1.8)


def test_a_cancelled_shim_stops_at_once_whatever_its_primary_controller_would_do():
    assert isinstance(CONTROLLERS.load("rpp"), type)
    assert not isinstance(make_shim({"use_cancel_deceleration": True}), GracefulController)


def facing(shim, plan, *, plan_id=1, memory=None, **values):
    """Returns the decision on a plan whose number is given."""
    memory = shim.initial_memory() if memory is None else memory
    return shim.step(observe(plan, plan_id=plan_id, **values), memory)


@pytest.mark.parametrize("release", sorted(set(RULES) - {"lyrical"}))
def test_before_lyrical_a_plan_that_was_faced_once_is_not_looked_at_again(release):
    shim = make_shim(nav2_release=release)
    driving = facing(shim, AHEAD).memory
    assert not facing(shim, LEFT, memory=driving).diagnostics["shim_is_turning"]
    assert facing(shim, LEFT, plan_id=2, memory=driving).diagnostics["shim_is_turning"]
    lyrical = make_shim()
    driving = facing(lyrical, AHEAD).memory
    assert facing(lyrical, LEFT, memory=driving).diagnostics["shim_is_turning"]


@pytest.mark.parametrize(
    ("release", "turns_again"),
    [("jazzy", False), ("kilted", False), ("humble", True), ("iron", True), ("lyrical", True)],
)
def test_once_a_goal_is_a_rule_of_jazzy_and_kilted_alone(release, turns_again):
    shim = make_shim(nav2_release=release, rotate_to_heading_once=True)
    goal = np.array([2.0, 0.0, 0.0])
    driving = facing(shim, AHEAD, goal=goal).memory
    again = facing(shim, LEFT, plan_id=2, memory=driving, goal=goal)
    assert again.diagnostics["shim_is_turning"] is turns_again
    elsewhere = facing(shim, LEFT, plan_id=2, memory=driving, goal=goal + 0.5)
    assert elsewhere.diagnostics["shim_is_turning"]


@pytest.mark.parametrize(
    ("release", "w"),
    [("humble", 1.4), ("iron", 1.4), ("jazzy", 1.0), ("kilted", 1.0), ("lyrical", 1.0)],
)
def test_turns_stop_in_time_from_jazzy_on(release, w):
    shim = make_shim(nav2_release=release, max_angular_accel=0.5, rotate_to_heading_angular_vel=1.4)
    fast = observe(turned_plan(1.0), twist=(0.0, 1.4))
    assert command_of(shim, fast)[1] == pytest.approx(w)


@pytest.mark.parametrize(
    ("release", "is_turning"),
    [("humble", False), ("iron", True), ("jazzy", True), ("kilted", True), ("lyrical", True)],
)
def test_in_humble_a_plan_shorter_than_the_sampling_distance_has_no_heading(release, is_turning):
    shim = make_shim(nav2_release=release)
    assert turns(shim, observe(turned_plan(math.pi / 2, 0.2))) is is_turning


@pytest.mark.parametrize("release", RULES)
def test_before_lyrical_the_sampling_distance_begins_at_the_first_pose_of_the_whole_plan(release):
    # 0.4 m ahead, then left; the robot is 0.2 m along. 0.5 m from (0, 0) lies (0.4, 0.3), and
    # from (0.2, 0) the first pose as far is (0.4, 0.5).
    ahead = [[0.05 * i, 0.0, 0.0] for i in range(9)]
    whole = np.array(ahead + [[0.4, 0.05 * i, math.pi / 2] for i in range(1, 21)])
    shim = make_shim(nav2_release=release)
    decision = facing(shim, whole[4:], pose=(0.2, 0.0, 0.0), global_plan=whole)
    seen_y = 0.5 if release == "lyrical" else 0.3
    assert decision.diagnostics["heading_error_rad"] == pytest.approx(math.atan2(seen_y, 0.2))


@pytest.mark.parametrize("release", RULES)
def test_a_release_reads_the_cost_threshold_or_takes_lethal(release):
    costly = observe(LEFT, twist=(0.0, 1.0), costmap=make_costmap(cells=[(*LEFT_OF_FRONT, 200)]))
    shim = make_shim(nav2_release=release, max_cost_threshold=150.0)
    assert turns(shim, costly) is (release in {"humble", "iron", "kilted"})


def test_in_iron_the_measured_rate_counts_whatever_closed_loop_says():
    shim = make_shim(nav2_release="iron", closed_loop=False)
    assert command_of(shim, observe(LEFT, twist=(0.0, 1.0)))[1] == pytest.approx(1.16)


@pytest.mark.parametrize(
    ("release", "stays"), [("humble", True), ("iron", False), ("jazzy", True), ("kilted", True)]
)
def test_before_lyrical_distance_tells_that_the_goal_is_reached_and_most_keep_it(release, stays):
    shim = make_shim(nav2_release=release, rotate_to_goal_heading=True)
    plan = turned_plan(0.0, 0.2)
    plan[-1, 2] = 1.0
    there = facing(shim, plan, goal_xy_tolerance_m=0.25)
    assert there.diagnostics["branch"] == "rotate_to_goal"
    away = facing(shim, plan, memory=there.memory, goal_xy_tolerance_m=0.1)
    assert (away.diagnostics["branch"] == "rotate_to_goal") is stays
    anew = facing(shim, plan, plan_id=2, memory=there.memory, goal_xy_tolerance_m=0.1)
    assert anew.diagnostics["branch"] != "rotate_to_goal"


def test_the_threshold_that_ends_a_turn_is_another_by_default_in_humble():
    values = {
        release: make_shim(nav2_release=release)._parameters.angular_disengage_threshold
        for release in RULES
    }
    assert values.pop("humble") == 0.785
    assert set(values.values()) == {0.3925}


def test_free_space_costs_nothing():
    assert turns(make_shim(max_cost_threshold=1.0), observe(LEFT, costmap=make_costmap(FREE)))
