"""The obstacle layer of a costmap: its parameters and the lidar, bound to one grid."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_navbench.costmaps.costmap_settings import ObstacleLayerSettings
from drake_navbench.costmaps.sensor import RangeSensor
from drake_navbench.kernels.layer_grid import centre_window
from drake_navbench.kernels.obstacle_layer import (
    NOTHING_TOUCHED,
    ObstacleLayerUpdate,
    update_obstacle_layer,
)
from drake_navbench.logged_scans import Scan

Array = NDArray[np.float64]
Costs = NDArray[np.uint8]


class ObstacleLayer:
    """Nav2's obstacle layer on one grid; the object itself never changes.

    footprint: (K, 2) padded outline in the base frame, m. is_short: as for `centre_window`.
    """

    def __init__(
        self,
        settings: ObstacleLayerSettings,
        lidar: RangeSensor,
        *,
        footprint: Array,
        resolution: float,
        default_cost: int,
        rolling_window: bool,
        is_short: bool = False,
    ) -> None:
        self._resolution = resolution
        self._default_cost = default_cost
        self._rolling_window = rolling_window
        self._is_short = is_short
        self._parameters = {
            "footprint": footprint,
            "range_min": lidar.range_min_m,
            "range_max": lidar.range_max_m,
            **settings.model_dump(exclude={"enabled", "combination_method"}),
        }

    def initial_costs(self, shape: tuple[int, int]) -> Costs:
        """Returns costs of a shape (rows, columns) in which nothing was seen."""
        return np.full(shape, self._default_cost, np.uint8)

    def updated(
        self, costs: Costs, origin: tuple[float, float], *, scan: Scan | None, pose: Array
    ) -> ObstacleLayerUpdate:
        """Returns the layer after one cycle; a rolling one follows the robot, scan or not.

        origin: lower left corner before the cycle, m. pose: (3,) of the robot, x m, y m, yaw rad.
        """
        grid: dict[str, Any] = {
            "resolution": self._resolution,
            "default_cost": self._default_cost,
            "is_short": self._is_short,
        }
        if scan is not None:
            return update_obstacle_layer(
                costs,
                origin,
                robot_pose=pose,
                sensor_pose=scan.sensor_pose,
                angles=scan.angles_rad,
                ranges=scan.ranges_m,
                further_scans=[(other.sensor_pose, other.ranges_m) for other in scan.further],
                rolling_window=self._rolling_window,
                **grid,
                **self._parameters,
            )
        if self._rolling_window:
            costs, *corner = centre_window(costs, origin, robot_pose=pose, **grid)
            origin = (corner[0], corner[1])
        return ObstacleLayerUpdate(costs, *origin, np.array(NOTHING_TOUCHED))
