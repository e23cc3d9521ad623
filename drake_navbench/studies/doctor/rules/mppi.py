"""Rules about the samples of Nav2's MPPI."""

from __future__ import annotations

from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.causes import Cause
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.quantities import braking_m, half_window_m, whole_m
from drake_navbench.studies.doctor.rules.rule import Rule, add, down, outside, put, up, upgrade
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

MPPI = ("mppi",)
PAGE = "docs.nav2.org, configuration of MPPI, words of wisdom"
CODE = "nav2_mppi_controller"
# The product of samples, steps and rate that a small board manages, 1/s: a Raspberry Pi 4 takes
# about 25 ms for 1000 samples of 56 steps.
BOARD_CELLS_PER_S = 1.2e6
# With fewer steps MPPI plans no bend ahead: fewer than half of Nav2's 56 are not advised.
LEAST_STEPS = 28


def horizon_s(f: Facts) -> float:
    """Returns the length of the horizon, s."""
    return f.number("controller.time_steps", 56) * f.number("controller.model_dt", 0.05)


def horizon_m(f: Facts) -> float:
    """Returns the length of the horizon at full speed, m."""
    return horizon_s(f) * f.number("controller.vx_max", 0.5)


def _steps_in_the_window(f: Facts) -> int:
    """Returns the steps at full speed that the local costmap holds, not too few to plan with."""
    steps = f.number("controller.time_steps", 56.0) * half_window_m(f) / horizon_m(f)
    return max(int(steps), LEAST_STEPS)


def _smoother(f: Facts, axis: int) -> float:
    return f.axis("velocity_smoother.max_accel", axis) or 0.0


def _raised_accel(axis: int, name: str, default: float) -> Cause:
    """Returns the cure that lets the velocity smoother accelerate as fast as MPPI expects."""

    def raised(f: Facts) -> list[float]:
        limits = list(f["velocity_smoother.max_accel"])
        return [*limits[:axis], f.number(f"controller.{name}", default), *limits[axis + 1 :]]

    return up("velocity_smoother.max_accel", raised)


def _cells_per_s(f: Facts) -> float:
    work = f.number("controller.batch_size", 1000) * f.number("controller.time_steps", 56)
    return work * f.number("controller.iteration_count", 1) / f.period_s


