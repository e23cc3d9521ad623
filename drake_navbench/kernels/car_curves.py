"""Shortest curves of a car between two poses: Dubins' (forward only) and Reeds and Shepp's.

Poses are tuples of x, y and yaw in rad (for an array, numba would compile all of it once more). A
curve is up to five pieces, as in `curve_pieces`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.curve_pieces import (
    LEFT,
    NONE,
    PIECES,
    RIGHT,
    STRAIGHT,
    TWO_PI,
    remainder,
    total_length,
)
from drake_navbench.kernels.dubins import positive_turn, write_dubins
from drake_navbench.kernels.reeds_shepp import write_reeds_shepp

PI = math.pi


@njit(cache=True)
def shortest_curve(start, end, radius, reverses, kinds, lengths):
    """Writes the shortest curve between poses (3,) x, y, rad; returns its length.

    radius: radius of the tightest turn, in the units of x and y. reverses: Reeds and Shepp's curve,
    else Dubins'.
    """
    dx, dy = end[0] - start[0], end[1] - start[1]
    kinds[:] = NONE
    lengths[:] = 0.0
    if reverses:
        cosine, sine = math.cos(start[2]), math.sin(start[2])
        x, y = cosine * dx + sine * dy, -sine * dx + cosine * dy
        write_reeds_shepp(x / radius, y / radius, end[2] - start[2], kinds, lengths)
        return radius * total_length(lengths)
    distance = math.sqrt(dx * dx + dy * dy) / radius
    bearing = math.atan2(dy, dx)
    alpha, beta = positive_turn(start[2] - bearing), positive_turn(end[2] - bearing)
    write_dubins(distance, alpha, beta, kinds, lengths)
    return radius * (lengths[0] + lengths[1] + lengths[2])


@njit(cache=True)
def curve_knots(yaw, kinds, lengths):
    """Returns (PIECES, 5) the starts of pieces: x, y in radii from the curve's, yaw, sin, cos."""
    knots = np.empty((PIECES, 5))
    x, y = 0.0, 0.0
    for i in range(PIECES):
        sine, cosine = math.sin(yaw), math.cos(yaw)
        knots[i, 0], knots[i, 1], knots[i, 2], knots[i, 3], knots[i, 4] = x, y, yaw, sine, cosine
        x, y, yaw = _after_piece(knots[i], kinds[i], lengths[i])
    return knots


@njit(cache=True)
def _after_piece(knot, kind, piece):
    """Returns (x, y, yaw) after a length of a piece that begins at a knot."""
    x, y, yaw, sine, cosine = knot[0], knot[1], knot[2], knot[3], knot[4]
    if kind == LEFT:
        turned = yaw + piece
        return x + math.sin(turned) - sine, y - math.cos(turned) + cosine, turned
    if kind == RIGHT:
        turned = yaw - piece
        return x - math.sin(turned) + sine, y + math.cos(turned) - cosine, turned
    if kind == STRAIGHT:
        return x + piece * cosine, y + piece * sine, yaw
    return x, y, yaw


@njit(cache=True)
def pose_on_curve(start, end, radius, kinds, lengths, knots, share, pose):
    """Writes the pose (3,) at a share, 0 to 1, of a curve's length; its yaw in [-pi, pi).

    knots: knots of the curve. At its ends it is `start` and `end` themselves, whatever their yaw.
    """
    if share >= 1.0 or share <= 0.0:
        for i in range(3):
            pose[i] = end[i] if share >= 1.0 else start[i]
        return
    left = share * total_length(lengths)
    last, piece = 0, 0.0
    for i in range(PIECES):
        if not left > 0.0:
            break
        last = i
        if lengths[i] < 0.0:
            piece = max(-left, lengths[i])
            left += piece
        else:
            piece = min(left, lengths[i])
            left -= piece
    x, y, yaw = _after_piece(knots[last], kinds[last], piece)
    pose[0] = x * radius + start[0]
    pose[1] = y * radius + start[1]
    pose[2] = _bounded(yaw)


@njit(cache=True)
def direction_changes(lengths):
    """Returns the number of changes between forward and backward along a curve."""
    changes, last = 0, 0
    for i in range(PIECES):
        if lengths[i] != 0.0:
            direction = 1 if lengths[i] > 0.0 else -1
            if last != 0 and direction != last:
                changes += 1
            last = direction
    return changes


@njit(cache=True)
def _bounded(angle):
    """Returns an angle in [-pi, pi)."""
    value = remainder(angle)
    if value < -PI:
        return value + TWO_PI
    return value - TWO_PI if value >= PI else value
