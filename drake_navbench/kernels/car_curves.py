"""Shortest curves of a car between two poses: Dubins' (forward only) and Reeds and Shepp's.

Poses are sequences of x, y and yaw in rad. A curve is up to five arcs of radius 1 and straight
lines. Arrays `kinds` (5,) hold LEFT, STRAIGHT, RIGHT or NONE, `lengths` (5,) rad of an arc or radii
of a line, negative where it is driven backwards. Of equally short curves the one that is tried
first is taken, in the order of OMPL 1.5, and its tolerances hold, so that planners built on it can
be compared to the last bit.
Sources: L. E. Dubins, "On curves of minimal length with a constraint on average curvature", 1957;
A. M. Shkel and V. Lumelsky, "Classification of the Dubins set", 2001; J. A. Reeds and L. A. Shepp,
"Optimal paths for a car that goes both forwards and backwards", 1990 (formulas 8.1 to 8.11, 8.3 and
8.11 with their misprints set right).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

PI = math.pi
TWO_PI = 2.0 * math.pi
HALF_PI = 0.5 * math.pi

LEFT, STRAIGHT, RIGHT, NONE = 1, 0, -1, 2
PIECES = 5
FARTHEST = float(np.finfo(np.float64).max)

DUBINS_EPSILON = 1e-6
DUBINS_ZERO = -1e-7
# Arcs of no length come out a little below 0.
LONGER = 1e-9
ZERO = 10.0 * float(np.finfo(np.float64).eps)


@njit(cache=True)
def shortest_curve(start, end, radius, reverses, kinds, lengths):
    """Writes the shortest curve between poses (3,) x, y, rad; returns its length.

    radius: of the tightest turn, in the units of x and y. reverses: Reeds and Shepp's curve, else
    Dubins'.
    """
    dx, dy = end[0] - start[0], end[1] - start[1]
    kinds[:] = NONE
    lengths[:] = 0.0
    if reverses:
        cosine, sine = math.cos(start[2]), math.sin(start[2])
        x, y = cosine * dx + sine * dy, -sine * dx + cosine * dy
        _reeds_shepp(x / radius, y / radius, end[2] - start[2], kinds, lengths)
        return radius * _total(lengths)
    distance = math.sqrt(dx * dx + dy * dy) / radius
    bearing = math.atan2(dy, dx)
    alpha, beta = _turn(start[2] - bearing), _turn(end[2] - bearing)
    _dubins(distance, alpha, beta, kinds, lengths)
    return radius * (lengths[0] + lengths[1] + lengths[2])


@njit(cache=True)
def curve_knots(yaw, kinds, lengths):
    """Returns (PIECES, 5) where each piece begins: x, y in radii from the start, yaw, sin, cos."""
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

    knots: of the curve. At its ends it is `start` and `end` themselves, whatever their yaw.
    """
    if share >= 1.0 or share <= 0.0:
        for i in range(3):
            pose[i] = end[i] if share >= 1.0 else start[i]
        return
    left = share * _total(lengths)
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
    """Returns how often a curve changes between forward and backward."""
    changes, last = 0, 0
    for i in range(PIECES):
        if lengths[i] != 0.0:
            direction = 1 if lengths[i] > 0.0 else -1
            if last != 0 and direction != last:
                changes += 1
            last = direction
    return changes


@njit(cache=True)
def _total(lengths):
    total = 0.0
    for i in range(PIECES):
        total += abs(lengths[i])
    return total


@njit(cache=True)
def _bounded(angle):
    """Returns an angle in [-pi, pi)."""
    value = _remainder(angle)
    if value < -PI:
        return value + TWO_PI
    return value - TWO_PI if value >= PI else value


@njit(cache=True)
def _remainder(angle):
    """Returns fmod(angle, 2 pi), at once below two turns, where that is exact."""
    size = abs(angle)
    if size < TWO_PI:
        return angle
    if size < 2.0 * TWO_PI:
        return math.copysign(size - TWO_PI, angle)
    return np.fmod(angle, TWO_PI)


# Dubins: distance in radii, headings alpha and beta against the line between the positions.


@njit(cache=True)
def _turn(angle):
    """Returns an angle in [0, 2 pi), what is nearly a full turn as none."""
    if DUBINS_ZERO < angle < 0.0:
        return 0.0
    turn = angle - TWO_PI * math.floor(angle / TWO_PI)
    return 0.0 if TWO_PI - turn < 0.5 * DUBINS_EPSILON else turn


