"""Rules about the velocity smoother."""

from __future__ import annotations

from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.rule import Rule, down, put, up, upgrade
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

SMOOTHER = "nav2_velocity_smoother"
# Slower commands than these move hardly any robot.
SLOW_MPS, SLOW_RADPS = 0.02, 0.05
# A cycle may take this many periods before somebody must wait for it.
LATE_PERIODS = 4.0


def _accel(f: Facts, name: str, axis: int) -> float | None:
    return f.axis(f"velocity_smoother.{name}", axis)


def _has_deadband(f: Facts) -> bool:
    """Tells whether commands are cut off that a drive needs to start or to arrive."""
    x, y, turn = (_accel(f, "deadband_velocity", axis) or 0.0 for axis in range(3))
    moves_sideways = _accel(f, "max_velocity", 1) != 0.0
    return x > SLOW_MPS or (moves_sideways and y > SLOW_MPS) or turn > SLOW_RADPS


def _sideways_mps(f: Facts) -> float:
    """Returns the speed to the side that the controller may command, m/s."""
    name = "vy_max" if f.controller("motion_model") == "Omni" else "max_vel_y"
    return f.number(f"controller.{name}") if f.is_kind("mppi", "dwb", "teb") else 0.0


def _with_the_speed_asked(f: Facts) -> list[float]:
    """Returns max_velocity with the controller's speed ahead, m/s."""
    return [f.speed_mps, *f["velocity_smoother.max_velocity"][1:]]


RULES = (
    Rule(
        "smoother-forbids-sideways",
        lambda f: _sideways_mps(f) > 0.0 and _accel(f, "max_velocity", 1) == 0.0,
        lambda f: (
            f"the controller may drive {_sideways_mps(f):g} m/s to the side, but the velocity "
            "smoother's max_velocity for y is 0 m/s: no command to the side reaches the base"
        ),
        {S.TOO_SLOW: 1.3, S.GOAL_NOT_REACHED: 0.9, S.NO_START: 0.5, S.STALL_BEFORE_GOAL: 0.6},
        (put("velocity_smoother.max_velocity"), put("velocity_smoother.max_accel")),
        SMOOTHER,
    ),
    Rule(
        "smoother-timeout-below-late-cycles",
        lambda f: (
            f["velocity_smoother.velocity_timeout"] is not None
            and f.number("velocity_smoother.velocity_timeout")
            < max(LATE_PERIODS * f.period_s + 0.02, 0.25)
        ),
        lambda f: (
            f"velocity_timeout is {f['velocity_smoother.velocity_timeout']} s: the velocity "
            "smoother stops the robot when the controller, with a period of "
            f"{f.period_s:.3f} s, is a few periods late"
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
            f"smoothing_frequency is {f['velocity_smoother.smoothing_frequency']} Hz, less "
            f"than controller_frequency {f['controller_server.controller_frequency']} Hz: "
            "the smoother drops commands"
        ),
        {S.STOP_START_JERK: 0.4, S.WOBBLE_STRAIGHT: 0.3},
        (up("velocity_smoother.smoothing_frequency", lambda f: 1.0 / f.period_s),),
        SMOOTHER,
    ),
    Rule(
        "smoother-cuts-speed",
        lambda f: 0.0 <= (_accel(f, "max_velocity", 0) or 1e9) < 0.95 * f.speed_mps,
        lambda f: (
            f"the velocity smoother lets through at most {_accel(f, 'max_velocity', 0):g} "
            f"m/s, but the controller asks for {f.speed_mps:g} m/s"
        ),
        {S.TOO_SLOW: 1.0, S.STALL_BEFORE_GOAL: 0.2},
        (up("velocity_smoother.max_velocity", _with_the_speed_asked),),
        SMOOTHER,
    ),
    Rule(
        "smoother-lets-nothing-back",
        lambda f: (
            f.axis("velocity_smoother.min_velocity", 0) is not None
            and (f.axis("velocity_smoother.min_velocity", 0) or 0.0) >= 0.0
        ),
        lambda f: (
            "velocity_smoother.min_velocity allows no driving backward; this also stops the "
            "behaviour BackUp if the launch file sends its commands through the smoother"
        ),
        {S.NO_RECOVERY: 1.0, S.REVERSE_FAILURE: 0.9},
        (down("velocity_smoother.min_velocity"),),
        SMOOTHER,
    ),
    Rule(
        "smoother-deadband",
        lambda f: _has_deadband(f),
        lambda f: (
            f"deadband_velocity is {f['velocity_smoother.deadband_velocity']}: the velocity "
            "smoother sets smaller commands to 0"
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
            "in open loop this release applies deadband_velocity first and accelerates from the "
            "result, so from 0 in every cycle"
        ),
        {S.STALL_BEFORE_GOAL: 1.0, S.NO_START: 1.0},
        (
            down("velocity_smoother.deadband_velocity", 0.0),
            upgrade(lambda f: "jazzy" if f.release is Release.IRON else "humble 1.1.9 or newer"),
        ),
        "navigation2#3699",
    ),
    Rule(
        "smoother-in-closed-loop",
        lambda f: f["velocity_smoother.feedback"] == "CLOSED_LOOP",
        lambda f: (
            "velocity_smoother.feedback is CLOSED_LOOP: late or coarse odometry slows down "
            "every acceleration"
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
            f"velocity_smoother.max_accel is {_accel(f, 'max_accel', 0):g} m/s^2: so high "
            "that the smoother smooths nothing"
        ),
        {S.STOP_START_JERK: 0.5},
        (down("velocity_smoother.max_accel"),),
        SMOOTHER,
        is_certain=False,
    ),
)
