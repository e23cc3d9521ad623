"""Geometry of one interval of the band: the circular arc between two poses.

With the mean heading of the two poses, d is their displacement along it and h across it. h = 0
holds exactly where both headings are tangent to one circle (the condition of Roesmann et al.
2012, eq. 5, without its loss of rank at half a turn); the signed arc length is then q(delta) d.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numba.extending import register_jitable

# Below this turn the series is exact to double precision, and the quotient is not.
SERIES_BELOW_RAD = 1e-3
# The same for its second derivative, which loses more digits.
CURVATURE_SERIES_BELOW_RAD = 2e-2
# q = (delta / 2) / sin(delta / 2) = 1 + delta^2 / 24 + 7 delta^4 / 5760 + 31 delta^6 / 967680 + ...
SERIES_2 = 1.0 / 24.0
SERIES_4 = 7.0 / 5760.0
SERIES_6 = 31.0 / 967680.0

# Columns of an interval's table of first derivatives.
X0, Y0, YAW0, X1, Y1, YAW1 = range(6)


@njit(cache=True)
def arc_ratio(delta):
    """Returns (q, dq/d delta): arc length over chord for a turn by delta, |delta| < 2 pi."""
    if abs(delta) < SERIES_BELOW_RAD:
        squared = delta * delta
        ratio = 1.0 + squared * (SERIES_2 + SERIES_4 * squared)
        return ratio, delta * (2.0 * SERIES_2 + 4.0 * SERIES_4 * squared)
    half = 0.5 * delta
    sine = math.sin(half)
    return half / sine, (sine - half * math.cos(half)) / (2.0 * sine * sine)


@njit(cache=True)
def arc_curvature(delta):
    """Returns d^2q/d delta^2 of `arc_ratio`."""
    if abs(delta) < CURVATURE_SERIES_BELOW_RAD:
        squared = delta * delta
        return 2.0 * SERIES_2 + squared * (12.0 * SERIES_4 + 30.0 * SERIES_6 * squared)
    half = 0.5 * delta
    sine, cosine = math.sin(half), math.cos(half)
    return 0.25 * (half * (1.0 + cosine * cosine) - 2.0 * sine * cosine) / sine**3


@register_jitable
def interval_geometry(first, second, length_slopes, offset_slopes):
    """Returns (signed arc length m, lateral offset h m, turn rad) between two poses (3,).

    length_slopes, offset_slopes: (6,) filled with d/d(x0, y0, yaw0, x1, y1, yaw1). Yaws must be
    unwrapped: the turn is their plain difference.
    """
    dx, dy = second[0] - first[0], second[1] - first[1]
    delta = second[2] - first[2]
    mean_yaw = 0.5 * (first[2] + second[2])
    c, s = math.cos(mean_yaw), math.sin(mean_yaw)
    along = c * dx + s * dy
    offset = -s * dx + c * dy
    q, q_slope = arc_ratio(delta)
    length_slopes[X0], length_slopes[Y0] = -q * c, -q * s
    length_slopes[X1], length_slopes[Y1] = q * c, q * s
    length_slopes[YAW0] = 0.5 * q * offset - q_slope * along
    length_slopes[YAW1] = 0.5 * q * offset + q_slope * along
    offset_slopes[X0], offset_slopes[Y0] = s, -c
    offset_slopes[X1], offset_slopes[Y1] = -s, c
    offset_slopes[YAW0] = offset_slopes[YAW1] = -0.5 * along
    return q * along, offset, delta


@njit(cache=True)
def band_geometry(poses):
    """Returns the geometry of all m intervals of a band, poses (n, 3) with unwrapped yaws.

    lengths (m,) m, offsets (m,) m, turns (m,) rad, length_slopes (m, 6), offset_slopes (m, 6).
    """
    m = poses.shape[0] - 1
    lengths, offsets, turns = np.empty(m), np.empty(m), np.empty(m)
    length_slopes, offset_slopes = np.empty((m, 6)), np.empty((m, 6))
    for k in range(m):
        lengths[k], offsets[k], turns[k] = interval_geometry(
            poses[k], poses[k + 1], length_slopes[k], offset_slopes[k]
        )
    return lengths, offsets, turns, length_slopes, offset_slopes


@register_jitable
def band_rates(lengths, turns, time_steps):
    """Returns speeds (m,) m/s, turn rates (m,) rad/s and the slopes (m, 6) of the turns."""
    m = time_steps.shape[0]
    speeds, turn_rates = np.empty(m), np.empty(m)
    turn_slopes = np.zeros((m, 6))
    for k in range(m):
        speeds[k] = lengths[k] / time_steps[k]
        turn_rates[k] = turns[k] / time_steps[k]
        turn_slopes[k, YAW0] = -1.0
        turn_slopes[k, YAW1] = 1.0
    return speeds, turn_rates, turn_slopes
