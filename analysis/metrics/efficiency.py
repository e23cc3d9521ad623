"""How well the task was done: time, length, energy, scores."""

from __future__ import annotations

import numpy as np

from drake_navbench.analysis.metrics.definition import Undefined, metric
from drake_navbench.analysis.metrics.mission import (
    first_plans_length_m,
    goals,
    positions_between_legs,
    present_leg,
    reached_every_goal,
)
from drake_navbench.analysis.metrics.signals import (
    Array,
    column,
    driven_length,
    hold_durations,
    motion,
    positions,
    speed,
    time_mean,
    times,
)
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.log import Outcome, TrialLog

STOPPED_BELOW_MPS = 0.01
STOPPED_BELOW_RADPS = 0.02
BARN_REFERENCE_SPEED_MPS = 2.0
BARN_CLOCK_STARTS_AFTER_M = 0.1
BARN_FASTEST = 2.0
BARN_SLOWEST = 8.0
# For a robot file without a mass: a powered chair of about 100 kg with a person of 80 kg.
ASSUMED_MASS_KG = 180.0
# Wheels with tyres on a hard floor.
ROLLING_RESISTANCE_RATIO = 0.015
GRAVITY_MPS2 = 9.81
# Frontal area 0.8 m^2, drag coefficient 1, air of 1.2 kg/m^3.
DRAG_AREA_M2 = 0.8
AIR_DENSITY_KGPM3 = 1.2
# Of a uniform box of the wheelchair's 1.1 m x 0.6 m: (1.1^2 + 0.6^2) / 12.
YAW_GYRATION_RADIUS_SQUARED_M2 = 0.131


@metric(unit="s", better="lower")
def time_to_goal_s(log: TrialLog) -> float:
    """Time from the start of the task until the goal was reached; successful trials only.

    Formula: end - start. A trial that failed has no time to goal, however early it gave up.
    """
    _require_success(log)
    return _duration_s(log)


@metric(unit="s", better="neither")
def duration_s(log: TrialLog) -> float:
    """Time from the start of the task to its end, whatever the outcome.

    Formula: end - start.
    """
    return _duration_s(log)


@metric(unit="m", better="neither")
def driven_length_m(log: TrialLog) -> float:
    """Length of the true path of the reference point.

    Formula: sum |dp| over the samples of the log.
    """
    return driven_length(log)


@metric(unit="", better="higher")
def path_efficiency_ratio(log: TrialLog) -> float:
    """How straight the robot drove: 1 on a straight line, 2/pi on half a circle.

    Formula: |p(end) - p(start)| / driven length; with waypoints the sum of the straight distances
    from where each leg began to where it ended / driven length.
    """
    length_m = driven_length(log)
    if length_m == 0.0:
        raise Undefined("the robot did not move")
    return path_length(positions_between_legs(log)) / length_m


@metric(unit="", better="lower")
def goal_traversal_ratio(log: TrialLog) -> float:
    """Share of the straight way to the goal that was left at the end.

    Formula: |p(end) - goal| / |p(start) - goal|; with waypoints the straight way from the end
    through all goals from that of the present leg on / the straight way from the start through all.
    Source: SocNavBench.
    """
    path, to_reach = positions(log), goals(log)[:, :2]
    whole_m = path_length(np.vstack([path[:1], to_reach]))
    if whole_m == 0.0:
        raise Undefined("the robot started on the goal")
    return path_length(np.vstack([path[-1:], to_reach[present_leg(log) :]])) / whole_m


@metric(unit="", better="higher")
def spl(log: TrialLog) -> float:
    """Success weighted by path length; 0 for a trial that failed.

    Formula: success L*/max(L, L*), L the driven length, L* that of the first plan, whatever was
    planned later; with waypoints the sum over the legs of the length of each one's first plan, and
    a missed waypoint is no success. The goal tolerance lets a good trial drive less than L*; it
    still scores 1.
    Source: Anderson et al., "On Evaluation of Embodied Navigation Agents", 2018.
    """
    if not reached_every_goal(log):
        return 0.0
    reference_m = first_plans_length_m(log)
    return reference_m / max(driven_length(log), reference_m)


