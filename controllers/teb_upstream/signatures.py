"""H-signatures: the sides on which a trajectory passes obstacles.

In x, y and time (Bhattacharya et al. 2011) each obstacle is a conductor, and the field that its
current has along the trajectory tells the side; in the plane (Bhattacharya et al. 2010) one complex
number tells all. Formulas of teb_local_planner's h_signature.h (ros2-master), for obstacles that
stand.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

# The time at which an obstacle's conductor ends, s.
CONDUCTOR_END_S = 120.0
# Points that the field is read at in each interval.
FIELD_SAMPLES = 10
COINCIDENT_M = 1e-15
# In the plane: obstacles this close count as one, m; and the least size of the region, m.
SAME_OBSTACLE_M = 0.05
LEAST_REGION_M = 3.0
FEWEST_OBSTACLES = 5


class ClassRules(NamedTuple):
    """The rules for making and comparing signatures, and for the number of bands of the best class.

    in_time: signatures are in x, y and time; else in the plane, with `prescaler`.
    """

    in_time: bool
    prescaler: float
    threshold: float
    most_of_best: int


@njit(cache=True, error_model="numpy")
def signature(poses, steps, obstacles, rules):
    """Returns the signature of a trajectory among obstacles (N, 2) m.

    In time it is one number for each obstacle, in the plane real and imaginary part of one number.
    """
    if rules.in_time:
        return signature_in_time(poses, steps, obstacles)
    return signature_in_plane(poses, obstacles, rules.prescaler)


@njit(cache=True, error_model="numpy")
def same_class(first, second, rules):
    """Whether two trajectories with these signatures are of one class.

    In time: unless they pass an obstacle that matters to both on different sides. Signatures of
    different numbers of obstacles are of different classes.
    """
    if first.shape[0] != second.shape[0]:
        return False
    if rules.in_time:
        return same_sides(first, second, rules.threshold)
    is_same = True
    for k in range(first.shape[0]):
        is_same = is_same and abs(first[k] - second[k]) <= rules.threshold
    return is_same


@njit(cache=True, error_model="numpy")
def is_wanted(values, known, best, rules):
    """Whether a band with a signature (N,) is kept beside those with signatures `known` (C, N).

    best: (1, M) that of the best band's class, or (0, 0). One band is kept of each class, and of
    the best one's as many as the rules allow. A band whose signature is not finite is never kept.
    """
    for value in values:
        if not math.isfinite(value):
            return False
    is_known = False
    for k in range(known.shape[0]):
        is_known = is_known or same_class(values, known[k], rules)
    if not is_known:
        return True
    if best.shape[0] == 0 or not same_class(best[0], values, rules):
        return False
    count = 0
    for k in range(known.shape[0]):
        count += same_class(best[0], known[k], rules)
    return count < rules.most_of_best


@register_jitable(error_model="numpy")
def same_sides(first, second, threshold):
    """Whether no value (N,) of at least the threshold in both has another sign."""
    for k in range(first.shape[0]):
        if (
            abs(first[k]) >= threshold
            and abs(second[k]) >= threshold
            and (first[k] > 0.0) != (second[k] > 0.0)
        ):
            return False
    return True


@register_jitable(error_model="numpy")
def add_interval(start, end, xs, ys, totals, fields):
    """Adds one straight interval's contribution to fields (N,); not yet divided by 4 pi.

    start, end: (x m, y m, time s). xs, ys: (N,) of the obstacles, each side by side so that several
    are computed at once. totals: (N,) for its own use.
    """
    x, y, t = start
    dx, dy, dt = end[0] - x, end[1] - y, end[2] - t
    if math.sqrt(dx * dx + dy * dy + dt * dt) < COINCIDENT_M:
        return
    share = 1.0 / FIELD_SAMPLES
    step_x, step_y, step_t = share * dx, share * dy, share * dt
    for k in range(xs.shape[0]):
        totals[k] = 0.0
    for _ in range(FIELD_SAMPLES):
        left = CONDUCTOR_END_S - t
        for k in range(xs.shape[0]):
            a_x, a_y = xs[k] - x, ys[k] - y
            squared = a_x * a_x + a_y * a_y
            totals[k] += (
                (a_y * step_x - a_x * step_y)
                / squared
                * (left / math.sqrt(squared + left * left) + t / math.sqrt(squared + t * t))
            )
        x += step_x
        y += step_y
        t += step_t
    for k in range(xs.shape[0]):
        fields[k] += totals[k]


@njit(cache=True, error_model="numpy")
def signature_in_time(poses, steps, obstacles):
    """Returns (N,): positive where the obstacle lies to the left of the trajectory."""
    xs, ys = obstacles[:, 0].copy(), obstacles[:, 1].copy()
    fields, totals = np.zeros(xs.shape[0]), np.empty(xs.shape[0])
    time = 0.0
    for i in range(poses.shape[0] - 1):
        later = time + steps[i]
        start, end = (poses[i, 0], poses[i, 1], time), (poses[i + 1, 0], poses[i + 1, 1], later)
        add_interval(start, end, xs, ys, totals, fields)
        time = later
    return fields / (4.0 * math.pi)


@register_jitable(error_model="numpy")
def signature_in_plane(poses, obstacles, prescaler):
    """Returns (2,): real and imaginary part of the complex signature."""
    number = obstacles.shape[0]
    if number == 0:
        return np.zeros(2)
    order = max(number - 1, FEWEST_OBSTACLES)
    upper = math.ceil(order / 2.0)
    lower = order - upper
    start = complex(poses[0, 0], poses[0, 1])
    delta = complex(poses[-1, 0], poses[-1, 1]) - start
    if abs(delta) < LEAST_REGION_M:
        bottom_left = start - complex(0.0, LEAST_REGION_M)
        top_right = start + complex(LEAST_REGION_M, LEAST_REGION_M)
    else:
        normal = complex(-delta.imag, delta.real)
        bottom_left, top_right = start - normal, start + delta + normal
    total = complex(0.0, 0.0)
    for k in range(number):
        obstacle = complex(obstacles[k, 0], obstacles[k, 1])
        # In logarithms: the product over hundreds of obstacles leaves the range of a double.
        numerator = (obstacle - bottom_left) * (obstacle - top_right)
        log_size = math.log(prescaler * upper * lower * abs(numerator))
        angle = math.atan2(numerator.imag, numerator.real)
        for j in range(number):
            apart_x = obstacles[k, 0] - obstacles[j, 0]
            apart_y = obstacles[k, 1] - obstacles[j, 1]
            distance = math.sqrt(apart_x * apart_x + apart_y * apart_y)
            if j != k and distance >= SAME_OBSTACLE_M:
                log_size -= math.log(distance)
                angle -= math.atan2(apart_y, apart_x)
        swept = complex(0.0, 0.0)
        for i in range(poses.shape[0] - 1):
            first = complex(poses[i, 0], poses[i, 1]) - obstacle
            second = complex(poses[i + 1, 0], poses[i + 1, 1]) - obstacle
            if abs(first) == 0.0 or abs(second) == 0.0:
                continue
            turn = math.atan2(second.imag, second.real) - math.atan2(first.imag, first.real)
            if turn > math.pi:
                turn -= 2.0 * math.pi
            elif turn < -math.pi:
                turn += 2.0 * math.pi
            swept += complex(math.log(abs(second)) - math.log(abs(first)), turn)
        size = math.exp(log_size)
        total += complex(size * math.cos(angle), size * math.sin(angle)) * swept
    return np.array([total.real, total.imag])