@njit(cache=True)
def _dubins(d, alpha, beta, kinds, lengths):
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
    """Returns whether there is an arc, a line and an arc, and their lengths.

    trig: cosine and sine of alpha, then of beta. Where the middle alone is longer than `least` it
    does not go on, here and below.
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
        return True, _turn(-alpha + theta), p, _turn(beta - theta)
    if first == RIGHT and last == RIGHT:
        theta = math.atan2(ca - cb, d - sa + sb)
        return True, _turn(alpha - theta), p, _turn(-beta + theta)
    if first == RIGHT:
        theta = math.atan2(ca + cb, d - sa - sb) - math.atan2(2.0, p)
        return True, _turn(alpha - theta), p, _turn(beta - theta)
    theta = math.atan2(-ca - cb, d + sa + sb) - math.atan2(-2.0, p)
    return True, _turn(-alpha + theta), p, _turn(-beta + theta)


@njit(cache=True)
def _dubins_of_arcs(d, alpha, beta, trig, outer, least):
    """Returns whether there are three arcs, and their lengths."""
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
        t = _turn(alpha - math.atan2(ca - cb, d - sa + sb) + 0.5 * p)
        return True, t, p, _turn(alpha - beta - t + p)
    t = _turn(-alpha + math.atan2(-ca + cb, d + sa - sb) + 0.5 * p)
    return True, t, p, _turn(beta - alpha - t + p)


# Reeds and Shepp: from the origin, heading along x, to (x, y, phi), in radii. Each word is tried as
# it is, backwards in time, mirrored, and both.


@njit(cache=True)
def _wrapped(angle):
    """Returns an angle in [-pi, pi]."""
    value = _remainder(angle)
    if value < -PI:
        return value + TWO_PI
    return value - TWO_PI if value > PI else value


@njit(cache=True)
def _tau_omega(u, v, xi, eta, phi):
    delta = _wrapped(u - v)
    a = math.sin(u) - math.sin(delta)
    b = math.cos(u) - math.cos(delta) - 1.0
    angle = math.atan2(eta * a - xi * b, xi * a + eta * b)
    sign = 2.0 * (math.cos(delta) - math.cos(v) - math.cos(u)) + 3.0
    tau = _wrapped(angle + PI) if sign < 0.0 else _wrapped(angle)
    return tau, _wrapped(tau - u + v - phi)


# Words, by the number of the formula.
W1, W2, W3, W7, W8, W9, W10, W11 = 1, 2, 3, 7, 8, 9, 10, 11


@njit(cache=True)
def _word(formula, x, y, phi, sine, cosine, shortest):
    """Returns whether a word leads to (x, y, phi), and its lengths t, u, v.

    sine, cosine: of phi. Where u alone is as long as `shortest` it does not go on.
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
        # Squared again, as the distance is rounded there.
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
def _reeds_shepp(x, y, phi, kinds, lengths):
    lengths[0] = FARTHEST
    sine, cosine = math.sin(phi), math.cos(phi)
    # From the end back: the same words in the other order.
    xb = x * cosine + y * sine
    yb = x * sine - y * cosine
    here, back = (x, y, phi, sine, cosine), (xb, yb, phi, sine, cosine)
    shortest = _total(lengths)
    shortest = _try(W1, False, here, shortest, kinds, lengths)
    _try(W2, False, here, shortest, kinds, lengths)
    shortest = _total(lengths)
    shortest = _try(W3, False, here, shortest, kinds, lengths)
    _try(W3, True, back, shortest, kinds, lengths)
    shortest = _total(lengths)
    shortest = _try(W7, False, here, shortest, kinds, lengths)
    _try(W8, False, here, shortest, kinds, lengths)
    # These have a quarter of a turn more than t, u and v tell, or two.
    shortest = _total(lengths) - HALF_PI
    shortest = _try(W9, False, here, shortest, kinds, lengths)
    shortest = _try(W10, False, here, shortest, kinds, lengths)
    shortest = _try(W9, True, back, shortest, kinds, lengths)
    _try(W10, True, back, shortest, kinds, lengths)
    _try(W11, False, here, _total(lengths) - PI, kinds, lengths)


@njit(cache=True)
def _try(formula, is_back, target, shortest, kinds, lengths):
    """Tries a word in its four forms; writes it where it is shorter, returns what is shortest.

    target: x, y, phi, and the sine and cosine of phi, whose signs the four forms share.
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
