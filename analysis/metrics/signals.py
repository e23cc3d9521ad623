"""Signals that several metrics share, derived from a log with its true sample times."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_navbench.analysis.metrics.definition import Undefined
from drake_navbench.analysis.metrics.parabolas import parabola_derivatives
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.logs.log import TrialLog

# Derivatives come from a parabola fitted over this time, not from neighbouring samples, so that
# they do not depend on the sampling period. It is six control periods at 20 Hz.
DERIVATIVE_WINDOW_S = 0.3
MIN_WINDOW_SAMPLES = 5


@dataclass(frozen=True, eq=False)
class Motion:
    """True motion on an even grid.

    period_s: period of the grid. v_mps, w_radps, vy_mps: (N,) as logged; vy is 0 where the robot
    cannot move sideways. Fitted over DERIVATIVE_WINDOW_S, (N,) each: smooth_v_mps,
    acceleration_mps2 and jerk_mps3 of v; smooth_w_radps, angular_acceleration_radps2 and
    angular_jerk_radps3 of w; smooth_vy_mps, lateral_acceleration_mps2 and lateral_jerk_mps3 of vy.
    They are derivatives of the velocity's components; the terms from the turning of the base frame
    (v w, vy w) are not included.
    """

    period_s: float
    v_mps: Array
    w_radps: Array
    smooth_v_mps: Array
    acceleration_mps2: Array
    jerk_mps3: Array
    smooth_w_radps: Array
    angular_acceleration_radps2: Array
    angular_jerk_radps3: Array
    vy_mps: Array
    smooth_vy_mps: Array
    lateral_acceleration_mps2: Array
    lateral_jerk_mps3: Array

    @property
    def speed_mps(self) -> Array:
        """(N,) speed over the floor, forwards or backwards or sideways."""
        return np.hypot(self.v_mps, self.vy_mps)


def times(log: TrialLog) -> Array:
    """Returns the sample times, (N,) s."""
    return column(log, "time_s")


def require(log: TrialLog, part: str) -> None:
    """Raises Undefined where a recording lacks a part of the log."""
    if part in log.missing:
        raise Undefined(log.missing[part])


def column(log: TrialLog, name: str) -> Array:
    """Returns a column of the samples as floats.

    Raises Undefined where there are no samples, or the recording lacks the column.
    """
    require(log, name)
    if len(log.samples) == 0:
        raise Undefined("the log has no samples")
    return log.samples[name].to_numpy(dtype=float)


def lateral_velocity(log: TrialLog) -> Array:
    """Returns the true velocities to the left, (N,) m/s; zeros without motion sideways."""
    if "vy_mps" not in log.samples.columns:
        return np.zeros(len(log.samples))
    return log.samples["vy_mps"].to_numpy(dtype=float)


def speed(log: TrialLog) -> Array:
    """Returns the true speed over the floor, whatever its direction, (N,) m/s."""
    return np.hypot(column(log, "v_mps"), lateral_velocity(log))


def positions(log: TrialLog) -> Array:
    """Returns the true positions, (N, 2) m."""
    return np.column_stack([column(log, "x_m"), column(log, "y_m")])


def is_carried(log: TrialLog) -> NDArray[np.bool_]:
    """Returns flags (N - 1,): a lift carried the robot to another floor between two samples."""
    if "floor" not in log.samples.columns:
        return np.zeros(max(len(log.samples) - 1, 0), dtype=bool)
    return np.diff(column(log, "floor")) != 0.0


def stretches(log: TrialLog) -> list[Array]:
    """Returns the true positions (N, 2) m, in one part for each stay on a floor, in order."""
    path = positions(log)
    return np.split(path, np.flatnonzero(is_carried(log)) + 1)


def poses_at(log: TrialLog, moments_s: ArrayLike) -> Array:
    """Returns the true poses at some times, (M, 3): x m, y m, yaw rad, linear between samples.

    Between two samples in which a lift carries the robot, the pose is that after the ride.
    """
    names, time_s = ("x_m", "y_m", "yaw_rad"), times(log)
    moments = np.asarray(moments_s, dtype=float)
    found = np.column_stack([np.interp(moments, time_s, column(log, name)) for name in names])
    carried = is_carried(log)
    if carried.any():
        after = np.searchsorted(time_s, moments, side="left").clip(1, len(time_s) - 1)
        is_within = carried[after - 1] & (moments > time_s[after - 1])
        for axis, name in enumerate(names):
            found[is_within, axis] = column(log, name)[after[is_within]]
    return found


def driven_length(log: TrialLog) -> float:
    """Returns the driven length, m, without the rides in lifts."""
    return sum(path_length(part) for part in stretches(log))


def hold_durations(time_s: Array) -> Array:
    """Returns the time until the next sample, (N,) s; 0 for the last sample."""
    return np.append(np.diff(time_s), 0.0)


def time_mean(time_s: Array, values: Array) -> float:
    """Returns the mean over time of a signal that is linear between its samples."""
    if len(time_s) == 1:
        return float(values[0])
    return float(np.trapezoid(values, time_s) / (time_s[-1] - time_s[0]))


# Several metrics measure one log in turn, and a log does not change: the last result is kept.
@lru_cache(maxsize=1)
def motion(log: TrialLog) -> Motion:
    """Returns velocities and their derivatives on an even grid of the log's usual period.

    The grid ends with the trial: in a sample behind its end the server's stop already brakes.
    Raises Undefined where the trial is too short for a fit.
    """
    time_s = times(log)
    if len(time_s) < MIN_WINDOW_SAMPLES:
        raise Undefined(f"{len(time_s)} samples are too few for derivatives")
    period_s = float(np.median(np.diff(time_s)))
    end_s = min(time_s[-1], log.end_time_s)
    # The small addition: the end of the trial may lie between two ticks of the recorder's clock.
    count = int(np.floor((end_s - time_s[0]) / period_s + 1e-6)) + 1
    if count < MIN_WINDOW_SAMPLES:
        raise Undefined(f"{count} samples are too few for derivatives")
    grid = time_s[0] + period_s * np.arange(count)
    v = np.interp(grid, time_s, column(log, "v_mps"))
    w = np.interp(grid, time_s, column(log, "w_radps"))
    vy = np.interp(grid, time_s, lateral_velocity(log))
    return Motion(
        period_s,
        v,
        w,
        *fitted_derivatives(v, period_s),
        *fitted_derivatives(w, period_s),
        vy,
        *fitted_derivatives(vy, period_s),
    )


def fitted_derivatives(values: Array, period_s: float) -> tuple[Array, Array, Array]:
    """Returns value, first and second derivative of parabolas fitted over DERIVATIVE_WINDOW_S.

    values: (N,) on an even grid, N >= 5. Exact for parabolas.
    """
    width = max(round(DERIVATIVE_WINDOW_S / period_s), MIN_WINDOW_SAMPLES)
    width = min(width, len(values))
    width -= 1 - width % 2
    return parabola_derivatives(values, width, period_s)


def rms(values: Array) -> float:
    """Returns the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def sign_changes(values: Array, *, dead_band: float) -> int:
    """Returns the number of a signal's sign changes, without values of |value| <= dead_band."""
    signs = np.sign(values[np.abs(values) > dead_band])
    return int(np.count_nonzero(np.diff(signs)))
