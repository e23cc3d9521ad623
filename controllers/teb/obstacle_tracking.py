"""Moving obstacles, found by the cells that successive costmaps gained and lost.

A costmap shows nothing but occupied cells. A cluster of them moves where it covers cells that an
earlier costmap saw free, or has left cells that are seen free now (motion_of_cells.py). That tells
it from a cluster that only comes into sight. costmap_converter, which does this for
teb_local_planner, subtracts a background instead and has no notion of sight.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controllers.teb.homotopy import find_clusters
from drake_navbench.controllers.teb.motion_of_cells import farthest_free_cell, nearest_labels
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.distance_field import DistanceField
from drake_navbench.kernels.grid import LETHAL, Costmap

Cells = NDArray[np.int64]

# Occupied cells with gaps of up to twice this belong to one thing, m.
HALF_GAP_M = 0.1
# Longer clusters are walls or rows of things, which stand, m.
LARGEST_M = 2.5
# Costmaps are compared with earlier ones no older than this, s.
LONGEST_BASELINE_S = 2.0
# Motion is measured over the shortest time in which it exceeds this, else over the longest, m.
ENOUGH_MOTION_M = 0.3
# Less motion than this is noise of poses and cells.
LEAST_MOTION_CELLS = 2.5
# Faster motion is an error; slower things stand, m/s.
FASTEST_MPS, SLOWEST_MPS = 2.0, 0.1
# Share of a new measurement in the velocity.
VELOCITY_GAIN = 0.5
# Measurements in a row that agree in direction before a thing counts as moving.
CONFIRMATIONS = 2
# Cells within this of the edge of sight may not have been seen.
SIGHT_MARGIN_CELLS = 3.0


class Snapshot(NamedTuple):
    """The clusters of one costmap. Rows and columns are counted from the origin of the frame.

    stamp_s. lethal: (rows, columns). corner: (2,) row and column of its first cell. robot: (2,) the
    same of the robot, as real numbers. cells: (N, 2) of all clusters small enough to move. labels:
    (N,) the number of each cell's cluster, below `cluster_count`.
    """

    stamp_s: float
    lethal: NDArray[np.bool_]
    corner: Cells
    robot: Array
    cells: Cells
    labels: Cells
    cluster_count: int


class Track(NamedTuple):
    """A cluster followed from costmap to costmap.

    cells: (N, 2) m, centres. velocity: (2,) m/s. confirmations: measurements in a row that agree.
    """

    cells: Array
    velocity: Array
    confirmations: int

    @property
    def is_moving(self) -> bool:
        """Whether it has moved for long enough, and fast enough."""
        return self.confirmations >= CONFIRMATIONS and math.hypot(*self.velocity) >= SLOWEST_MPS


class Tracking(NamedTuple):
    """The snapshots of the last costmaps, the newest last, and the tracks in the newest.

    sight: the largest distance from the robot at which a cell became occupied so far, in cells.
    """

    snapshots: tuple[Snapshot, ...] = ()
    tracks: tuple[Track, ...] = ()
    sight: float = 0.0

    def moving(self) -> list[Track]:
        """Returns the tracks of moving things, at their places in the newest costmap."""
        return [track for track in self.tracks if track.is_moving]


def track_obstacles(
    tracking: Tracking, costmap: Costmap, field: DistanceField, pose: Array
) -> Tracking:
    """Returns the tracking after a costmap; the same one where the costmap is not a new one.

    field: distance field of the costmap. pose: (3,) of the robot.
    """
    if tracking.snapshots and costmap.stamp_s <= tracking.snapshots[-1].stamp_s:
        return tracking
    now = take_snapshot(costmap, field, pose)
    # A tolerance, as stamps are sums of periods.
    kept = tuple(
        old for old in tracking.snapshots if now.stamp_s - old.stamp_s <= LONGEST_BASELINE_S + 1e-6
    )
    sight = max(tracking.sight, _farthest_new_cell(now, kept[-1] if kept else None))
    velocities = _measured_velocities(now, kept, sight - SIGHT_MARGIN_CELLS, costmap.resolution)
    tracks = []
    for label in range(now.cluster_count):
        centres = (now.cells[now.labels == label][:, ::-1] + 0.5) * costmap.resolution
        centres.flags.writeable = False
        elapsed = now.stamp_s - kept[-1].stamp_s if kept else 0.0
        before = _predecessor(tracking.tracks, centres, elapsed)
        tracks.append(_advanced(before, centres, velocities[label]))
    return Tracking((*kept, now), tuple(tracks), sight)


def take_snapshot(costmap: Costmap, field: DistanceField, pose: Array) -> Snapshot:
    """Returns the snapshot of a costmap, with the robot at a pose (3,)."""
    resolution = costmap.resolution
    corner = np.rint(np.array([costmap.origin_y, costmap.origin_x]) / resolution).astype(np.int64)
    lethal = costmap.costs == LETHAL
    clusters = find_clusters(field, HALF_GAP_M)
    found = np.argwhere(lethal)
    labels = clusters.labels[lethal]
    kept_cells, kept_labels = [np.empty((0, 2), dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    count = 0
    for label in range(len(clusters.anchors)):
        cells = found[labels == label]
        if not len(cells) or math.hypot(*np.ptp(cells, axis=0)) * resolution > LARGEST_M:
            continue
        kept_cells.append(cells + corner)
        kept_labels.append(np.full(len(cells), count))
        count += 1
    robot = np.array([pose[1], pose[0]]) / resolution
    arrays = (np.concatenate(kept_cells), np.concatenate(kept_labels))
    for array in (lethal, corner, robot, *arrays):
        array.flags.writeable = False
    return Snapshot(costmap.stamp_s, lethal, corner, robot, *arrays, count)


def _farthest_new_cell(now: Snapshot, before: Snapshot | None) -> float:
    """Returns the distance from the robot to the farthest newly occupied cell, in cells."""
    fresh = now.lethal.copy()
    if before is not None:
        rows, columns = now.lethal.shape
        row, column = now.corner - before.corner
        old = np.zeros_like(now.lethal)
        source = before.lethal[max(row, 0) :, max(column, 0) :]
        source = source[: max(rows - max(-row, 0), 0), : max(columns - max(-column, 0), 0)]
        first_row, first_column = max(-row, 0), max(-column, 0)
        old[
            first_row : first_row + source.shape[0], first_column : first_column + source.shape[1]
        ] = source
        fresh &= ~old
    cells = np.argwhere(fresh)
    if not len(cells):
        return 0.0
    return float(np.hypot(*(cells + now.corner + 0.5 - now.robot).T).max())


def _measured_velocities(
    now: Snapshot, kept: tuple[Snapshot, ...], sight: float, resolution: float
) -> Array:
    """Returns (count, 2) m/s, x and y, of each cluster: zero where it stands or is new."""
    velocities = np.zeros((now.cluster_count, 2))
    is_settled = np.zeros(now.cluster_count, dtype=bool)
    for old in reversed(kept):
        elapsed = now.stamp_s - old.stamp_s
        to_old, distances = nearest_labels(
            now.cells, now.labels, now.cluster_count, old.cells, old.labels
        )
        reach = FASTEST_MPS * elapsed / resolution + LEAST_MOTION_CELLS
        for label in np.flatnonzero(~is_settled & (distances <= reach)):
            ours = now.cells[now.labels == label]
            theirs = old.cells[old.labels == to_old[label]]
            gained = farthest_free_cell(ours, theirs, old.lethal, old.corner, old.robot, sight)
            lost = farthest_free_cell(theirs, ours, now.lethal, now.corner, now.robot, sight)
            moved, row, column = gained if gained[0] >= lost[0] else (lost[0], -lost[1], -lost[2])
            if moved > reach:
                continue
            has_moved = moved >= LEAST_MOTION_CELLS
            velocities[label] = has_moved * resolution / elapsed * np.array([column, row])
            is_settled[label] = moved * resolution >= ENOUGH_MOTION_M
    return velocities


def _predecessor(tracks: tuple[Track, ...], centres: Array, elapsed_s: float) -> Track | None:
    """Returns the track that a cluster continues: the nearest one by where it should be now."""
    nearest, gap = None, FASTEST_MPS * max(elapsed_s, 0.0)
    middle = 0.5 * (centres.min(axis=0) + centres.max(axis=0))
    for track in tracks:
        expected = 0.5 * (track.cells.min(axis=0) + track.cells.max(axis=0))
        distance = float(np.hypot(*(expected + elapsed_s * track.velocity - middle)))
        if distance < gap:
            nearest, gap = track, distance
    return nearest


def _advanced(before: Track | None, centres: Array, measured: Array) -> Track:
    """Returns the track of a cluster with its newly measured velocity (2,)."""
    if before is None or not before.velocity.any():
        velocity, confirmations = measured, 1 if measured.any() else 0
    elif not measured.any():
        velocity = (1.0 - VELOCITY_GAIN) * before.velocity
        confirmations = before.confirmations
        if math.hypot(*velocity) < SLOWEST_MPS:
            velocity, confirmations = np.zeros(2), 0
    elif float(measured @ before.velocity) > 0.0:
        velocity = before.velocity + VELOCITY_GAIN * (measured - before.velocity)
        confirmations = before.confirmations + 1
    else:
        velocity, confirmations = measured, 1
    velocity.flags.writeable = False
    return Track(centres, velocity, confirmations)
