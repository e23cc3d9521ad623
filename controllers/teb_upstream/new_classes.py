"""Bands of new classes along the paths of a graph.

A graph has dozens of paths but few classes, so that paths are walked and judged in one kernel.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from drake_navbench.controllers.teb_upstream.band import band_from_points
from drake_navbench.controllers.teb_upstream.exploration import walk_on
from drake_navbench.controllers.teb_upstream.signatures import is_wanted, signature


class PathBand(NamedTuple):
    """The arguments by which `band_from_points` makes a band of a path's points."""

    start_yaw: float
    goal_yaw: float
    backwards: bool
    fewest: int
    max_speed: float
    max_acceleration: float


@njit(cache=True, error_model="numpy")
def next_wanted_band(points, edges, walk, length, band, obstacles, known, best, rules):
    """Walks on through a graph until the points (K, 2) m of a path make a band that is wanted.

    length: of the walk's path so far. known, best, rules: see `is_wanted`. Returns the path's new
    length, poses, time steps and signature; the length is 0 where the walk has ended.
    """
    goal = points.shape[0] - 1
    while True:
        length = walk_on(edges, walk, length)
        if length == 0:
            return 0, np.empty((0, 3)), np.empty(0), np.empty(0)
        if not edges[walk.path[length - 1], goal]:
            continue
        # Behind the walk's points there is room for the goal, which they never contain.
        walk.path[length] = goal
        poses, steps = band_from_points(
            points[walk.path[: length + 1]],
            band.start_yaw,
            band.goal_yaw,
            band.backwards,
            band.fewest,
            band.max_speed,
            band.max_acceleration,
        )
        values = signature(poses, steps, obstacles, rules)
        if is_wanted(values, known, best, rules):
            return length, poses, steps, values
