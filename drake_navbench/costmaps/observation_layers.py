"""Nav2's obstacle and voxel layer as blocks: any number of them, each with any sources.

The layers `obstacle_layer` and `voxel_layer` of every costmap do the same for the robot's scans.
Source: nav2_costmap_2d (ObstacleLayer, VoxelLayer, ObservationBuffer). With
`observation_persistence` those readings are kept that were the newest at an update; Nav2 keeps
those between two updates as well.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drake_navbench.costmaps.layer_plugin import LayerParameters, LayerSetup, Observed, Seen
from drake_navbench.costmaps.observation_source import BufferedSourceSettings
from drake_navbench.costmaps.observations import Buffer, observed_by
from drake_navbench.kernels.grid import Grid
from drake_navbench.kernels.layer_grid import MergeRule, merge_layer
from drake_navbench.kernels.observation import Observation
from drake_navbench.kernels.obstacle_clouds import update_obstacle_layer_from_clouds
from drake_navbench.kernels.voxel_layer import UNKNOWN_COLUMN, update_voxel_layer
from drake_navbench.typed_files.immutable import Immutable


class _SensingParameters(LayerParameters):
    footprint_clearing_enabled: bool = Field(True, description="Free the cells under the robot.")
    min_obstacle_height: float = Field(0.0, description="Lower points do not mark [m].")
    max_obstacle_height: float = Field(2.0, description="Higher points do not mark [m].")
    combination_method: Literal[0, 1, 2] = Field(
        1, description="0 overwrites, 1 takes the larger cost, 2 as 1 but keeps unknown cells."
    )
    observation_sources: dict[str, BufferedSourceSettings] = Field(
        description="What it listens to, by name, in order."
    )


class ObstacleLayerParameters(_SensingParameters):
    """Nav2's obstacle layer."""


class VoxelLayerParameters(_SensingParameters):
    """Nav2's voxel layer."""

    z_voxels: int = Field(10, ge=1, le=16, description="Levels of the grid [voxels].")
    origin_z: float = Field(0.0, description="Height of the lowest level's floor [m].")
    z_resolution: float = Field(0.2, gt=0.0, description="Height of a level [m].")
    unknown_threshold: int = Field(
        15, ge=0, description="Columns with more unknown voxels stay unknown [voxels]."
    )
    mark_threshold: int = Field(
        0, ge=0, description="Columns with more marked voxels are lethal [voxels]."
    )


@dataclass(frozen=True, eq=False)
class SensingState(Immutable):
    """All of such a layer that evolves.

    costs: (rows, columns) uint8. voxels: (rows, columns) uint32, None for an obstacle layer.
    origin: lower left corner of cell (0, 0), m. buffers: of the sources, by name.
    """

    costs: NDArray[np.uint8]
    voxels: NDArray[np.uint32] | None
    origin: tuple[float, float]
    buffers: Mapping[str, Buffer[Observation]]


Costs = NDArray[np.uint8]
Updated = tuple[Costs, NDArray[np.uint32] | None, tuple[float, float], NDArray[np.float64]]


class _SensingLayer:
    """What both layers do alike."""

    def __init__(self, parameters: Any, setup: LayerSetup) -> None:
        self._sources = parameters.observation_sources
        self._rule = MergeRule(parameters.combination_method)
        self._setup = setup
        self._parameters = {
            "footprint": setup.footprint,
            "resolution": setup.resolution,
            "default_cost": setup.default_cost,
            "rolling_window": setup.rolling_window,
            "is_short": setup.is_short,
            **parameters.model_dump(
                exclude={"plugin", "enabled", "combination_method", "observation_sources"}
            ),
        }

    def initial_state(self) -> SensingState | None:
        return None

    def observe(self, state: SensingState | None, seen: Seen) -> Observed:
        before = state or self._first_state(seen.origin)
        buffers = observed_by(self._sources, before.buffers, self._setup.lidar, seen)
        observations = [reading for buffer in buffers.values() for _, reading in buffer]
        parameters = self._parameters
        if seen.scan is None and not seen.clouds:
            parameters = {**parameters, "footprint_clearing_enabled": False}
        costs, voxels, origin, bounds = self._updated(before, observations, seen.pose, parameters)
        touched = tuple(bounds) if np.all(np.isfinite(bounds)) else None
        return Observed(SensingState(costs, voxels, origin, buffers), touched)

    def write(self, state: SensingState, grid: Grid, seen: Seen) -> NDArray[np.uint8]:
        merge_layer(grid.costs, state.costs, self._rule)
        return grid.costs

    def _first_state(self, origin: tuple[float, float]) -> SensingState:
        shape = (self._setup.rows, self._setup.columns)
        costs = np.full(shape, self._setup.default_cost, np.uint8)
        return SensingState(costs, np.full(shape, UNKNOWN_COLUMN, np.uint32), origin, {})

    def _updated(
        self,
        before: SensingState,
        observations: list[Observation],
        pose: NDArray[np.float64],
        parameters: dict[str, Any],
    ) -> Updated:
        """Returns costs, voxels, origin and the box touched after a cycle."""
        raise NotImplementedError


class SourcedObstacleLayer(_SensingLayer):
    """Nav2's ObstacleLayer."""

    Parameters = ObstacleLayerParameters

    def _updated(
        self,
        before: SensingState,
        observations: list[Observation],
        pose: NDArray[np.float64],
        parameters: dict[str, Any],
    ) -> Updated:
        costs, x, y, bounds = update_obstacle_layer_from_clouds(
            before.costs, before.origin, observations, robot_pose=pose, **parameters
        )
        return costs, None, (x, y), bounds


class SourcedVoxelLayer(_SensingLayer):
    """Nav2's VoxelLayer."""

    Parameters = VoxelLayerParameters

    def _updated(
        self,
        before: SensingState,
        observations: list[Observation],
        pose: NDArray[np.float64],
        parameters: dict[str, Any],
    ) -> Updated:
        voxels = before.voxels
        assert voxels is not None  # See _first_state.
        costs, voxels, x, y, bounds = update_voxel_layer(
            before.costs, voxels, before.origin, observations, robot_pose=pose, **parameters
        )
        return costs, voxels, (x, y), bounds
