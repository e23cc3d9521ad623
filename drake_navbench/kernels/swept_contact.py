"""The time at which a moving outline first touches a standing obstacle.

The motion within a step of an integrator is the cubic through the poses at both ends with the
velocities there (Hermite), as Drake's dense output has it. A touch on it is found by conservative
advancement: no touch happens before the gap divided by an upper bound of the outline's speed.
Source: B. Mirtich, "Impulse-based Dynamic Simulation of Rigid Body Systems", 1996.

States are x m, y m, yaw rad, v m/s, w rad/s, vy m/s: velocity forward, yaw rate and velocity to
the left. A footprint is (K, 2)
corners in the base frame, m. Obstacles are (N, 4) edges x0, y0, x1, y1 m of outlines, each
counter-clockwise, and (M, 3) circles x, y, radius m.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.outline_distance import outline_to_circles, outline_to_edges
from drake_navbench.kernels.poses import outline_at

# A parabola stays within this factor of the largest of its values at 0, 1/2 and 1.
PARABOLA_EXCESS = 1.25


@njit(cache=True)
def clearance_at(footprint, x, y, yaw, edges, circles, limit):
    """Returns the distance from a footprint at a pose to the obstacles, m; inf beyond `limit` m.

    It is 0 where they overlap, except where the footprint lies wholly inside one (see covers).
    """
    outline = outline_at(footprint, x, y, yaw)
    to_edges = outline_to_edges(outline, edges, limit)
    return min(to_edges, outline_to_circles(outline, circles, min(limit, to_edges)))


@njit(cache=True)
def covers(edges, circles, x, y):
    """Returns whether a point lies inside a standing obstacle."""
    # The winding number: outlines may overlap.
    turns = 0
    for n in range(edges.shape[0]):
        x0, y0, x1, y1 = edges[n, 0], edges[n, 1], edges[n, 2], edges[n, 3]
        if (y0 <= y) != (y1 <= y) and x < x0 + (y - y0) * (x1 - x0) / (y1 - y0):
            turns += 1 if y1 > y0 else -1
    for m in range(circles.shape[0]):
        if math.hypot(x - circles[m, 0], y - circles[m, 1]) <= circles[m, 2]:
            return True
    return turns != 0


@njit(cache=True)
def pose_within_step(start, end, duration, share):
    """Returns (x m, y m, yaw rad) at a share, 0 to 1, of a step of `duration` s between states."""
    from_start = (2.0 * share - 3.0) * share * share + 1.0
    slope_start = ((share - 2.0) * share + 1.0) * share * duration
    slope_end = (share - 1.0) * share * share * duration
    start_rates, end_rates = _pose_rates(start), _pose_rates(end)
    pose = np.empty(3)
    for i in range(3):
        ends = from_start * start[i] + (1.0 - from_start) * end[i]
        pose[i] = ends + slope_start * start_rates[i] + slope_end * end_rates[i]
    return pose


@njit(cache=True)
def share_until_contact(footprint, start, end, duration, edges, circles, touching):
    """Returns the share, 0 to 1, of a step after which the outline first touches something.

    start, end: (6,) states at both ends of a step of `duration` s. touching: a gap of this many m
    or less is a touch. inf where there is none in this step.
    """
    speed = outline_speed_bound(footprint, start, end, duration)
    share = 0.0
    while share < 1.0:
        pose = pose_within_step(start, end, duration, share)
        reach = speed * (1.0 - share) * duration + touching
        gap = clearance_at(footprint, pose[0], pose[1], pose[2], edges, circles, reach)
        if gap <= touching:
            return share
        if math.isinf(gap):
            return math.inf
        share += gap / (speed * duration)
    gap = clearance_at(footprint, end[0], end[1], end[2], edges, circles, touching)
    return 1.0 if gap <= touching else math.inf


def soonest_contact_s(
    gap_m: float, *, speed_mps: float, acceleration_mps2: float, top_speed_mps: float
) -> float:
    """Returns the least time in which a point of an outline can cross a gap, s.

    speed_mps, acceleration_mps2, top_speed_mps: bounds of the points' speed now, of its growth, and
    of the speed at any time; inf without a bound.
    """
    if gap_m <= 0.0:
        return 0.0
    # gap = speed t + acceleration t^2 / 2
    root = math.sqrt(speed_mps * speed_mps + 2.0 * acceleration_mps2 * gap_m)
    return max(gap_m / top_speed_mps, 2.0 * gap_m / (speed_mps + root))


@njit(cache=True)
def outline_speed_bound(footprint, start, end, duration):
    """Returns an upper bound of the speed of the outline's points during a step, m/s."""
    radius = 0.0
    for k in range(footprint.shape[0]):
        radius = max(radius, math.hypot(footprint[k, 0], footprint[k, 1]))
    start_rates, end_rates = _pose_rates(start), _pose_rates(end)
    largest = np.empty(3)
    for i in range(3):
        # The derivative of the cubic is a parabola; its mean is that of the step.
        middle = 1.5 * (end[i] - start[i]) / duration - 0.25 * (start_rates[i] + end_rates[i])
        largest[i] = max(abs(start_rates[i]), abs(middle), abs(end_rates[i]))
    return PARABOLA_EXCESS * (math.hypot(largest[0], largest[1]) + radius * largest[2])


@njit(cache=True)
def _pose_rates(state):
    """Returns the time derivatives of x, y and yaw."""
    cos_yaw, sin_yaw = math.cos(state[2]), math.sin(state[2])
    v, w, vy = state[3], state[4], state[5]
    return v * cos_yaw - vy * sin_yaw, v * sin_yaw + vy * cos_yaw, w
