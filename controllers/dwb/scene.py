"""The input of the critics in one cycle: a situation, and the window to be scored."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controllers.dwb.map_grids import (
    cell_distances,
    densify_plan,
    first_run_of_cells,
    locate,
)
from drake_navbench.controllers.dwb.trajectories import Trajectories
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import Costmap


@dataclass(frozen=True, eq=False)
class Situation:
    """The facts of a cycle before sampling; all poses in the costmap's frame. Read-only.

    time_s: start of the cycle, s. pose: (x m, y m, yaw rad). twist: measured (vx, vy m/s, wz
    rad/s). plan: (M, 3) local plan, M >= 1. goal: (3,) last pose of the whole plan.

    The cached properties serve several critics; each is computed when it is first read.
    """

    time_s: float
    pose: tuple[float, float, float]
    twist: tuple[float, float, float]
    plan: Array
    goal: tuple[float, float, float]
    costmap: Costmap

    def cells_under(self, plan: Array) -> NDArray[np.int32]:
        """Returns the flat indices of the cells under a plan while it is on known cells.

        plan: (M, 3) read-only, M >= 1.
        """
        costmap = self.costmap
        points = densify_plan(plan, costmap.resolution)
        cells = np.empty(len(points), dtype=np.int32)
        count = first_run_of_cells(points, costmap.grid, cells)
        return cells[:count]

    def distances_to(self, seeds: NDArray[np.int32]) -> NDArray[np.int32]:
        """Returns the Manhattan distance of every cell to the nearest seed, in cells."""
        rows, columns = self.costmap.costs.shape
        return cell_distances(rows, columns, seeds)

    @cached_property
    def path_cells(self) -> NDArray[np.int32]:
        """The cells under the local plan, first to last."""
        return self.cells_under(self.plan)

    @cached_property
    def path_distances(self) -> NDArray[np.int32]:
        """(rows, columns) Manhattan distance of every cell to the local plan, in cells."""
        return self.distances_to(self.path_cells)


@dataclass(frozen=True, eq=False)
class Scene(Situation):
    """A situation with its window of trajectories, which a critic scores."""

    trajectories: Trajectories

    @classmethod
    def of(cls, situation: Situation, trajectories: Trajectories) -> Scene:
        """Returns a situation with its window."""
        known = {f.name: getattr(situation, f.name) for f in fields(Situation)}
        return cls(**known, trajectories=trajectories)

    @cached_property
    def _located(self) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
        window = self.trajectories
        cells = np.empty(window.poses.shape[:2], dtype=np.int32)
        on_map_counts = np.empty(len(cells), dtype=np.int64)
        locate(window.poses, window.pose_counts, self.costmap.grid, cells, on_map_counts)
        return cells, on_map_counts

    @property
    def cells(self) -> NDArray[np.int32]:
        """(K, N) flat cell index of every pose up to the first one off the map."""
        return self._located[0]

    @property
    def on_map_counts(self) -> NDArray[np.int64]:
        """(K,) numbers of poses before the first one off the map."""
        return self._located[1]

    @cached_property
    def end_poses(self) -> Array:
        """(K, 3) the last pose of every trajectory."""
        window = self.trajectories
        return window.poses[np.arange(len(window.poses)), window.pose_counts - 1]
