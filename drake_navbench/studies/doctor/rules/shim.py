"""Rules about Nav2's rotation shim."""

from __future__ import annotations

from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.rule import Rule, down, put, up, upgrade
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

SHIM = ("shim",)
CODE = "nav2_rotation_shim_controller"
# Turn rates so small move no heavy base, rad/s.
SMALL_RADPS = 0.07


def _first_step_radps(f: Facts) -> float:
    """Returns the turn rate that the first cycle of a turn commands, rad/s."""
    return f.number("controller.max_angular_accel", 3.2) * f.period_s


def _others_topic(f: Facts) -> str:
    """Returns the odometry's topic that other nodes of the file listen to; '' where none says."""
    return str(f["bt_navigator.odom_topic"] or f["velocity_smoother.odom_topic"] or "")


def _own_topic(f: Facts) -> str:
    """Returns the odometry's topic that the controller server listens to."""
    return str(f["controller_server.odom_topic"] or "odom")


def _topics_differ(f: Facts) -> bool:
    """Tells whether the controller listens to other odometry than the rest.

    A name without a slash is within the node's namespace: 'odom' may be /robot/odom. Where the rest
    is told the topic of maps by mistake, the controller shall not follow.
    """
    own = _own_topic(f)
    other = _others_topic(f) or own
    namespace, _, last = other.rpartition("/")
    if last == "map":
        return False
    if own == last and any(
        str(value).startswith(f"{namespace}/") and value != other for value in f.values.values()
    ):
        return False
    return own.strip("/") != other.strip("/")


RULES = (
    Rule(
        "shim-gap-of-two-thresholds",
        lambda f: (
            f.release >= Release.JAZZY
            and f.controller("rotate_to_goal_heading") is not True
            and f.number("goal_checker.yaw_goal_tolerance", 0.25)
            < f.number("controller.angular_dist_threshold", 0.785)
        ),
        lambda f: (
            "rotate_to_goal_heading is off: for errors between yaw_goal_tolerance, "
            f"{f['goal_checker.yaw_goal_tolerance']} rad, and angular_dist_threshold, "
            f"{f.controller('angular_dist_threshold')} rad, the shim does not turn the robot"
        ),
        {S.GOAL_NOT_REACHED: 1.0, S.STALL_BEFORE_GOAL: 0.8, S.GOAL_OSCILLATION: 0.5},
        (put("rotate_to_goal_heading", True), down("angular_dist_threshold")),
        f"{CODE}: rotate_to_goal_heading",
        SHIM,
    ),
    Rule(
        "shim-slow-ramp",
        lambda f: _first_step_radps(f) < SMALL_RADPS,
        lambda f: (
            f"max_angular_accel is {f.controller('max_angular_accel')} rad/s^2: the first "
            f"cycle of a turn commands {_first_step_radps(f):.2f} rad/s, at which many "
            "motors do not move the robot"
        ),
        {S.STOP_START_JERK: 1.0, S.NO_TURNING: 0.9, S.NO_START: 0.7, S.TOO_SLOW: 0.5},
        (
            up("max_angular_accel", 3.2),
            up("rotate_to_heading_angular_vel"),
            put("closed_loop", False),
        ),
        f"{CODE}: the ramp starts from the measured rate",
        SHIM,
    ),
    Rule(
        "shim-slow-turn",
        lambda f: f.number("controller.rotate_to_heading_angular_vel", 1.8) < 0.5,
        lambda f: (
            "rotate_to_heading_angular_vel is "
            f"{f.controller('rotate_to_heading_angular_vel')} rad/s: the shim turns the "
            "robot slowly"
        ),
        {S.TOO_SLOW: 0.8, S.NO_TURNING: 0.6, S.STOP_START_JERK: 0.4},
        (up("rotate_to_heading_angular_vel", 1.8),),
        CODE,
        SHIM,
        is_certain=False,
    ),
    Rule(
        "shim-turns-for-little",
        lambda f: f.number("controller.angular_dist_threshold", 0.785) < 0.4,
        lambda f: (
            f"angular_dist_threshold is {f.controller('angular_dist_threshold')} rad: the "
            "shim stops the robot to turn for small errors of the heading"
        ),
        {S.STOP_START_JERK: 1.0, S.WOBBLE_STRAIGHT: 0.8, S.SPINS: 0.7, S.TOO_SLOW: 0.5},
        (up("angular_dist_threshold", 0.785),),
        CODE,
        SHIM,
    ),
    Rule(
        "shim-samples-noise",
        lambda f: f.number("controller.forward_sampling_distance", 0.5) < 0.25,
        lambda f: (
            f"forward_sampling_distance is {f.controller('forward_sampling_distance')} m: "
            "the shim takes the path's heading from a piece this short, which is mostly noise"
        ),
        {S.WOBBLE_STRAIGHT: 0.7, S.STOP_START_JERK: 0.7, S.SPINS: 0.7},
        (up("forward_sampling_distance", 0.5),),
        CODE,
        SHIM,
    ),
    Rule(
        "shim-checks-a-long-turn",
        lambda f: f.number("controller.simulate_ahead_time", 1.0) > 1.8,
        lambda f: (
            f"simulate_ahead_time is {f.controller('simulate_ahead_time')} s: the shim "
            "simulates so much of the turn that an obstacle near its end keeps the robot from "
            "starting it"
        ),
        {S.NO_TURNING: 0.8, S.NO_START: 0.6, S.NO_RECOVERY: 0.6},
        (down("simulate_ahead_time", 1.0),),
        CODE,
        SHIM,
    ),
    Rule(
        "shim-never-brakes",
        lambda f: (
            f.release <= Release.JAZZY
            and f.number("controller.rotate_to_heading_angular_vel", 1.8) > 0.8
        ),
        lambda f: (
            "in Jazzy of 2024 and older the shim turns at "
            f"{f.controller('rotate_to_heading_angular_vel')} rad/s until the heading is "
            "reached, and does not slow down before"
        ),
        {S.GOAL_OVERSHOOT: 1.0, S.GOAL_OSCILLATION: 0.6, S.SPINS: 0.4},
        (
            down("rotate_to_heading_angular_vel"),
            upgrade("jazzy of 2025 or newer, with navigation2#4864"),
        ),
        "navigation2#4864",
        SHIM,
        is_certain=False,
    ),
    Rule(
        "odometry-of-another-topic",
        _topics_differ,
        lambda f: (
            f"controller_server.odom_topic is {_own_topic(f)}"
            f"{'' if f['controller_server.odom_topic'] else ' by default'}, but other nodes of the "
            f"file listen to {_others_topic(f)}: if nothing publishes {_own_topic(f)}, the "
            "controller takes the measured speed as 0 m/s"
        ),
        {
            S.TOO_SLOW: 0.6,
            S.NO_START: 0.4,
            S.NO_TURNING: 0.4,
            S.WOBBLE_STRAIGHT: 0.3,
            S.STOP_START_JERK: 0.3,
            S.GOAL_OVERSHOOT: 0.2,
        },
        (put("controller_server.odom_topic", _others_topic),),
        "nav2_controller: OdomSmoother subscribes odom_topic; roasinc/former_robot#19",
    ),
)
