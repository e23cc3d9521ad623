"""Rules about the servers around the controller: checkers, smoother, monitor, behaviours, tree."""

from __future__ import annotations

from typing import Any

from drake_navbench.releases import Release
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.rule import Rule, down, outside, put, up, upgrade
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

SMOOTHER = "nav2_velocity_smoother"
MONITOR = "nav2_collision_monitor"
SERVER = "nav2_controller"
# Farther than this between two commands, and a path of a house is lost, m.
FAR_BETWEEN_COMMANDS_M = 0.1
# A pose estimate that stands still wanders by about so much, m.
POSE_NOISE_M = 0.06
# Slower commands than these move hardly any robot.
SLOW_MPS, SLOW_RADPS = 0.02, 0.05
# A cycle may take this many periods before somebody must wait for it.
LATE_PERIODS = 4.0


def _step_m(f: Facts) -> float:
    return f.speed_mps * f.period_s


def _polygons(f: Facts) -> list[str]:
    start = "collision_monitor.polygons."
    places = (p for p in f.values if p.startswith(start) and p.endswith(".action_type"))
    return [p.removeprefix(start).partition(".")[0] for p in places]


def _of(f: Facts, polygon: str, name: str) -> Any:
    return f[f"collision_monitor.polygons.{polygon}.{name}"]


def _polygons_that(f: Facts, action: str) -> list[str]:
    return [
        p
        for p in _polygons(f)
        if _of(f, p, "action_type") == action and _of(f, p, "enabled") is not False
    ]


def _least(f: Facts, name: str, default: float) -> float:
    found = [_of(f, polygon, name) for polygon in _polygons(f)]
    numbers = [float(v) for v in found if isinstance(v, int | float)]
    return min(numbers, default=default)


def _accel(f: Facts, name: str, axis: int) -> float | None:
    return f.axis(f"velocity_smoother.{name}", axis)


def _has_deadband(f: Facts) -> bool:
    """Tells whether commands are cut off that a drive needs to start or to arrive."""
    x, y, turn = (_accel(f, "deadband_velocity", axis) or 0.0 for axis in range(3))
    return max(x, y) > SLOW_MPS or turn > SLOW_RADPS


def _progress_mps(f: Facts) -> float:
    return f.number("progress_checker.required_movement_radius", 0.5) / max(
        f.number("progress_checker.movement_time_allowance", 10.0), 0.1
    )


