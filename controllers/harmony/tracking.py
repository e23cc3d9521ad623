"""Moving things in the local costmap: where they are, how fast, and whether they would touch.

A lethal cell is old after STILL_S, and so are all that it leads to over gaps of up to two cells, as
in a wall that comes into sight. Young cells in sight that are near each other are one thing, such
as the legs of a person, which stands if one of them gets old. A thing is followed over updates, for
COAST_S unseen; its velocity is the slope of the least-squares line through its last places.
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
# Least radius, of a body around the legs that a low lidar sees, and largest width of a thing, m. A
# single cell is no thing: a wall that the beams graze comes into sight so.
BODY_M, LARGEST_M, FEWEST_CELLS = 0.3, 1.5, 2
# A thing is one that was expected within GATE_M m, and GATE_MPS m more for each second. Faster than
# SLOWEST_MPS it is expected for COAST_S after the last update that shows it.
GATE_M, GATE_MPS, COAST_S = 0.5, 1.0, 0.7
# A velocity needs FEWEST of the last MOST places. It is sure above SLOWEST_MPS, if the places are
# within SPREAD_M of its line, in the root mean square, and the thing's rear, too, has moved by
# REAR_M: what comes into sight grows, and its rear stands. Else its front has come nearer to the
# lidar by COMES_M and by at least the share STRAIGHT of its way.
FEWEST, MOST, SLOWEST_MPS, SPREAD_M, REAR_M = 3, 6, 0.4, 0.2, 0.1
COMES_M, STRAIGHT = 0.3, 0.8


class Tracks(NamedTuple):
    """Costmap and the things in it, followed until then; arrays are read-only.

    since_s: (rows, columns) when each cell became lethal, inf if it is not, -inf if it is old.
    places: (T, MOST, 5) time s and box (least x, y, largest x, y) m of each thing, newest last, NaN
    where there were fewer. The newest is older than the costmap where that does not show the thing.
    lidar: (2,) m, where it was when the costmap came.
    """

    costmap: Costmap
    since_s: Array
    places: Array
    lidar: Array


def followed(tracks: Tracks | None, costmap: Costmap, position: Array) -> Tracks:
    """Returns the tracks after one more costmap, seen by a lidar at a position (2,) m.

    They are unchanged if the costmap is not newer. Of the first one only what is larger than
    LARGEST_M, as walls are, counts as still at once.
    """
    is_lethal, now_s = costmap.costs == LETHAL, costmap.stamp_s
    if tracks is None or tracks.since_s.shape != is_lethal.shape:
        parts, _ = ndimage.label(ndimage.binary_dilation(is_lethal, BESIDE), BESIDE)
        since_s = np.where(is_lethal, now_s, np.inf)
        for number, box in enumerate(ndimage.find_objects(parts), 1):
            if max(part.stop - part.start for part in box) * costmap.resolution > LARGEST_M:
                since_s[is_lethal & (parts == number)] = -np.inf
        return Tracks(costmap, read_only(since_s), np.empty((0, MOST, 5)), position)
    old = tracks.costmap
    if now_s <= old.stamp_s:
        return tracks
    rolled_m = old.origin_y - costmap.origin_y, old.origin_x - costmap.origin_x
    shift = [round(way / costmap.resolution) for way in rolled_m]
    before = ndimage.shift(np.minimum(tracks.since_s, now_s), shift, order=0, cval=now_s)
    since_s = np.where(is_lethal, before, np.inf)
    is_near = ndimage.binary_dilation(is_lethal, BESIDE)
    is_old = ndimage.binary_propagation(since_s <= now_s - STILL_S, BESIDE, is_near)
    was_young = np.isfinite(since_s) & (since_s < now_s)
    cells = seen_cells(costmap, is_lethal & (was_young | ~is_old), position)
    boxes, is_still = things(costmap, cells, is_old[tuple(cells.T)])
    since_s[is_old & is_lethal] = -np.inf
    since_s[tuple(cells[is_still].T)] = -np.inf
    places = np.full((len(boxes), MOST, 5), np.nan)
    places[:, -1, 0], places[:, -1, 1:] = now_s, boxes
    centres = 0.5 * (boxes[:, :2] + boxes[:, 2:])
    expected, unseen_s = moving_at(tracks, now_s), now_s - tracks.places[:, -1, 0]
    away = np.hypot(*np.moveaxis(centres[:, None] - expected[:, :2], 2, 0))
    away[away > GATE_M + GATE_MPS * unseen_s] = np.inf
    is_kept = (np.hypot(*expected[:, 2:4].T) >= SLOWEST_MPS) & (unseen_s <= COAST_S)
    while np.min(away, initial=np.inf) < np.inf:
        new, same = np.unravel_index(np.argmin(away), away.shape)
        places[new, :-1] = tracks.places[same, 1:]
        away[new, :], away[:, same], is_kept[same] = np.inf, np.inf, False
    places = np.concatenate([places, tracks.places[is_kept]])
    return Tracks(costmap, read_only(since_s), read_only(places), position)


def seen_cells(costmap: Costmap, is_young: NDArray[np.bool_], position: Array) -> NDArray[np.intp]:
    """Returns (N, 2) row and column of the young cells that are in sight of a lidar at (2,) m.

    A cell out of sight may be one that a person has left.
    """
    row_column = np.argwhere(is_young)
    away = _centres(costmap, row_column) - position
    far_m, bearings = np.hypot(*away.T), np.arctan2(away[:, 1], away[:, 0])
    off = np.abs(np.angle(np.exp(1j * (bearings[:, None] - bearings))))
    is_behind = far_m[:, None] > far_m + BEHIND_CELLS * costmap.resolution
    is_behind &= off * far_m < BESIDE_CELLS * costmap.resolution
    return row_column[~is_behind.any(axis=1)]


def things(
    costmap: Costmap, cells: NDArray[np.intp], is_old: NDArray[np.bool_]
) -> tuple[Array, NDArray[np.bool_]]:
    """Returns the boxes (T, 4) of things that may move, and (N,) which cells belong to what stands.

    cells: (N, 2) lethal cells, row and column; neighbours form a thing. is_old: (N,) cells lethal
    for so long that they stand; then the whole thing stands. A box is least x, y, largest x, y, m.
    """
    centres = _centres(costmap, cells)
    apart_m = np.hypot(*np.moveaxis(centres[:, None] - centres, 2, 0))
    count, thing = connected_components(apart_m <= NEAR_M)
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, thing, centres)
    np.maximum.at(high, thing, centres)
    is_still = np.isin(np.arange(count), thing[is_old])
    is_thing = ~is_still & (np.bincount(thing, minlength=count) >= FEWEST_CELLS)
    is_thing &= (high - low).max(axis=1, initial=0.0) <= LARGEST_M
    half_m = 0.5 * costmap.resolution
    return np.hstack([low - half_m, high + half_m])[is_thing], is_still[thing]


def _centres(costmap: Costmap, row_column: NDArray[np.intp]) -> Array:
    origin = np.array([costmap.origin_x, costmap.origin_y])
    return origin + costmap.resolution * (row_column[:, ::-1] + 0.5)


def moving_at(tracks: Tracks, time_s: float, most: int = MOST) -> Array:
    """Returns (T, 6) of each thing at a time: x m, y m, velocity x and y m/s, radius m, 1 if sure.

    A velocity of fewer than FEWEST places is 0.
    """
    found = np.zeros((len(tracks.places), 6))
    for row, places in zip(found, tracks.places[:, -most:], strict=True):
        known = places[~np.isnan(places[:, 0])]
        middles, halves = 0.5 * (known[:, 1:3] + known[:, 3:]), 0.5 * (known[:, 3:] - known[:, 1:3])
        row[:2], row[4] = middles[-1], max(halves[-1].max(), BODY_M)
        if len(known) < FEWEST:
            continue
        since = known[:, 0] - known[:, 0].mean()
        mean, off = middles.mean(axis=0), middles - middles.mean(axis=0)
        velocity = since @ off / (since @ since)
        spread_m = math.sqrt(((off - np.outer(since, velocity)) ** 2).sum() / len(known))
        row[:2], row[2:4] = mean + (time_s - known[:, 0].mean()) * velocity, velocity
        speed = math.hypot(*velocity)
        is_sure = spread_m <= SPREAD_M and speed >= SLOWEST_MPS
        row[5] = is_sure and _has_left(middles, halves, velocity / speed, tracks.lidar)
    return found


def _has_left(middles: Array, halves: Array, way: Array, lidar: Array) -> bool:
    """Tells whether a thing's rear has moved, or its front straight towards the lidar (2,) m.

    middles, halves: (K, 2) m of its boxes, newest last. way: (2,) the direction in which it goes. A
    wall that comes into sight grows sideways or away: what is nearer was free, and in sight.
    """
    along, half = middles @ way, halves @ np.abs(way)
    rear, front = along - half, along + half
    away = np.hypot(*np.maximum(np.abs(middles - lidar) - halves, 0.0).T)
    comes = away[0] - away[-1] >= max(STRAIGHT * (front[-1] - front[0]), COMES_M)
    return bool(comes or rear[-1] - rear[0] >= REAR_M)


@njit(cache=True)
def touches(moving, outline, poses, step_s, bound, until_s):
    """Returns (D,) which of moving discs come within `bound` m of an outline at poses (M, 3).

    One pose each step_s, and the last one from then on, until until_s; without poses all do.
    moving: (D, 6), as `moving_at` has them at the first pose.
    """
    found = np.full(moving.shape[0], poses.shape[0] == 0)
    placed, disc = np.empty_like(outline), np.empty((1, 3))
    for m in range(math.ceil(until_s / step_s) + 1 if poses.shape[0] > 0 else 0):
        x, y, yaw = poses[min(m, poses.shape[0] - 1)]
        cosine, sine = math.cos(yaw), math.sin(yaw)
        for k in range(outline.shape[0]):
            corner = place_point(outline[k, 0], outline[k, 1], x, y, cosine, sine)
            placed[k, 0], placed[k, 1] = corner
        for d in range(moving.shape[0]):
            disc[0, 0] = moving[d, 0] + m * step_s * moving[d, 2]
            disc[0, 1] = moving[d, 1] + m * step_s * moving[d, 3]
            disc[0, 2] = moving[d, 4] + bound
            if not found[d]:
                found[d] = outline_to_circles(placed, disc, math.inf) == 0.0
    return found
