"""Nav2's obstacle and voxel layer, each with any sources.

Source: nav2_costmap_2d (ObstacleLayer, VoxelLayer, ObservationBuffer). With
`observation_persistence` those readings are kept that were the newest at an update; Nav2 keeps
those between two updates as well.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import Grid
from drake_navbench.kernels.immutable import Immutable
from drake_navbench.kernels.layer_grid import MergeRule, merge_layer, moved_cells
from drake_navbench.kernels.observation import Observation
from drake_navbench.kernels.obstacle_layer import (
    IN_CELLS,
    IN_PLANE,
    IN_SPACE,
    update_obstacle_layer,
)
from drake_navbench.kernels.poses import place_outline
from drake_navbench.kernels.voxel_layer import UNKNOWN_COLUMN, update_voxel_layer, voxel_grid
from drake_navbench.navigation.costmaps.layer_plugin import (
    LayerParameters,
    LayerSetup,
    Observed,
    Seen,
)
from drake_navbench.navigation.costmaps.observation_source import ObservationSourceSettings
from drake_navbench.navigation.costmaps.observations import Buffer, observed_by
from drake_navbench.plugins.releases import ReadBy, Release, before, since

Costs = NDArray[np.uint8]
Voxels = NDArray[np.uint32]
# How the obstacle layer of a release measures the distance of points; of the others IN_PLANE.
MEASURED_IN: Mapping[Release, int] = {
    Release.HUMBLE: IN_CELLS,
    Release.IRON: IN_SPACE,
    Release.KILTED: IN_SPACE,
}


def _one_scan() -> dict[str, ObservationSourceSettings]:
    """Returns the sources of Nav2's bringup: a scan that marks and clears."""
    return {"scan": ObservationSourceSettings(clearing=True, max_obstacle_height=2.0)}


class SensingParameters(LayerParameters):
    """The parameters that Nav2's obstacle and voxel layer have in common."""

    observation_sources: dict[str, ObservationSourceSettings] = Field(
        default_factory=_one_scan, description="Observation sources, in order."
    )
    footprint_clearing_enabled: bool = Field(True, description="Free the cells under the robot.")
    min_obstacle_height: float = Field(
        0.0, description="Height below which points do not mark [m]."
    )
    max_obstacle_height: float = Field(
        2.0, description="Height above which points do not mark [m]."
    )
    combination_method: Literal[0, 1, 2] = Field(
        1,
        description="How costs are written: 0 overwrites, 1 takes the larger cost, 2 as 1 but "
        "keeps unknown cells.",
    )


class ObstacleLayerParameters(SensingParameters):
    """Nav2's obstacle layer."""

    plugin: Literal["nav2_costmap_2d::ObstacleLayer"] = "nav2_costmap_2d::ObstacleLayer"


# The least height of a point for voxel layers before Jazzy, which had no such parameter, m.
ANY_HEIGHT_M = -1000.0


