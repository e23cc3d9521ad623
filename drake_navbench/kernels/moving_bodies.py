"""Bodies that move in the plane on given ways: their poses, and when a robot touches one.

A track is rows (time s, x m, y m, yaw rad), rising in time, between which the pose is linear in
time; before the first row and after the last one the body stands. A track with a period starts over
after its last row, whose pose is then that of the first. Tracks stand one below the other in one
array: those of body b are the rows firsts[b] to firsts[b + 1].

The parts of bodies are in their own frames: (E, 5) edges body, x0, y0, x1, y1 of outlines, and
(D, 4) discs body, x, y, radius.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.poses import place_point
from drake_navbench.kernels.swept_contact import clearance_at, outline_speed_bound, pose_within_step

# The coordinate of people who are not in the world: beyond all ranges.
FAR_AWAY_M = 1e6


@dataclass(frozen=True)
class Tracks:
    """The tracks of B bodies: knots (K, 4), firsts (B + 1,), periods_s (B,), 0 without a period."""

    knots: Array
    firsts: NDArray[np.int64]
    periods_s: Array

    @classmethod
    def of(cls, tracks: Sequence[Array], periods_s: Sequence[float] = ()) -> Tracks:
        """Returns the motions of bodies with the given rows (K, 4) each."""
        firsts = np.cumsum([0, *(len(rows) for rows in tracks)])
        knots = np.vstack([np.empty((0, 4)), *tracks])
        periods = np.array(periods_s, dtype=float) if periods_s else np.zeros(len(tracks))
        return cls(np.ascontiguousarray(knots), firsts.astype(np.int64), periods)

    @property
    def count(self) -> int:
        """The number of bodies."""
        return len(self.periods_s)

    def poses_at(self, time_s: float) -> Array:
        """Returns the poses of all bodies at a time: (B, 3) x m, y m, yaw rad."""
        return poses_on_tracks(self.knots, self.firsts, self.periods_s, time_s)

    def joined(self, other: Tracks) -> Tracks:
        """Returns these bodies, followed by the other ones."""
        return Tracks(
            np.vstack([self.knots, other.knots]),
            np.concatenate([self.firsts, self.firsts[-1] + other.firsts[1:]]),
            np.concatenate([self.periods_s, other.periods_s]),
        )


@njit(cache=True)
def first_later_row(knots, first, past, time):
    """Returns the first row from `first` up to `past` that is later than a time, else `past`."""
    low, high = first, past
    while low < high:
        middle = (low + high) // 2
        if knots[middle, 0] <= time:
            low = middle + 1
        else:
            high = middle
    return low


@njit(cache=True)
def poses_on_tracks(knots, firsts, periods, time):
    """Returns (B, 3) the poses of all bodies at a time, s."""
    poses = np.empty((periods.shape[0], 3))
    for body in range(periods.shape[0]):
        first, past = firsts[body], firsts[body + 1]
        own = time
        if periods[body] > 0.0 and own > knots[first, 0]:
            own = knots[first, 0] + (own - knots[first, 0]) % periods[body]
        low = first_later_row(knots, first, past, own)
        if low in (first, past):
            row = first if low == first else past - 1
            # Assigned as an array, it would have numba compile its strings, for an error message.
            for i in range(3):
                poses[body, i] = knots[row, i + 1]
            continue
        share = (own - knots[low - 1, 0]) / (knots[low, 0] - knots[low - 1, 0])
        for i in range(3):
            poses[body, i] = (1.0 - share) * knots[low - 1, i + 1] + share * knots[low, i + 1]
    return poses


@njit(cache=True)
def place_edges(edges, poses):
    """Returns (E, 4) the edges of bodies at poses (B, 3), world frame, m."""
    placed = np.empty((edges.shape[0], 4))
    for n in range(edges.shape[0]):
        x, y, yaw = poses[int(edges[n, 0])]
        cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
        for end in range(2):
            placed[n, 2 * end], placed[n, 2 * end + 1] = place_point(
                edges[n, 2 * end + 1], edges[n, 2 * end + 2], x, y, cos_yaw, sin_yaw
            )
    return placed


@njit(cache=True)
def place_discs(discs, poses):
    """Returns (D, 3) the discs of bodies at poses (B, 3): x, y, radius, world frame, m."""
    placed = np.empty((discs.shape[0], 3))
    for m in range(discs.shape[0]):
        x, y, yaw = poses[int(discs[m, 0])]
        placed[m, 0], placed[m, 1] = place_point(
            discs[m, 1], discs[m, 2], x, y, math.cos(yaw), math.sin(yaw)
        )
        placed[m, 2] = discs[m, 3]
    return placed


@njit(cache=True)
def share_until_contact_with_moving(
    footprint, start, end, span, parts, tracks, moving_speed, touching
):
    """Returns the share, 0 to 1, of a step after which the outline first touches a moving body.

    As `swept_contact.share_until_contact`, with both moving: a gap closes at most by the sum of the
    outline's speed bound and `moving_speed` m/s, an upper bound of the speed of the bodies' points.
    span: start and duration of the step, s. parts: edges and discs of the bodies. tracks: knots,
    firsts and periods_s of `Tracks`.
    """
    start_time, duration = span
    edges, discs = parts
    knots, firsts, periods = tracks
    speed = outline_speed_bound(footprint, start, end, duration) + moving_speed
    share = 0.0
    while share < 1.0:
        pose = pose_within_step(start, end, duration, share)
        poses = poses_on_tracks(knots, firsts, periods, start_time + share * duration)
        reach = speed * (1.0 - share) * duration + touching
        gap = clearance_at(
            footprint,
            pose[0],
            pose[1],
            pose[2],
            place_edges(edges, poses),
            place_discs(discs, poses),
            reach,
        )
        if gap <= touching:
            return share
        if math.isinf(gap):
            return math.inf
        share += gap / (speed * duration)
    poses = poses_on_tracks(knots, firsts, periods, start_time + duration)
    placed_edges, placed_discs = place_edges(edges, poses), place_discs(discs, poses)
    gap = clearance_at(footprint, end[0], end[1], end[2], placed_edges, placed_discs, touching)
    return 1.0 if gap <= touching else math.inf


@njit(cache=True)
def clearances_of_bodies(footprint, x, y, yaw, edges, discs, poses, limit):
    """Returns (B,) the distance from a footprint at a pose to each body, m; inf beyond `limit`."""
    gaps = np.full(poses.shape[0], math.inf)
    placed_edges, placed_discs = place_edges(edges, poses), place_discs(discs, poses)
    for n in range(edges.shape[0]):
        body = int(edges[n, 0])
        gap = clearance_at(footprint, x, y, yaw, placed_edges[n : n + 1], placed_discs[:0], limit)
        gaps[body] = min(gaps[body], gap)
    for m in range(discs.shape[0]):
        body = int(discs[m, 0])
        gap = clearance_at(footprint, x, y, yaw, placed_edges[:0], placed_discs[m : m + 1], limit)
        gaps[body] = min(gaps[body], gap)
    return gaps
