"""Rules about the turns of Regulated Pure Pursuit and its kin, and about its collision check."""

from __future__ import annotations

from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.pursuit import CODE, PURSUIT, RPP
from drake_navbench.studies.doctor.rules.rule import Rule, add, down, put, up, upgrade
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom


def _look_m(f: Facts) -> float:
    """Returns the way ahead that RPP looks along for a collision at full speed, m."""
    return f.speed_mps * f.number("controller.max_allowed_time_to_collision_up_to_carrot", 1.0)


def _least_lookahead_m(f: Facts) -> float:
    """Returns the distance of RPP's carrot while the robot stands, m."""
    if f.controller("use_velocity_scaled_lookahead_dist") is True:
        return f.number("controller.min_lookahead_dist", 0.3)
    return f.number("controller.lookahead_dist", 0.6)


def _arrival_m(f: Facts) -> float:
    """Returns the distance from the goal at which the goal checker takes it as reached, m."""
    return f.number("goal_checker.xy_goal_tolerance", 0.25)


def _turn_to_stop_rad(f: Facts) -> float:
    rate = f.number("controller.rotate_to_heading_angular_vel", 1.8)
    return rate * f.period_s + rate**2 / (
        2.0 * max(f.number("controller.max_angular_accel", 3.2), 0.1)
    )