RULES = (
    Rule(
        "mppi-horizon-beyond-window",
        lambda f: horizon_m(f) > 1.05 * half_window_m(f),
        lambda f: (
            f"at full speed the samples reach {horizon_m(f):.1f} m, but the local costmap "
            f"only {half_window_m(f):.1f} m from the robot"
        ),
        {S.COLLISION: 0.4, S.TOO_SLOW: 0.4, S.STOP_START_JERK: 0.4, S.WOBBLE_STRAIGHT: 0.2},
        (
            up("local_costmap.width", lambda f: whole_m(2.0 * horizon_m(f))),
            down("time_steps", _steps_in_the_window),
            down("vx_max", lambda f: int(100.0 * half_window_m(f) / horizon_s(f)) / 100.0),
        ),
        PAGE,
        MPPI,
    ),
    Rule(
        "mppi-step-below-period",
        lambda f: f.period_s > 1.001 * f.number("controller.model_dt", 0.05),
        lambda f: (
            f"model_dt is {f.controller('model_dt')} s, less than the control period of "
            f"{f.period_s:.3f} s: MPPI refuses to start"
        ),
        {S.NO_START: 1.0, S.NO_TURNING: 0.7, S.WOBBLE_STRAIGHT: 0.5, S.LATE_CYCLES: 0.3},
        (
            up(
                "controller_server.controller_frequency",
                lambda f: 1.0 / f.number("controller.model_dt", 0.05),
            ),
            up("model_dt", lambda f: f.period_s),
        ),
        f"{CODE}/src/optimizer.cpp: controller period more than model dt",
        MPPI,
    ),
    Rule(
        "mppi-step-above-period",
        lambda f: f.number("controller.model_dt", 0.05) > 1.001 * f.period_s,
        lambda f: (
            f"model_dt is {f.controller('model_dt')} s, more than the control period of "
            f"{f.period_s:.4f} s: MPPI does not shift its planned commands in time from cycle to "
            "cycle"
        ),
        {S.WOBBLE_STRAIGHT: 0.3, S.STOP_START_JERK: 0.3},
        (down("model_dt", lambda f: f.period_s),),
        f"{CODE}/src/optimizer.cpp: consider setting it equal",
        MPPI,
    ),
    Rule(
        "mppi-wide-turn-samples",
        lambda f: f.number("controller.wz_std", 0.4) > 0.45,
        lambda f: (
            f"wz_std is {f.controller('wz_std')} rad/s: MPPI samples turn rates that are larger "
            "than driving needs"
        ),
        {S.WOBBLE_STRAIGHT: 1.0, S.STOP_START_JERK: 0.5, S.SPINS: 0.6, S.GOAL_OSCILLATION: 0.4},
        (down("wz_std", 0.4),),
        f"{PAGE}; navigation2#5281",
        MPPI,
    ),
    Rule(
        "mppi-wide-turn-samples-at-speed",
        lambda f: (
            0.3 < f.number("controller.wz_std", 0.4) <= 0.45
            and f.number("controller.vx_max", 0.5) > 0.8
        ),
        lambda f: (
            f"wz_std is {f.controller('wz_std')} rad/s and vx_max {f.controller('vx_max')} "
            "m/s: the faster the robot, the farther aside such turn rates bring it"
        ),
        {S.WOBBLE_STRAIGHT: 0.8},
        (down("wz_std", 0.25),),
        "navigation2#5281",
        MPPI,
    ),
    Rule(
        "mppi-narrow-turn-samples",
        lambda f: f.number("controller.wz_std", 0.4) < 0.25,
        lambda f: f"wz_std is {f.controller('wz_std')} rad/s: hardly any sample turns",
        {S.NO_TURNING: 1.0, S.REVERSE_FAILURE: 0.4, S.CORNER_CUTTING: 0.3},
        (up("wz_std", 0.4),),
        f"{CODE}/src/noise_generator.cpp",
        MPPI,
    ),
    Rule(
        "mppi-narrow-speed-samples",
        lambda f: (
            f.number("controller.vx_std", 0.2) < 0.18
            or f.number("controller.vx_std", 0.2) < 0.199 * f.number("controller.vx_max", 0.5)
        ),
        lambda f: (
            f"vx_std is {f.controller('vx_std')} m/s and vx_max {f.controller('vx_max')} "
            "m/s: from a low speed no sample is much faster, so the robot stays slow"
        ),
        {S.STALL_BEFORE_GOAL: 0.8, S.TOO_SLOW: 0.8, S.NO_START: 0.5},
        (up("vx_std", lambda f: max(0.2, 0.2 * f.number("controller.vx_max", 0.5))),),
        f"{CODE}/src/noise_generator.cpp",
        MPPI,
    ),
    Rule(
        "mppi-slow-ramp-in-rollouts",
        lambda f: f.release >= Release.JAZZY and f.number("controller.ax_max", 3.0) < 1.0,
        lambda f: (
            f"ax_max is {f.controller('ax_max')} m/s^2: the samples gain little speed, and the "
            "command, their weighted mean, gains even less"
        ),
        {S.STALL_BEFORE_GOAL: 0.7, S.TOO_SLOW: 0.6, S.NO_START: 0.5},
        (up("ax_max", 2.5), upgrade("lyrical or newer, which mends low accelerations")),
        "navigation2#6072",
        MPPI,
    ),
    Rule(
        "mppi-no-reverse",
        lambda f: f.number("controller.vx_min", -0.35) >= 0.0,
        lambda f: f"vx_min is {f.controller('vx_min')} m/s: no sample drives backward",
        {S.NO_RECOVERY: 0.7, S.NO_TURNING: 0.25, S.REVERSE_FAILURE: 0.3},
        (down("vx_min", -0.2),),
        f"{CODE}/src/optimizer.cpp",
        MPPI,
        is_certain=False,
    ),
    Rule(
        "mppi-faster-than-smoother",
        lambda f: (
            f.release >= Release.JAZZY
            and 0.0 < _smoother(f, 0) < 0.8 * f.number("controller.ax_max", 3.0)
        ),
        lambda f: (
            f"ax_max is {f.controller('ax_max')} m/s^2, but velocity_smoother.max_accel "
            f"lets through only {_smoother(f, 0):g} m/s^2: the robot accelerates more slowly than "
            "MPPI expects"
        ),
        {S.STOP_START_JERK: 0.5, S.GOAL_OVERSHOOT: 0.5, S.WOBBLE_STRAIGHT: 0.3},
        (down("ax_max", lambda f: _smoother(f, 0)), _raised_accel(0, "ax_max", 3.0)),
        f"{CODE}/src/optimizer.cpp; nav2_velocity_smoother",
        MPPI,
    ),
    Rule(
        "mppi-turns-faster-than-smoother",
        lambda f: (
            f.release >= Release.JAZZY
            and 0.0 < _smoother(f, 2) < 0.8 * f.number("controller.az_max", 3.5)
        ),
        lambda f: (
            f"az_max is {f.controller('az_max')} rad/s^2, but velocity_smoother.max_accel "
            f"lets through only {_smoother(f, 2):g} rad/s^2: the robot begins to turn more slowly "
            "than MPPI expects"
        ),
        {S.WOBBLE_STRAIGHT: 0.4, S.STOP_START_JERK: 0.3, S.GOAL_OSCILLATION: 0.3},
        (down("az_max", lambda f: _smoother(f, 2)), _raised_accel(2, "az_max", 3.5)),
        f"{CODE}/src/optimizer.cpp; nav2_velocity_smoother",
        MPPI,
    ),
    Rule(
        "mppi-steep-ramps",
        lambda f: f.number("controller.ax_max", 3.0) > 3.5,
        lambda f: (
            f"ax_max is {f.controller('ax_max')} m/s^2: wheels on a floor slip at such an "
            "acceleration"
        ),
        {S.STOP_START_JERK: 1.0, S.GOAL_OVERSHOOT: 0.4},
        (down("ax_max", 2.0),),
        PAGE,
        MPPI,
    ),
    Rule(
        "mppi-heavy-for-a-board",
        lambda f: _cells_per_s(f) > BOARD_CELLS_PER_S,
        lambda f: (
            f"batch_size {f.controller('batch_size')}, time_steps "
            f"{f.controller('time_steps')} and {1.0 / f.period_s:.0f} Hz: more than a small "
            "board computes in time"
        ),
        {S.LATE_CYCLES: 0.9, S.STOP_START_JERK: 0.5},
        (
            down("batch_size", 1000),
            down("time_steps"),
            down("controller_server.controller_frequency"),
        ),
        f"{PAGE}; navigation2#5956",
        MPPI,
        is_certain=False,
    ),
    Rule(
        "mppi-visualises",
        lambda f: f.controller("visualize") is True,
        lambda f: "visualize is on: MPPI publishes its samples in every cycle, which takes time",
        {S.LATE_CYCLES: 0.6, S.STOP_START_JERK: 0.3, S.WOBBLE_STRAIGHT: 0.15},
        (put("visualize", False),),
        PAGE,
        MPPI,
        is_certain=False,
    ),
    Rule(
        "mppi-short-plan",
        lambda f: (
            f.is_whole and 0.0 < f.number("controller.prune_distance", 1.5) < 0.9 * horizon_m(f)
        ),
        lambda f: (
            f"prune_distance is {f.controller('prune_distance')} m, less than the "
            f"{horizon_m(f):.1f} m that samples reach at full speed: the samples go on beyond the "
            "end of the pruned path"
        ),
        {S.TOO_SLOW: 0.7, S.STALL_BEFORE_GOAL: 0.3, S.STOP_START_JERK: 0.3},
        (up("prune_distance", horizon_m),),
        PAGE,
        MPPI,
    ),
    Rule(
        "mppi-hot-mean",
        lambda f: f.number("controller.temperature", 0.3) > 0.5,
        lambda f: (
            f"temperature is {f.controller('temperature')}: bad samples also count in the "
            "weighted mean, so the command is slow"
        ),
        {S.TOO_SLOW: 0.7, S.STALL_BEFORE_GOAL: 0.6, S.CORNER_CUTTING: 0.3},
        (down("temperature", 0.3),),
        PAGE,
        MPPI,
    ),
    Rule(
        "mppi-cold-mean",
        lambda f: f.number("controller.temperature", 0.3) < 0.12,
        lambda f: (
            f"temperature is {f.controller('temperature')}: the best sample alone makes the "
            "command, which is noisy"
        ),
        {S.WOBBLE_STRAIGHT: 0.6, S.STOP_START_JERK: 0.6},
        (up("temperature", 0.3),),
        PAGE,
        MPPI,
    ),
    Rule(
        "mppi-few-samples",
        lambda f: f.number("controller.batch_size", 1000) < 500,
        lambda f: (
            f"batch_size is {f.controller('batch_size')}: the weighted mean of so few "
            "samples, the command, is noisy"
        ),
        {S.WOBBLE_STRAIGHT: 0.7, S.STOP_START_JERK: 0.4, S.DOOR_STOP: 0.3, S.COLLISION: 0.3},
        (up("batch_size", 1000),),
        PAGE,
        MPPI,
    ),
    Rule(
        "mppi-horizon-below-braking",
        lambda f: (
            braking_m(f, f.number("controller.ax_min", -3.0)) > horizon_m(f) or horizon_s(f) < 1.0
        ),
        lambda f: (
            f"the horizon (time_steps times model_dt) is {horizon_s(f):.1f} s: it ends "
            "before the robot could stop or turn"
        ),
        {S.COLLISION: 0.6, S.GOAL_OVERSHOOT: 0.5, S.CORNER_CUTTING: 0.2, S.STALL_BEFORE_GOAL: 0.3},
        (up("time_steps"), down("vx_max")),
        PAGE,
        MPPI,
    ),
    Rule(
        "mppi-turn-rate-not-driven",
        lambda f: (
            f.controller("motion_model") == "Omni"
            and (f.axis("velocity_smoother.max_velocity", 2) == 0.0)
        ),
        lambda f: (
            "MPPI commands turns, but the velocity_smoother's max_velocity for turns is 0 rad/s"
        ),
        {S.WOBBLE_STRAIGHT: 1.0, S.SPINS: 0.3},
        (put("wz_max", 0.0), down("wz_std", 0.0)),
        "navigation2#5021",
        MPPI,
    ),
    Rule(
        "mppi-no-plugin-for-speed-limits",
        lambda f: (
            f.release is Release.HUMBLE and f.is_whole and not f.has_node("velocity_smoother")
        ),
        lambda f: (
            "Humble's MPPI has no limits of acceleration, and the file has no velocity "
            "smoother after it"
        ),
        {S.STOP_START_JERK: 0.9, S.GOAL_OVERSHOOT: 0.6},
        (add("velocity_smoother"), upgrade("jazzy or newer, which reads ax_max and az_max")),
        f"{CODE} of humble",
        MPPI,
    ),
    Rule(
        "mppi-lags-unmodelled",
        lambda f: (
            f.robot is not None
            and f.robot.drive.response_time_constant_s > 0.3
            and f.number("controller.model_delay_vx") == 0.0
        ),
        lambda f: "the base answers commands late, and MPPI's samples do not include this delay",
        {S.WOBBLE_STRAIGHT: 0.5, S.GOAL_OVERSHOOT: 0.5},
        (up("model_delay_vx"), outside("lag"), upgrade("lyrical or newer, which models the delay")),
        "navigation2#6154",
        MPPI,
    ),
)
