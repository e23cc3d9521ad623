"""Comfort of a person in the chair: accelerations and jerk.

The simulator's floor is flat, so these metrics contain no road vibration. Their frequency-weighted
acceleration does not measure the ride comfort of a chair on a real floor. The frequencies of slow
braking and turning lie below the band of ISO 2631-1; so also read the peaks and the jerk.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from drake_navbench.analysis.metrics.definition import Undefined, metric
from drake_navbench.analysis.metrics.signals import column, lateral_velocity, motion, times
from drake_navbench.kernels.arrays import Array
from drake_navbench.logs.log import TrialLog

# Shorter peaks come from the simulator's motor; nobody feels them as a push.
SUSTAINED_S = 0.1
# Weights of the squared jerks, s^6/m^2: with 1, a jerk of 1 m/s^3 for 1 s costs as much as 1 s.
TANGENTIAL_JERK_WEIGHT = 1.0
NORMAL_JERK_WEIGHT = 1.0
# ISO 2631-1:1997, annex A, weighting W_d for the horizontal axes of a seat.
HIGH_PASS_HZ = 0.4
LOW_PASS_HZ = 100.0
TRANSITION_HZ = 2.0
TRANSITION_QUALITY = 0.63
PADDING_RATIO = 4


@metric(unit="m/s^2", better="lower", title="Lateral acceleration, largest")
def lateral_acceleration_max_mps2(log: TrialLog) -> float:
    """Largest true lateral acceleration of the reference point.

    Formula: max |v w|; with vy max |v w + dvy/dt|, fitted over 0.3 s.
    """
    if not lateral_velocity(log).any():
        return np.abs(column(log, "v_mps") * column(log, "w_radps")).max()
    signal = motion(log)
    turning = signal.smooth_v_mps * signal.smooth_w_radps
    return np.abs(turning + signal.lateral_acceleration_mps2).max()


@metric(unit="m/s^2", better="lower", title="Acceleration, largest")
def acceleration_max_mps2(log: TrialLog) -> float:
    """Largest true forward acceleration that lasted 0.1 s.

    Formula: max(0, (v(t + 0.1 s) - v(t)) / 0.1 s).
    """
    return max(float(sustained_accelerations(log).max()), 0.0)


@metric(unit="m/s^2", better="lower", title="Braking, hardest")
def deceleration_max_mps2(log: TrialLog) -> float:
    """Largest true deceleration that lasted 0.1 s.

    Formula: max(0, (v(t) - v(t + 0.1 s)) / 0.1 s).
    """
    return max(float(-sustained_accelerations(log).min()), 0.0)


@metric(unit="s", better="lower", title="Discomfort", relevant=0.1)
def gulati_kuipers_discomfort_s(log: TrialLog) -> float:
    """Discomfort of a wheelchair's passenger: duration plus squared jerks.

    Formula: T + w_T integral j_t^2 dt + w_N integral j_n^2 dt with j_t = d2v/dt2 - v w^2, j_n = 2 w
    dv/dt + v dw/dt (with vy the jerk along and across the heading), both weights 1 s^6/m^2 (our
    choice: the original scales them).
    Source: Gulati, PhD thesis, UT Austin, 2011.
    """
    signal = motion(log)
    v, w = signal.smooth_v_mps, signal.smooth_w_radps
    tangential = signal.jerk_mps3 - v * w**2
    normal = 2.0 * w * signal.acceleration_mps2 + v * signal.angular_acceleration_radps2
    vy, turning = signal.smooth_vy_mps, signal.angular_acceleration_radps2
    tangential -= 2.0 * w * signal.lateral_acceleration_mps2 + vy * turning
    normal += signal.lateral_jerk_mps3 - vy * w**2
    cost = TANGENTIAL_JERK_WEIGHT * tangential**2 + NORMAL_JERK_WEIGHT * normal**2
    duration_s = signal.period_s * (len(v) - 1)
    return duration_s + float(np.trapezoid(cost, dx=signal.period_s))


@metric(unit="m/s^2", better="lower", title="Weighted acceleration at the seat")
def iso_2631_av_mps2(log: TrialLog) -> float:
    """Frequency-weighted r.m.s. acceleration in the plane of the seat; says nothing of vibration.

    Formula: a_v = sqrt(a_wx^2 + a_wy^2), each the r.m.s. of the acceleration at the reference point
    weighted with W_d, k = 1; a_x = dv/dt - vy w, a_y = dvy/dt + v w. W_d lets little through below
    0.4 Hz (slow braking, long bends).
    Source: ISO 2631-1:1997, 6 and annex A.
    """
    signal = motion(log)
    forward = np.diff(signal.v_mps) / signal.period_s - (signal.vy_mps * signal.w_radps)[1:]
    sideways = (signal.v_mps * signal.w_radps)[1:] + np.diff(signal.vy_mps) / signal.period_s
    return math.hypot(
        weighted_rms(forward, signal.period_s), weighted_rms(sideways, signal.period_s)
    )


def sustained_accelerations(log: TrialLog) -> Array:
    """Returns the mean forward acceleration over the 0.1 s after each sample, m/s^2."""
    time_s, v = times(log), column(log, "v_mps")
    later = time_s + SUSTAINED_S
    # The tolerance keeps the last whole interval in spite of rounding.
    whole = later <= time_s[-1] + 1e-9
    if not whole.any():
        raise Undefined(f"the trial is shorter than {SUSTAINED_S} s")
    return (np.interp(later[whole], time_s, v) - v[whole]) / SUSTAINED_S


def weighting_wd(frequency_hz: NDArray[np.floating]) -> Array:
    """Returns the magnitude of ISO 2631-1's weighting W_d at frequencies (N,) Hz."""
    s = 2j * np.pi * np.asarray(frequency_hz, dtype=float)
    high, low, turn = (2.0 * np.pi * f for f in (HIGH_PASS_HZ, LOW_PASS_HZ, TRANSITION_HZ))
    high_pass = s**2 / (s**2 + math.sqrt(2.0) * high * s + high**2)
    low_pass = low**2 / (s**2 + math.sqrt(2.0) * low * s + low**2)
    transition = (1.0 + s / turn) / (1.0 + s / (TRANSITION_QUALITY * turn) + (s / turn) ** 2)
    return np.abs(high_pass * low_pass * transition)


def weighted_rms(acceleration: Array, period_s: float) -> float:
    """Returns the r.m.s. of an acceleration (N,) on an even grid, weighted with W_d.

    In the frequency domain (Parseval), padded with zeros so that the weighting's ringing at the
    end is counted and not folded back to the start.
    """
    size = PADDING_RATIO * len(acceleration)
    spectrum = np.fft.rfft(acceleration, size)
    weighted = np.fft.irfft(spectrum * weighting_wd(np.fft.rfftfreq(size, period_s)), size)
    return float(np.sqrt((weighted**2).sum() / len(acceleration)))
