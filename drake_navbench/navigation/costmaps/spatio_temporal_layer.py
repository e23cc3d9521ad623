"""The spatio-temporal voxel layer: a depth sensor's points, forgotten after a while.

Source: spatio_temporal_voxel_layer, branch ros2. As there, the costmap shows the marks of an
update one update later.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import FREE, LETHAL, NO_INFORMATION, Grid
from drake_navbench.kernels.immutable import Immutable
from drake_navbench.kernels.layer_grid import MergeRule, fill_outline, merge_layer
from drake_navbench.kernels.poses import place_outline
from drake_navbench.kernels.spatio_temporal_voxels import (
    KEY_BITS,
    NO_VOXELS,
    Frustum,
    Keys,
    Voxels,
    centres_of,
    decayed,
    marked,
)
from drake_navbench.navigation.costmaps.layer_plugin import (
    LayerParameters,
    LayerSetup,
    Observed,
    Seen,
)
from drake_navbench.navigation.costmaps.observation_source import SourceSettings
from drake_navbench.navigation.costmaps.observations import Buffer, buffered, clouds_of
from drake_navbench.navigation.costmaps.point_cloud import PointCloud
from drake_navbench.typed_files.quantities import Duration


class SpatioTemporalSourceSettings(SourceSettings):
    """A source of the layer, with the original's defaults."""

    data_type: Literal["LaserScan", "PointCloud2"] = Field(
        "PointCloud2", description="Message type of the source; the robot's lidar sends LaserScan."
    )
    enabled: bool = Field(True, description="Use this source.")
    marking: bool = Field(True, description="Let the points mark voxels.")
    clearing: bool = Field(False, description="Let voxels in the sensor's view age faster.")
    min_obstacle_height: float = Field(
        0.0, description="Height below which points do not mark [m]."
    )
    max_obstacle_height: float = Field(
        3.0, description="Height above which points do not mark [m]."
    )
    obstacle_range: float = Field(
        2.5, ge=0.0, description="Largest distance of a point that marks [m]."
    )
    inf_is_valid: bool = Field(
        False, description="Take beams of a LaserScan without a hit as hits at the sensor's range."
    )
    observation_persistence: Duration = Field(
        0.0, ge=0.0, description="Time for which an observation is kept [s]; 0: until the next one."
    )
    clear_after_reading: bool = Field(False, description="Use each observation in one update only.")
    filter: str = Field(
        "passthrough",
        description="Filter of the points: passthrough applies the heights; voxel does, too, "
        "and replaces the points of a voxel by their mean; any other word applies "
        "neither.",
    )
    voxel_min_points: int = Field(
        0,
        ge=0,
        description="Filter voxel: number of points below which a voxel is dropped [points].",
    )
    model_type: int = Field(
        0, description="Shape of the sensor's view: 0 a camera's frustum, 1 a lidar's hourglass."
    )
    min_z: float = Field(0.0, description="Distance at which the view begins [m].")
    max_z: float = Field(10.0, description="Distance at which the view ends [m].")
    vertical_fov_angle: float = Field(0.7, description="Vertical angle of the view [rad].")
    vertical_fov_padding: float = Field(
        0.0, description="Height added to the view, lidars only [m]."
    )
    horizontal_fov_angle: float = Field(1.04, description="Horizontal angle of the view [rad].")
    decay_acceleration: float = Field(
        0.0, description="Acceleration of ageing inside the view [1/s^2]."
    )


