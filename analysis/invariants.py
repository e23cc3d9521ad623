"""Invariants of a trial's log: conditions that hold in every trial, whatever the controller does.

A violated invariant means that the robot exceeded the limits in its file, or that the log does not
show what happened. It is a warning, never an error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.analysis.metrics.body import gyration_squared_m2, outline_of
from drake_navbench.analysis.metrics.movers import movers_of
from drake_navbench.analysis.metrics.signals import is_carried, speed
from drake_navbench.analysis.numbers import counted
from drake_navbench.kernels.arrays import Array
from drake_navbench.logs.log import TrialLog

Flags = NDArray[np.bool_]

# The end of a task takes effect with the next step and the next sample.
END_GRACE_S = 0.05
# A robot slower than this is at rest.
REST_MPS, REST_RADPS = 0.01, 0.02
# Larger clearances are not measured, and logged as infinite.
CLEARANCE_REACH_M = 5.0
CLEARANCE_PERIOD_S = 0.05
# Between two rows the robot may be a little faster than at both rows.
CLEARANCE_TOLERANCE_M = 1e-3
SLACK = 1.01
ROUNDING = 1e-6


class Violation(NamedTuple):
    """An invariant that does not hold: the number of such rows, and the first one's time, s."""

    kind: str
    row_count: int
    first_s: float


def violations_of(log: TrialLog) -> list[Violation]:
    """Returns the violated invariants of a log, at most one entry for each, in fixed order.

    NaN violates the invariant of its column. A trial without samples violates none. A recording is
    checked only for invariants that also hold without a simulation: a real robot rolls on after its
    goal, and its velocities are measured.
    """
    time_s = _column(log, "time_s")
    if len(time_s) == 0:
        return []
    kinds = _OF_RECORDINGS - _untold(log) if log.is_recording else set(INVARIANTS)
    with np.errstate(invalid="ignore"):
        flags = {kind: check(log) for kind, check in INVARIANTS.items() if kind in kinds}
    return [
        Violation(kind, int(rows.sum()), float(time_s[rows.argmax()]))
        for kind, rows in flags.items()
        if rows.any()
    ]


def warnings_of(trials: Iterable[tuple[str, Sequence[Violation]]]) -> list[str]:
    """Returns one line for each violated invariant: the number of rows and trials, and the first.

    trials: the violations of each trial by its name.
    """
    found: dict[str, list[tuple[str, Violation]]] = {}
    for name, violations in trials:
        for violation in violations:
            found.setdefault(violation.kind, []).append((name, violation))
    lines = []
    for kind, places in found.items():
        rows = sum(violation.row_count for _, violation in places)
        name, first = places[0]
        lines.append(
            f"{kind}: {counted(rows, 'row')} in {counted(len(places), 'trial')}; "
            f"first in {name}, at {first.first_s:.2f} s"
        )
    return lines


def _time_stands_still(log: TrialLog) -> Flags:
    """Flags rows that are not later than the one before."""
    return _from_second(~(np.diff(_column(log, "time_s")) > 0.0))


def _command_beyond_the_drive(log: TrialLog) -> Flags:
    """Flags rows with a command that exceeds the drive's limits."""
    limits = _Limits.of(log)
    v, w = _column(log, "command_v_mps"), _column(log, "command_w_radps")
    is_within = (
        (v <= limits.forward_mps + ROUNDING)
        & (v >= limits.backward_mps - ROUNDING)
        & (np.abs(w) <= limits.turning_radps + ROUNDING)
        & (np.abs(_lateral(log, "command_vy_mps")) <= limits.sideways_mps + ROUNDING)
    )
    return ~is_within


def _motion_after_the_end(log: TrialLog) -> Flags:
    """Flags rows after the end of the trial in which the robot moves."""
    is_late = ~(_column(log, "time_s") <= log.end_time_s + END_GRACE_S)
    v, w = speed(log), np.abs(_column(log, "w_radps"))
    return is_late & ~((v <= REST_MPS) & (w <= REST_RADPS))


def _clearance_jumps(log: TrialLog) -> Flags:
    """Flags rows whose clearance differs from the last sample's by more than the outline moved.

    A clearance changes at most as fast as the fastest point of the outline moves, |v| + |w| times
    its radius, plus the fastest point of any moving obstacle or person.
    """
    time_s = _column(log, "time_s")
    radius_m = float(np.hypot(*outline_of(log).T).max())
    v, w = speed(log), np.abs(_column(log, "w_radps"))
    speed_mps = np.maximum(v[1:], v[:-1]) + radius_m * np.maximum(w[1:], w[:-1])
    speed_mps += movers_of(log).top_speed_mps
    moved_m = np.concatenate([[0.0], np.cumsum(speed_mps * np.diff(time_s))])
    # A clearance holds for a period: the last row's was measured up to one period before that row.
    moved_before_m = np.interp(time_s - CLEARANCE_PERIOD_S, time_s, moved_m)
    allowed_m = moved_m[1:] - moved_before_m[:-1] + CLEARANCE_TOLERANCE_M
    clearance_m = np.minimum(_column(log, "clearance_m"), CLEARANCE_REACH_M)
    jumps = ~(np.abs(np.diff(clearance_m)) <= allowed_m)
    just_there = _somebody_came_or_went(log, time_s)[1:] | _just_carried(log)
    return _from_second(jumps & ~just_there)


