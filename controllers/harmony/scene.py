"""The optimisation problem of one cycle as kernels take it: path, limits, obstacles, weights."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.controllers.harmony.motion import ALPHA, YAW, A, V, W, X, Y
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.distance_field import DistanceField, pose_clearance

Array = NDArray[np.float64]

# A reference has x m, y m, yaw rad of the path's nearest point, and the speed wanted there m/s.
REFERENCE_SIZE = 4
# In the last APPROACH_M m before the goal the wanted heading turns from the path's to the goal's.
APPROACH_M = 1.5
# Rounding errors of the bounds on reachable velocities, m/s and rad/s.
REACHABLE_SLACK = 1e-3
# How much closer than at its start a plan may come to obstacles that are too near already, m.
START_SLACK_M = 0.01
# How quickly a plan makes up for the clearance that its start lacks for its turn rate, m/s.
RECOVERY_MPS = 0.03


class Limits(NamedTuple):
    """Hard limits of plans, all positive.

    Speeds m/s, turn rate rad/s, accelerations m/s^2 and rad/s^2 (lateral: v times w), jerks m/s^3
    and rad/s^3; wheel_speed of either wheel, half_track m from the middle to a wheel; clearance of
    the discs from lethal cells, m; sweep: by how much it grows in a turn, m for each rad/s.
    """

    forward_speed: float
    backward_speed: float
    turn_rate: float
    acceleration: float
    angular_acceleration: float
    jerk: float
    angular_jerk: float
    wheel_speed: float
    half_track: float
    lateral_acceleration: float
    clearance: float
    sweep: float


class Scene(NamedTuple):
    """One cycle's program.

    dt s. target: (3,) pose that plans aim at. nears_goal: 1 where that is the goal, and its yaw
    counts. references: (N + 1, 4), see REFERENCE_SIZE, yaw unwrapped along the guess. field, discs
    (D, 2) offset along x and radius, m. required: (N + 1,) m, clearance of discs without a turn.
    low, high: (N + 1, 2) bounds of v and w. limit_share: the share of a limit above which the term
    `constraints` counts. weights: (12,), in the order of `terms.TERMS`.
    """

    dt: float
    target: Array
    nears_goal: float
    references: Array
    field: DistanceField
    discs: Array
    required: Array
    low: Array
    high: Array
    limits: Limits
    limit_share: float
    weights: Array


@njit(cache=True)
def nearest_on_path(path, x, y, first, window):
    """Returns (index, x, y, yaw) of the path's point nearest to (x, y), from segment `first` on.

    path: (P, 3), P >= 1. At most `window` segments are searched; yaw is along the segment.
    """
    last = path.shape[0] - 1
    if last == 0:
        return 0, path[0, 0], path[0, 1], path[0, 2]
    best = np.inf
    found = (first, path[first, 0], path[first, 1], path[first, 2])
    for i in range(first, min(first + window, last)):
        dx, dy = path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1]
        squared = dx * dx + dy * dy
        share = 0.0
        if squared > 0.0:
            share = ((x - path[i, 0]) * dx + (y - path[i, 1]) * dy) / squared
            share = min(max(share, 0.0), 1.0)
        px, py = path[i, 0] + share * dx, path[i, 1] + share * dy
        distance = (x - px) ** 2 + (y - py) ** 2
        if distance < best:
            best = distance
            yaw = np.arctan2(dy, dx) if squared > 0.0 else path[i, 2]
            found = (i, px, py, yaw)
    return found


@njit(cache=True)
def heading_wanted(scene, x, y, yaw):
    """Returns the heading wanted at a point of the path: that of the path, near a goal the goal's.

    The path of a planner without headings reaches the goal from any side. If the robot turned only
    at the goal, it would have to turn in place.
    """
    if scene.nears_goal <= 0.0:
        return yaw
    left = math.hypot(scene.target[0] - x, scene.target[1] - y)
    if left >= APPROACH_M:
        return yaw
    return yaw + (1.0 - left / APPROACH_M) * wrap(scene.target[2] - yaw)


@njit(cache=True)
def references_along(scene, path, plan, window):
    """Returns (N + 1, 4) the references of a plan: the path's points nearest to its stages."""
    count = plan.shape[0]
    references = np.empty((count, REFERENCE_SIZE))
    # A variable, not 0: numba would compile `nearest_on_path` for a literal 0, and once more for
    # any number.
    index = np.int64(0)
    for k in range(count):
        index, x, y, yaw = nearest_on_path(path, plan[k, X], plan[k, Y], index, window)
        references[k, 0], references[k, 1] = x, y
        wanted = heading_wanted(scene, x, y, yaw)
        references[k, 2] = plan[k, YAW] + wrap(wanted - plan[k, YAW])
        references[k, 3] = scene.references[k, 3]
    return references