class SpatioTemporalVoxelLayerParameters(LayerParameters):
    """The layer's parameters, with the original's defaults."""

    voxel_size: float = Field(0.05, gt=0.0, description="Edge length of a voxel [m].")
    voxel_decay: float = Field(-1.0, description="Age at which a voxel is removed [s].")
    decay_model: int = Field(
        0, description="How voxels age: 0 linearly, 1 exponentially, any other number: never."
    )
    mark_threshold: int = Field(
        0, description="Number of marked voxels from which a column is lethal [voxels]."
    )
    track_unknown_space: bool | None = Field(
        None,
        description="Leave cells without marks as they are; null: as the costmap's "
        "track_unknown_space.",
    )
    combination_method: int = Field(
        1,
        description="How costs are written: 0 overwrites, 1 takes the larger cost, any other "
        "number writes nothing.",
    )
    update_footprint_enabled: bool = Field(True, description="Free the cells under the robot.")
    mapping_mode: bool = Field(
        False, description="Mapping mode: nothing ages, and the costmap stays unchanged."
    )
    observation_sources: dict[str, SpatioTemporalSourceSettings] = Field(
        description="Names of the observation sources, in order."
    )


@dataclass(frozen=True, eq=False)
class SpatioTemporalState(Immutable):
    """The state of the layer; costs: (rows, columns) uint8, of the last update.

    buffers: buffers of the sources, by name; read_s: measuring times of the newest clouds read, by
    source.
    """

    voxels: Voxels
    costs: NDArray[np.uint8]
    buffers: Mapping[str, Buffer[PointCloud]]
    read_s: Mapping[str, float]


