"""Efficiency of a trial: time, driven length, energy, and scores of published benchmarks."""

from __future__ import annotations

from typing import Any

import numpy as np

from drake_navbench.analysis.metrics.body import Body, body_of
from drake_navbench.analysis.metrics.definition import Undefined, metric
from drake_navbench.analysis.metrics.mission import (
    first_plans_length_m,
    goals,
    reached_every_goal,
    ride_s,
    straight_way_left_m,
    straight_way_m,
    straight_ways_to_goals,
)
from drake_navbench.analysis.metrics.signals import (
    Motion,
    column,
    driven_length,
    hold_durations,
    motion,
    positions,
    require,
    speed,
    time_mean,
    times,
)
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome

STOPPED_BELOW_MPS = 0.01
STOPPED_BELOW_RADPS = 0.02
BARN_REFERENCE_SPEED_MPS = 2.0
BARN_CLOCK_STARTS_AFTER_M = 0.1
BARN_FASTEST = 2.0
BARN_SLOWEST = 8.0
GRAVITY_MPS2 = 9.81
AIR_DENSITY_KGPM3 = 1.2


@metric(unit="s", better="lower", title="Time to goal", relevant=0.1)
def time_to_goal_s(log: TrialLog) -> float:
    """Time from the start of the task until the goal was reached; successful trials only.

    Formula: end - start.
    """
    _require_success(log)
    return duration_s(log)


@metric(unit="s", better="neither", title="Duration")
def duration_s(log: TrialLog) -> float:
    """Time from the start of the task to its end, whatever the outcome.

    Formula: end - start.
    """
    return log.end_time_s - float(log.info["start_time_s"])


@metric(unit="m", better="neither", title="Driven length", relevant=0.02)
def driven_length_m(log: TrialLog) -> float:
    """Length of the true path of the reference point.

    Formula: sum |dp| over the samples of the log.
    """
    return driven_length(log)


@metric(unit="", better="higher", title="Straightness")
def path_efficiency_ratio(log: TrialLog) -> float:
    """Straightness of the driven path: 1 on a straight line, 2/pi on half a circle.

    Formula: |p(end) - p(start)| / driven length; with waypoints the straight distances of all legs
    are added.
    """
    length_m = driven_length(log)
    if length_m == 0.0:
        raise Undefined("the robot did not move")
    return straight_way_m(log) / length_m


@metric(unit="", better="lower", title="Share of the way left")
def goal_traversal_ratio(log: TrialLog) -> float:
    """Share of the straight way to the goal that remained at the end.

    Formula: |p(end) - goal| / |p(start) - goal|; with waypoints straight ways through all goals
    left.
    Source: SocNavBench.
    """
    require(log, "goal")
    whole_m = sum(path_length(part) for part in straight_ways_to_goals(log))
    if whole_m == 0.0:
        raise Undefined("the robot started on the goal")
    return straight_way_left_m(log) / whole_m


@metric(unit="", better="higher", title="Success weighted by path length")
def spl(log: TrialLog) -> float:
    """Success weighted by path length; 0 for a trial that failed.

    Formula: success L*/max(L, L*), L the driven length, L* the length of the first plan. A missed
    waypoint is no success. A trial that stops short of the goal, within its tolerance, scores 1.
    Source: Anderson et al. 2018.
    """
    if not reached_every_goal(log):
        return 0.0
    reference_m = first_plans_length_m(log)
    return reference_m / max(driven_length(log), reference_m)


@metric(unit="", better="higher", title="BARN score")
def barn_score(log: TrialLog) -> float:
    """Score of the BARN challenge; 0 for a trial that failed, at most 0.5.

    Formula: success OT / clip(AT, 2 OT, 8 OT), OT = L*/(2 m/s), success and L* as in spl, AT the
    time from the first 0.1 m of motion to the goal. In BARN's worlds L* is the length of the
    reference path (the first plan is up to a fifth longer), and the first arrival within 1 m of the
    goal counts. A robot limited to 0.5 m/s scores about 0.25.
    Source: The BARN Challenge, rule since 2024-02.
    """
    arrival_s = _arrival_time_s(log)
    if arrival_s is None:
        return 0.0
    reference_m = _suite(log).get("reference_length_m") or first_plans_length_m(log)
    path = positions(log)
    moved = np.hypot(*(path - path[0]).T) >= BARN_CLOCK_STARTS_AFTER_M
    if not moved.any():
        raise Undefined(f"the robot moved less than {BARN_CLOCK_STARTS_AFTER_M} m")
    actual_s = arrival_s - times(log)[moved.argmax()]
    optimal_s = reference_m / BARN_REFERENCE_SPEED_MPS
    return optimal_s / np.clip(actual_s, BARN_FASTEST * optimal_s, BARN_SLOWEST * optimal_s)


