"""The aim of Vector Pursuit: the pose on the plan at the lookahead distance.

Source: vector_pursuit_controller (getCuspDist, getLookAheadPoint), branch master at 3f1b30a. A plan
is (M, 3): x m, y m, yaw rad, in the base frame.
"""

from __future__ import annotations

import math

from numba import njit

from drake_navbench.kernels.angles import TWO_PI, wrap


@njit(cache=True)
def cusp_distance(plan):
    """Returns the straight distance to the first cusp or turn in place, m; or inf."""
    for i in range(1, plan.shape[0] - 1):
        before_x, before_y = plan[i, 0] - plan[i - 1, 0], plan[i, 1] - plan[i - 1, 1]
        after_x, after_y = plan[i + 1, 0] - plan[i, 0], plan[i + 1, 1] - plan[i, 1]
        is_cusp = before_x * after_x + before_y * after_y < 0.0
        stood = before_x == 0.0 and before_y == 0.0 and plan[i - 1, 2] != plan[i, 2]
        stands = after_x == 0.0 and after_y == 0.0 and plan[i, 2] != plan[i + 1, 2]
        if is_cusp or stood or stands:
            return math.hypot(plan[i, 0], plan[i, 1])
    return math.inf


@njit(cache=True)
def circle_crossing(x_1, y_1, x_2, y_2, radius):
    """Returns (x, y) m where a segment crosses a circle about the robot.

    Weisstein, Circle-Line Intersection, MathWorld; the crossing on the segment is taken.
    """
    delta_x, delta_y = x_2 - x_1, y_2 - y_1
    squared_length = delta_x * delta_x + delta_y * delta_y
    cross = x_1 * y_2 - x_2 * y_1
    growth = (x_2 * x_2 + y_2 * y_2) - (x_1 * x_1 + y_1 * y_1)
    root = math.sqrt(radius * radius * squared_length - cross * cross)
    sign = math.copysign(1.0, growth)
    return (
        (cross * delta_y + sign * delta_x * root) / squared_length,
        (-cross * delta_x + sign * delta_y * root) / squared_length,
    )


@njit(cache=True)
def heading_between(plan, i, j):
    """Returns the heading from one pose of a plan to another, rad."""
    return math.atan2(plan[j, 1] - plan[i, 1], plan[j, 0] - plan[i, 0])


@njit(cache=True)
def mean_heading(yaw_1, yaw_2):
    """Returns half the sum of two headings counted from 0 to 2 pi, rad.

    As in the original, two headings on either side of 0 give the opposite one.
    """
    positive_1 = yaw_1 + TWO_PI if yaw_1 < 0.0 else yaw_1
    positive_2 = yaw_2 + TWO_PI if yaw_2 < 0.0 else yaw_2
    return wrap((positive_2 + positive_1) / 2.0)


@njit(cache=True)
def pose_ahead(plan, lookahead, use_interpolation, use_heading_from_path):
    """Returns (x, y, yaw): the first pose at least `lookahead` m straight from the robot.

    Interpolated, the pose lies at that distance, on the segment before. On a plan that stays nearer
    it is the last pose. Without `use_heading_from_path` it faces along the segment that leads to
    it, and the first pose along the segment that leaves it; the plan then has two poses or more.
    """
    count = plan.shape[0]
    i = 0
    while i < count and not math.hypot(plan[i, 0], plan[i, 1]) >= lookahead:
        i += 1
    if i == count:
        i = count - 1
    elif i > 0 and use_interpolation:
        x, y = circle_crossing(plan[i - 1, 0], plan[i - 1, 1], plan[i, 0], plan[i, 1], lookahead)
        if use_heading_from_path:
            return x, y, mean_heading(plan[i - 1, 2], plan[i, 2])
        return x, y, heading_between(plan, i - 1, i)
    elif i == 0:
        yaw = plan[0, 2] if use_heading_from_path else heading_between(plan, 0, 1)
        return plan[0, 0], plan[0, 1], yaw
    yaw = plan[i, 2] if use_heading_from_path else heading_between(plan, i - 1, i)
    return plan[i, 0], plan[i, 1], yaw
