"""The voxel layer of a costmap: which sources it listens to, and what each of them shows it.

Source: nav2_costmap_2d (VoxelLayer, ObservationBuffer). Only the newest message of a source counts,
as without `observation_persistence` there. Nav2 passes points on as float32; here they stay
float64, as in the obstacle layer.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_navbench.costmaps.costmap_settings import VoxelLayerSettings
from drake_navbench.costmaps.observations import clouds_of, observation_of
from drake_navbench.costmaps.point_cloud import PointCloud
from drake_navbench.costmaps.sensor import RangeSensor
from drake_navbench.kernels.observation import Observation
from drake_navbench.kernels.voxel_layer import UNKNOWN_COLUMN, update_voxel_layer
from drake_navbench.logged_scans import Scan
from drake_navbench.typed_files.immutable import Immutable

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class VoxelGrids(Immutable):
    """All of the layer that evolves: costs (rows, columns) uint8, columns of voxels uint32."""

    costs: NDArray[np.uint8]
    voxels: NDArray[np.uint32]


class VoxelLayer:
    """Nav2's voxel layer on one grid; the object itself never changes.

    footprint: (K, 2) padded outline in the base frame, m. is_short: as for `centre_window`.
    """

    def __init__(
        self,
        settings: VoxelLayerSettings,
        lidar: RangeSensor,
        *,
        footprint: Array,
        resolution: float,
        default_cost: int,
        rolling_window: bool,
        is_short: bool = False,
    ) -> None:
        self._sources = settings.observation_sources
        self._lidar = lidar
        self._parameters = {
            "footprint": footprint,
            "resolution": resolution,
            "default_cost": default_cost,
            "rolling_window": rolling_window,
            "is_short": is_short,
            **settings.model_dump(exclude={"enabled", "combination_method", "observation_sources"}),
        }

    def initial_grids(self, shape: tuple[int, int]) -> VoxelGrids:
        """Returns grids of a shape (rows, columns) in which nothing was seen."""
        default_cost = self._parameters["default_cost"]
        return VoxelGrids(
            np.full(shape, default_cost, np.uint8), np.full(shape, UNKNOWN_COLUMN, np.uint32)
        )

    def updated(
        self,
        grids: VoxelGrids,
        origin: tuple[float, float],
        *,
        scan: Scan | None,
        clouds: Mapping[str, PointCloud],
        pose: Array,
    ) -> tuple[VoxelGrids, Array]:
        """Returns the grids after one cycle, and (4,) the box that it touched, m.

        origin: lower left corner before the cycle, m; a rolling grid follows the robot. scan: what
        all sources of type LaserScan get. clouds: the newest one of each sensor that sends points.
        pose: (3,) of the robot, x m, y m, yaw rad. Where there is neither scan nor cloud yet, the
        footprint is not freed either.
        """
        parameters = self._parameters
        if scan is None and not clouds:
            parameters = {**parameters, "footprint_clearing_enabled": False}
        update = update_voxel_layer(
            grids.costs,
            grids.voxels,
            origin,
            list(self._observations(scan, clouds)),
            robot_pose=pose,
            **parameters,
        )
        return VoxelGrids(update.costs, update.voxels), update.bounds

    def _observations(
        self, scan: Scan | None, clouds: Mapping[str, PointCloud]
    ) -> Iterator[Observation]:
        for name, source in self._sources.items():
            own = clouds_of(
                name,
                source,
                self._lidar,
                scan=scan,
                clouds=clouds,
                inf_is_valid=source.inf_is_valid,
            )
            for cloud in own:
                yield observation_of(source, cloud)