RULES = (
    Rule(
        "slow-loop",
        lambda f: (
            f.number("controller_server.controller_frequency", 20.0) < 8.0
            or (
                f.number("controller_server.controller_frequency", 20.0) < 20.0
                and _step_m(f) > FAR_BETWEEN_COMMANDS_M
            )
        ),
        lambda f: (
            f"controller_frequency {f['controller_server.controller_frequency']} Hz: "
            f"{_step_m(f):.2f} m between two commands at {f.speed_mps:g} m/s"
        ),
        {
            S.WOBBLE_STRAIGHT: 1.0,
            S.GOAL_OVERSHOOT: 1.0,
            S.CORNER_CUTTING: 0.6,
            S.GOAL_OSCILLATION: 0.7,
            S.COLLISION: 0.4,
            S.STOP_START_JERK: 0.5,
        },
        (up("controller_server.controller_frequency", 20.0),),
        f"{SERVER}; docs.nav2.org, controller server",
    ),
    Rule(
        "fast-loop",
        lambda f: f.number("controller_server.controller_frequency", 20.0) > 35.0,
        lambda f: (
            f"controller_frequency {f['controller_server.controller_frequency']} Hz is more "
            "than most computers keep"
        ),
        {S.LATE_CYCLES: 0.8, S.STOP_START_JERK: 0.4},
        (down("controller_server.controller_frequency", 20.0),),
        f"{SERVER}; docs.nav2.org, controller server",
        is_certain=False,
    ),
    Rule(
        "smoother-timeout-below-late-cycles",
        lambda f: (
            f["velocity_smoother.velocity_timeout"] is not None
            and f.number("velocity_smoother.velocity_timeout")
            < max(LATE_PERIODS * f.period_s + 0.02, 0.25)
        ),
        lambda f: (
            f"velocity_timeout {f['velocity_smoother.velocity_timeout']} s: the smoother "
            f"stops the robot where a cycle of {f.period_s:.3f} s is a few periods late"
        ),
        {S.STOP_START_JERK: 1.0, S.TOO_SLOW: 0.3},
        (
            up("velocity_smoother.velocity_timeout", 1.0),
            down("controller_server.controller_frequency"),
        ),
        f"{SMOOTHER}; innate-inc/innate-os#510",
    ),
    Rule(
        "smoother-slower-than-loop",
        lambda f: (
            0.0
            < f.number("velocity_smoother.smoothing_frequency")
            < 0.95 * f.number("controller_server.controller_frequency", 20.0)
        ),
        lambda f: (
            f"smoothing_frequency {f['velocity_smoother.smoothing_frequency']} Hz is below "
            f"controller_frequency {f['controller_server.controller_frequency']} Hz"
        ),
        {S.STOP_START_JERK: 0.4, S.WOBBLE_STRAIGHT: 0.3},
        (up("velocity_smoother.smoothing_frequency"),),
        SMOOTHER,
    ),
    Rule(
        "smoother-cuts-speed",
        lambda f: 0.0 <= (_accel(f, "max_velocity", 0) or 1e9) < 0.95 * f.speed_mps,
        lambda f: (
            f"the velocity smoother lets {_accel(f, 'max_velocity', 0):g} m/s through, the "
            f"controller asks for {f.speed_mps:g}"
        ),
        {S.TOO_SLOW: 1.0, S.STALL_BEFORE_GOAL: 0.2},
        (up("velocity_smoother.max_velocity"),),
        SMOOTHER,
    ),
    Rule(
        "smoother-lets-nothing-back",
        lambda f: (
            f.axis("velocity_smoother.min_velocity", 0) is not None
            and (f.axis("velocity_smoother.min_velocity", 0) or 0.0) >= 0.0
        ),
        lambda f: (
            "velocity_smoother.min_velocity forbids driving back, for the behaviour BackUp as well "
            "where the launch file leads its commands through the smoother"
        ),
        {S.NO_RECOVERY: 1.0, S.REVERSE_FAILURE: 0.9},
        (down("velocity_smoother.min_velocity"),),
        SMOOTHER,
    ),
    Rule(
        "smoother-deadband",
        lambda f: _has_deadband(f),
        lambda f: (
            f"deadband_velocity {f['velocity_smoother.deadband_velocity']}: smaller commands "
            "are set to zero"
        ),
        {S.STALL_BEFORE_GOAL: 0.8, S.NO_START: 0.9, S.GOAL_NOT_REACHED: 0.6, S.NO_TURNING: 0.4},
        (down("velocity_smoother.deadband_velocity", 0.0),),
        SMOOTHER,
    ),
    Rule(
        "smoother-deadband-in-open-loop",
        lambda f: (
            f.release <= Release.IRON
            and _has_deadband(f)
            and f["velocity_smoother.feedback"] in (None, "OPEN_LOOP")
        ),
        lambda f: (
            "in open loop this release keeps the command after the deadband, so that the ramp "
            "begins at zero again and again"
        ),
        {S.STALL_BEFORE_GOAL: 1.0, S.NO_START: 1.0},
        (
            down("velocity_smoother.deadband_velocity", 0.0),
            upgrade("humble 1.1.9 or newer"),
        ),
        "navigation2#3699",
    ),
    Rule(
        "smoother-in-closed-loop",
        lambda f: f["velocity_smoother.feedback"] == "CLOSED_LOOP",
        lambda f: (
            "velocity_smoother.feedback is CLOSED_LOOP: late or coarse odometry holds the ramp back"
        ),
        {S.TOO_SLOW: 0.5, S.NO_START: 0.5, S.WOBBLE_STRAIGHT: 0.3, S.STOP_START_JERK: 0.3},
        (put("velocity_smoother.feedback", "OPEN_LOOP"), put("velocity_smoother.odom_topic")),
        f"{SMOOTHER}, README",
        is_certain=False,
    ),
    Rule(
        "smoother-steep",
        lambda f: (_accel(f, "max_accel", 0) or 0.0) > 3.0,
        lambda f: (
            f"velocity_smoother.max_accel {_accel(f, 'max_accel', 0):g} m/s^2 smooths nothing"
        ),
        {S.STOP_START_JERK: 0.5},
        (down("velocity_smoother.max_accel"),),
        SMOOTHER,
        is_certain=False,
    ),
    Rule(
        "progress-is-noise",
        lambda f: (
            f["progress_checker.required_movement_radius"] is not None
            and f.number("progress_checker.required_movement_radius") < POSE_NOISE_M
        ),
        lambda f: (
            "required_movement_radius "
            f"{f['progress_checker.required_movement_radius']} m: a pose estimate wanders by about "
            f"{POSE_NOISE_M} m on most robots, so that one that stands may count as moving"
        ),
        {S.NO_RECOVERY: 1.0, S.GIVES_UP_LATE: 1.0},
        (up("progress_checker.required_movement_radius", 0.2),),
        f"{SERVER}: simple_progress_checker.cpp",
    ),
    Rule(
        "progress-waits-long",
        lambda f: f.number("progress_checker.movement_time_allowance") > 45.0,
        lambda f: (
            "movement_time_allowance "
            f"{f['progress_checker.movement_time_allowance']} s: so long it stands before "
            "anything is "
            "tried"
        ),
        {S.NO_RECOVERY: 0.8, S.GIVES_UP_LATE: 0.9},
        (down("progress_checker.movement_time_allowance", 20.0),),
        f"{SERVER}: simple_progress_checker.cpp",
    ),
    Rule(
        "progress-faster-than-allowed-drive",
        lambda f: (
            f["progress_checker.movement_time_allowance"] is not None
            and (
                _progress_mps(f) > 0.25 * max(f.speed_mps, 0.05)
                or f.number("progress_checker.movement_time_allowance") <= 10.0
            )
        ),
        lambda f: (
            f"progress asks for {f['progress_checker.required_movement_radius']} m in "
            f"{f['progress_checker.movement_time_allowance']} s, which slow pieces, turns and "
            "jumps of "
            "the pose do not give"
        ),
        {S.FALSE_ABORT: 1.0, S.GOAL_NOT_REACHED: 0.3},
        (
            up("progress_checker.movement_time_allowance", 20.0),
            down("progress_checker.required_movement_radius"),
        ),
        f"{SERVER}: simple_progress_checker.cpp",
        is_certain=False,
    ),
    Rule(
        "progress-forgets-turns",
        lambda f: (
            str(f["progress_checker.plugin"]).endswith("SimpleProgressChecker")
            and f.number("controller.rotate_to_heading_angular_vel", 2.0)
            * f.number("progress_checker.movement_time_allowance", 10.0)
            < 6.3
        ),
        lambda f: (
            "SimpleProgressChecker counts turns as standing, and a whole turn takes longer "
            "than movement_time_allowance"
        ),
        {S.FALSE_ABORT: 0.9},
        (
            put("progress_checker.plugin", "nav2_controller::PoseProgressChecker"),
            up("progress_checker.movement_time_allowance"),
        ),
        f"{SERVER}: pose_progress_checker.cpp",
    ),
    Rule(
        "goal-smaller-than-a-step",
        lambda f: 0.0 < f.number("goal_checker.xy_goal_tolerance") < max(_step_m(f), POSE_NOISE_M),
        lambda f: (
            f"xy_goal_tolerance {f['goal_checker.xy_goal_tolerance']} m is less than "
            + (
                f"the {_step_m(f):.2f} m between two commands at {f.speed_mps:g} m/s"
                if _step_m(f) > POSE_NOISE_M
                else f"the {POSE_NOISE_M} m by which a pose estimate wanders on most robots"
            )
        ),
        {
            S.GOAL_OSCILLATION: 1.0,
            S.GOAL_NOT_REACHED: 1.0,
            S.GOAL_OVERSHOOT: 0.5,
            S.SPINS: 0.6,
            S.STALL_BEFORE_GOAL: 0.4,
        },
        (up("goal_checker.xy_goal_tolerance", 0.2),),
        f"{SERVER}: simple_goal_checker.cpp",
    ),
    Rule(
        "goal-heading-smaller-than-a-step",
        lambda f: 0.0 < f.number("goal_checker.yaw_goal_tolerance") < 0.07,
        lambda f: (
            f"yaw_goal_tolerance {f['goal_checker.yaw_goal_tolerance']} rad is about what the "
            "heading of a pose estimate wanders by on most robots"
        ),
        {S.GOAL_OSCILLATION: 0.9, S.GOAL_NOT_REACHED: 0.9, S.SPINS: 0.8, S.GOAL_OVERSHOOT: 0.4},
        (up("goal_checker.yaw_goal_tolerance", 0.2),),
        f"{SERVER}: simple_goal_checker.cpp",
    ),
    Rule(
        "goal-asked-again-while-turning",
        lambda f: f["goal_checker.stateful"] is False,
        lambda f: "goal_checker.stateful is off: a robot that drifts while it turns must come back",
        {S.GOAL_OSCILLATION: 1.0, S.GOAL_NOT_REACHED: 0.5, S.SPINS: 0.4},
        (put("goal_checker.stateful", True),),
        f"{SERVER}: simple_goal_checker.cpp",
    ),
    Rule(
        "goal-kept-by-the-checker-alone",
        lambda f: (
            f["goal_checker.stateful"] is True
            and f.release < Release.LYRICAL
            and f.is_kind("rpp", "mppi", "graceful")
        ),
        lambda f: (
            "the goal checker keeps that the position was reached, the controller does not: "
            "it drives there again"
        ),
        {S.GOAL_OSCILLATION: 0.4},
        (
            up("goal_checker.xy_goal_tolerance"),
            upgrade("lyrical, with navigation2#6071 and #6124"),
        ),
        "navigation2#5166",
        is_certain=False,
    ),
    Rule(
        "no-patience",
        lambda f: (
            f["controller_server.failure_tolerance"] is not None
            and f.number("controller_server.failure_tolerance") == 0.0
        ),
        lambda f: "failure_tolerance 0: the first failed cycle ends the task",
        {S.FALSE_ABORT: 0.8, S.STOP_START_JERK: 0.4, S.DOOR_STOP: 0.4},
        (up("controller_server.failure_tolerance", 0.3),),
        f"{SERVER}: controller_server.cpp",
        is_certain=False,
    ),
    Rule(
        "patience-for-ever",
        lambda f: (
            f.number("controller_server.failure_tolerance") < 0.0
            or f.number("controller_server.failure_tolerance") > 10.0
        ),
        lambda f: (
            f"failure_tolerance {f['controller_server.failure_tolerance']} s: failing cycles "
            "are borne without end"
        ),
        {S.NO_RECOVERY: 0.7, S.GIVES_UP_LATE: 0.8},
        (down("controller_server.failure_tolerance", 0.3),),
        f"{SERVER}: controller_server.cpp",
    ),
    Rule(
        "transforms-must-be-fresh",
        lambda f: (
            0.0
            < min(
                f.number("controller_server.transform_tolerance", 1.0),
                f.number("local_costmap.transform_tolerance", 1.0),
                f.number("controller.transform_tolerance", 1.0),
            )
            < 0.15
        ),
        lambda f: "a transform_tolerance below 0.15 s: one late transform fails the cycle",
        {S.FALSE_ABORT: 0.6, S.LATE_CYCLES: 0.6, S.NO_START: 0.5, S.STOP_START_JERK: 0.4},
        (up("controller_server.transform_tolerance", 0.3),),
        f"{SERVER}; nav2_util",
        is_certain=False,
    ),
    Rule(
        "measured-speed-cut-off",
        lambda f: (
            f.number("controller_server.min_x_velocity_threshold") > 0.05
            or f.number("controller_server.min_theta_velocity_threshold") > 0.1
        ),
        lambda f: (
            "min_x_velocity_threshold "
            f"{f['controller_server.min_x_velocity_threshold']} m/s, min_theta_velocity_threshold "
            f"{f['controller_server.min_theta_velocity_threshold']} rad/s: slow drives are taken "
            "as "
            "standing, so that every ramp begins at zero"
        ),
        {S.NO_START: 0.8, S.TOO_SLOW: 0.6, S.STALL_BEFORE_GOAL: 0.7, S.NO_TURNING: 0.6},
        (
            down("controller_server.min_x_velocity_threshold", 0.001),
            down("controller_server.min_theta_velocity_threshold", 0.001),
        ),
        f"{SERVER}: controller_server.cpp",
    ),
    Rule(
        "monitor-stops-the-way-back",
        lambda f: bool(_polygons_that(f, "stop")),
        lambda f: (
            f"{', '.join(_polygons_that(f, 'stop'))} of the collision monitor stops every "
            "command while something is in it, also those that lead away"
        ),
        {
            S.NO_RECOVERY: 1.0,
            S.NO_START: 0.7,
            S.STALL_BEFORE_GOAL: 0.5,
            S.DOOR_STOP: 0.6,
            S.REVERSE_FAILURE: 0.6,
            S.STOP_START_JERK: 0.4,
        },
        (put("collision_monitor.*.action_type", "approach"),),
        f"{MONITOR}: polygon.cpp, action STOP",
        is_certain=False,
    ),
    Rule(
        "monitor-slows-hard",
        lambda f: bool(_polygons_that(f, "slowdown")) and _least(f, "slowdown_ratio", 1.0) < 0.35,
        lambda f: (
            f"a zone of the collision monitor slows down to "
            f"{_least(f, 'slowdown_ratio', 1.0):g} of the command"
        ),
        {S.TOO_SLOW: 0.6, S.STALL_BEFORE_GOAL: 0.5, S.STOP_START_JERK: 0.4},
        (up("collision_monitor.*.slowdown_ratio", 0.5), put("collision_monitor.*.points")),
        f"{MONITOR}: polygon.cpp, action SLOWDOWN",
        is_certain=False,
    ),
    Rule(
        "monitor-believes-single-points",
        lambda f: bool(_polygons(f)) and _least(f, "min_points", 4) < 3,
        lambda f: (
            f"min_points {_least(f, 'min_points', 4):g}: noise of the scan is enough for the "
            "collision monitor"
        ),
        {S.STOP_START_JERK: 0.9, S.NO_START: 0.4, S.DOOR_STOP: 0.4},
        (up("collision_monitor.*.min_points", 4),),
        f"{MONITOR}: polygon.cpp",
    ),
    Rule(
        "monitor-without-patience",
        lambda f: 0.0 < f.number("collision_monitor.source_timeout", 2.0) < 0.3,
        lambda f: (
            f"source_timeout {f['collision_monitor.source_timeout']} s: a late scan stops the robot"
        ),
        {S.STOP_START_JERK: 0.9, S.NO_START: 0.7},
        (up("collision_monitor.source_timeout", 1.0),),
        f"{MONITOR}: source.cpp",
    ),
    Rule(
        "monitor-looks-far-ahead",
        lambda f: any(
            float(_of(f, p, "time_before_collision") or 0.0) > 2.5
            for p in _polygons_that(f, "approach")
        ),
        lambda f: (
            "time_before_collision of the collision monitor is above 2.5 s: it slows down for "
            "what it will never touch"
        ),
        {S.TOO_SLOW: 0.8, S.DOOR_STOP: 0.7, S.STALL_BEFORE_GOAL: 0.6},
        (down("collision_monitor.*.time_before_collision", 1.2),),
        f"{MONITOR}: polygon.cpp, action APPROACH",
    ),
    Rule(
        "behaviours-look-far-ahead",
        lambda f: f.number("behavior_server.simulate_ahead_time", 2.0) > 2.5,
        lambda f: (
            f"behavior_server.simulate_ahead_time {f['behavior_server.simulate_ahead_time']} "
            "s: Spin and BackUp refuse where anything is near"
        ),
        {S.NO_RECOVERY: 0.8},
        (down("behavior_server.simulate_ahead_time", 1.5),),
        "nav2_behaviors",
    ),
    Rule(
        "tree-without-patience",
        lambda f: 0.0 < f.number("bt_navigator.default_server_timeout", 20.0) <= 10.0,
        lambda f: (
            f"default_server_timeout {f['bt_navigator.default_server_timeout']} ms: a server "
            "that answers later counts as failed"
        ),
        {S.FALSE_ABORT: 0.8, S.PLANNER_FAILS: 0.3},
        (up("bt_navigator.default_server_timeout", 100),),
        "nav2_behavior_tree: bt_action_node.hpp",
        is_certain=False,
    ),
    Rule(
        "clocks-differ",
        lambda f: (
            len(
                {
                    str(value).lower()
                    for place, value in f.values.items()
                    if place.endswith(".use_sim_time")
                }
            )
            > 1
        ),
        lambda f: (
            "use_sim_time is on for some nodes and off for others, unless the launch file sets it "
            "for all, as nav2_bringup's does"
        ),
        {S.FALSE_ABORT: 0.8, S.NO_START: 0.8, S.LOCALIZATION_JUMPS: 0.5, S.IGNORES_OBSTACLES: 0.5},
        (outside("clock"),),
        "ROS 2: use_sim_time",
        is_certain=False,
    ),
    Rule(
        "stamped-and-plain-commands",
        lambda f: (
            len(
                {
                    str(value).lower()
                    for place, value in f.values.items()
                    if place.endswith(".enable_stamped_cmd_vel")
                }
            )
            > 1
        ),
        lambda f: (
            "enable_stamped_cmd_vel is on for some nodes and off for others: they do not hear "
            "each other"
        ),
        {S.NO_START: 1.0, S.NO_RECOVERY: 0.6},
        (outside("enable_stamped_cmd_vel"),),
        "docs.nav2.org, migration to jazzy",
    ),
)
