"""Elementary functions in float32, without branches, so that loops over lanes vectorise.

Numba leaves calls of sinf, cosf and logf scalar; these polynomials do not call anything. Every
constant is a float32: a bare Python number would turn the whole expression into float64.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numba.extending import register_jitable

F32 = np.float32
ZERO = F32(0.0)
HALF = F32(0.5)
ONE = F32(1.0)
TWO = F32(2.0)
PI = F32(math.pi)
TWO_PI = F32(2.0 * math.pi)
HALF_PI = F32(0.5 * math.pi)

_TWO_OVER_PI = F32(2.0 / math.pi)
# pi/2 in three parts; the first two have few bits, so that their products with a small whole
# number are exact (Cody and Waite's range reduction).
_HALF_PI_1 = F32(1.5703125)
_HALF_PI_2 = F32(4.837512969970703e-4)
_HALF_PI_3 = F32(math.pi / 2 - 1.5703125 - 4.837512969970703e-4)
_BIT_0 = np.int32(1)
_BIT_1 = np.int32(2)
_NONE = np.int32(0)

# Taylor coefficients: on [-pi/4, pi/4] the remainders are below half a unit in the last place.
_SIN_3, _SIN_5, _SIN_7, _SIN_9 = (
    F32(s / math.factorial(k)) for s, k in zip((-1, 1, -1, 1), (3, 5, 7, 9), strict=True)
)
_COS_4, _COS_6, _COS_8, _COS_10 = (
    F32(s / math.factorial(k)) for s, k in zip((1, -1, 1, -1), (4, 6, 8, 10), strict=True)
)


@njit(cache=True)
def sin_cos(angle):
    """Returns (sin, cos) of a float32 angle in rad, |angle| < 8000; absolute error below 1.5e-7."""
    rounding = HALF if angle >= ZERO else -HALF
    quadrant = np.int32(angle * _TWO_OVER_PI + rounding)
    turns = F32(quadrant)
    r = ((angle - turns * _HALF_PI_1) - turns * _HALF_PI_2) - turns * _HALF_PI_3
    r2 = r * r
    sine = r + r * r2 * (_SIN_3 + r2 * (_SIN_5 + r2 * (_SIN_7 + r2 * _SIN_9)))
    cosine = ONE - HALF * r2 + r2 * r2 * (_COS_4 + r2 * (_COS_6 + r2 * (_COS_8 + r2 * _COS_10)))
    swapped = (quadrant & _BIT_0) != _NONE
    sin_magnitude = cosine if swapped else sine
    cos_magnitude = sine if swapped else cosine
    sin_negative = (quadrant & _BIT_1) != _NONE
    cos_negative = ((quadrant + _BIT_0) & _BIT_1) != _NONE
    return (
        -sin_magnitude if sin_negative else sin_magnitude,
        -cos_magnitude if cos_negative else cos_magnitude,
    )


@njit(cache=True)
def wrap32(angle):
    """Wraps a float32 angle in rad the way MPPI's critics do: remainder with C's sign rule."""
    shifted = angle + PI
    remainder = shifted - F32(np.int32(shifted / TWO_PI)) * TWO_PI
    return remainder + PI if remainder < ZERO else remainder - PI


@register_jitable
def clamp32(value, low, high):
    """Returns min(high, max(value, low)), in that order: `high` wins where low > high.

    NaN becomes `high`, as in C++.
    """
    raised = low if value < low else value
    return raised if raised < high else high