class VoxelLayerParameters(SensingParameters):
    """Nav2's voxel layer."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "min_obstacle_height": since(Release.JAZZY, before(Release.JAZZY, ANY_HEIGHT_M)),
    }

    plugin: Literal["nav2_costmap_2d::VoxelLayer"] = "nav2_costmap_2d::VoxelLayer"
    z_voxels: int = Field(
        10, ge=1, le=16, description="Number of levels of the voxel grid [voxels]."
    )
    origin_z: float = Field(0.0, description="Height of the floor of the lowest level [m].")
    z_resolution: float = Field(0.2, gt=0.0, description="Height of a level [m].")
    unknown_threshold: int = Field(
        15,
        ge=0,
        description="Number of unknown voxels above which a column stays unknown [voxels].",
    )
    mark_threshold: int = Field(
        0, ge=0, description="Number of marked voxels above which a column is lethal [voxels]."
    )


@dataclass(frozen=True, eq=False)
class SensingState(Immutable):
    """The state of an obstacle or voxel layer.

    costs: (rows, columns) uint8. voxels: (rows, columns) uint32, None for an obstacle layer.
    origin: lower left corner of cell (0, 0), m. buffers: buffers of the sources, by name.
    """

    costs: Costs
    voxels: Voxels | None
    origin: tuple[float, float]
    buffers: Mapping[str, Buffer[Observation]]


class ObstacleLayer:
    """Nav2's ObstacleLayer on one grid."""

    Parameters: ClassVar[type[SensingParameters]] = ObstacleLayerParameters
    stays_in_window = True

    def __init__(self, parameters: SensingParameters, setup: LayerSetup) -> None:
        self._parameters = parameters
        self._rule = MergeRule(parameters.combination_method)
        self._setup = setup
        self._heights = {
            "min_obstacle_height": parameters.min_obstacle_height,
            "max_obstacle_height": parameters.max_obstacle_height,
        }

    def initial_state(self) -> SensingState | None:
        """See `Layer`; None stands for a grid in which nothing was seen."""
        return None

    def observe(self, state: SensingState | None, seen: Seen) -> Observed:
        """See `Layer`. Before the first scan or cloud no cells under the robot are freed."""
        sources, lidar = self._parameters.observation_sources, self._setup.lidar
        buffers = observed_by(sources, state.buffers if state else {}, lidar, seen)
        observations = [reading for buffer in buffers.values() for _, reading in buffer]
        outline = None
        is_seen = seen.scan is not None or bool(seen.clouds)
        if is_seen and self._parameters.footprint_clearing_enabled:
            outline = place_outline(self._setup.footprint, seen.pose)
        before = state.costs if state else None
        grid = Grid(
            self._moved(before, state, seen, self._setup.default_cost, np.uint8),
            *seen.origin,
            self._setup.resolution,
        )
        voxels, bounds = self._updated(grid, state, observations, outline, seen)
        min_x, min_y, max_x, max_y = bounds.tolist()
        touched = (min_x, min_y, max_x, max_y) if min_x <= max_x and min_y <= max_y else None
        return Observed(SensingState(grid.costs, voxels, seen.origin, buffers), touched)

    def write(self, state: SensingState, grid: Grid, seen: Seen) -> Costs:
        """See `Layer`."""
        window = seen.slices
        merge_layer(grid.costs[window], state.costs[window], self._rule)
        return grid.costs

    def _moved(
        self,
        cells: Any,
        state: SensingState | None,
        seen: Seen,
        default: int | np.unsignedinteger,
        dtype: type[np.unsignedinteger],
    ) -> Any:
        """Returns the state's cells as a new array at the costmap's present place."""
        if state is None:
            return np.full((self._setup.rows, self._setup.columns), default, dtype)
        resolution = self._setup.resolution
        return moved_cells(cells, state.origin, seen.origin, resolution=resolution, default=default)

    def _updated(
        self,
        grid: Grid,
        state: SensingState | None,
        observations: list[Observation],
        outline: Array | None,
        seen: Seen,
    ) -> tuple[Voxels | None, Array]:
        """Updates the costs of `grid` in place; returns the voxels and the box touched, (4,) m."""
        measured = MEASURED_IN.get(self._setup.rules.nav2_release, IN_PLANE)
        bounds = update_obstacle_layer(
            grid, observations, outline=outline, measured=measured, **self._heights
        )
        return None, bounds


class VoxelLayer(ObstacleLayer):
    """Nav2's VoxelLayer on one grid."""

    Parameters = VoxelLayerParameters

    def __init__(self, parameters: VoxelLayerParameters, setup: LayerSetup) -> None:
        super().__init__(parameters, setup)
        self._levels: dict[str, Any] = {
            "origin_z": parameters.origin_z,
            "z_resolution": parameters.z_resolution,
            "z_voxels": parameters.z_voxels,
            "unknown_threshold": parameters.unknown_threshold,
            "mark_threshold": parameters.mark_threshold,
        }

    def _updated(
        self,
        grid: Grid,
        state: SensingState | None,
        observations: list[Observation],
        outline: Array | None,
        seen: Seen,
    ) -> tuple[Voxels | None, Array]:
        before = state.voxels if state else None
        voxels = self._moved(before, state, seen, UNKNOWN_COLUMN, np.uint32)
        bounds = update_voxel_layer(
            voxel_grid(grid, voxels, **self._levels),
            observations,
            outline=outline,
            **self._heights,
        )
        return voxels, bounds
