"""Dubins' shortest curve of a car that only drives forward.

Distances are in radii, headings alpha and beta against the line between the positions. Of equally
short curves the one that is tried first is taken, in the order of OMPL 1.5, whose tolerances hold.
Sources: L. E. Dubins, "On curves of minimal length with a constraint on average curvature", 1957;
A. M. Shkel and V. Lumelsky, "Classification of the Dubins set", 2001.
"""

from __future__ import annotations

import math

from numba import njit

from drake_navbench.kernels.curve_pieces import FARTHEST, LEFT, RIGHT, STRAIGHT, TWO_PI

DUBINS_EPSILON = 1e-6
DUBINS_ZERO = -1e-7
# Arcs of no length come out a little below 0.
LONGER = 1e-9


@njit(cache=True)
def positive_turn(angle):
    """Returns an angle in [0, 2 pi); nearly a full turn becomes 0."""
    if DUBINS_ZERO < angle < 0.0:
        return 0.0
    turn = angle - TWO_PI * math.floor(angle / TWO_PI)
    return 0.0 if TWO_PI - turn < 0.5 * DUBINS_EPSILON else turn


@njit(cache=True)
def write_dubins(d, alpha, beta, kinds, lengths):
    """Writes the first three pieces of the shortest curve."""
    lengths[1] = FARTHEST
    kinds[0], kinds[1], kinds[2] = LEFT, STRAIGHT, LEFT
    if d < DUBINS_EPSILON and abs(alpha - beta) < DUBINS_EPSILON:
        lengths[1] = d
        return
    least = FARTHEST
    trig = (math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta))
    for first, last in ((LEFT, LEFT), (RIGHT, RIGHT), (RIGHT, LEFT), (LEFT, RIGHT)):
        found, t, p, q = _dubins_with_line(d, alpha, beta, trig, first, last, least)
        if found and t + p + q < least:
            kinds[0], kinds[1], kinds[2] = first, STRAIGHT, last
            lengths[0], lengths[1], lengths[2] = t, p, q
            least = t + p + q
    for outer in (RIGHT, LEFT):
        found, t, p, q = _dubins_of_arcs(d, alpha, beta, trig, outer, least)
        if found and t + p + q < least:
            kinds[0], kinds[1], kinds[2] = outer, -outer, outer
            lengths[0], lengths[1], lengths[2] = t, p, q
            least = t + p + q


@njit(cache=True)
def _dubins_with_line(d, alpha, beta, trig, first, last, least):
    """Returns whether a curve of arc, line and arc exists, and the three lengths.

    trig: cosine and sine of alpha, then of beta. A curve whose middle piece alone is longer than
    `least` is given up, here and below.
    """
    ca, sa, cb, sb = trig
    cross = ca * cb + sa * sb
    if first == last:
        across = sa - sb if first == LEFT else sb - sa
        squared = 2.0 + d * d - 2.0 * (cross - d * across)
    elif first == RIGHT:
        squared = d * d - 2.0 + 2.0 * (cross - d * (sa + sb))
    else:
        squared = -2.0 + d * d + 2.0 * (cross + d * (sa + sb))
    if not squared >= DUBINS_ZERO:
        return False, 0.0, 0.0, 0.0
    p = math.sqrt(max(squared, 0.0))
    if p > least + LONGER:
        return False, 0.0, 0.0, 0.0
    if first == LEFT and last == LEFT:
        theta = math.atan2(cb - ca, d + sa - sb)
        return True, positive_turn(-alpha + theta), p, positive_turn(beta - theta)
    if first == RIGHT and last == RIGHT:
        theta = math.atan2(ca - cb, d - sa + sb)
        return True, positive_turn(alpha - theta), p, positive_turn(-beta + theta)
    if first == RIGHT:
        theta = math.atan2(ca + cb, d - sa - sb) - math.atan2(2.0, p)
        return True, positive_turn(alpha - theta), p, positive_turn(beta - theta)
    theta = math.atan2(-ca - cb, d + sa + sb) - math.atan2(-2.0, p)
    return True, positive_turn(-alpha + theta), p, positive_turn(-beta + theta)


@njit(cache=True)
def _dubins_of_arcs(d, alpha, beta, trig, outer, least):
    """Returns whether a curve of three arcs exists, and the three lengths."""
    ca, sa, cb, sb = trig
    cross = ca * cb + sa * sb
    if outer == RIGHT:
        cosine = 0.125 * (6.0 - d * d + 2.0 * (cross + d * (sa - sb)))
    else:
        cosine = 0.125 * (6.0 - d * d + 2.0 * (cross - d * (sa - sb)))
    if not abs(cosine) < 1.0:
        return False, 0.0, 0.0, 0.0
    p = TWO_PI - math.acos(cosine)
    if p > least + LONGER:
        return False, 0.0, 0.0, 0.0
    if outer == RIGHT:
        t = positive_turn(alpha - math.atan2(ca - cb, d - sa + sb) + 0.5 * p)
        return True, t, p, positive_turn(alpha - beta - t + p)
    t = positive_turn(-alpha + math.atan2(-ca + cb, d + sa - sb) + 0.5 * p)
    return True, t, p, positive_turn(beta - alpha - t + p)