def _somebody_came_or_went(log: TrialLog, time_s: Array) -> Flags:
    """Flags rows at which a person in a recording may have appeared or disappeared."""
    flags: Flags = np.zeros(len(time_s), dtype=bool)
    if log.people is None:
        return flags
    away = np.isnan(log.people.poses[..., 0])
    for row in np.flatnonzero((away[1:] != away[:-1]).any(axis=1)):
        first_s, last_s = log.people.time_s[row : row + 2]
        # A row's clearance was measured at most two periods before the row.
        flags |= (time_s >= first_s - ROUNDING) & (time_s <= last_s + 2.0 * CLEARANCE_PERIOD_S)
    return flags


def _just_carried(log: TrialLog) -> Flags:
    """Flags the steps (N - 1,) in which the clearance may change from one floor's to another's."""
    time_s = _column(log, "time_s")[1:]
    arrivals_s = time_s[is_carried(log)]
    since_s = time_s - arrivals_s[:, None]
    is_just = (since_s >= 0.0) & (since_s <= 2.0 * CLEARANCE_PERIOD_S)
    return np.asarray(is_just.any(axis=0))


def _energy_from_nowhere(log: TrialLog) -> Flags:
    """Flags rows with more kinetic energy, per kg of the robot, than the drive can have given.

    The energy of the velocities, and that of the mean velocities since the last row, may not exceed
    the energy at the top speeds. Between rows it may rise by at most the work of the largest
    accelerations.
    """
    limits = _Limits.of(log)
    step_s = np.diff(_column(log, "time_s"))
    v, w = speed(log), np.abs(_column(log, "w_radps"))
    way_x, way_y, turn = (np.diff(_column(log, name)) for name in ("x_m", "y_m", "yaw_rad"))
    gyration = gyration_squared_m2(log)
    energy = _kinetic_energy(v, w, gyration)
    way_energy = _kinetic_energy(np.hypot(way_x, way_y), turn, gyration)
    top = SLACK * _kinetic_energy(
        math.hypot(max(limits.forward_mps, -limits.backward_mps), limits.sideways_mps),
        limits.turning_radps,
        gyration,
    )
    is_fast = ~(way_energy <= top * step_s**2 + ROUNDING**2) & ~is_carried(log)
    if limits.has_accelerations:
        power = limits.acceleration_mps2 * np.maximum(v[1:], v[:-1])
        turning_power = limits.angular_acceleration_radps2 * np.maximum(w[1:], w[:-1])
        power += gyration * turning_power
        is_fast |= ~(np.diff(energy) <= SLACK * power * step_s + ROUNDING)
    return np.asarray(~(energy <= top) | _from_second(is_fast))


INVARIANTS: Mapping[str, Callable[[TrialLog], Flags]] = {
    "time stands still": _time_stands_still,
    "command beyond the limits of the drive": _command_beyond_the_drive,
    "motion after the end": _motion_after_the_end,
    "clearance jumps": _clearance_jumps,
    "kinetic energy from nowhere": _energy_from_nowhere,
}


_OF_RECORDINGS = {"time stands still", "command beyond the limits of the drive"}


def _untold(log: TrialLog) -> set[str]:
    """Returns the invariants that need signals which a recording lacks."""
    has_commands = "command_v_mps" not in log.missing
    return set() if has_commands else {"command beyond the limits of the drive"}


class _Limits(NamedTuple):
    """Limits of the robot's drive in the base frame; infinite where the log tells no limit."""

    forward_mps: float
    backward_mps: float
    turning_radps: float
    sideways_mps: float
    acceleration_mps2: float
    angular_acceleration_radps2: float

    @classmethod
    def of(cls, log: TrialLog) -> _Limits:
        drive = log.info["robot"]["drive"]
        top_mps = drive["max_linear_velocity_mps"]
        sideways_mps = drive.get("max_lateral_velocity_mps", 0.0)
        sideways_mps2 = 0.0
        if sideways_mps > 0.0:
            sideways_mps2 = drive.get("max_lateral_acceleration_mps2") or math.inf
        return cls(
            top_mps,
            drive.get("min_linear_velocity_mps", -top_mps),
            drive.get("max_angular_velocity_radps") or math.inf,
            sideways_mps,
            math.hypot(drive.get("max_linear_acceleration_mps2") or math.inf, sideways_mps2),
            drive.get("max_angular_acceleration_radps2") or math.inf,
        )

    @property
    def has_accelerations(self) -> bool:
        return math.isfinite(self.acceleration_mps2 + self.angular_acceleration_radps2)


def _kinetic_energy(v: Array | float, w: Array | float, gyration: float) -> Array | float:
    """Returns the kinetic energy per mass, J/kg, at v m/s and w rad/s.

    gyration: yaw inertia per mass, m^2."""
    return 0.5 * (np.square(v) + gyration * np.square(w))


def _column(log: TrialLog, name: str) -> Array:
    return log.samples[name].to_numpy(dtype=float)


def _lateral(log: TrialLog, name: str) -> Array:
    """Returns a column of velocities to the left; zeros where the robot cannot move sideways."""
    has_it = name in log.samples.columns
    return _column(log, name) if has_it else np.zeros(len(log.samples))


def _from_second(flags: Flags) -> Flags:
    """Returns the flags of all rows: False for the first row, then `flags`."""
    return np.concatenate([[False], flags])