def _suite(log: TrialLog) -> dict[str, Any]:
    """Returns the `suite` block of the trial's scenario, {} where it belongs to no suite."""
    return log.info["scenario"].get("suite") or {}


def _arrival_time_s(log: TrialLog) -> float | None:
    """Returns the time of arrival, s, or None where the robot did not arrive.

    In a suite with an arrival radius the first sample within it is the arrival; else the outcome
    decides.
    """
    radius_m = _suite(log).get("arrival_radius_m")
    if radius_m is None:
        return log.end_time_s if reached_every_goal(log) else None
    near = np.hypot(*(positions(log) - goals(log)[-1, :2]).T) <= radius_m
    return float(times(log)[near.argmax()]) if near.any() else None


@metric(unit="m/s", better="higher", title="Mean speed")
def mean_speed_mps(log: TrialLog) -> float:
    """Mean over time of the true speed, whatever its direction.

    Formula: integral |v| dt / duration.
    """
    return time_mean(times(log), speed(log))


@metric(unit="s", better="lower", title="Time at standstill")
def stopped_time_s(log: TrialLog) -> float:
    """Time during which the robot neither drove nor turned.

    Formula: time with |v| < 0.01 m/s and |w| < 0.02 rad/s.
    Source: HuNavSim, after SEAN 2.0.
    """
    stopped = (speed(log) < STOPPED_BELOW_MPS) & (
        np.abs(column(log, "w_radps")) < STOPPED_BELOW_RADPS
    )
    return float(hold_durations(times(log))[stopped].sum())


@metric(unit="s", better="lower", title="Time at lifts")
def lift_time_s(log: TrialLog) -> float:
    """Time that the robot waited for lifts and rode in them, in missions over several floors.

    Formula: sum over the rides of the time from request to arrival or giving up.
    """
    if "mission" not in log.info:
        raise Undefined("the task is on one floor")
    return sum(ride_s(log, leg) for leg in log.info["legs"])


@metric(unit="J", better="lower", title="Mechanical energy")
def mechanical_energy_j(log: TrialLog) -> float:
    """Work of the drive against inertia, rolling resistance and air; braking gives nothing back.

    Formula: integral max(0, m a v + I dw/dt w + c m g |v| + 0.5 rho A |v|^3) dt with m, c and A of
    the robot file (`mass_kg`, `rolling_resistance_ratio`, `drag_area_m2`), I of a uniform box
    around the outline or of a disc, rho = 1.2 kg/m^3; with vy the same terms sideways. Losses of
    motors and mecanum wheels are left out.
    """
    signal = motion(log)
    return float(np.trapezoid(spent_power_w(signal, body_of(log)), dx=signal.period_s))


def spent_power_w(signal: Motion, body: Body) -> Array:
    """Returns the drive's power during a motion, (N,) W, at least 0: braking gives nothing back."""
    power_w = drive_power_w(
        signal.smooth_v_mps,
        signal.acceleration_mps2,
        signal.smooth_w_radps,
        signal.angular_acceleration_radps2,
        body=body,
        vy_mps=signal.smooth_vy_mps,
        lateral_acceleration_mps2=signal.lateral_acceleration_mps2,
    )
    return np.maximum(power_w, 0.0)


def drive_power_w(
    v_mps: Array,
    acceleration_mps2: Array,
    w_radps: Array,
    angular_acceleration_radps2: Array,
    *,
    body: Body,
    vy_mps: Array,
    lateral_acceleration_mps2: Array,
) -> Array:
    """Returns the power that drives a robot with its load on a flat floor, (N,) W."""
    speed_mps = np.hypot(v_mps, vy_mps)
    translation = body.mass_kg * (acceleration_mps2 * v_mps + lateral_acceleration_mps2 * vy_mps)
    inertia_kgm2 = body.mass_kg * body.gyration_squared_m2
    rotation = inertia_kgm2 * angular_acceleration_radps2 * w_radps
    rolling = body.rolling_resistance_ratio * body.mass_kg * GRAVITY_MPS2 * speed_mps
    drag = 0.5 * AIR_DENSITY_KGPM3 * body.drag_area_m2 * speed_mps**3
    return translation + rotation + rolling + drag


def _require_success(log: TrialLog) -> None:
    if log.outcome is not Outcome.SUCCEEDED:
        raise Undefined(f"the trial did not reach its goal ({log.outcome})")
