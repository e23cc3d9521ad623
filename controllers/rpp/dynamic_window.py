"""The dynamic window option: the speeds that the acceleration limits let pass.

Source: Nav2's dynamic_window_pure_pursuit_functions. A window is a range of v and one of w; the
command is the point in it that follows the curvature best. Speeds in m/s and rad/s.
"""

from __future__ import annotations

import math

from numba import njit

# Slower than this, an axis may accelerate either way.
STANDSTILL_SPEED = 1e-3
# Below this curvature the path counts as straight, 1/m.
STRAIGHT_CURVATURE = 1e-3
# Corners whose distances to the line w = curvature v differ by less count as equally far.
DISTANCE_TIE = 1e-3


@njit(cache=True)
def axis_window(current, lowest, highest, acceleration, deceleration, period):
    """Returns (low, high): the speeds of one axis that can be reached within a period.

    acceleration > 0 bounds the change away from zero, deceleration < 0 the change towards it.
    lowest, highest: bounds on the speed itself.
    """
    low = current - acceleration * period
    high = current + acceleration * period
    if current > STANDSTILL_SPEED:
        low = current + deceleration * period
    elif current < -STANDSTILL_SPEED:
        high = current - deceleration * period
    return max(low, lowest), min(high, highest)


@njit(cache=True)
def cut_to_speed(low, high, speed):
    """Returns the window (low, high) of v cut to the range between zero and a regulated speed.

    An empty cut collapses to the edge of the window nearest to that range.
    """
    cut_low = max(low, min(0.0, speed))
    cut_high = min(high, max(0.0, speed))
    if cut_low > cut_high:
        if cut_low > max(0.0, speed):
            cut_high = cut_low
        else:
            cut_low = cut_high
    return cut_low, cut_high


@njit(cache=True)
def _straight_command(low, high, turn_low, turn_high, sign):
    """Returns (v, w) for a straight path: the fastest v, the w nearest to zero."""
    v = high if sign >= 0.0 else low
    if turn_low <= 0.0 <= turn_high:
        return v, 0.0
    return v, (turn_low if abs(turn_low) <= abs(turn_high) else turn_high)


@njit(cache=True)
def _nearest_corner(low, high, turn_low, turn_high, curvature, sign):
    """Returns the corner (v, w) of the window nearest to the line w = curvature v."""
    corners = ((low, turn_low), (low, turn_high), (high, turn_low), (high, turn_high))
    scale = math.sqrt(curvature * curvature + 1.0)
    least = math.inf
    best_v, best_w = low, turn_low
    for v, w in corners:
        distance = abs(curvature * v - w) / scale
        is_tie = abs(distance - least) <= DISTANCE_TIE
        if distance < least or (is_tie and v * sign > best_v * sign):
            least, best_v, best_w = distance, v, w
    return best_v, best_w


@njit(cache=True)
def command_in_window(low, high, turn_low, turn_high, curvature, sign):
    """Returns (v, w) in the window [low, high] x [turn_low, turn_high] for a curvature 1/m.

    Where the line w = curvature v crosses the window: its fastest point in the direction `sign`.
    Elsewhere the corner nearest to the line.
    """
    if abs(curvature) < STRAIGHT_CURVATURE:
        return _straight_command(low, high, turn_low, turn_high, sign)
    crossings = (
        (low, curvature * low),
        (high, curvature * high),
        (turn_low / curvature, turn_low),
        (turn_high / curvature, turn_high),
    )
    fastest = -math.inf
    best_v, best_w = 0.0, 0.0
    for v, w in crossings:
        is_inside = low <= v <= high and turn_low <= w <= turn_high
        if is_inside and v * sign > fastest:
            fastest, best_v, best_w = v * sign, v, w
    if fastest > -math.inf:
        return best_v, best_w
    return _nearest_corner(low, high, turn_low, turn_high, curvature, sign)