@metric(unit="", better="higher")
def barn_score(log: TrialLog) -> float:
    """Score of the BARN challenge; 0 for a trial that failed, at most 0.5.

    Formula: success OT / clip(AT, 2 OT, 8 OT), OT = L*/(2 m/s) with success and L* as in spl, AT
    the time from the first 0.1 m of motion to the goal. Until 2024 the lower limit was 4 OT. BARN
    itself takes the length of a reference path that comes with the world; it keeps farther off the
    obstacles than a plan and is up to a fifth longer, and the score with it. A robot limited to
    0.5 m/s scores 0.25 and what the goal tolerance, the first 0.1 m and cut corners save.
    Source: The BARN Challenge (Perille et al. 2020; Xiao et al. 2022), rule since 2024-02.
    """
    if not reached_every_goal(log):
        return 0.0
    reference_m = first_plans_length_m(log)
    path = positions(log)
    moved = np.hypot(*(path - path[0]).T) >= BARN_CLOCK_STARTS_AFTER_M
    if not moved.any():
        raise Undefined(f"the robot moved less than {BARN_CLOCK_STARTS_AFTER_M} m")
    actual_s = log.end_time_s - times(log)[moved.argmax()]
    optimal_s = reference_m / BARN_REFERENCE_SPEED_MPS
    return optimal_s / np.clip(actual_s, BARN_FASTEST * optimal_s, BARN_SLOWEST * optimal_s)


@metric(unit="m/s", better="higher")
def mean_speed_mps(log: TrialLog) -> float:
    """Mean over time of the true speed, whatever its direction.

    Formula: integral |v| dt / duration.
    """
    return time_mean(times(log), speed(log))


@metric(unit="s", better="lower")
def stopped_time_s(log: TrialLog) -> float:
    """Time during which the robot neither drove nor turned.

    Formula: time with |v| < 0.01 m/s and |w| < 0.02 rad/s.
    Source: HuNavSim, after SEAN 2.0.
    """
    stopped = (speed(log) < STOPPED_BELOW_MPS) & (
        np.abs(column(log, "w_radps")) < STOPPED_BELOW_RADPS
    )
    return float(hold_durations(times(log))[stopped].sum())


@metric(unit="J", better="lower")
def mechanical_energy_j(log: TrialLog) -> float:
    """Work of the drive against inertia, rolling resistance and air; braking gives nothing back.

    Formula: integral max(0, m a v + I dw/dt w + c m g |v| + 0.5 rho A |v|^3) dt with m of the robot
    file (`mass_kg`; 180 kg where it has none), I = m 0.131 m^2, c = 0.015, rho A = 0.96 kg/m. A
    robot that moves sideways has the same terms in vy, and |v| is its speed over the floor; that
    mecanum wheels roll harder is not in it. Losses of the motors are not in it.
    """
    signal = motion(log)
    power_w = drive_power_w(
        signal.smooth_v_mps,
        signal.acceleration_mps2,
        signal.smooth_w_radps,
        signal.angular_acceleration_radps2,
        mass_kg=robot_mass_kg(log),
        vy_mps=signal.smooth_vy_mps,
        lateral_acceleration_mps2=signal.lateral_acceleration_mps2,
    )
    return float(np.trapezoid(np.maximum(power_w, 0.0), dx=signal.period_s))


def robot_mass_kg(log: TrialLog) -> float:
    """Returns the mass of the robot file with its load; ASSUMED_MASS_KG where it has none."""
    return log.info["robot"].get("mass_kg") or ASSUMED_MASS_KG


def drive_power_w(
    v_mps: Array,
    acceleration_mps2: Array,
    w_radps: Array,
    angular_acceleration_radps2: Array,
    *,
    mass_kg: float,
    vy_mps: Array,
    lateral_acceleration_mps2: Array,
) -> Array:
    """Returns the power that drives a wheelchair with its occupant on a flat floor, (N,) W."""
    speed_mps = np.hypot(v_mps, vy_mps)
    translation = mass_kg * acceleration_mps2 * v_mps + mass_kg * lateral_acceleration_mps2 * vy_mps
    inertia_kgm2 = mass_kg * YAW_GYRATION_RADIUS_SQUARED_M2
    rotation = inertia_kgm2 * angular_acceleration_radps2 * w_radps
    rolling = ROLLING_RESISTANCE_RATIO * mass_kg * GRAVITY_MPS2 * speed_mps
    drag = 0.5 * AIR_DENSITY_KGPM3 * DRAG_AREA_M2 * speed_mps**3
    return translation + rotation + rolling + drag


def _duration_s(log: TrialLog) -> float:
    return log.end_time_s - float(log.info["start_time_s"])


def _require_success(log: TrialLog) -> None:
    if log.outcome is not Outcome.SUCCEEDED:
        raise Undefined(f"the trial did not reach its goal ({log.outcome})")
