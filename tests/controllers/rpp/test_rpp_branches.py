"""Regulated Pure Pursuit, one cycle at a time, with the arithmetic beside the numbers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from drake_navbench.controller import (
    CollisionAhead,
    ControllerError,
    InvalidPath,
    NoValidControl,
    SpeedLimit,
)
from drake_navbench.controllers.rpp import RegulatedPurePursuit, RegulatedPurePursuitParameters
from drake_navbench.controllers.rpp.controller import RppMemory

DIGITS = 1e-6


def straight(length_m=3.0, spacing_m=0.1, y=0.0, yaw=0.0):
    return [[spacing_m * i, y, yaw] for i in range(round(length_m / spacing_m) + 1)]


def turned(plan, angle):
    """The plan turned about the robot, at the origin."""
    cos, sin = math.cos(angle), math.sin(angle)
    return [[cos * x - sin * y, sin * x + cos * y, yaw + angle] for x, y, yaw in plan]


def command(controller, observation, memory=None):
    return controller.step(observation, memory or controller.initial_memory()).command


# Tracking


def test_steers_along_the_circle_through_the_carrot(make_controller, observe):
    # Carrot (0.6, 0.3): curvature 2 * 0.3 / 0.45 = 4/3, radius 0.75 < 0.9.
    # v = 0.5 * 0.75 / 0.9 = 0.416667, w = 4/3 v.
    decision = make_controller().step(observe(), RppMemory())
    assert decision.command == pytest.approx([0.416667, 0.555556], abs=DIGITS)
    assert decision.diagnostics["branch"] == "track"
    assert decision.diagnostics["curvature_radpm"] == pytest.approx(4.0 / 3.0)


def test_slows_down_near_obstacles(make_controller, observe, make_costmap):
    # d = 0.2254985 + ln(253 / 128) / 3 = 0.452618 m < 0.6; v = 0.5 * d / 0.6 = 0.377182.
    observation = observe(costmap=make_costmap(128))
    assert command(make_controller(), observation) == pytest.approx(
        [0.377182, 0.502909], abs=DIGITS
    )


@pytest.mark.parametrize(
    "parameters",
    [
        {"use_cost_regulated_linear_velocity_scaling": False},
        {"inflation_cost_scaling_factor": 0.0},
        {"cost_scaling_dist": 0.45},  # d = 0.4526 is farther
    ],
)
def test_obstacles_do_not_slow_down_where_switched_off(
    make_controller, observe, make_costmap, parameters
):
    observation = observe(costmap=make_costmap(128))
    v, _ = command(make_controller(**parameters), observation)
    assert v == pytest.approx(0.5 * 0.75 / 0.9)


def test_unknown_cells_do_not_slow_down(make_controller, observe, make_costmap):
    observation = observe(costmap=make_costmap(255, tracks_unknown=True))
    v, _ = command(make_controller(), observation)
    assert v == pytest.approx(0.5 * 0.75 / 0.9)


def test_curves_and_obstacles_slow_down_to_a_floor(make_controller, observe):
    # Carrot (0.6, 0.3) and R_min 3 m: 0.5 * 0.75 / 3 = 0.125 is raised to 0.25.
    v, w = command(make_controller(regulated_linear_scaling_min_radius=3.0), observe())
    assert (v, w) == pytest.approx((0.25, 0.25 * 4.0 / 3.0))


def test_without_regulation_the_speed_is_the_cruise_speed(make_controller, observe):
    controller = make_controller(use_regulated_linear_velocity_scaling=False)
    assert command(controller, observe()) == pytest.approx([0.5, 0.5 * 4.0 / 3.0])


def test_approach_slows_down_in_proportion_to_the_distance(make_controller, observe):
    # 0.3 m of plan are left, fewer than 0.6: v = 0.5 * 0.3 / 0.6.
    assert command(make_controller(), observe(straight(0.3))) == pytest.approx([0.25, 0.0])
    # Fewer than 0.05 m/s are not commanded.
    crawl = command(make_controller(), observe(straight(0.05, spacing_m=0.05)))
    assert crawl == pytest.approx([0.05, 0.0])


def test_approach_measures_along_the_plan_to_begin_and_straight_to_slow_down(
    make_controller, observe
):
    # Two segments of 0.25 m, at a right angle: 0.5 m are left, the end is 0.3536 m away.
    bend = [[0.0, 0.0, 0.0], [0.25, 0.0, 0.0], [0.25, 0.25, 0.0]]
    controller = make_controller(
        use_rotate_to_heading=False, use_regulated_linear_velocity_scaling=False
    )
    v, _ = command(controller, observe(bend))
    assert v == pytest.approx(0.5 * math.hypot(0.25, 0.25) / 0.6)


def test_lateral_error_does_not_shorten_the_lookahead(make_controller, observe):
    # 0.6 m along the plan, wherever the robot is: carrot (0.6, 1.0) seen from the robot, with
    # curvature 2 / 1.36; the heading error of 1.03 rad would turn the robot in place otherwise.
    controller = make_controller(use_rotate_to_heading=False)
    decision = controller.step(observe(straight(y=1.0)), RppMemory())
    assert decision.diagnostics["curvature_radpm"] == pytest.approx(2.0 / 1.36)


@pytest.mark.parametrize(("measured_v", "expected"), [(0.1, 0.3), (-0.4, 0.6), (0.9, 0.9)])
def test_lookahead_scales_with_the_measured_speed(make_controller, observe, measured_v, expected):
    # 1.5 s of the speed, between 0.3 and 0.9 m.
    controller = make_controller(use_velocity_scaled_lookahead_dist=True)
    decision = controller.step(observe(straight(), twist=(measured_v, 0.0)), RppMemory())
    assert decision.diagnostics["lookahead_distance_m"] == pytest.approx(expected)


def test_a_point_of_its_own_gives_the_curvature(make_controller, observe):
    # At 1.2 m along: (1.2, 0.3), curvature 0.6 / 1.53; the radius of 2.55 m is not tight.
    controller = make_controller(use_fixed_curvature_lookahead=True, curvature_lookahead_dist=1.2)
    assert command(controller, observe()) == pytest.approx([0.5, 0.5 * 0.6 / 1.53])


def test_that_point_runs_on_beyond_the_plan_where_asked(make_controller, observe):
    # The plan of 0.8 m ends at (0.8, 0.3); 1.2 m along its continuation is (1.2, 0.3).
    plan = straight(0.8, y=0.3)
    fixed = {"use_fixed_curvature_lookahead": True, "curvature_lookahead_dist": 1.2}
    stays = make_controller(**fixed).step(observe(plan), RppMemory())
    runs_on = make_controller(**fixed, interpolate_curvature_after_goal=True).step(
        observe(plan), RppMemory()
    )
    alone = make_controller(interpolate_curvature_after_goal=True).step(observe(plan), RppMemory())
    assert stays.diagnostics["curvature_radpm"] == pytest.approx(0.6 / 0.73)
    assert runs_on.diagnostics["curvature_radpm"] == pytest.approx(0.6 / 1.53)
    assert alone.diagnostics["curvature_radpm"] == pytest.approx(0.6 / 0.45)


@pytest.mark.parametrize(
    ("speed_limit", "expected"),
    [
        (SpeedLimit(40.0, is_percentage=True), 0.2),
        (SpeedLimit(0.3), 0.3),
        (SpeedLimit(0.8), 0.8),
        (SpeedLimit(0.0), 0.5),
        (None, 0.5),
    ],
)
def test_a_speed_limit_replaces_the_cruise_speed(make_controller, observe, speed_limit, expected):
    controller = make_controller(regulated_linear_scaling_min_speed=0.0)
    v, _ = command(controller, observe(straight(), speed_limit=speed_limit))
    assert v == pytest.approx(expected)


def test_the_floor_does_not_lift_the_speed_above_a_limit(make_controller, observe):
    v, _ = command(make_controller(), observe(straight(), speed_limit=SpeedLimit(0.1)))
    assert v == pytest.approx(0.1)


# Turning in place


@pytest.mark.parametrize(
    ("angle", "measured_w", "expected"),
    [
        (0.9, 0.0, 0.16),  # 3.2 * 0.05 from rest
        (-0.9, 0.0, -0.16),
        (0.9, 1.75, 1.8),  # the turn rate asked for
        (0.9, -0.5, -0.34),  # brakes first
    ],
)
def test_turns_towards_a_plan_far_off_the_heading(
    make_controller, observe, angle, measured_w, expected
):
    observation = observe(turned(straight(), angle), twist=(0.0, measured_w))
    decision = make_controller().step(observation, RppMemory())
    assert decision.command == pytest.approx([0.0, expected])
    assert decision.diagnostics["branch"] == "rotate_to_path"


def test_drives_a_plan_only_a_little_off_the_heading(make_controller, observe):
    decision = make_controller().step(observe(turned(straight(), 0.78)), RppMemory())
    assert decision.diagnostics["branch"] == "track"


def test_turns_to_the_heading_of_the_goal_at_its_position(make_controller, observe):
    plan = [[0.0, 0.0, 0.0], [0.1, 0.0, 1.0]]
    observation = observe(plan, goal_xy_reached=True)
    decision = make_controller().step(observation, RppMemory())
    assert decision.command == pytest.approx([0.0, 0.16])
    assert decision.diagnostics["branch"] == "rotate_to_goal"


def test_turning_slows_down_as_it_must_stop(make_controller, observe):
    # sqrt(2 * 3.2 * 0.003) = 0.138564, even where that brakes harder than the limit.
    plan = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.003]]
    observation = observe(plan, goal_xy_reached=True, twist=(0.0, 0.5))
    assert command(make_controller(), observation) == pytest.approx([0.0, 0.138564], abs=DIGITS)


def test_does_not_turn_in_place_where_switched_off(make_controller, observe):
    controller = make_controller(use_rotate_to_heading=False)
    plan = turned(straight(), 0.9)
    for at_goal in (False, True):
        decision = controller.step(observe(plan, goal_xy_reached=at_goal), RppMemory())
        assert decision.diagnostics["branch"] == "track"


# Reversing


def test_drives_backwards_where_the_carrot_is_behind(make_controller, observe):
    # Carrot (-0.6, 0.3): curvature 4/3 as ahead; the speed changes its sign, and w with it.
    plan = [[-x, y, yaw] for x, y, yaw in straight(y=0.3)]
    decision = make_controller(allow_reversing=True).step(observe(plan), RppMemory())
    assert decision.command == pytest.approx([-0.416667, -0.555556], abs=DIGITS)


def test_turns_round_instead_where_it_may_not_reverse(make_controller, observe):
    plan = [[-x, y, yaw] for x, y, yaw in straight(y=0.3)]
    assert command(make_controller(), observe(plan)) == pytest.approx([0.0, 0.16])


def test_turns_its_back_to_a_plan_behind(make_controller, observe):
    # The plan leaves to the back left, 0.9 rad off straight back: the robot turns to the right.
    plan = turned([[-x, y, yaw] for x, y, yaw in straight()], -0.9)
    observation = observe(plan)
    assert command(make_controller(allow_reversing=True), observation) == pytest.approx(
        [0.0, -0.16]
    )


# Cancelling


def test_brakes_gently_when_cancelled_until_it_stands(make_controller, observe):
    controller = make_controller(use_cancel_deceleration=True, cancel_deceleration=2.0)
    memory = controller.initial_memory()
    speeds, stopped = [0.35], []
    for _ in range(5):
        observation = observe(straight(), twist=(speeds[-1], 0.0), cancel_requested=True)
        decision = controller.step(observation, memory)
        memory = decision.memory
        speeds.append(decision.command[0])
        stopped.append(memory.has_stopped)
    # 2.0 m/s^2 * 0.05 s = 0.1 m/s a cycle.
    assert speeds == pytest.approx([0.35, 0.25, 0.15, 0.05, 0.0, 0.0])
    assert stopped == [False, False, False, True, True]


def test_brakes_gently_backwards_too(make_controller, observe):
    controller = make_controller(
        use_cancel_deceleration=True, cancel_deceleration=2.0, allow_reversing=True
    )
    plan = [[-x, y, yaw] for x, y, yaw in straight()]
    observation = observe(plan, twist=(-0.35, 0.0), cancel_requested=True)
    assert command(controller, observation) == pytest.approx([-0.25, 0.0])


def test_cancelling_changes_nothing_where_switched_off(make_controller, observe):
    observation = observe(straight(), twist=(0.35, 0.0), cancel_requested=True)
    assert command(make_controller(), observation) == pytest.approx([0.5, 0.0])


# Failures


def test_a_plan_of_one_pose_is_driven_to(make_controller, observe):
    # Carrot (0.5, 0), no length: v = 0.5 * 0.5 / 0.6.
    v, w = command(make_controller(), observe([[0.5, 0.0, 0.0]]))
    assert (v, w) == pytest.approx((0.5 * 0.5 / 0.6, 0.0))


def test_a_plan_of_one_pose_cannot_run_on(make_controller, observe):
    controller = make_controller(
        use_fixed_curvature_lookahead=True, interpolate_curvature_after_goal=True
    )
    with pytest.raises(InvalidPath, match="interpolate_curvature_after_goal"):
        command(controller, observe([[0.5, 0.0, 0.0]]))


def test_a_plan_of_equal_poses_gives_a_finite_command(make_controller, observe):
    assert np.isfinite(command(make_controller(), observe(4 * [[0.0, 0.0, 0.0]]))).all()


def test_a_robot_off_the_costmap_cannot_track(make_controller, observe):
    far = (5.0, 0.0, 0.0)
    plan = np.array(straight()) + np.array([5.0, 0.0, 0.0])
    with pytest.raises(ControllerError, match=r"centre \(5.000, 0.000\) m lies outside") as failure:
        command(make_controller(), observe(plan, pose=far))
    assert failure.value.code == 100
    assert not isinstance(failure.value, NoValidControl)


def test_a_robot_off_the_costmap_can_turn_in_place(make_controller, observe):
    plan = np.array(turned(straight(), 0.9)) + np.array([5.0, 0.0, 0.0])
    observation = observe(plan, pose=(5.0, 0.0, 0.0))
    assert command(make_controller(), observation) == pytest.approx([0.0, 0.16])


def test_what_cancelling_did_is_kept_when_the_command_collides(
    make_controller, observe, make_costmap
):
    controller = make_controller(use_cancel_deceleration=True)
    observation = observe(
        straight(), costmap=make_costmap(lethal=[(0.22, 0.01)]), cancel_requested=True
    )
    with pytest.raises(CollisionAhead) as failure:
        controller.step(observation, RppMemory(last_v=0.3, last_w=0.1))
    assert failure.value.memory == RppMemory(0.3, 0.1, is_cancelling=True, has_stopped=True)


# Parameters and diagnostics


def test_the_older_name_of_the_cruise_speed_is_understood():
    older = RegulatedPurePursuitParameters.model_validate({"desired_linear_vel": 0.3})
    assert older.max_linear_vel == 0.3
    assert RegulatedPurePursuitParameters(max_linear_vel=0.3) == older


SCALED = {"use_velocity_scaled_lookahead_dist": True}
WINDOW = {"use_dynamic_window": True}


@pytest.mark.parametrize(
    ("parameters", "names"),
    [
        (SCALED | {"min_lookahead_dist": 1.0}, "min_lookahead_dist: .* max_lookahead_dist"),
        (WINDOW | {"min_linear_vel": 0.6}, "min_linear_vel: .* max_linear_vel"),
        (WINDOW | {"min_angular_vel": 3.0}, "min_angular_vel: .* max_angular_vel"),
        (
            WINDOW | {"max_linear_decel": 0.9},
            "max_linear_decel: got 0.9, expected a negative",
        ),
        (
            WINDOW | {"max_angular_decel": 0.0},
            "max_angular_decel: got 0.0, expected a negative",
        ),
        ({"cancel_deceleration": 0.0}, "cancel_deceleration"),
        ({"lookahead_distance": 1.0}, "lookahead_distance"),
    ],
)
def test_wrong_parameters_are_named(parameters, names):
    with pytest.raises(ValueError, match=names):
        RegulatedPurePursuitParameters(**parameters)


def test_what_only_unused_features_would_read_may_be_anything_as_in_nav2():
    unused = {"min_lookahead_dist": 1.0, "max_linear_decel": 0.9, "min_linear_vel": 0.6}
    parameters = RegulatedPurePursuitParameters(**unused)
    assert {name: getattr(parameters, name) for name in unused} == unused


def test_arrays_to_draw_come_only_where_wanted(make_controller, observe, setup):
    pose = (0.5, -0.2, math.pi / 2.0)
    plan = np.array(turned(straight(), math.pi / 2.0)) + np.array([0.5, -0.2, 0.0])
    observation = observe(plan, pose=pose)
    assert "carrot" not in make_controller().step(observation, RppMemory()).diagnostics
    drawing = RegulatedPurePursuit(
        RegulatedPurePursuitParameters(), replace(setup, wants_diagnostics=True)
    )
    diagnostics = drawing.step(observation, RppMemory()).diagnostics
    # 0.6 m ahead of a robot that faces +y.
    assert diagnostics["carrot"] == pytest.approx([0.5, 0.4])
    # A pose each cell of 0.05 m at 0.5 m/s, so each 0.1 s of 1 s: the present one and nine more.
    trajectory = diagnostics["predicted_trajectory"]
    assert trajectory.shape == (10, 3)
    assert trajectory[-1] == pytest.approx([0.5, 0.25, math.pi / 2.0])
