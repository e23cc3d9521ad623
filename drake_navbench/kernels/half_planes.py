"""The velocity nearest to a preferred one within half-planes and a top speed.

The linear programs of van den Berg, Guy, Lin, Manocha, "Reciprocal n-Body Collision Avoidance",
2011, section 5: in two dimensions, by adding one half-plane after another (de Berg et al.,
"Computational Geometry", chapter 4). If they do not intersect, the program has a third dimension,
the violation of the soft half-planes.

A half-plane is a row: x, y of a point on its edge, m/s, and the unit vector along the edge; allowed
velocities are to its left.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

# Edges whose directions have a smaller cross product are parallel.
PARALLEL = 1e-5
HALF_PLANE_SIZE = 4
# What a wished velocity is; numba would compile the search anew for each plain constant.
IS_VELOCITY, IS_DIRECTION = np.bool_(False), np.bool_(True)


@njit(cache=True)
def cross(ax, ay, bx, by):
    """Returns the cross product of two vectors, positive where b is to the left of a."""
    return ax * by - ay * bx


@njit(cache=True)
def allowed_velocity(planes, count, hard_count, top_speed, wished_x, wished_y):
    """Returns (x, y) m/s that is nearest to the wished velocity among those that are allowed.

    planes: (N, 4), of which the first `count` are used. If no velocity obeys them all, the first
    `hard_count` are obeyed, and the largest violation of the others is as small as possible.
    """
    kept, x, y = _nearest(planes, count, top_speed, wished_x, wished_y, IS_VELOCITY)
    if kept < count:
        x, y = _least_broken(planes, count, hard_count, kept, top_speed, x, y)
    return x, y


@njit(cache=True)
def _excess(planes, index, x, y):
    """Returns the distance of a velocity (x, y) to a half-plane, m/s; negative inside."""
    return cross(planes[index, 2], planes[index, 3], planes[index, 0] - x, planes[index, 1] - y)


@njit(cache=True)
def _worst(planes, first, last, x, y):
    """Returns the largest excess of a velocity (x, y) over the half-planes first to last, m/s."""
    worst = -math.inf
    for index in range(first, last + 1):
        worst = max(worst, _excess(planes, index, x, y))
    return worst


@njit(cache=True)
def _nearest(planes, count, top_speed, wished_x, wished_y, is_direction):
    """Returns (kept, x, y): the best velocity, within the first `kept` half-planes.

    is_direction: the wished one is a unit vector along which to go as far as possible.
    """
    x, y = wished_x, wished_y
    size = math.hypot(x, y)
    if is_direction or size > top_speed:
        x, y = top_speed * x / size, top_speed * y / size
    for index in range(count):
        if _excess(planes, index, x, y) > 0.0:
            found, new_x, new_y = _nearest_on_edge(
                planes, index, top_speed, wished_x, wished_y, is_direction
            )
            if not found:
                return index, x, y
            x, y = new_x, new_y
    return count, x, y


@njit(cache=True)
def _nearest_on_edge(planes, index, top_speed, wished_x, wished_y, is_direction):
    """Returns (found, x, y) on a half-plane's edge, within all before it and the top speed."""
    px, py, dx, dy = planes[index]
    middle = -(px * dx + py * dy)
    squared = middle * middle + top_speed * top_speed - px * px - py * py
    if squared < 0.0:
        return False, 0.0, 0.0
    low, high = middle - math.sqrt(squared), middle + math.sqrt(squared)
    for other in range(index):
        turn = cross(dx, dy, planes[other, 2], planes[other, 3])
        inside = -_excess(planes, other, px, py)
        if abs(turn) <= PARALLEL:
            if inside < 0.0:
                return False, 0.0, 0.0
            continue
        if turn > 0.0:
            high = min(high, inside / turn)
        else:
            low = max(low, inside / turn)
        if low > high:
            return False, 0.0, 0.0
    if is_direction:
        share = high if wished_x * dx + wished_y * dy > 0.0 else low
    else:
        share = min(max(dx * (wished_x - px) + dy * (wished_y - py), low), high)
    return True, px + share * dx, py + share * dy


@njit(cache=True)
def _least_broken(planes, count, hard_count, first, top_speed, x, y):
    """Returns (x, y) m/s that breaks the soft half-planes by the least largest excess.

    first: the one at which the search in two dimensions ended, at x, y.
    """
    largest = 0.0
    for index in range(first, count):
        if _excess(planes, index, x, y) <= largest:
            continue
        # The velocities that break two half-planes equally lie on a line through the crossing of
        # their edges.
        px, py, dx, dy = planes[index]
        equal = np.empty((max(index, hard_count), HALF_PLANE_SIZE))
        # A number at a time: a slice would have numba compile its strings, for an error message.
        for hard in range(hard_count):
            for i in range(HALF_PLANE_SIZE):
                equal[hard, i] = planes[hard, i]
        used = hard_count
        for other in range(hard_count, index):
            qx, qy, ex, ey = planes[other]
            turn = cross(dx, dy, ex, ey)
            if abs(turn) <= PARALLEL:
                if dx * ex + dy * ey > 0.0:
                    continue
                equal[used, 0], equal[used, 1] = 0.5 * (px + qx), 0.5 * (py + qy)
            else:
                share = cross(ex, ey, px - qx, py - qy) / turn
                equal[used, 0], equal[used, 1] = px + share * dx, py + share * dy
            length = math.hypot(ex - dx, ey - dy)
            equal[used, 2], equal[used, 3] = (ex - dx) / length, (ey - dy) / length
            used += 1
        kept, new_x, new_y = _nearest(equal, used, top_speed, -dy, dx, IS_DIRECTION)
        # This fails by rounding alone, where edges are almost parallel: either velocity may be
        # better.
        if kept == used or _worst(planes, hard_count, index, new_x, new_y) < _worst(
            planes, hard_count, index, x, y
        ):
            x, y = new_x, new_y
        largest = _excess(planes, index, x, y)
    return x, y