class SpatioTemporalVoxelLayer:
    """The layer; pure."""

    Parameters = SpatioTemporalVoxelLayerParameters

    def __init__(self, parameters: SpatioTemporalVoxelLayerParameters, setup: LayerSetup) -> None:
        self._parameters = parameters
        self._setup = setup
        self._sources = {
            name: source
            for name, source in parameters.observation_sources.items()
            if source.enabled
        }
        # The original keeps the size in single precision.
        self._voxel_size = float(np.float32(parameters.voxel_size))
        tracks_unknown = setup.default_cost == NO_INFORMATION
        if parameters.track_unknown_space is not None:
            tracks_unknown = parameters.track_unknown_space
        self._default_cost = NO_INFORMATION if tracks_unknown else FREE

    def initial_state(self) -> SpatioTemporalState:
        """See `Layer`."""
        return SpatioTemporalState(NO_VOXELS, self._no_costs(), {}, {})

    def observe(self, state: SpatioTemporalState, seen: Seen) -> Observed:
        """See `Layer`."""
        buffers, readings, read_s = self._read(state, seen)
        grid = Grid(self._no_costs(), *seen.origin, self._setup.resolution)
        voxels, gone = state.voxels, NO_VOXELS.keys
        if not self._parameters.mapping_mode:
            voxels, gone = decayed(
                voxels,
                [
                    self._frustum(self._sources[name], cloud)
                    for name, cloud in readings
                    if self._sources[name].clearing
                ],
                decay_model=self._parameters.decay_model,
                voxel_decay=self._parameters.voxel_decay,
                voxel_size=self._voxel_size,
                now=seen.time_s,
            )
        touched = [] if self._parameters.mapping_mode else self._draw(grid, voxels.keys)
        touched.append(centres_of(gone, self._voxel_size)[:, :2])
        for name, cloud in readings:
            voxels = self._with_marks(voxels, self._sources[name], cloud, seen.time_s)
        if self._parameters.update_footprint_enabled:
            outline = place_outline(self._setup.footprint, seen.pose)
            fill_outline(grid, outline, FREE)
            touched.append(outline)
        box = _box(np.vstack(touched)) if touched else None
        return Observed(SpatioTemporalState(voxels, grid.costs, buffers, read_s), box)

    def write(self, state: SpatioTemporalState, grid: Grid, seen: Seen) -> NDArray[np.uint8]:
        """See `Layer`."""
        rules = {0: MergeRule.OVERWRITE, 1: MergeRule.MAX}
        rule = rules.get(self._parameters.combination_method)
        if rule is not None:
            merge_layer(grid.costs, state.costs, rule)
        return grid.costs

    def _no_costs(self) -> NDArray[np.uint8]:
        return np.full((self._setup.rows, self._setup.columns), self._default_cost, np.uint8)

    def _read(
        self, state: SpatioTemporalState, seen: Seen
    ) -> tuple[dict[str, Buffer[PointCloud]], list[tuple[str, PointCloud]], dict[str, float]]:
        """Returns the buffers, the clouds read from them with their source, and the read times."""
        buffers: dict[str, Buffer[PointCloud]] = {}
        readings: list[tuple[str, PointCloud]] = []
        read_s = dict(state.read_s)
        for name, source in self._sources.items():
            clouds = clouds_of(
                name,
                source,
                self._setup.lidar,
                scan=seen.scan,
                clouds=seen.clouds,
                inf_is_valid=source.inf_is_valid,
            )
            buffer = buffered(
                state.buffers.get(name, ()),
                [(cloud.time_s, cloud) for cloud in clouds],
                now_s=seen.time_s,
                keep_s=source.observation_persistence,
            )
            if source.clear_after_reading:
                buffer = tuple(entry for entry in buffer if entry[0] > read_s.get(name, -np.inf))
            readings += [(name, cloud) for _, cloud in buffer]
            if buffer:
                read_s[name] = buffer[0][0]
            buffers[name] = buffer
        return buffers, readings, read_s

    def _frustum(self, source: SpatioTemporalSourceSettings, cloud: PointCloud) -> Frustum:
        return Frustum(
            model=source.model_type,
            origin=cloud.origin,
            yaw=cloud.yaw_rad,
            pitch=cloud.pitch_rad,
            horizontal_fov=source.horizontal_fov_angle,
            vertical_fov=source.vertical_fov_angle,
            padding=source.vertical_fov_padding,
            near=source.min_z,
            far=source.max_z,
            acceleration=source.decay_acceleration,
        )

    def _with_marks(
        self, voxels: Voxels, source: SpatioTemporalSourceSettings, cloud: PointCloud, now_s: float
    ) -> Voxels:
        if not source.marking:
            return voxels
        points = cloud.points
        if source.filter in ("passthrough", "voxel"):
            low, high = source.min_obstacle_height, source.max_obstacle_height
            points = points[(points[:, 2] >= low) & (points[:, 2] <= high)]
        if source.filter == "voxel":
            points = means_of_voxels(points, self._voxel_size, source.voxel_min_points)
        return marked(
            voxels,
            cloud.origin,
            points,
            reach=source.obstacle_range,
            voxel_size=self._voxel_size,
            now=now_s,
        )

    def _draw(self, grid: Grid, keys: Keys) -> list[Array]:
        """Draws, in place, the columns with enough voxels; returns where, (N, 2) m."""
        _, first, counts = np.unique(keys >> KEY_BITS, return_index=True, return_counts=True)
        chosen = keys[first[counts >= self._parameters.mark_threshold]]
        centres = centres_of(chosen, self._voxel_size)[:, :2]
        rows, columns = grid.costs.shape
        cells = np.floor((centres - [grid.origin_x, grid.origin_y]) / grid.resolution).astype(int)
        is_on_grid = np.all((cells >= 0) & (cells < [columns, rows]), axis=1)
        grid.costs[cells[is_on_grid, 1], cells[is_on_grid, 0]] = LETHAL
        return [centres[is_on_grid]]


def means_of_voxels(points: Array, voxel_size: float, min_points: int) -> Array:
    """Returns the means (M, 3) of the points (N, 3) in each voxel that has enough of them, m."""
    if not len(points):
        return points
    indices = np.floor(points / voxel_size).astype(np.int64)
    _, voxel, counts = np.unique(indices, axis=0, return_inverse=True, return_counts=True)
    sums = np.zeros((len(counts), 3))
    np.add.at(sums, voxel.reshape(-1), points)
    return (sums / counts[:, np.newaxis])[counts >= min_points]


def _box(points: Array) -> tuple[float, float, float, float] | None:
    """Returns the box min_x, min_y, max_x, max_y m around points (N, 2), None around none."""
    if not len(points):
        return None
    low, high = points.min(axis=0), points.max(axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])
