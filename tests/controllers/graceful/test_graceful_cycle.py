"""A cycle of the Graceful Controller: targets, turns in place, obstacles, and its memory.

Defaults: targets up to 1 m ahead, 0.1 to 0.5 m/s, 1 rad/s, slower within 1.5 m of the target; a
turn in place at half the angle left, at 0.25 rad/s at least.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from controller_scenes import arc_plan, command_of, make_costmap, make_setup, observe, turned_plan

from drake_navbench.controller import NoValidControl, SpeedLimit
from drake_navbench.controllers.graceful import Graceful, GracefulParameters
from drake_navbench.controllers.graceful.targets import (
    distances_along,
    has_orientations,
    orient,
    point_ahead,
)
from drake_navbench.kernels.grid import INSCRIBED, LETHAL, NO_INFORMATION

AHEAD = turned_plan(0.0)
THIRD = 0.5 / 1.5
WALL = [(1.5, -1.0 + 0.05 * i, LETHAL) for i in range(40)]


def make_graceful(*, circle=False, **parameters):
    model = GracefulParameters.model_validate(parameters)
    return Graceful(model, make_setup(circle=circle))


def test_on_a_straight_plan_it_drives_to_the_point_a_metre_ahead():
    assert command_of(make_graceful(), observe(AHEAD)) == (pytest.approx(THIRD), 0.0)
    nearer = make_graceful(max_lookahead=0.6)
    assert command_of(nearer, observe(AHEAD)) == (pytest.approx(0.5 * 0.6 / 1.5), 0.0)


def test_targets_lie_on_the_plan_between_its_poses():
    plan = np.array([[0.0, 0.0, 0.0], [0.4, 0.0, 0.0], [0.4, 0.8, 1.0]])
    assert point_ahead(plan, 0.8) == pytest.approx((0.4, 0.4, math.pi / 2, 0.8))
    assert point_ahead(plan, 2.0) == (0.4, 0.8, 1.0, pytest.approx(1.2))
    assert distances_along(plan + np.array([1.0, 0.0, 0.0])).tolist() == pytest.approx(
        [1.0, 1.4, 2.2]
    )


def test_a_plan_without_headings_is_given_those_of_its_segments():
    plan = np.array([[0.0, 0.0, 0.3], [1.0, 0.0, 0.3], [1.0, 1.0, 0.3], [2.0, 2.0, 0.3]])
    orient(plan)
    assert plan[:, 2].tolist() == pytest.approx([0.0, math.pi / 2, math.pi / 4, 0.3])


def test_headings_count_only_where_they_turn_to_the_right_as_in_nav2():
    left, right = arc_plan(1.0, 1.0), arc_plan(1.0, 1.0) * [1.0, -1.0, -1.0]
    assert has_orientations(right)
    assert not has_orientations(left)


def test_a_new_plan_to_the_side_is_turned_to_first():
    decision = make_graceful().step(observe(turned_plan(1.0)), make_graceful().initial_memory())
    assert decision.command.tolist() == [0.0, pytest.approx(0.5)]
    assert decision.memory.may_turn_first


def test_an_old_plan_to_the_side_is_driven_to():
    graceful = make_graceful()
    memory = graceful.step(observe(AHEAD), graceful.initial_memory()).memory
    assert not memory.may_turn_first
    v, _ = command_of(graceful, observe(turned_plan(1.0)), memory)
    assert v >= 0.1 - 1e-6
    assert command_of(graceful, observe(turned_plan(1.0), plan_id=2), memory)[0] == 0.0


def test_a_turn_in_place_is_slow_at_its_end_but_not_too_slow():
    plan = turned_plan(0.0, 0.1)
    for angle, w in [(1.6, 0.8), (-1.6, -0.8), (0.3, 0.25), (-0.3, -0.25), (0.0, 0.25)]:
        plan[-1, 2] = angle
        there = observe(plan, goal_xy_reached=True)
        assert command_of(make_graceful(), there) == (0.0, pytest.approx(w))


def test_at_the_goal_a_turn_that_would_collide_is_not_begun():
    plan = turned_plan(0.0, 0.2)
    plan[-1, 2] = 1.6
    # Where the left front corner comes, and it has room to go on straight ahead.
    beside = make_costmap(cells=[(0.3, 0.7, LETHAL)])
    there = observe(plan, goal_xy_reached=True, costmap=beside)
    assert command_of(make_graceful(), there)[0] > 0.0
    assert command_of(make_graceful(use_collision_detection=False), there) == (
        0.0,
        pytest.approx(0.8),
    )


def test_before_a_wall_it_drives_to_a_nearer_target():
    # Of the plan 0.65 m are free of the wall at 1.5 m, the front being 0.85 m ahead. A drive to
    # 0.75 m is looked at for 3 * 0.75/0.05 = 45 steps of 0.1 s: 27 of them by a thirtieth of what
    # is left, the others by 1 cm, and so ends at 0.63 m.
    v, w = command_of(make_graceful(), observe(AHEAD, costmap=make_costmap(cells=WALL)))
    assert (v, w) == (pytest.approx(0.5 * 0.75 / 1.5), 0.0)


def test_where_no_target_is_free_there_is_no_command_and_the_memory_goes_on():
    near = [(x - 0.65, y, cost) for x, y, cost in WALL]
    with pytest.raises(NoValidControl) as raised:
        make_graceful().step(
            observe(AHEAD, costmap=make_costmap(cells=near)), make_graceful().initial_memory()
        )
    assert raised.value.memory.plan_id == 1
    assert not raised.value.memory.may_turn_first
    blind = make_graceful(use_collision_detection=False)
    seen = observe(AHEAD, costmap=make_costmap(cells=near))
    assert command_of(blind, seen) == (pytest.approx(THIRD), 0.0)


@pytest.mark.parametrize(
    ("circle", "cost", "tracks_unknown", "is_free"),
    [
        (False, INSCRIBED, False, True),
        (True, INSCRIBED, False, False),
        (True, LETHAL, False, False),
        (False, NO_INFORMATION, True, True),
        (False, NO_INFORMATION, False, False),
        (True, NO_INFORMATION, True, True),
    ],
)
def test_what_counts_as_a_collision(circle, cost, tracks_unknown, is_free):
    costmap = make_costmap(cost, tracks_unknown=tracks_unknown)
    command = command_of(make_graceful(circle=circle), observe(AHEAD, costmap=costmap))
    assert (command != "NoValidControl") is is_free


def test_a_fast_robot_needs_more_room():
    # At its 0.5 m/s, 0.3 above the 0.2, the outline is half as wide again: 0.45 m to each side.
    beside = [(0.05 * i, 0.4, LETHAL) for i in range(60)]
    seen = observe(AHEAD, costmap=make_costmap(cells=beside))
    fast = {"slowdown_radius": 0.0, "footprint_scaling_linear_vel": 0.2}
    assert command_of(make_graceful(slowdown_radius=0.0), seen)[0] == pytest.approx(0.5)
    wide = make_graceful(**fast, footprint_scaling_factor=0.5, footprint_scaling_step=0.1)
    # 0.4 m/s: two thirds of a half wider, 0.4 m; 0.3 m/s: a third of it, 0.35 m, and free.
    assert command_of(wide, seen)[0] == pytest.approx(0.3)


def test_driving_backwards_needs_initial_rotation_off():
    behind = AHEAD * [-1.0, 1.0, 1.0]
    assert command_of(make_graceful(allow_backward=True), observe(behind))[0] == 0.0
    v, w = command_of(make_graceful(allow_backward=True, initial_rotation=False), observe(behind))
    assert (v, w) == (pytest.approx(-THIRD, abs=1e-6), pytest.approx(0.0, abs=1e-6))


def test_before_the_goal_its_heading_is_left_for_the_end():
    plan = turned_plan(0.0, 0.5)
    plan[:, 2] = 0.0
    plan[-1, 2] = 1.0
    assert command_of(make_graceful(), observe(plan)) == (pytest.approx(0.5 / 3.0), 0.0)
    _, w = command_of(make_graceful(prefer_final_rotation=False), observe(plan))
    assert w < -0.1


def test_before_a_goal_near_an_obstacle_it_looks_for_a_heading_and_keeps_it():
    costly = [(0.3 + 0.05 * i, 0.02, 200) for i in range(20)]
    seen = observe(turned_plan(0.0, 0.6), costmap=make_costmap(cells=costly))
    near = make_graceful(obstacle_cost_margin=60)
    decision = near.step(seen, near.initial_memory())
    assert decision.memory.safe_angle is not None
    assert near.step(seen, decision.memory).memory.safe_angle == decision.memory.safe_angle
    far = make_graceful(obstacle_cost_margin=50)
    assert far.step(seen, far.initial_memory()).memory.safe_angle is None
    assert near.step(observe(AHEAD, plan_id=2), decision.memory).memory.safe_angle is None


@pytest.mark.parametrize(
    ("limit", "v", "w"),
    [
        (SpeedLimit(50.0, is_percentage=True), THIRD / 2, 0.5),
        (SpeedLimit(0.3), 0.2, 0.6),
        (SpeedLimit(0.05), 0.1, 0.1),
        (SpeedLimit(0.0), THIRD, 1.0),
    ],
)
def test_a_speed_limit_slows_turning_in_proportion(limit, v, w):
    assert command_of(make_graceful(), observe(AHEAD, speed_limit=limit))[0] == pytest.approx(v)
    turn = observe(turned_plan(2.0), speed_limit=limit)
    rate = command_of(make_graceful(v_angular_min_in_place=0.0), turn)[1]
    assert rate == pytest.approx(0.5 * 2.0 * w)


def test_a_target_where_the_robot_stands_gives_no_command():
    here = observe([[0.0, 0.0, 0.0]])
    assert command_of(make_graceful(), here) == "NoValidControl"


def test_a_margin_above_the_largest_cost_of_a_circle_is_refused():
    with pytest.raises(ValueError, match="obstacle_cost_margin: got 253, expected at most 252"):
        make_graceful(circle=True, obstacle_cost_margin=253)
    assert make_graceful(obstacle_cost_margin=253)


BESIDE_GOAL = [(0.3 + 0.05 * i, 0.02, 200) for i in range(20)]
PLAN_TO_TURNED_GOAL = np.vstack([turned_plan(0.0, 0.5), [[0.55, 0.0, 1.0]]])
SCENES = {
    "ahead": lambda: observe(AHEAD),
    "curve": lambda: observe(arc_plan(0.8, 1.2)),
    "side": lambda: observe(turned_plan(1.0)),
    "goal": lambda: observe(PLAN_TO_TURNED_GOAL),
    "turn": lambda: observe(PLAN_TO_TURNED_GOAL, goal_xy_reached=True),
    "slow turn": lambda: observe(turned_plan(0.1, 0.2), goal_xy_reached=True),
    "behind": lambda: observe(AHEAD * [-1.0, 1.0, 1.0]),
    "blocked": lambda: observe(AHEAD, costmap=make_costmap(cells=WALL)),
    "beside": lambda: observe(
        AHEAD, costmap=make_costmap(cells=[(0.05 * i, 0.4, LETHAL) for i in range(60)])
    ),
    "costly": lambda: observe(turned_plan(0.0, 0.6), costmap=make_costmap(cells=BESIDE_GOAL)),
    "back again": lambda: observe(np.concatenate([AHEAD, AHEAD[::-1]]), pose=(0.8, 0.0, 0.0)),
    # One cell which the left front corner crosses between two of the steps of 0.1 rad.
    "corner": lambda: observe(
        PLAN_TO_TURNED_GOAL,
        goal_xy_reached=True,
        costmap=make_costmap(cells=[(0.575, 0.725, LETHAL)]),
    ),
}
JAZZY, HUMBLE = {"nav2_release": "jazzy"}, {"nav2_release": "humble"}
FAST = {"slowdown_radius": 0.0, "footprint_scaling_linear_vel": 0.2}
# Parameter: another value, the scene in which it shows, and what else it takes.
CHANGES = {
    "max_lookahead": (0.5, "ahead", {}),
    "k_phi": (1.0, "curve", {}),
    "k_delta": (2.0, "curve", {}),
    "beta": (0.8, "curve", {"slowdown_radius": 0.5}),
    "lambda": (1.0, "curve", {"slowdown_radius": 0.5}),
    "v_linear_min": (0.4, "ahead", {}),
    "v_linear_max": (0.4, "ahead", {}),
    "v_angular_max": (0.5, "side", {}),
    "v_angular_min_in_place": (0.1, "slow turn", {}),
    "slowdown_radius": (1.0, "ahead", {}),
    "deceleration_max": (0.01, "ahead", {}),
    "initial_rotation": (False, "side", {}),
    "initial_rotation_tolerance": (1.1, "side", {}),
    "prefer_final_rotation": (False, "goal", {}),
    "rotation_scaling_factor": (0.8, "side", {}),
    "allow_backward": (True, "behind", {"initial_rotation": False}),
    "in_place_collision_resolution": (0.02, "corner", {}),
    "use_collision_detection": (False, "blocked", {}),
    "footprint_scaling_linear_vel": (0.3, "beside", {**FAST, "footprint_scaling_factor": 0.5}),
    "footprint_scaling_factor": (0.5, "beside", FAST),
    "footprint_scaling_step": (0.05, "beside", {**FAST, "footprint_scaling_factor": 0.5}),
    "obstacle_cost_margin": (60, "costly", {}),
    "final_rotation_search_step": (0.45, "costly", {"obstacle_cost_margin": 60}),
    "nav2_release": ("humble", "ahead", {}),
    "min_lookahead": (0.9, "blocked", JAZZY),
    "max_robot_pose_search_dist": (0.3, "back again", JAZZY),
    "motion_target_dist": (0.3, "ahead", HUMBLE),
    "initial_rotation_min_angle": (1.1, "side", HUMBLE),
    "final_rotation": (False, "goal", HUMBLE),
}


@pytest.mark.parametrize("name", CHANGES)
def test_every_parameter_changes_a_command(name):
    value, scene, others = CHANGES[name]
    others = {n: v for n, v in others.items() if n != name}
    default = command_of(make_graceful(**others), SCENES[scene]())
    changed = command_of(make_graceful(**others | {name: value}), SCENES[scene]())
    assert changed != default


def test_the_changes_name_every_parameter_that_has_an_effect():
    assert set(GracefulParameters().model_dump()) == set(CHANGES)
