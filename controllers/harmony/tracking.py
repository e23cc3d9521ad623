"""Moving things in the local costmap: where they are, how fast, and whether they would touch.

A lethal cell is old after STILL_S, and so are all that it leads to over gaps of up to two cells, as
in a wall that comes into sight. Young cells in sight that are near each other are one thing, such
as the legs of a person. A thing is followed over updates of the costmap; its velocity is the slope
of the least-squares line through its last places.
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

STILL_S, BESIDE = 0.8, np.ones((3, 3))
# Young cells that are no farther apart are one thing, m: the feet of a person who walks are.
NEAR_M = 0.62
# A cell is out of sight behind one that is nearer by 2 cells and within 0.75 cells of its line.
BEHIND_CELLS, BESIDE_CELLS = 2.0, 0.75
# Least radius, of a body around the legs that a low lidar sees, and largest one of a thing, m.
BODY_M, LARGEST_M = 0.3, 0.8
# A thing is one that was expected within GATE_M m, and GATE_MPS m more for each second.
GATE_M, GATE_MPS = 0.5, 1.0
# A velocity needs FEWEST of the last MOST places. It is sure above SLOWEST_MPS, if the places are
# within SPREAD_M of its line, in the root mean square.
FEWEST, MOST, SLOWEST_MPS, SPREAD_M = 3, 6, 0.4, 0.2


class Tracks(NamedTuple):
    """Costmap and the things in it, followed until then; arrays are read-only.

    since_s: (rows, columns) when each cell became lethal, inf if it is not. places: (T, MOST, 3)
    time s, x m, y m of each thing, newest last, NaN where there were fewer. radii: (T,) m.
    """

    costmap: Costmap
    since_s: Array
    places: Array
    radii: Array


def followed(tracks: Tracks | None, costmap: Costmap, position: Array) -> Tracks:
    """Returns the tracks after one more costmap, seen by a lidar at a position (2,) m.

    They are unchanged if the costmap is not newer. What the first one shows counts as still.
    """
    is_lethal, now_s = costmap.costs == LETHAL, costmap.stamp_s
    if tracks is None or tracks.since_s.shape != is_lethal.shape:
        since_s = np.where(is_lethal, -np.inf, np.inf)
        return Tracks(costmap, read_only(since_s), np.empty((0, MOST, 3)), np.empty(0))
    old = tracks.costmap
    if now_s <= old.stamp_s:
        return tracks
    rolled_m = old.origin_y - costmap.origin_y, old.origin_x - costmap.origin_x
    shift = [round(way / costmap.resolution) for way in rolled_m]
    before = ndimage.shift(np.minimum(tracks.since_s, now_s), shift, order=0, cval=now_s)
    since_s = np.where(is_lethal, before, np.inf)
    is_near = ndimage.binary_dilation(is_lethal, BESIDE)
    is_old = ndimage.binary_propagation(since_s <= now_s - STILL_S, BESIDE, is_near)
    centres, radii = things(costmap, is_lethal & ~is_old, position)
    places = np.full((len(centres), MOST, 3), np.nan)
    places[:, -1, 0], places[:, -1, 1:] = now_s, centres
    expected = moving_at(tracks, now_s)[:, :2]
    away = np.hypot(*np.moveaxis(centres[:, None] - expected, 2, 0))
    away -= GATE_M + GATE_MPS * (now_s - tracks.places[:, -1, 0])
    while away.size and np.min(away) <= 0.0:
        new, same = np.unravel_index(np.argmin(away), away.shape)
        places[new, :-1] = tracks.places[same, 1:]
        away[new, :], away[:, same] = np.inf, np.inf
    return Tracks(costmap, read_only(since_s), read_only(places), read_only(radii))


def things(costmap: Costmap, is_young: NDArray[np.bool_], position: Array) -> tuple[Array, Array]:
    """Returns centres (C, 2) m and radii (C,) m of the things that young cells in sight show.

    position: (2,) m of the lidar. A cell out of sight may be one that a person has left.
    """
    row_column = np.argwhere(is_young)
    half_m = 0.5 * costmap.resolution
    origin = np.array([costmap.origin_x, costmap.origin_y])
    cells = origin + costmap.resolution * row_column[:, ::-1] + half_m
    away = cells - position
    far_m, bearings = np.hypot(*away.T), np.arctan2(away[:, 1], away[:, 0])
    off = np.abs(np.angle(np.exp(1j * (bearings[:, None] - bearings))))
    is_behind = far_m[:, None] > far_m + BEHIND_CELLS * costmap.resolution
    is_behind &= off * far_m < BESIDE_CELLS * costmap.resolution
    cells = cells[~is_behind.any(axis=1)]
    apart_m = np.hypot(*np.moveaxis(cells[:, None] - cells, 2, 0))
    count, thing = connected_components(apart_m <= NEAR_M)
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, thing, cells)
    np.maximum.at(high, thing, cells)
    radii = np.maximum(0.5 * (high - low).max(axis=1, initial=0.0) + half_m, BODY_M)
    return (0.5 * (low + high))[radii <= LARGEST_M], radii[radii <= LARGEST_M]


def moving_at(tracks: Tracks, time_s: float) -> Array:
    """Returns (T, 6) of each thing at a time: x m, y m, velocity x and y m/s, radius m, 1 if sure.

    A velocity of fewer than FEWEST places is 0.
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
    """Returns whether moving discs come within `bound` m of an outline at poses (M, 3).

    One pose each step_s, and the last one from then on, until until_s; without poses they do.
    moving: (D, 6), as `moving_at` has them at the first pose.
    """
    if poses.shape[0] == 0:
        return True
    placed, disc = np.empty_like(outline), np.empty((1, 3))
    for m in range(math.ceil(until_s / step_s) + 1):
        x, y, yaw = poses[min(m, poses.shape[0] - 1)]
        cosine, sine = math.cos(yaw), math.sin(yaw)
        for k in range(outline.shape[0]):
            corner = place_point(outline[k, 0], outline[k, 1], x, y, cosine, sine)
            placed[k, 0], placed[k, 1] = corner
        for d in range(moving.shape[0]):
            disc[0, 0] = moving[d, 0] + m * step_s * moving[d, 2]
            disc[0, 1] = moving[d, 1] + m * step_s * moving[d, 3]
            disc[0, 2] = moving[d, 4] + bound
            if outline_to_circles(placed, disc, math.inf) == 0.0:
                return True
    return False
