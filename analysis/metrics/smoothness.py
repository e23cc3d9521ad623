"""Smoothness of the motion and of the commands."""

from __future__ import annotations

import math

import numpy as np

from drake_navbench.analysis.metrics.definition import Undefined, metric
from drake_navbench.analysis.metrics.signals import (
    column,
    driven_length,
    is_carried,
    motion,
    rms,
    sign_changes,
)
from drake_navbench.kernels.arrays import Array
from drake_navbench.logs.log import TrialLog

SPECTRUM_CUT_HZ = 10.0
SPECTRUM_THRESHOLD_RATIO = 0.05
# The signal is padded with zeros to a length that is so many powers of two larger: a finer grid of
# frequencies.
SPECTRUM_PADDING_LEVELS = 4
# A smaller dimensionless jerk is the rounding error of a constant speed; the smoothest possible
# movement has 204.8.
NEGLIGIBLE_JERK = 1e-6
DIRECTION_DEAD_BAND_MPS = 0.01
TURN_DEAD_BAND_RADPS = 0.05


@metric(unit="m/s^3", better="lower", title="Jerk, r.m.s.", relevant=0.01)
def jerk_rms_mps3(log: TrialLog) -> float:
    """Root mean square of the jerk of the true forward velocity.

    Formula: sqrt(mean(j^2)), j = d2v/dt2 of parabolas fitted over 0.3 s, whatever the sampling
    period.
    """
    return rms(motion(log).jerk_mps3)


@metric(unit="m/s^3", better="lower", title="Jerk, largest")
def jerk_max_mps3(log: TrialLog) -> float:
    """Largest jerk of the true forward velocity.

    Formula: max |j|, j as in jerk_rms_mps3.
    """
    return np.abs(motion(log).jerk_mps3).max()


@metric(unit="rad/s^3", better="lower", title="Angular jerk, r.m.s.", relevant=0.01)
def angular_jerk_rms_radps3(log: TrialLog) -> float:
    """Root mean square of the jerk of the true yaw rate.

    Formula: sqrt(mean(j^2)), j = d2w/dt2 of parabolas fitted over 0.3 s.
    """
    return rms(motion(log).angular_jerk_radps3)


@metric(unit="", better="higher", title="Smoothness (spectral arc length)")
def spectral_arc_length(log: TrialLog) -> float:
    """SPARC of the true speed: the nearer to 0, the smoother.

    Formula: -arc length of the normalised magnitude spectrum of |v|, up to 10 Hz and to the last
    bin of at least 0.05.
    Source: Balasubramanian et al. 2015.
    """
    signal = motion(log)
    return sparc(signal.speed_mps, signal.period_s)


@metric(unit="", better="higher", title="Smoothness (log dimensionless jerk)")
def log_dimensionless_jerk(log: TrialLog) -> float:
    """LDLJ of the true speed: the larger, the smoother.

    Formula: -ln(D^3/v_peak^2 integral (d2v/dt2)^2 dt), D the duration, v the forward velocity (of a
    robot that moves sideways the speed) fitted over 0.3 s.
    Source: Balasubramanian et al. 2015.
    """
    signal = motion(log)
    v, vy = signal.smooth_v_mps, signal.smooth_vy_mps
    jerk = dimensionless_jerk(np.hypot(v, vy) if vy.any() else v, signal.period_s)
    if -jerk < NEGLIGIBLE_JERK:
        raise Undefined("the speed is constant")
    return -math.log(-jerk)


@metric(unit="m/s^2", better="lower", title="Acceleration, mean")
def acceleration_mean_mps2(log: TrialLog) -> float:
    """Mean magnitude of the true forward acceleration.

    Formula: mean |dv/dt|.
    Source: MRPB 1.0, velocity smoothness f_vs.
    """
    return np.abs(motion(log).acceleration_mps2).mean()


@metric(unit="m/s", better="lower", title="Changes of the commanded velocity")
def command_v_variation_mps(log: TrialLog) -> float:
    """Total variation of the commanded forward velocity.

    Formula: sum |dv command|.
    """
    return np.abs(np.diff(column(log, "command_v_mps"))).sum()


@metric(unit="rad/s", better="lower", title="Changes of the commanded yaw rate")
def command_w_variation_radps(log: TrialLog) -> float:
    """Total variation of the commanded yaw rate.

    Formula: sum |dw command|.
    """
    return np.abs(np.diff(column(log, "command_w_radps"))).sum()


@metric(unit="rad", better="lower", title="Total turning")
def heading_change_rad(log: TrialLog) -> float:
    """Total angle through which the robot turned, left and right both positive.

    Formula: sum |dyaw|, without the rides in lifts.
    """
    return np.abs(np.diff(column(log, "yaw_rad")))[~is_carried(log)].sum()


@metric(unit="rad/m", better="lower", title="Turning per metre")
def heading_change_per_metre_radpm(log: TrialLog) -> float:
    """Total angle through which the robot turned, per metre driven.

    Formula: sum |dyaw| / driven length.
    """
    length_m = driven_length(log)
    if length_m == 0.0:
        raise Undefined("the robot did not move")
    return heading_change_rad(log) / length_m


@metric(unit="", better="lower", title="Changes of the turning direction")
def heading_reversal_count(log: TrialLog) -> float:
    """Number of changes between turning left and turning right.

    Formula: sign changes of the true yaw rate, |w| <= 0.05 rad/s ignored.
    """
    return sign_changes(column(log, "w_radps"), dead_band=TURN_DEAD_BAND_RADPS)


@metric(unit="", better="lower", title="Changes between forwards and backwards")
def direction_reversal_count(log: TrialLog) -> float:
    """Number of changes between driving forwards and driving backwards.

    Formula: sign changes of the true velocity, |v| <= 0.01 m/s ignored.
    """
    return sign_changes(column(log, "v_mps"), dead_band=DIRECTION_DEAD_BAND_MPS)


def sparc(speed: Array, period_s: float) -> float:
    """Returns the spectral arc length of a speed profile, (N,) on an even grid; at most 0.

    Raises Undefined where the speed is 0 throughout.
    """
    size = 2 ** (math.ceil(math.log2(len(speed))) + SPECTRUM_PADDING_LEVELS)
    magnitude = np.abs(np.fft.rfft(speed, size))
    frequency = np.fft.rfftfreq(size, period_s)
    if magnitude.max() == 0.0:
        raise Undefined("the robot did not move")
    magnitude = (magnitude / magnitude.max())[frequency <= SPECTRUM_CUT_HZ]
    frequency = frequency[frequency <= SPECTRUM_CUT_HZ]
    strong = np.flatnonzero(magnitude >= SPECTRUM_THRESHOLD_RATIO)
    kept = slice(strong[0], strong[-1] + 1)
    frequency, magnitude = frequency[kept], magnitude[kept]
    if len(frequency) < 2:
        raise Undefined("the trial is too short for a spectrum of the speed")
    relative = np.diff(frequency) / (frequency[-1] - frequency[0])
    return -float(np.hypot(relative, np.diff(magnitude)).sum())


def dimensionless_jerk(speed: Array, period_s: float) -> float:
    """Returns -(D^3/v_peak^2) sum (d2v/dt2)^2 dt of a speed profile, D = N dt.

    speed: (N,) on an even grid. Raises Undefined where the speed is 0 throughout.
    """
    peak = np.abs(speed).max()
    if peak == 0.0:
        raise Undefined("the robot did not move")
    duration_s = len(speed) * period_s
    jerk = np.diff(speed, n=2) / period_s**2
    return -float(duration_s**3 / peak**2 * (jerk**2).sum() * period_s)
