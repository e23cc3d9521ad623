"""The obstacles around the robot, standing and moving, and the check that a band keeps off them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_navbench.controllers.teb.feasibility import OUTLINE_MARGIN_M, is_free
from drake_navbench.controllers.teb.obstacle_tracking import Track
from drake_navbench.controllers.teb.predicted import (
    NOTHING_MOVES,
    MovingFields,
    field_of,
    moving_fields,
)
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.distance_field import DistanceField, distance_field, sample_distance
from drake_navbench.kernels.footprint import pad_footprint
from drake_navbench.kernels.grid import FREE, Costmap


class Surroundings(NamedTuple):
    """The obstacles around the robot.

    costmap: costmap of the standing ones. field: its distances. moving: fields of the moving ones.
    """

    costmap: Costmap
    field: DistanceField
    moving: MovingFields = NOTHING_MOVES


def standing(costmap: Costmap) -> Surroundings:
    """Returns the surroundings where all stands that a costmap shows."""
    return Surroundings(costmap, distance_field(costmap))


def with_moving(
    costmap: Costmap, tracks: Sequence[Track], *, elapsed_s: float, reach_m: float
) -> Surroundings:
    """Returns the surroundings in which the tracks of a costmap, `elapsed_s` old, move on.

    reach_m: distances to moving obstacles have to be exact up to this one.
    """
    costs = costmap.costs.copy()
    origin = np.array([costmap.origin_x, costmap.origin_y])
    for track in tracks:
        columns, rows = np.rint((track.cells - origin) / costmap.resolution - 0.5).astype(int).T
        costs[rows, columns] = FREE
    left = Costmap(
        costs,
        costmap.origin_x,
        costmap.origin_y,
        costmap.resolution,
        tracks_unknown=costmap.tracks_unknown,
        stamp_s=costmap.stamp_s,
    )
    fields = moving_fields(tracks, elapsed_s, resolution=costmap.resolution, reach_m=reach_m)
    return Surroundings(left, distance_field(left), fields)


def keeps_off(surroundings: Surroundings, footprint: Array, poses: Array, times: Array) -> bool:
    """Whether the outline meets no obstacle at any pose.

    Moving obstacles are where they will be at the time of the pose. poses: (N, 3), the first is the
    robot's. times: (N,) s from now.
    """
    if not is_free(surroundings.costmap, footprint, poses):
        return False
    if not len(surroundings.moving.velocities):
        return True
    padded = pad_footprint(footprint, OUTLINE_MARGIN_M)
    return not _meets(surroundings.moving, padded, poses, times)


@njit(cache=True)
def _meets(fields, footprint, poses, times):
    """Whether the outline (V, 2) m comes upon something that moves, by points a cell apart."""
    count = footprint.shape[0]
    for i in range(poses.shape[0]):
        cos_yaw, sin_yaw = math.cos(poses[i, 2]), math.sin(poses[i, 2])
        for thing in range(fields.distances.shape[0]):
            field = field_of(fields, thing)
            base_x = poses[i, 0] - times[i] * fields.velocities[thing, 0]
            base_y = poses[i, 1] - times[i] * fields.velocities[thing, 1]
            for v in range(count):
                x0, y0 = footprint[v, 0], footprint[v, 1]
                x1, y1 = footprint[(v + 1) % count, 0], footprint[(v + 1) % count, 1]
                steps = int(math.hypot(x1 - x0, y1 - y0) / fields.resolution) + 1
                for k in range(steps):
                    x, y = x0 + k / steps * (x1 - x0), y0 + k / steps * (y1 - y0)
                    distance, _, _ = sample_distance(
                        field,
                        base_x + cos_yaw * x - sin_yaw * y,
                        base_y + sin_yaw * x + cos_yaw * y,
                    )
                    if distance < 0.0:
                        return True
    return False
