"""Vector Pursuit: where it aims, the curve it takes, its speed, its turns in place.

Defaults: k 8, 0.5 m/s, no curve tighter than 1 m, the target 0.6 m ahead; at 20 Hz the speed grows
by 2 * 0.05 = 0.1 m/s a cycle, the rate of a turn in place by 3.2 * 0.05 = 0.16 rad/s.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from controller_scenes import arc_plan, command_of, make_costmap, make_setup, observe, turned_plan

from drake_navbench.controller import CollisionAhead, InvalidPath, SpeedLimit
from drake_navbench.controllers.vector_pursuit import VectorPursuit, VectorPursuitParameters
from drake_navbench.controllers.vector_pursuit.aim import (
    circle_crossing,
    cusp_distance,
    mean_heading,
    pose_ahead,
)
from drake_navbench.controllers.vector_pursuit.controller import VectorPursuitMemory
from drake_navbench.controllers.vector_pursuit.cycle import STRAIGHT_RADIUS_M, turning_radius
from drake_navbench.kernels.grid import LETHAL

AHEAD, CURVE, SIDE = turned_plan(0.0), arc_plan(1.2, 1.2), turned_plan(1.2)
CRUISING = VectorPursuitMemory(0.5, 0.0)
WALL = [(1.1, -0.5 + 0.05 * i, LETHAL) for i in range(20)]


def make_pursuit(**parameters):
    return VectorPursuit(VectorPursuitParameters(**parameters), make_setup())


def radius_to(x, y, yaw, **parameters):
    return turning_radius(make_pursuit(**parameters)._settings_record[0], x, y, yaw)


def test_the_target_is_where_the_plan_leaves_the_circle_of_the_lookahead():
    assert circle_crossing(0.5, 0.3, 1.0, 0.3, 0.5) == pytest.approx((0.4, 0.3))
    plan = np.array([[0.0, 0.3, 0.2], [1.0, 0.3, 0.6]])
    assert pose_ahead(plan, 0.5, True, True) == pytest.approx((0.4, 0.3, 0.4))
    assert pose_ahead(plan, 0.5, True, False) == pytest.approx((0.4, 0.3, 0.0))
    assert pose_ahead(plan, 0.5, False, True) == (1.0, 0.3, 0.6)
    assert pose_ahead(plan, 0.5, False, False) == (1.0, 0.3, 0.0)


def test_of_a_plan_that_stays_within_the_lookahead_the_end_is_the_target():
    plan = np.array([[0.0, 0.0, 0.1], [0.2, 0.0, 0.2], [0.2, 0.2, 0.3]])
    assert pose_ahead(plan, 0.5, True, True) == (0.2, 0.2, 0.3)
    assert pose_ahead(plan, 0.5, True, False) == (0.2, 0.2, pytest.approx(math.pi / 2))


def test_of_a_plan_that_begins_beyond_the_lookahead_the_start_is_the_target():
    plan = np.array([[1.0, 0.0, 0.1], [1.0, 1.0, 0.2]])
    assert pose_ahead(plan, 0.5, True, True) == (1.0, 0.0, 0.1)
    assert pose_ahead(plan, 0.5, True, False) == (1.0, 0.0, pytest.approx(math.pi / 2))


def test_headings_on_either_side_of_straight_ahead_are_taken_for_one_behind():
    assert mean_heading(0.2, 0.4) == pytest.approx(0.3)
    assert mean_heading(-0.2, -0.4) == pytest.approx(-0.3)
    assert abs(mean_heading(0.1, -0.1)) == pytest.approx(math.pi)


@pytest.mark.parametrize(
    ("plan", "distance"),
    [
        ([[0.0, 0.0, 0.0], [0.3, 0.4, 0.0], [0.6, 0.8, 0.0]], math.inf),
        ([[0.0, 0.0, 0.0], [0.3, 0.4, 0.0], [0.0, 0.1, 0.0]], 0.5),
        ([[0.3, 0.4, 0.0], [0.3, 0.4, 1.0], [0.6, 0.8, 0.0]], 0.5),
        ([[0.0, 0.0, 0.0], [0.3, 0.4, 0.0], [0.3, 0.4, 1.0]], 0.5),
        ([[0.0, 0.0, 0.0], [0.3, 0.4, 0.0], [0.3, 0.4, 0.0]], math.inf),
        ([[0.0, 0.0, 0.0], [0.3, 0.4, 1.0]], math.inf),
    ],
)
def test_a_cusp_or_a_turn_in_place_ends_the_lookahead(plan, distance):
    assert cusp_distance(np.array(plan)) == pytest.approx(distance)


def test_the_curve_is_the_sum_of_two_screws():
    # To (1, 1): d^2 = 2, circle 1, angle atan2(0, 2) - pi/2, counted positive: 3 pi/2.
    angle = 1.5 * math.pi
    parallel = 8.0 * angle / (7.0 * angle)
    assert radius_to(1.0, 1.0, 0.0) == pytest.approx(parallel) == pytest.approx(8.0 / 7.0)
    assert radius_to(1.0, 1.0, 1.0, min_turning_radius=0.5) == pytest.approx(
        8.0 * angle / (7.0 * angle + 1.0)
    )
    assert radius_to(1.0, 1.0, 0.0, k=3.0) == pytest.approx(1.5)


def test_a_curve_to_the_right_is_wider_than_the_same_to_the_left():
    # To (1, -1): the angle is atan2(0, -2) + pi/2 = 3 pi/2, too, but the heading is -1.
    angle = 1.5 * math.pi
    assert radius_to(1.0, -1.0, -1.0) == pytest.approx(8.0 * angle / (7.0 * angle - 1.0))


def test_no_curve_is_tighter_than_allowed_and_straight_ahead_there_is_none():
    assert radius_to(0.1, 0.1, 0.0) == 1.0
    assert radius_to(1.0, 0.0, 0.0) == STRAIGHT_RADIUS_M
    assert radius_to(-1.0, 0.5, 0.0) == 1.0
    assert radius_to(-1.0, 0.5, 0.0, allow_reversing=True) > 1.0


def test_it_speeds_up_from_its_last_command():
    assert command_of(make_pursuit(), observe(AHEAD, twist=(0.4, 0.0)))[0] == pytest.approx(0.1)
    memory = VectorPursuitMemory(0.3, 0.0)
    assert command_of(make_pursuit(), observe(AHEAD), memory)[0] == pytest.approx(0.4)
    assert command_of(make_pursuit(), observe(AHEAD), CRUISING)[0] == pytest.approx(0.5)


def test_the_next_task_starts_from_the_last_command_of_the_one_before():
    # 2 m/s^2 for 0.05 s: 0.1 m/s more than the last command.
    pursuit = make_pursuit()
    memory = pursuit.next_memory(VectorPursuitMemory(0.3, 0.0, plan_id=4, plan_begin=9))
    assert memory == VectorPursuitMemory(0.3, 0.0)
    assert command_of(pursuit, observe(AHEAD), memory)[0] == pytest.approx(0.4)


def test_in_a_curve_the_lateral_acceleration_bounds_the_speed():
    # Of radius 1: v = sqrt(0.09 * 1).
    pursuit = make_pursuit(max_lateral_accel=0.09)
    v, w = command_of(pursuit, observe(arc_plan(0.7, 1.2)), CRUISING)
    assert (v, w) == (pytest.approx(0.3), pytest.approx(0.3))


def test_before_the_goal_it_slows_down_with_the_distance():
    # 0.4 m of 1 m left: 0.2 m/s; of 0.02 m no slower than 0.05 m/s.
    assert command_of(make_pursuit(), observe(turned_plan(0.0, 0.4)), CRUISING)[0] == pytest.approx(
        0.2
    )
    there = observe(turned_plan(0.0, 0.05), goal_xy_tolerance_m=0.01)
    assert command_of(make_pursuit(), there, CRUISING)[0] == pytest.approx(0.05)


def test_near_an_obstacle_it_slows_down():
    # A cost of 252 stands for the inscribed radius, 0.25 m: 0.5 * 0.25/0.6.
    near = observe(AHEAD, costmap=make_costmap(252))
    assert command_of(make_pursuit(), near, CRUISING)[0] == pytest.approx(0.5 * 0.25 / 0.6)
    blind = make_pursuit(use_cost_regulated_linear_velocity_scaling=False)
    assert command_of(blind, near, CRUISING)[0] == 0.5
    wrong = make_pursuit(inflation_cost_scaling_factor=0.0)
    assert command_of(wrong, near, CRUISING)[0] == 0.5


def test_a_target_to_the_side_is_turned_to():
    assert command_of(make_pursuit(), observe(SIDE)) == (0.0, pytest.approx(0.16))
    memory = VectorPursuitMemory(0.0, 1.7)
    assert command_of(make_pursuit(), observe(SIDE), memory) == (0.0, pytest.approx(1.8))
    v, _ = command_of(make_pursuit(use_rotate_to_heading=False), observe(SIDE))
    assert v == pytest.approx(0.1)


def test_without_a_least_radius_it_turns_in_place_whatever_is_asked():
    pursuit = make_pursuit(min_turning_radius=0.0, use_rotate_to_heading=False)
    assert command_of(pursuit, observe(SIDE))[0] == 0.0
    assert VectorPursuitParameters(
        min_turning_radius=0.0, use_rotate_to_heading=False
    ).turns_in_place()


def test_a_target_within_the_goals_tolerance_is_turned_at():
    plan = turned_plan(0.0, 0.2)
    plan[-1, 2] = -1.0
    assert command_of(make_pursuit(), observe(plan)) == (0.0, pytest.approx(-0.16))
    assert command_of(make_pursuit(), observe(plan, goal_xy_tolerance_m=0.1))[0] > 0.0


def test_a_target_behind_is_driven_to_backwards_where_allowed():
    behind = AHEAD * np.array([-1.0, 1.0, 1.0])
    pursuit = make_pursuit(allow_reversing=True)
    v, w = command_of(pursuit, observe(behind), VectorPursuitMemory(-0.5, 0.0))
    assert (v, w) == (-0.5, pytest.approx(0.0))
    assert command_of(make_pursuit(), observe(behind))[0] == 0.0


def test_a_command_that_would_collide_is_refused():
    # The front at 0.85 m is at the wall, 1.1 m, in 0.5 s at 0.5 m/s.
    with pytest.raises(CollisionAhead, match=r"collision ahead in 0\.50 s"):
        make_pursuit().step(observe(AHEAD, costmap=make_costmap(cells=WALL)), CRUISING)


def test_a_collision_beyond_the_target_or_the_time_does_not_count():
    seen = observe(AHEAD, costmap=make_costmap(cells=WALL), goal_xy_tolerance_m=0.1)
    assert command_of(make_pursuit(lookahead_dist=0.2), seen, CRUISING)[0] == 0.5
    short = make_pursuit(max_allowed_time_to_collision_up_to_target=0.4)
    assert command_of(short, seen, CRUISING)[0] == 0.5


def test_a_speed_limit_takes_the_place_of_the_cruise_speed():
    for limit, v in [
        (SpeedLimit(50.0, True), 0.25),
        (SpeedLimit(0.3), 0.3),
        (SpeedLimit(0.0), 0.5),
    ]:
        seen = observe(AHEAD, speed_limit=limit)
        assert command_of(make_pursuit(), seen, CRUISING)[0] == pytest.approx(v)


def test_off_the_costmap_there_is_no_speed():
    lost = observe(AHEAD + np.array([9.0, 0.0, 0.0]), pose=(9.0, 0.0, 0.0))
    assert command_of(make_pursuit(use_collision_detection=False), lost) == "NoValidControl"


def test_a_turn_rate_without_bound_is_no_command():
    pursuit = make_pursuit(min_turning_radius=0.0, rotate_to_heading_min_angle=3.0)
    behind = AHEAD * np.array([-1.0, 1.0, 1.0]) + np.array([0.0, 0.1, 0.0])
    assert command_of(pursuit, observe(behind)) == "NoValidControl"


@pytest.mark.parametrize("poses", [0, 1])
def test_a_plan_too_short_for_a_heading_is_refused(poses):
    pursuit = make_pursuit(use_heading_from_path=False)
    with pytest.raises(InvalidPath):
        pursuit.step(observe(AHEAD[:poses]), CRUISING)


SCENES = {
    "ahead": lambda: observe(AHEAD),
    "curve": lambda: observe(CURVE),
    "coarse curve": lambda: observe(CURVE[::8]),
    "askew": lambda: observe(CURVE + np.array([0.0, 0.0, 0.3])),
    "side": lambda: observe(SIDE),
    "back again": lambda: observe(np.concatenate([CURVE, AHEAD]), pose=(0.8, 0.5, 0.0)),
    "end": lambda: observe(turned_plan(0.0, 0.4)),
    "near end": lambda: observe(turned_plan(0.0, 0.1), goal_xy_tolerance_m=0.05),
    "near": lambda: observe(AHEAD, costmap=make_costmap(240)),
    "wall": lambda: observe(AHEAD, costmap=make_costmap(cells=WALL)),
    "behind": lambda: observe(AHEAD * np.array([-1.0, 1.0, 1.0])),
}
SCALED = {"use_velocity_scaled_lookahead_dist": True}
STRAIGHT_ON = {"use_rotate_to_heading": False}
# Parameter: another value, the scene in which it shows, and what else it takes.
CHANGES = {
    "k": (2.0, "curve", {"min_turning_radius": 0.1}),
    "desired_linear_vel": (0.4, "ahead", {}),
    "min_turning_radius": (2.0, "curve", {}),
    "lookahead_dist": (0.9, "curve", {"min_turning_radius": 0.1}),
    "use_velocity_scaled_lookahead_dist": (True, "curve", {"min_turning_radius": 0.1}),
    "min_lookahead_dist": (0.85, "curve", SCALED | {"min_turning_radius": 0.1}),
    "max_lookahead_dist": (0.5, "curve", SCALED | {"min_turning_radius": 0.1}),
    "lookahead_time": (1.0, "curve", SCALED | {"min_turning_radius": 0.1}),
    "use_interpolation": (False, "coarse curve", {"min_turning_radius": 0.1}),
    "use_heading_from_path": (False, "askew", {"min_turning_radius": 0.1}),
    "min_linear_velocity": (0.3, "end", {}),
    "min_approach_linear_velocity": (0.1, "near end", {}),
    "approach_velocity_scaling_dist": (0.3, "end", {}),
    "max_linear_accel": (0.0, "ahead", {"desired_linear_vel": 0.8}),
    "max_lateral_accel": (0.05, "curve", {}),
    "use_cost_regulated_linear_velocity_scaling": (False, "near", {}),
    "cost_scaling_dist": (1.0, "near", {}),
    "cost_scaling_gain": (0.5, "near", {}),
    "inflation_cost_scaling_factor": (0.2, "near", {}),
    "use_rotate_to_heading": (False, "side", {}),
    "rotate_to_heading_min_angle": (1.3, "side", {}),
    "rotate_to_heading_angular_vel": (0.1, "side", {}),
    "max_angular_accel": (1.0, "side", {}),
    "allow_reversing": (True, "behind", STRAIGHT_ON),
    "use_collision_detection": (False, "wall", {}),
    "max_allowed_time_to_collision_up_to_target": (0.3, "wall", {}),
    "nav2_release": ("jazzy", "curve", {"min_turning_radius": 0.1}),
    "max_robot_pose_search_dist": (0.3, "back again", {"nav2_release": "jazzy"} | STRAIGHT_ON),
}


@pytest.mark.parametrize("name", CHANGES)
def test_every_parameter_changes_a_command(name):
    value, scene, others = CHANGES[name]
    default = command_of(make_pursuit(**others), SCENES[scene](), CRUISING)
    changed = command_of(make_pursuit(**others | {name: value}), SCENES[scene](), CRUISING)
    assert changed != default


def test_the_changes_name_every_parameter_that_has_an_effect():
    resolved = set(VectorPursuitParameters().model_dump())
    assert resolved - VectorPursuitParameters.WITHOUT_EFFECT == set(CHANGES)


@pytest.mark.parametrize(
    ("release", "left", "right"),
    [("jazzy", 1.5631, 1.5631), ("kilted", 1.5631, 1.5631), ("humble", 1.3836, 1.4648)],
)
def test_since_jazzy_curves_to_either_side_are_alike(release, left, right):
    # Along the circle to (1, 0.5), of 1.25 m: atan2(-0.75, 1) - atan2(1.25, 1) = -1.5396 rad, in
    # Humble atan2(-0.75, 1) - pi/2 + 2 pi = 4.0689; 8 a / (7 a + 0.9273) times 1.25 m.
    # To (1, -0.5), in Humble: atan2(-0.75, -1) + pi/2 + 2 pi = 5.3559.
    fields = {"nav2_release": release, "min_turning_radius": 0.1}
    assert radius_to(1.0, 0.5, 0.9273, **fields) == pytest.approx(left, abs=1e-4)
    assert radius_to(1.0, -0.5, -0.9273, **fields) == pytest.approx(right, abs=1e-4)


@pytest.mark.parametrize(
    ("release", "error"), [("humble", "CollisionAhead"), ("jazzy", "ControllerError")]
)
def test_since_jazzy_a_collision_ends_the_task(release, error):
    pursuit = make_pursuit(nav2_release=release)
    walled = observe(AHEAD, costmap=make_costmap(cells=WALL))
    assert command_of(pursuit, walled, CRUISING) == error


def test_up_to_kilted_it_cuts_the_plan_itself_and_forgets_what_it_has_passed():
    pursuit = make_pursuit(nav2_release="jazzy", max_robot_pose_search_dist=1.0)
    long = turned_plan(0.0, 4.0)
    first = pursuit.step(observe(long, pose=(0.5, 0.0, 0.0)), pursuit.initial_memory())
    assert first.memory.plan_begin == 10
    assert pursuit.step(observe(long), first.memory).memory.plan_begin == 10
    other = pursuit.step(observe(long, plan_id=2), first.memory)
    assert other.memory.plan_begin == 0
    with pytest.raises(InvalidPath, match="no poses"):
        make_pursuit(nav2_release="humble").step(
            observe(AHEAD + np.array([9.0, 0.0, 0.0])), pursuit.initial_memory()
        )


def test_the_reason_of_an_approach_is_the_straight_distance_from_the_robot_to_the_plans_end():
    # From (-1, -1) to (-0.7, -0.6) are 0.5 m; it slows down within 1 m: 0.5 * 0.5 / 1 = 0.25 m/s.
    yaw = math.atan2(0.4, 0.3)
    plan = [[-1.0, -1.0, yaw], [-0.85, -0.8, yaw], [-0.7, -0.6, yaw]]
    pursuit, seen = make_pursuit(), observe(plan, pose=(-1.0, -1.0, yaw))
    found = pursuit.explain(seen, CRUISING)
    assert found.sentence == "Vector Pursuit drives 0.25 m/s: it is 0.5 m to the plan's end."
    assert found.command[0] == pytest.approx(0.25)


def test_the_reason_of_a_turn_before_a_way_back_is_the_angle_behind_the_robot():
    # The plan leads backwards, 1 rad to the left of the robot's back: it turns right by 1 rad.
    back = math.pi - 1.0
    plan = [[r * math.cos(back), r * math.sin(back), back] for r in (0.0, 0.5, 1.0)]
    pursuit = make_pursuit(allow_reversing=True)
    found = pursuit.explain(observe(plan), CRUISING)
    assert found.sentence == (
        "Vector Pursuit turns in place: the pose ahead is -1 rad aside, more than 0.785 rad."
    )
