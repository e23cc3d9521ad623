"""The hard limits of a plan as rows that must not be negative, stage by stage of a `Scene`.

Rows of one stage, in order: bounds of v, w, a, alpha and of both jerks (high, low each), the wheel
speeds (right and left, high, low each), the lateral acceleration (two), and the clearance of each
disc, more in a turn. In parts of their limits, clearances in parts of CLEARANCE_SCALE_M. A row has
up to four slopes.
"""

from __future__ import annotations

import math

from numba import njit

from drake_navbench.controllers.harmony.motion import (
    ALPHA,
    ANGULAR_JERK,
    JERK,
    YAW,
    A,
    V,
    W,
    X,
    Y,
)
from drake_navbench.kernels.distance_field import sample_distance

FIRST_INPUT_ROW, FIRST_WHEEL_ROW, FIRST_LATERAL_ROW, FIRST_DISC_ROW = 8, 12, 16, 18
SLOPES_A_ROW = 4
CLEARANCE_SCALE_M = 0.1
# Near 0 the amount of a turn rate is rounded off, so that it has a slope there, rad/s.
ROUNDED_RADPS = 0.1


@njit(cache=True, error_model="numpy")
def row_count(scene):
    """Returns the number of rows of a stage."""
    return FIRST_DISC_ROW + scene.discs.shape[0]


@njit(cache=True, error_model="numpy")
def is_row_of(k, last, row):
    """Returns whether a stage has a row: the first one's state is given, the last has no input."""
    is_input = FIRST_INPUT_ROW <= row < FIRST_WHEEL_ROW
    return k < last if is_input else k > 0


@njit(cache=True, error_model="numpy")
def _bound(row, value, low, high, scale, column, values, columns, slopes):
    values[row], values[row + 1] = (high - value) / scale, (value - low) / scale
    columns[row, 0] = columns[row + 1, 0] = column
    slopes[row, 0], slopes[row + 1, 0] = -1.0 / scale, 1.0 / scale


@njit(cache=True, error_model="numpy")
def _bound_of_two(row, value, limit, first, by_first, second, by_second, values, columns, slopes):
    values[row], values[row + 1] = 1.0 - value / limit, 1.0 + value / limit
    for k in range(2):
        sign = -1.0 if k == 0 else 1.0
        columns[row + k, 0], columns[row + k, 1] = first, second
        slopes[row + k, 0], slopes[row + k, 1] = sign * by_first / limit, sign * by_second / limit


@njit(cache=True, error_model="numpy")
def stage_rows(scene, k, stage, values, columns, slopes):
    """Writes the rows (R,) of stage k with the columns and slopes (R, 3) of each; unused are 0."""
    limits = scene.limits
    columns[:] = 0
    slopes[:] = 0.0
    for axis, scale in ((0, limits.forward_speed), (1, limits.turn_rate)):
        low, high = scene.low[k, axis], scene.high[k, axis]
        _bound(2 * axis, stage[V + axis], low, high, scale, V + axis, values, columns, slopes)
    for row, column, limit in (
        (4, A, limits.acceleration),
        (6, ALPHA, limits.angular_acceleration),
        (8, JERK, limits.jerk),
        (10, ANGULAR_JERK, limits.angular_jerk),
    ):
        _bound(row, stage[column], -limit, limit, limit, column, values, columns, slopes)
    half, top = limits.half_track, limits.wheel_speed
    for row, side in ((FIRST_WHEEL_ROW, half), (FIRST_WHEEL_ROW + 2, -half)):
        speed = stage[V] + side * stage[W]
        _bound_of_two(row, speed, top, V, 1.0, W, side, values, columns, slopes)
    lateral, most = stage[V] * stage[W], limits.lateral_acceleration
    row = FIRST_LATERAL_ROW
    _bound_of_two(row, lateral, most, V, stage[W], W, stage[V], values, columns, slopes)
    sweep = limits.sweep / CLEARANCE_SCALE_M
    turning = math.hypot(stage[W], ROUNDED_RADPS)
    cosine, sine = math.cos(stage[YAW]), math.sin(stage[YAW])
    for d in range(scene.discs.shape[0]):
        row, along = FIRST_DISC_ROW + d, scene.discs[d, 0]
        distance, by_x, by_y = sample_distance(
            scene.field, stage[X] + along * cosine, stage[Y] + along * sine
        )
        values[row] = (distance - scene.discs[d, 1] - scene.required[k]) / CLEARANCE_SCALE_M
        values[row] -= sweep * (turning - ROUNDED_RADPS)
        for i, column in enumerate((X, Y, YAW, W)):
            columns[row, i] = column
        slopes[row, 0], slopes[row, 1] = by_x / CLEARANCE_SCALE_M, by_y / CLEARANCE_SCALE_M
        slopes[row, 2] = (by_y * cosine - by_x * sine) * along / CLEARANCE_SCALE_M
        slopes[row, 3] = -sweep * stage[W] / turning