@njit(cache=True)
def wanted_speeds(count, dt, speed, top, acceleration, distance):
    """Returns (count,) m/s: as fast as allowed, and slow enough to stop in `distance` m."""
    speeds = np.empty(count)
    left = distance
    for k in range(count):
        speeds[k] = speed
        left -= dt * speed
        stoppable = np.sqrt(2.0 * acceleration * max(left, 0.0))
        speed = max(min(top, speed + acceleration * dt, stoppable), 0.0)
    return speeds


@njit(cache=True)
def _reachable(value, rate, limit, jerk, dt, count):
    """Returns the least velocity at each stage when braking from now on, (count,)."""
    least = np.empty(count)
    for k in range(count):
        least[k] = value
        # As much jerk as reaches the rate's limit by the next stage, and no more.
        change = max(-jerk, (-limit - rate) / dt)
        value += dt * rate + 0.5 * dt * dt * change
        rate += dt * change
    return least


@njit(cache=True)
def velocity_bounds(start, limits, dt, count):
    """Returns (low, high) (count, 2): the limits of v and w, wider while a start cannot keep them.

    start: (9,) state. If a limit falls below the present speed, plans brake as hard as allowed.
    """
    low, high = np.empty((count, 2)), np.empty((count, 2))
    tops = (limits.forward_speed, limits.turn_rate)
    bottoms = (-limits.backward_speed, -limits.turn_rate)
    rates = (limits.acceleration, limits.angular_acceleration)
    jerks = (limits.jerk, limits.angular_jerk)
    for axis in range(2):
        value, rate = start[V + axis], start[A + axis]
        falling = _reachable(value, rate, rates[axis], jerks[axis], dt, count)
        rising = _reachable(-value, -rate, rates[axis], jerks[axis], dt, count)
        for k in range(count):
            high[k, axis] = max(tops[axis], falling[k] + REACHABLE_SLACK)
            low[k, axis] = min(bottoms[axis], -rising[k] - REACHABLE_SLACK)
    return low, high


@njit(cache=True)
def required_clearances(field, discs, start, limits, dt, count):
    """Returns the clearance required without a turn at each stage, (count,) m.

    It is less if the start has less.

    A plan cannot give its start more room; a moving robot may even come a bit closer before it can
    turn away. What the start lacks for its turn rate, the plan makes up for.
    """
    here = pose_clearance(field, discs, start[X], start[Y], start[YAW]) - START_SLACK_M
    straight = min(limits.clearance, here)
    lacking = straight + limits.sweep * abs(start[W]) - here
    return straight - np.maximum(lacking - RECOVERY_MPS * dt * np.arange(count), 0.0)


def make_start(pose: Array, v: float, w: float, a: float = 0.0, alpha: float = 0.0) -> Array:
    """Returns (9,) the first stage of plans: a pose (3,), velocities and accelerations."""
    start = np.zeros(9)
    start[:3] = pose
    start[V], start[W], start[A], start[ALPHA] = v, w, a, alpha
    return start