RULES = (
    Rule(
        "rpp-turns-and-reverses",
        lambda f: (
            f.controller("use_rotate_to_heading") is True
            and f.controller("allow_reversing") is True
        ),
        lambda f: (
            "use_rotate_to_heading and allow_reversing are both on; RPP allows only one of them"
        ),
        {S.REVERSE_FAILURE: 1.0, S.SPINS: 0.5, S.NO_START: 0.5},
        (put("use_rotate_to_heading", False), put("allow_reversing", False)),
        f"{CODE}: parameter_handler.cpp",
        RPP,
    ),
    Rule(
        "rpp-checks-nothing",
        lambda f: f.controller("use_collision_detection") is False,
        lambda f: "use_collision_detection is off: the controller checks no command for collisions",
        {S.COLLISION: 1.0, S.IGNORES_OBSTACLES: 0.9, S.NEAR_MISS: 0.4},
        (put("use_collision_detection", True),),
        CODE,
        (*PURSUIT, "graceful"),
    ),
    Rule(
        "rpp-checks-a-short-time",
        lambda f: f.number("controller.max_allowed_time_to_collision_up_to_carrot", 1.0) < 0.6,
        lambda f: (
            "max_allowed_time_to_collision_up_to_carrot is "
            f"{f.controller('max_allowed_time_to_collision_up_to_carrot')} s: at {f.speed_mps:g} "
            f"m/s RPP sees a collision only {_look_m(f):.2f} m ahead"
        ),
        {S.COLLISION: 0.9},
        (up("max_allowed_time_to_collision_up_to_carrot", 1.0),),
        CODE,
        RPP,
    ),
    Rule(
        "rpp-checks-a-long-time",
        lambda f: f.number("controller.max_allowed_time_to_collision_up_to_carrot", 1.0) > 1.8,
        lambda f: (
            "max_allowed_time_to_collision_up_to_carrot is "
            f"{f.controller('max_allowed_time_to_collision_up_to_carrot')} s: the robot "
            "stops for obstacles at the far end of an arc, although it would leave the arc "
            "before"
        ),
        {S.DOOR_STOP: 0.9, S.STOP_START_JERK: 0.6, S.NO_RECOVERY: 0.5, S.NO_START: 0.4},
        (down("max_allowed_time_to_collision_up_to_carrot", 1.0),),
        CODE,
        RPP,
    ),
    Rule(
        "rpp-check-shrinks-with-speed",
        lambda f: (
            f.number("controller.min_distance_to_obstacle", -1.0) > 0.0
            and f.controller("use_velocity_scaled_lookahead_dist") is True
        ),
        lambda f: (
            f"min_distance_to_obstacle is {f.controller('min_distance_to_obstacle')} m, but "
            "the collision check ends at the carrot, which comes nearer as the robot slows "
            "down"
        ),
        {S.COLLISION: 1.0, S.NEAR_MISS: 1.0, S.STALL_BEFORE_GOAL: 0.3},
        (
            put("use_velocity_scaled_lookahead_dist", False),
            up("max_lookahead_dist"),
            upgrade("a release with navigation2#5677"),
        ),
        "navigation2#5989",
        RPP,
    ),
    Rule(
        "rpp-carrot-within-tolerance",
        lambda f: (
            _least_lookahead_m(f) <= _arrival_m(f)
            and f.controller("use_rotate_to_heading") is True
            and f.release < Release.LYRICAL
        ),
        lambda f: (
            f"the carrot is {_least_lookahead_m(f):g} m ahead of a robot that stands, not beyond "
            f"xy_goal_tolerance ({_arrival_m(f):g} m): RPP takes it for the goal (of equal ones "
            "rounding decides) and turns the robot to the goal's heading wherever it is"
        ),
        {
            S.NO_START: 1.0,
            S.GOAL_NOT_REACHED: 0.9,
            S.SPINS: 0.8,
            S.TOO_SLOW: 0.6,
            S.FALSE_ABORT: 0.6,
        },
        (
            up("min_lookahead_dist", lambda f: 1.2 * _arrival_m(f)),
            up("lookahead_dist", lambda f: 1.2 * _arrival_m(f)),
            down("goal_checker.xy_goal_tolerance", lambda f: 0.8 * _least_lookahead_m(f)),
        ),
        f"{CODE}: shouldRotateToGoalHeading",
        RPP,
    ),
    Rule(
        "rpp-turns-past-the-heading",
        lambda f: (
            _turn_to_stop_rad(f) > f.number("goal_checker.yaw_goal_tolerance", 0.25)
            and f.release <= Release.JAZZY
        ),
        lambda f: (
            f"from {f.controller('rotate_to_heading_angular_vel')} rad/s the robot turns "
            f"{_turn_to_stop_rad(f):.2f} rad farther before it stops, but yaw_goal_tolerance is "
            f"only {f['goal_checker.yaw_goal_tolerance']} rad"
        ),
        {S.GOAL_OVERSHOOT: 0.8, S.GOAL_OSCILLATION: 0.6, S.SPINS: 0.4},
        (down("rotate_to_heading_angular_vel"), up("goal_checker.yaw_goal_tolerance")),
        CODE,
        PURSUIT,
        is_certain=False,
    ),
    Rule(
        "rpp-turns-for-little",
        lambda f: (
            f.controller("use_rotate_to_heading") is True
            and f.number("controller.rotate_to_heading_min_angle", 0.785) < 0.35
        ),
        lambda f: (
            f"rotate_to_heading_min_angle is {f.controller('rotate_to_heading_min_angle')} "
            "rad: the robot stops to turn for small errors of the heading"
        ),
        {S.STOP_START_JERK: 1.0, S.WOBBLE_STRAIGHT: 0.6, S.SPINS: 0.5, S.TOO_SLOW: 0.4},
        (up("rotate_to_heading_min_angle", 0.785),),
        CODE,
        PURSUIT,
    ),
    Rule(
        "rpp-turns-late",
        lambda f: (
            not f.is_kind("shim")
            and (
                f.controller("use_rotate_to_heading") is False
                or f.number("controller.rotate_to_heading_min_angle", 0.785) > 1.3
            )
        ),
        lambda f: (
            f"use_rotate_to_heading is {f.controller('use_rotate_to_heading')} and "
            f"rotate_to_heading_min_angle {f.controller('rotate_to_heading_min_angle')} "
            "rad: the robot drives arcs where it could turn on the spot"
        ),
        {S.NO_TURNING: 1.0, S.CORNER_CUTTING: 0.6, S.GOAL_NOT_REACHED: 0.6, S.COLLISION: 0.3},
        (put("use_rotate_to_heading", True), down("rotate_to_heading_min_angle", 0.785)),
        CODE,
        PURSUIT,
        is_certain=False,
    ),
    Rule(
        "rpp-steps-to-the-base",
        lambda f: (
            f.is_whole
            and not f.has_node("velocity_smoother")
            and f.controller("use_dynamic_window") is not True
        ),
        lambda f: (
            "RPP changes its speed in steps, and the file has no velocity smoother that "
            "smooths them"
        ),
        {S.STOP_START_JERK: 0.7, S.GOAL_OVERSHOOT: 0.3},
        (add("velocity_smoother"), put("use_dynamic_window", True)),
        CODE,
        RPP,
        is_certain=False,
    ),
)
