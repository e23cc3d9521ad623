"""Moving things in the local costmap: which clusters of cells move, and how fast.

Lethal cells that touch each other are one cluster. A cluster is followed from one update of the
costmap to the next by the nearest centre. It counts as moving when its centre has moved farther
than the cluster's radius: a still thing of which more and more is seen shifts its centre less. Its
velocity is the slope of the least-squares line through its centres of the last HISTORY_S.

A person hides the cells that they have left from the lidar, so that these stay lethal: a cluster
behind another is not followed. In open space the layer clears no cells at all by default, and
pieces of walls that come into sight may count as moving (docs/harmony.md).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from drake_navbench.kernels.grid import LETHAL, Costmap
from drake_navbench.kernels.read_only import read_only

Array = NDArray[np.float64]

# A cluster that reaches farther than this from its centre is a wall or furniture, m.
LARGEST_RADIUS_M = 0.8
# A velocity needs FEWEST_CENTRES centres that are no older than HISTORY_S, s.
HISTORY_S, FEWEST_CENTRES = 0.9, 3
MOST_CENTRES = 20
# A cluster continues a track if its centre is within GATE_M m of the track's expected place, and
# GATE_MPS m more for each second since the track's last centre.
GATE_M, GATE_MPS = 0.15, 2.0
# A cluster slower than SLOWEST_MPS counts as still, m/s. A hidden moving cluster is moved on at its
# velocity for HIDDEN_S, s.
SLOWEST_MPS, HIDDEN_S = 0.2, 0.6
EIGHT_NEIGHBOURS = np.ones((3, 3), dtype=int)


class Tracks(NamedTuple):
    """The followed clusters after an update of the costmap; arrays are read-only.

    stamp_s: of the update. centres: (T, MOST_CENTRES, 3) time s, x m, y m, newest last, NaN where
    there were fewer. radii: (T,) of the farthest cell from the centre, m.
    """

    stamp_s: float
    centres: Array
    radii: Array


NO_TRACKS = Tracks(-np.inf, read_only(np.empty((0, MOST_CENTRES, 3))), read_only(np.empty(0)))


def clusters(costmap: Costmap, position: Array) -> tuple[Array, Array]:
    """Returns centres (C, 2) m and radii (C,) m of small clusters in sight of a position (2,) m."""
    labels, count = ndimage.label(costmap.costs == LETHAL, EIGHT_NEIGHBOURS)
    rows, columns = np.nonzero(labels)
    index = labels[rows, columns] - 1
    x = costmap.origin_x + (columns + 0.5) * costmap.resolution
    y = costmap.origin_y + (rows + 0.5) * costmap.resolution
    cells = np.bincount(index, minlength=count)
    centres = np.stack([np.bincount(index, part, count) / cells for part in (x, y)], axis=1)
    away = np.hypot(x - centres[index, 0], y - centres[index, 1])
    radii = np.zeros(count)
    np.maximum.at(radii, index, away)
    radii += 0.5 * costmap.resolution
    is_small = radii <= LARGEST_RADIUS_M
    centres, radii = centres[is_small], radii[is_small]
    away = centres - position
    far_m, bearings = np.hypot(*away.T), np.arctan2(away[:, 1], away[:, 0])
    off = np.abs(np.angle(np.exp(1j * (bearings[:, None] - bearings))))
    half = np.arcsin(np.minimum(radii / np.maximum(far_m, radii), 1.0))
    in_sight = ~((far_m < far_m[:, None]) & (off < half)).any(axis=1)
    return centres[in_sight], radii[in_sight]


def followed(tracks: Tracks, costmap: Costmap, position: Array) -> Tracks:
    """Returns the tracks after one more costmap, seen from a position (2,) m.

    They are unchanged if the costmap is not newer.
    """
    time_s = costmap.stamp_s
    if time_s <= tracks.stamp_s:
        return tracks
    centres, radii = clusters(costmap, position)
    expected, velocities = _now(tracks, time_s)
    unseen_s = time_s - tracks.centres[:, -1, 0]
    seen_before = _matches(expected, centres, GATE_M + GATE_MPS * unseen_s)
    later = np.full((len(centres), MOST_CENTRES, 3), np.nan)
    later[:, -1, 0], later[:, -1, 1:] = time_s, centres
    for new, old in seen_before:
        later[new, :-1] = tracks.centres[old, 1:]
    is_hidden = _moves(tracks, velocities) & (unseen_s <= HIDDEN_S)
    is_hidden[[old for _, old in seen_before]] = False
    return Tracks(
        time_s,
        read_only(np.concatenate([later, tracks.centres[is_hidden]])),
        read_only(np.concatenate([radii, tracks.radii[is_hidden]])),
    )


def moving_things(tracks: Tracks, time_s: float) -> Array:
    """Returns the moving things at a time, (M, 5): x m, y m, velocity x and y m/s, radius m."""
    places, velocities = _now(tracks, time_s)
    moves = _moves(tracks, velocities)
    return np.column_stack([places, velocities, tracks.radii])[moves]


def _now(tracks: Tracks, time_s: float) -> tuple[Array, Array]:
    """Returns places (T, 2) m at a time and velocities (T, 2) m/s, by lines fitted to centres."""
    times, places = tracks.centres[:, :, 0], tracks.centres[:, :, 1:]
    newest = times[:, -1]
    counts = ~(np.isnan(times) | (times < newest[:, None] - HISTORY_S))
    number = np.maximum(counts.sum(axis=1), 1)
    shares = counts / number[:, None]
    since = np.where(counts, times - newest[:, None], 0.0)
    mean_s = (shares * since).sum(axis=1)
    filled = np.where(counts[:, :, None], places, 0.0)
    mean = (shares[:, :, None] * filled).sum(axis=1)
    off_s = np.where(counts, since - mean_s[:, None], 0.0)
    spread = (off_s**2).sum(axis=1)
    slopes = (off_s[:, :, None] * (filled - mean[:, None])).sum(axis=1)
    is_known = (number >= FEWEST_CENTRES) & (spread > 0.0)
    velocities = np.where(is_known, 1.0 / np.where(is_known, spread, 1.0), 0.0)[:, None] * slopes
    after_s = np.where(is_known, time_s - newest - mean_s, 0.0)
    start = np.where(is_known[:, None], mean, places[:, -1])
    return start + velocities * after_s[:, None], velocities


def _moves(tracks: Tracks, velocities: Array) -> NDArray[np.bool_]:
    """Returns flags (T,) of the clusters that have moved by more than their own radius."""
    times, places = tracks.centres[:, :, 0], tracks.centres[:, :, 1:]
    is_recent = times >= times[:, -1:] - HISTORY_S
    away = np.hypot(*np.moveaxis(places - places[:, -1:], 2, 0))
    gone_m = np.max(np.where(is_recent, away, 0.0), axis=1, initial=0.0)
    return (gone_m > tracks.radii) & (np.hypot(*velocities.T) > SLOWEST_MPS)


def _matches(expected: Array, centres: Array, gates: Array) -> list[tuple[int, int]]:
    """Returns pairs (new, old) of clusters and tracks, the nearest ones first."""
    away = np.hypot(*np.moveaxis(centres[:, None] - expected[None], 2, 0))
    order = np.argsort(away, axis=None, kind="stable")
    found: list[tuple[int, int]] = []
    new_ones: set[int] = set()
    old_ones: set[int] = set()
    for place in order:
        new, old = divmod(int(place), len(expected))
        if away[new, old] > gates[old]:
            continue
        if new not in new_ones and old not in old_ones:
            found.append((new, old))
            new_ones.add(new)
            old_ones.add(old)
    return found
