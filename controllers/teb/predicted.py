"""The predicted places of moving obstacles, as distance fields that move along.

Each thing has a field of its own, in cells about it. A robot at p in t seconds is at p - t v as
seen from a thing of velocity v: there its field is read.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from drake_navbench.controllers.teb.obstacle_tracking import Track
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.distance_field import DistanceField, pose_clearance, signed_distances
from drake_navbench.kernels.grid import FREE, LETHAL
from drake_navbench.kernels.read_only import read_only


class MovingFields(NamedTuple):
    """Distance fields of K moving things as they lie now, all of one size.

    distances: (K, rows, columns) m, as in a `DistanceField`. origins: (K, 2) x and y of their lower
    left corners, m. resolution: m. velocities: (K, 2) m/s.
    """

    distances: Array
    origins: Array
    resolution: float
    velocities: Array


class Encounters(NamedTuple):
    """Which moving thing each inner pose of a band has to keep off, and where that will be.

    fields: of all moving things. things: (m - 1,) index of the thing nearest to each pose at its
    time; (0,) where nothing moves. shifts: (m - 1, 2) m, displacement of that thing until then.
    """

    fields: MovingFields
    things: NDArray[np.int64]
    shifts: Array


NOTHING_MOVES = MovingFields(
    read_only(np.empty((0, 1, 1))), np.empty((0, 2)), 1.0, np.empty((0, 2))
)
NO_ENCOUNTERS = Encounters(NOTHING_MOVES, np.empty(0, dtype=np.int64), np.empty((0, 2)))


def moving_fields(
    tracks: Sequence[Track], elapsed_s: float, *, resolution: float, reach_m: float
) -> MovingFields:
    """Returns the fields of tracks that were seen `elapsed_s` ago; exact up to `reach_m` from them.

    Beyond it, a field's distances are at least about `reach_m`.
    """
    if not tracks:
        return NOTHING_MOVES
    # One cell more, as look-ups stay off the border.
    margin = math.ceil(reach_m / resolution) + 1
    cells = [np.floor(track.cells / resolution).astype(np.int64) for track in tracks]
    columns, rows = np.max([np.ptp(found, axis=0) for found in cells], axis=0) + 1 + 2 * margin
    distances = np.empty((len(tracks), rows, columns))
    origins = np.empty((len(tracks), 2))
    for k, (track, found) in enumerate(zip(tracks, cells, strict=True)):
        corner = found.min(axis=0) - margin
        costs = np.full((rows, columns), FREE, dtype=np.uint8)
        costs[found[:, 1] - corner[1], found[:, 0] - corner[0]] = LETHAL
        distances[k] = signed_distances(costs, LETHAL, resolution)
        origins[k] = resolution * corner + elapsed_s * track.velocity
    velocities = np.array([track.velocity for track in tracks])
    return MovingFields(read_only(distances), origins, resolution, velocities)


@register_jitable
def field_of(fields, thing):
    """Returns the `DistanceField` of one thing as it lies now."""
    origin = fields.origins[thing]
    return DistanceField(fields.distances[thing], origin[0], origin[1], fields.resolution)


@njit(cache=True)
def clearance_now(fields, discs, x, y, yaw):
    """Returns the least distance between the robot's discs at a pose and moving obstacles, m."""
    clearance = math.inf
    for thing in range(fields.distances.shape[0]):
        clearance = min(clearance, pose_clearance(field_of(fields, thing), discs, x, y, yaw))
    return clearance


@njit(cache=True)
def encounters_of(fields, discs, poses, time_steps):
    """Returns the `Encounters` of a band: poses (n, 3), time_steps (n - 1,) s.

    Times are those of the guess, as in teb_local_planner: the solver does not change them.
    """
    inner = time_steps.shape[0] - 1 if fields.distances.shape[0] > 0 else 0
    things, shifts = np.empty(inner, dtype=np.int64), np.empty((inner, 2))
    time = 0.0
    for i in range(inner):
        time += time_steps[i]
        nearest = math.inf
        for thing in range(fields.distances.shape[0]):
            shift_x = time * fields.velocities[thing, 0]
            shift_y = time * fields.velocities[thing, 1]
            pose = poses[i + 1]
            clearance = pose_clearance(
                field_of(fields, thing), discs, pose[0] - shift_x, pose[1] - shift_y, pose[2]
            )
            if clearance < nearest:
                nearest = clearance
                things[i] = thing
                shifts[i, 0], shifts[i, 1] = shift_x, shift_y
    return Encounters(fields, things, shifts)
