"""Moving things in the local costmap: where they are, how fast, and when they would touch.

A lethal cell is young until it has been lethal for STILL_S; a cell beside an old one is the jitter
of a still thing. Young cells in sight that are near each other are one thing, such as the two legs
of a person. A thing is followed from one update of the costmap to the next; its velocity is the
slope of the least-squares line through its last places, and counts where they fit that line.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse.csgraph import connected_components

from drake_navbench.kernels.grid import LETHAL, Costmap
from drake_navbench.kernels.outline_distance import outline_to_circles
from drake_navbench.kernels.poses import place_point
from drake_navbench.kernels.read_only import read_only

Array = NDArray[np.float64]

# A cell that has been lethal for STILL_S belongs to something still, s.
STILL_S = 0.8
# Young cells that are no farther apart are one thing, m: the feet of a person who walks are.
COVER, FAR = 1.5, 4.0
NEAR_M, BESIDE = 0.62, np.ones((3, 3))
# The disc of a body around its legs, and the largest half width of a thing that is followed, m.
BODY_M, LARGEST_M = 0.3, 0.8
# A thing is the one expected there if it is within GATE_M m, and GATE_MPS m more for each second.
GATE_M, GATE_MPS = 0.5, 1.0
# A velocity needs FEWEST places, is of the last MOST, faster than SLOWEST_MPS, and its line passes
# by them within SPREAD_M in the root mean square.
FEWEST, MOST, SLOWEST_MPS, SPREAD_M = 3, 6, 0.4, 0.2


class Tracks(NamedTuple):
    """What an update of the costmap adds to those before; arrays are read-only.

    costmap: of the update. since_s: (rows, columns) when each cell became lethal; inf if it is not.
    places: (T, MOST, 3) time s, x m, y m of each thing, newest last, NaN where there were fewer.
    radii: (T,) m.
    """

    costmap: Costmap
    since_s: Array
    places: Array
    radii: Array


def followed(tracks: Tracks | None, costmap: Costmap, position: Array) -> Tracks:
    """Returns the tracks after one more costmap, seen from a position (2,) m.

    They are unchanged if the costmap is not newer.
    """
    is_lethal, now_s = costmap.costs == LETHAL, costmap.stamp_s
    if tracks is None or tracks.costmap.costs.shape != costmap.costs.shape:
        since_s = np.where(is_lethal, -np.inf, np.inf)
        return Tracks(costmap, read_only(since_s), np.empty((0, MOST, 3)), np.empty(0))
    old = tracks.costmap
    if now_s <= old.stamp_s:
        return tracks
    moved = costmap.origin_y - old.origin_y, costmap.origin_x - old.origin_x
    shift = [-round(way / costmap.resolution) for way in moved]
    before = ndimage.shift(np.minimum(tracks.since_s, now_s), shift, order=0, cval=now_s)
    since_s = np.where(is_lethal, before, np.inf)
    is_old = ndimage.binary_dilation(since_s <= now_s - STILL_S, BESIDE)
    centres, radii = things(costmap, is_lethal & ~is_old, position)
    places = np.full((len(centres), MOST, 3), np.nan)
    places[:, -1, 0], places[:, -1, 1:] = now_s, centres
    expected = moving_at(tracks, now_s)[:, :2]
    away = np.hypot(*np.moveaxis(centres[:, None] - expected[None], 2, 0))
    gates = GATE_M + GATE_MPS * (now_s - tracks.places[:, -1, 0])
    while away.size and np.min(away - gates) <= 0.0:
        new, same = np.unravel_index(np.argmin(away - gates), away.shape)
        places[new, :-1] = tracks.places[same, 1:]
        away[new, :], away[:, same] = np.inf, np.inf
    return Tracks(costmap, read_only(since_s), read_only(places), read_only(radii))


def things(costmap: Costmap, is_young: NDArray[np.bool_], position: Array) -> tuple[Array, Array]:
    """Returns centres (C, 2) m and radii (C,) m of the things that young cells show in sight.

    position: (2,) m of the lidar. Cells behind nearer ones may be what a person has left.
    """
    rows, columns = np.nonzero(is_young)
    origin, half_m = np.array([costmap.origin_x, costmap.origin_y]), 0.5 * costmap.resolution
    cells = origin + costmap.resolution * np.stack([columns, rows], axis=1) + half_m
    away = cells - position
    far_m, bearings = np.hypot(*away.T), np.arctan2(away[:, 1], away[:, 0])
    off = np.abs(np.angle(np.exp(1j * (bearings[:, None] - bearings))))
    is_behind = (far_m[:, None] > far_m + FAR * half_m) & (off * far_m < COVER * half_m)
    in_sight = ~is_behind.any(axis=1)
    cells = cells[in_sight]
    apart_m = np.hypot(*np.moveaxis(cells[:, None] - cells, 2, 0))
    count, thing = connected_components(apart_m <= NEAR_M)
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, thing, cells)
    np.maximum.at(high, thing, cells)
    radii = np.maximum(0.5 * (high - low).max(axis=1, initial=0.0) + half_m, BODY_M)
    is_small = radii <= LARGEST_M
    return (0.5 * (low + high))[is_small], radii[is_small]


def moving_at(tracks: Tracks, time_s: float) -> Array:
    """Returns (T, 6) x m, y m, velocity x and y m/s, radius m, of each thing at a time; 1 if sure.

    A velocity that is not known is 0.
    """
    found = np.zeros((len(tracks.places), 6))
    for row, places, radius in zip(found, tracks.places, tracks.radii, strict=True):
        known = places[~np.isnan(places[:, 0])]
        row[:2], row[4] = known[-1, 1:], radius
        if len(known) < FEWEST:
            continue
        mean = known.mean(axis=0)
        off = known - mean
        velocity = off[:, 0] @ off[:, 1:] / (off[:, 0] @ off[:, 0])
        spread_m = math.sqrt(((off[:, 1:] - np.outer(off[:, 0], velocity)) ** 2).sum() / len(known))
        row[:2], row[2:4] = mean[1:] + (time_s - mean[0]) * velocity, velocity
        row[5] = spread_m <= SPREAD_M and math.hypot(*velocity) >= SLOWEST_MPS
    return found


@njit(cache=True)
def touches(moving, outline, poses, step_s, bound, until_s):
    """Returns whether moving discs come within `bound` m of an outline along poses (M, 3).

    One pose each step_s, and the last one from then on, until until_s. moving: (D, 6), see
    `moving_at`, at the first pose.
    """
    placed, disc = np.empty_like(outline), np.empty((1, 3))
    for m in range(math.ceil(until_s / step_s) + 1):
        x, y, yaw = poses[min(m, poses.shape[0] - 1)]
        cosine, sine = math.cos(yaw), math.sin(yaw)
        for k in range(outline.shape[0]):
            placed[k, 0], placed[k, 1] = place_point(
                outline[k, 0], outline[k, 1], x, y, cosine, sine
            )
        for d in range(moving.shape[0]):
            disc[0, 0] = moving[d, 0] + m * step_s * moving[d, 2]
            disc[0, 1] = moving[d, 1] + m * step_s * moving[d, 3]
            disc[0, 2] = moving[d, 4] + bound
            if outline_to_circles(placed, disc, math.inf) == 0.0:
                return True
    return False
