"""Reeds and Shepp's shortest curve of a car that drives forward and backward.

From the origin, heading along x, to (x, y, phi), in radii. Each word is tried as it is, backwards
in time, mirrored, and both. Of equally short curves the one that is tried first is taken, in the
order of OMPL 1.5, whose tolerances hold.
Source: J. A. Reeds and L. A. Shepp, "Optimal paths for a car that goes both forwards and
backwards", 1990 (formulas 8.1 to 8.11, 8.3 and 8.11 with their misprints set right).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.curve_pieces import (
    FARTHEST,
    LEFT,
    NONE,
    PIECES,
    RIGHT,
    STRAIGHT,
    TWO_PI,
    remainder,
    total_length,
)

PI = math.pi
HALF_PI = 0.5 * math.pi
ZERO = 10.0 * float(np.finfo(np.float64).eps)

# The words, by the numbers of their formulas; as numpy's numbers, since numba would compile the
# kernels anew for each plain one.
W1, W2, W3, W7, W8, W9, W10, W11 = map(np.int64, (1, 2, 3, 7, 8, 9, 10, 11))
AS_IT_IS, BACKWARDS = np.bool_(False), np.bool_(True)


@njit(cache=True)
def write_reeds_shepp(x, y, phi, kinds, lengths):
    """Writes the pieces of the shortest curve."""
    lengths[0] = FARTHEST
    sine, cosine = math.sin(phi), math.cos(phi)
    # The same words backwards in time: the pieces in the opposite order.
    xb = x * cosine + y * sine
    yb = x * sine - y * cosine
    here, back = (x, y, phi, sine, cosine), (xb, yb, phi, sine, cosine)
    shortest = total_length(lengths)
    shortest = _try(W1, AS_IT_IS, here, shortest, kinds, lengths)
    _try(W2, AS_IT_IS, here, shortest, kinds, lengths)
    shortest = total_length(lengths)
    shortest = _try(W3, AS_IT_IS, here, shortest, kinds, lengths)
    _try(W3, BACKWARDS, back, shortest, kinds, lengths)
    shortest = total_length(lengths)
    shortest = _try(W7, AS_IT_IS, here, shortest, kinds, lengths)
    _try(W8, AS_IT_IS, here, shortest, kinds, lengths)
    # These words have one or two quarter turns more than t, u and v tell.
    shortest = total_length(lengths) - HALF_PI
    shortest = _try(W9, AS_IT_IS, here, shortest, kinds, lengths)
    shortest = _try(W10, AS_IT_IS, here, shortest, kinds, lengths)
    shortest = _try(W9, BACKWARDS, back, shortest, kinds, lengths)
    _try(W10, BACKWARDS, back, shortest, kinds, lengths)
    _try(W11, AS_IT_IS, here, total_length(lengths) - PI, kinds, lengths)


@njit(cache=True)
def _try(formula, is_back, target, shortest, kinds, lengths):
    """Tries a word in its four forms, and writes the first that is shorter than `shortest`.

    Returns the least length. target: x, y, phi, and the sine and cosine of phi, whose signs the
    four forms share.
    """
    x, y, phi, sine, cosine = target
    for time, mirror in ((1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)):
        sign = time * mirror
        found, t, u, v = _word(
            formula, time * x, mirror * y, sign * phi, sign * sine, cosine, shortest
        )
        if not found:
            continue
        twice = 2.0 if formula in (W7, W8) else 1.0
        length = abs(t) + twice * abs(u) + abs(v)
        if shortest > length:
            shortest = length
            _write(formula, is_back, t, u, v, kinds, lengths)
            for i in range(PIECES):
                lengths[i] *= time
                if kinds[i] != NONE:
                    kinds[i] *= int(mirror)
    return shortest


@njit(cache=True)
def _word(formula, x, y, phi, sine, cosine, shortest):
    """Returns whether a word leads to (x, y, phi), and its lengths t, u, v.

    sine, cosine: sine and cosine of phi. Gives up where u alone is as long as `shortest`.
    """
    if formula in (W1, W3, W9):
        xi, eta = x - sine, y - 1.0 + cosine
    else:
        xi, eta = x + sine, y - 1.0 - cosine
    t = u = v = 0.0
    found = False
    distance = math.sqrt(xi * xi + eta * eta)
    if formula == W1:
        u = distance
        if u < shortest:
            t = math.atan2(eta, xi)
            if t >= -ZERO:
                v = _wrapped(phi - t)
                found = v >= -ZERO
    elif formula == W2:
        # Squared again, as the distance has been rounded.
        squared = distance * distance
        if squared >= 4.0:
            u = math.sqrt(squared - 4.0)
            if u < shortest:
                t = _wrapped(math.atan2(eta, xi) + math.atan2(2.0, u))
                v = _wrapped(t - phi)
                found = t >= -ZERO and v >= -ZERO
    elif formula == W3:
        if distance <= 4.0:
            u = -2.0 * math.asin(0.25 * distance)
            if -u < shortest:
                t = _wrapped(math.atan2(eta, xi) + 0.5 * u + PI)
                v = _wrapped(phi - t + u)
                found = t >= -ZERO and u <= ZERO
    elif formula == W7:
        rho = 0.25 * (2.0 + distance)
        if rho <= 1.0:
            u = math.acos(rho)
            if 2.0 * u < shortest:
                t, v = _tau_omega(u, -u, xi, eta, phi)
                found = t >= -ZERO and v <= ZERO
    elif formula == W8:
        rho = (20.0 - xi * xi - eta * eta) / 16.0
        if 0.0 <= rho <= 1.0:
            u = -math.acos(rho)
            if u >= -HALF_PI and -2.0 * u < shortest:
                t, v = _tau_omega(u, u, xi, eta, phi)
                found = t >= -ZERO and v >= -ZERO
    elif formula == W9:
        if distance >= 2.0:
            r = math.sqrt(distance * distance - 4.0)
            u = 2.0 - r
            if -u < shortest:
                t = _wrapped(math.atan2(eta, xi) + math.atan2(r, -2.0))
                v = _wrapped(phi - HALF_PI - t)
                found = t >= -ZERO and u <= ZERO and v <= ZERO
    elif formula == W10:
        if distance >= 2.0:
            u = 2.0 - distance
            if -u < shortest:
                t = math.atan2(xi, -eta)
                v = _wrapped(t + HALF_PI - phi)
                found = t >= -ZERO and u <= ZERO and v <= ZERO
    elif distance >= 2.0:
        u = 4.0 - math.sqrt(distance * distance - 4.0)
        if u <= ZERO and -u < shortest:
            angle = math.atan2((4.0 - u) * xi - 2.0 * eta, -2.0 * xi + (u - 4.0) * eta)
            t = _wrapped(angle)
            v = _wrapped(t - phi)
            found = t >= -ZERO and v >= -ZERO
    return found, t, u, v


@njit(cache=True)
def _tau_omega(u, v, xi, eta, phi):
    delta = _wrapped(u - v)
    a = math.sin(u) - math.sin(delta)
    b = math.cos(u) - math.cos(delta) - 1.0
    angle = math.atan2(eta * a - xi * b, xi * a + eta * b)
    sign = 2.0 * (math.cos(delta) - math.cos(v) - math.cos(u)) + 3.0
    tau = _wrapped(angle + PI) if sign < 0.0 else _wrapped(angle)
    return tau, _wrapped(tau - u + v - phi)


@njit(cache=True)
def _wrapped(angle):
    """Returns an angle in [-pi, pi]."""
    value = remainder(angle)
    if value < -PI:
        return value + TWO_PI
    return value - TWO_PI if value > PI else value


@njit(cache=True)
def _write(formula, is_back, t, u, v, kinds, lengths):
    """Writes the pieces of a word as it is."""
    kinds[:] = NONE
    lengths[:] = 0.0
    if formula in (W1, W2):
        kinds[0], kinds[1], kinds[2] = LEFT, STRAIGHT, LEFT if formula == W1 else RIGHT
        lengths[0], lengths[1], lengths[2] = t, u, v
    elif formula == W3:
        kinds[0], kinds[1], kinds[2] = LEFT, RIGHT, LEFT
        lengths[0], lengths[1], lengths[2] = (v, u, t) if is_back else (t, u, v)
    elif formula in (W7, W8):
        kinds[0], kinds[1], kinds[2], kinds[3] = LEFT, RIGHT, LEFT, RIGHT
        lengths[0], lengths[1], lengths[3] = t, u, v
        lengths[2] = -u if formula == W7 else u
    elif formula == W11:
        kinds[0], kinds[1], kinds[2], kinds[3], kinds[4] = LEFT, RIGHT, STRAIGHT, LEFT, RIGHT
        lengths[0], lengths[2], lengths[4] = t, u, v
        lengths[1] = lengths[3] = -HALF_PI
    elif not is_back:
        kinds[0], kinds[1], kinds[2], kinds[3] = LEFT, RIGHT, STRAIGHT, LEFT
        if formula == W10:
            kinds[3] = RIGHT
        lengths[0], lengths[1], lengths[2], lengths[3] = t, -HALF_PI, u, v
    else:
        kinds[0], kinds[1], kinds[2], kinds[3] = LEFT, STRAIGHT, RIGHT, LEFT
        if formula == W10:
            kinds[0] = RIGHT
        lengths[0], lengths[1], lengths[2], lengths[3] = v, u, -HALF_PI, t
