"""PathAlignLegacyCritic: the path alignment of Humble and Iron, without arc lengths.

Source: nav2_mppi_controller, branches humble and iron. Jazzy and later ones do not have it.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from drake_navbench.controllers.mppi.critics.batch import Float32Array, Reach, Scene
from drake_navbench.controllers.mppi.critics.path import PathAlignCritic, closest_to_first_sample
from drake_navbench.controllers.mppi.float32_math import F32, ZERO
from drake_navbench.controllers.mppi.lanes import LANES
from drake_navbench.kernels.angles import wrap

FARTHEST = F32(np.finfo(np.float32).max)


class PathAlignLegacyCritic(PathAlignCritic):
    """Keeps samples on the path: every q-th column near the path point closest to it."""

    def score_reach(self, scene: Scene, reach: Reach, furthest: int) -> Float32Array | None:
        p = self.parameters
        if furthest < p.offset_from_furthest or len(scene.path) < 2:
            return None
        if self.is_off(scene, closest_to_first_sample(scene, reach), furthest):
            return None
        costs = np.empty_like(reach.end_x)
        closest_point_costs(
            scene.path_x,
            scene.path_y,
            scene.path_yaw,
            scene.path_valid,
            p.use_path_orientations,
            # Nav2 divides by this many, however many of the columns counted.
            F32(self.context.time_steps // p.trajectory_point_step),
            reach,
            costs,
        )
        return costs


@njit(cache=True, error_model="numpy")
def closest_point_costs(path_x, path_y, path_yaw, valid, use_yaw, divisor, reach, costs):
    """Writes (blocks, LANES) the distances of a sample's columns to the path, summed, over divisor.

    The last two path points do not count, nor does a column whose closest point is the first one or
    is occupied.
    """
    for block in range(costs.shape[0]):
        x, y, yaw = reach.column_x[block], reach.column_y[block], reach.column_yaw[block]
        costs[block] = ZERO
        for t in range(1, x.shape[0]):
            least = np.full(LANES, FARTHEST)
            closest = np.zeros(LANES, np.int64)
            for s in range(path_x.size - 2):
                for lane in range(LANES):
                    dx, dy = path_x[s] - x[t, lane], path_y[s] - y[t, lane]
                    squared = dx * dx + dy * dy
                    if use_yaw:
                        turn = F32(wrap(np.float64(yaw[t, lane]) - np.float64(path_yaw[s])))
                        squared += turn * turn
                    if squared < least[lane]:
                        least[lane], closest[lane] = squared, s
            for lane in range(LANES):
                if closest[lane] != 0 and valid[closest[lane]]:
                    costs[block, lane] += np.sqrt(least[lane])
        for lane in range(LANES):
            costs[block, lane] = costs[block, lane] / divisor
