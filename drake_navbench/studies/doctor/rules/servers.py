"""Rules about the controller server's loop and patience, behaviours, tree and clocks."""

from __future__ import annotations

from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.quantities import driven_mps
from drake_navbench.studies.doctor.rules.rule import Rule, down, outside, put, up
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

SERVER = "nav2_controller"
# Farther than this between two commands, and a path of a house is lost, m.
FAR_BETWEEN_COMMANDS_M = 0.1


def step_m(f: Facts) -> float:
    """Returns the way at full speed from one command to the next, m."""
    return driven_mps(f) * f.period_s


RULES = (
    Rule(
        "slow-loop",
        lambda f: (
            f.number("controller_server.controller_frequency", 20.0) < 8.0
            or (
                f.number("controller_server.controller_frequency", 20.0) < 20.0
                and step_m(f) > FAR_BETWEEN_COMMANDS_M
            )
        ),
        lambda f: (
            f"controller_frequency is {f['controller_server.controller_frequency']} Hz: at "
            f"{driven_mps(f):g} m/s the robot drives {step_m(f):.2f} m between two commands. By a "
            "rule of thumb a loop is slow below 8 Hz, and below 20 Hz if that is more than 0.1 m"
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
            f"controller_frequency is {f['controller_server.controller_frequency']} Hz: "
            "most computers cannot keep this rate"
        ),
        {S.LATE_CYCLES: 0.8, S.STOP_START_JERK: 0.4},
        (down("controller_server.controller_frequency", 20.0),),
        f"{SERVER}; docs.nav2.org, controller server",
        is_certain=False,
    ),
    Rule(
        "no-patience",
        lambda f: (
            f["controller_server.failure_tolerance"] is not None
            and f.number("controller_server.failure_tolerance") == 0.0
        ),
        lambda f: "failure_tolerance is 0 s: the first failed control cycle ends the task",
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
            f"failure_tolerance is {f['controller_server.failure_tolerance']} s: when control "
            "cycles fail, the controller server gives up only after this time, and never if it is "
            "negative"
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
                f.number("local_costmap.transform_tolerance", 1.0),
                f.number("controller.transform_tolerance", 1.0),
            )
            < 0.15
        ),
        lambda f: (
            "a transform_tolerance is below 0.15 s: one late transform makes the control cycle fail"
        ),
        {S.FALSE_ABORT: 0.6, S.LATE_CYCLES: 0.6, S.NO_START: 0.5, S.STOP_START_JERK: 0.4},
        (up("transform_tolerance", 0.3),),
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
            f"min_x_velocity_threshold is {f['controller_server.min_x_velocity_threshold']} "
            "m/s and min_theta_velocity_threshold "
            f"{f['controller_server.min_theta_velocity_threshold']} rad/s: the controller "
            "takes slower measured speeds as 0, so it accelerates from 0 in every cycle"
        ),
        {S.NO_START: 0.8, S.TOO_SLOW: 0.6, S.STALL_BEFORE_GOAL: 0.7, S.NO_TURNING: 0.6},
        (
            down("controller_server.min_x_velocity_threshold", 0.001),
            down("controller_server.min_theta_velocity_threshold", 0.001),
        ),
        f"{SERVER}: controller_server.cpp",
    ),
    Rule(
        "behaviours-look-far-ahead",
        lambda f: f.number("behavior_server.simulate_ahead_time", 2.0) > 2.5,
        lambda f: (
            "behavior_server.simulate_ahead_time is "
            f"{f['behavior_server.simulate_ahead_time']} s: Spin and BackUp refuse to start "
            "near any obstacle"
        ),
        {S.NO_RECOVERY: 0.8},
        (down("behavior_server.simulate_ahead_time", 1.5),),
        "nav2_behaviors",
    ),
    Rule(
        "tree-without-patience",
        lambda f: 0.0 < f.number("bt_navigator.default_server_timeout", 20.0) <= 10.0,
        lambda f: (
            f"default_server_timeout is {f['bt_navigator.default_server_timeout']} ms: the "
            "behaviour tree counts a server that answers later as failed"
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
            "use_sim_time is true for some nodes and false for others; this is no fault if the "
            "launch file sets it for all nodes, as nav2_bringup's does"
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
            "enable_stamped_cmd_vel is on for some nodes and off for others: they do not "
            "receive each other's commands"
        ),
        {S.NO_START: 1.0, S.NO_RECOVERY: 0.6},
        (put("controller_server.enable_stamped_cmd_vel"),),
        "docs.nav2.org, migration to jazzy",
    ),
)
