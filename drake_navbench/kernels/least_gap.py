"""The least gap between an outline that moves in the plane and the standing and moving bodies.

The motion between two states is the cubic of `swept_contact`. The gap at any instant is bounded by
the gaps at two others, as no gap changes faster than the outline and the bodies can move. A span in
which it could fall below the least one so far is halved until it cannot.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.moving_bodies import place_discs, place_edges, poses_on_tracks
from drake_navbench.kernels.swept_contact import clearance_at, outline_speed_bound, pose_within_step

# The least gap is found to this much, m.
TOLERANCE_M = 1e-4
# Halvings of a step: the shortest span is then 20 ns of a step of 0.02 s.
MOST_HALVINGS = 20


class NearObstacles(NamedTuple):
    """The obstacles around an outline; arrays as in `swept_contact` and `moving_bodies`.

    edges (N, 4), circles (M, 3): standing obstacles. body_edges (E, 5), body_discs (D, 4): the
    parts of bodies on the tracks knots (K, 4), firsts (B + 1,), periods (B,). moving_speed: an
    upper bound of the speed of any point of a body, m/s.
    """

    edges: Array
    circles: Array
    body_edges: Array
    body_discs: Array
    knots: Array
    firsts: NDArray[np.int64]
    periods: Array
    moving_speed: float


@njit(cache=True)
def least_gap(footprint, times, states, is_step, around, least):
    """Returns the least gap, m, at or between states, or `least` where that is no larger.

    footprint: (K, 2) base frame, m. times: (T,) s, rising. states: (T, 6). is_step: (T - 1,)
    whether the robot moved from one state to the next; between other states no gap is measured.
    around: NearObstacles.
    """
    if times.shape[0] == 0:
        return least
    least = min(least, _gap(footprint, states[0, :3], times[0], around, least))
    for k in range(times.shape[0] - 1):
        least = min(least, _gap(footprint, states[k + 1, :3], times[k + 1], around, least))
        if is_step[k]:
            least = _least_in_step(
                footprint, states[k], states[k + 1], times[k], times[k + 1], around, least
            )
    return least


@njit(cache=True)
def _least_in_step(footprint, start, end, start_time, end_time, around, least):
    """Returns the least gap between two states, or `least` where that is no larger."""
    duration = end_time - start_time
    speed = outline_speed_bound(footprint, start, end, duration) + around.moving_speed
    if speed <= 0.0:
        return least
    # Spans that are still to be looked at: shares where they begin and end, and the gaps there.
    spans = np.empty((MOST_HALVINGS + 2, 4))
    reach = least + speed * duration
    first_gap = min(reach, _gap(footprint, start[:3], start_time, around, reach))
    last_gap = min(reach, _gap(footprint, end[:3], end_time, around, reach))
    _put(spans, np.int64(0), 0.0, 1.0, first_gap, last_gap)
    count = 1
    while count > 0:
        count -= 1
        first, last, first_gap, last_gap = spans[count]
        span = last - first
        bound = 0.5 * (first_gap + last_gap - speed * span * duration)
        if bound >= least - TOLERANCE_M or span * 2.0**MOST_HALVINGS < 1.0:
            continue
        middle = 0.5 * (first + last)
        pose = pose_within_step(start, end, duration, middle)
        reach = least + speed * duration
        gap = min(reach, _gap(footprint, pose, start_time + middle * duration, around, reach))
        least = min(least, gap)
        _put(spans, count, first, middle, first_gap, gap)
        _put(spans, count + 1, middle, last, gap, last_gap)
        count += 2
    return least


@njit(cache=True)
def _put(spans, row, first, last, first_gap, last_gap):
    """Writes a span; a row assigned as a whole would have numba compile its strings, 3 s."""
    spans[row, 0], spans[row, 1] = first, last
    spans[row, 2], spans[row, 3] = first_gap, last_gap


@njit(cache=True)
def _gap(footprint, pose, time, around, limit):
    """Returns the gap of an outline at a pose and a time, m; inf beyond `limit` m."""
    x, y, yaw = pose[0], pose[1], pose[2]
    limit = max(limit, 0.0)
    gap = clearance_at(footprint, x, y, yaw, around.edges, around.circles, limit)
    if around.periods.shape[0] == 0:
        return gap
    poses = poses_on_tracks(around.knots, around.firsts, around.periods, time)
    edges, discs = place_edges(around.body_edges, poses), place_discs(around.body_discs, poses)
    return min(gap, clearance_at(footprint, x, y, yaw, edges, discs, min(limit, gap)))
