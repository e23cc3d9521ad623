"""A costmap made of layers and filters, as a pure function of what it was and what is seen.

Source: nav2_costmap_2d (LayeredCostmap). A costmap that stays where it is updates, as there, the
window that the sensors touched, grown by the reach of the inflation; all else is as it was. A
rolling one is made anew as a whole at every update. Nav2 would leave what lies beyond the sensors'
reach as it was; the two differ along the edges of the window only, where an obstacle has just
rolled in or out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.costmaps.costmap_settings import CostmapSettings, LocalCostmapSettings
from drake_navbench.costmaps.filter_masks import FilterMask
from drake_navbench.costmaps.layer_plugin import LayerSetup, Seen
from drake_navbench.costmaps.layer_writer import Cycle, LayerWriter
from drake_navbench.costmaps.map_file import OccupancyMap
from drake_navbench.costmaps.obstacle_layer import ObstacleLayer
from drake_navbench.costmaps.plugin_layers import PluginLayers
from drake_navbench.costmaps.point_cloud import PointCloud
from drake_navbench.costmaps.sensor import RangeSensor
from drake_navbench.costmaps.voxel_layer import VoxelGrids, VoxelLayer
from drake_navbench.kernels.footprint import footprint_radii
from drake_navbench.kernels.grid import FREE, NO_INFORMATION, Costmap, Grid
from drake_navbench.kernels.inflation import CellWindow
from drake_navbench.kernels.layer_grid import fill_outline
from drake_navbench.kernels.poses import compose, place_outline
from drake_navbench.kernels.static_layer import static_costs
from drake_navbench.logged_scans import Scan
from drake_navbench.typed_files.immutable import Immutable

Costs = NDArray[np.uint8]
Array = NDArray[np.float64]

# Where a rolling costmap lies before its first update; it fixes the lattice of its cells.
FIRST_ORIGIN = (0.0, 0.0)
# Where the costmap lies in the map's frame, unless told otherwise.
SAME_FRAME = np.zeros(3)
NO_CLOUDS: Mapping[str, PointCloud] = MappingProxyType({})


class GridGeometry(NamedTuple):
    """Where a costmap's cells lie: cells, lower left corner and cell edge m, whether it follows."""

    rows: int
    columns: int
    origin_x: float
    origin_y: float
    resolution: float
    rolling_window: bool

    @classmethod
    def of_map(cls, grid: OccupancyMap) -> GridGeometry:
        """Returns the geometry of a costmap that stays on a map's own grid."""
        rows, columns = grid.occupancy.shape
        return cls(rows, columns, grid.origin_x, grid.origin_y, grid.resolution, False)


@dataclass(frozen=True, eq=False)
class LayersState(Immutable):
    """All of a costmap that evolves; grids are (rows, columns) uint8.

    origin: lower left corner of cell (0, 0), m. obstacles: the obstacle layer's own grid.
    voxels: the voxel layer's, None where there is none.
    static: the map's costs, on its own grid; they change where the footprint is cleared for good.
    plugged: what the layers made, before the filters; None before the first update.
    costmap: the result; None before the first update.
    plugins: the states of the layers that are not built in, by name.
    """

    origin: tuple[float, float]
    obstacles: Costs
    voxels: VoxelGrids | None
    static: Costs | None
    plugged: Costs | None = None
    costmap: Costmap | None = None
    plugins: Mapping[str, Any] = field(default_factory=dict)


class LayeredCostmap:
    """The layers and filters of one costmap; the object itself never changes.

    footprint: (K, 2) padded outline in the base frame, m. static_map: what the static layer shows,
    in the frame of the costmap. masks: of all filters; those of keepouts are used here.
    """

    def __init__(
        self,
        settings: CostmapSettings,
        geometry: GridGeometry,
        *,
        lidar: RangeSensor,
        footprint: Array,
        static_map: OccupancyMap | None = None,
        masks: Sequence[FilterMask] = (),
    ) -> None:
        self._settings = settings
        self._geometry = geometry
        self._footprint = np.ascontiguousarray(footprint)
        self._default_cost = NO_INFORMATION if settings.track_unknown_space else FREE
        grid: dict[str, Any] = {
            "footprint": self._footprint,
            "resolution": geometry.resolution,
            "default_cost": self._default_cost,
            "rolling_window": geometry.rolling_window,
            "is_short": settings.is_before_lyrical,
        }
        self._obstacle_layer = ObstacleLayer(settings.obstacle_layer, lidar, **grid)
        self._voxel_layer = VoxelLayer(settings.voxel_layer, lidar, **grid)
        self._static_map = static_map
        keepouts = [mask for mask in masks if mask.type == "keepout"]
        have_input = {"static_layer": static_map is not None, "keepout_filter": keepouts}
        self._plugins = [
            name
            for name in settings.plugins
            if settings.is_active(name) and have_input.get(name, True)
        ]
        self._layers = PluginLayers(
            {
                name: settings.plugin_blocks[name]
                for name in self._plugins
                if name in settings.plugin_blocks
            },
            LayerSetup(
                rows=geometry.rows,
                columns=geometry.columns,
                resolution=geometry.resolution,
                rolling_window=geometry.rolling_window,
                footprint=self._footprint,
                default_cost=self._default_cost,
                lidar=lidar,
                is_short=settings.is_before_lyrical,
            ),
        )
        self._writer = LayerWriter(
            settings,
            self._layers,
            resolution=geometry.resolution,
            rolling_window=geometry.rolling_window,
            default_cost=self._default_cost,
            inscribed_radius=footprint_radii(self._footprint)[0],
            static_map=static_map,
            keepouts=keepouts,
        )
        self._keepout_comes_last = (
            "keepout_filter" in settings.filters
            and settings.is_active("keepout_filter")
            and bool(keepouts)
        )

    def initial_state(self) -> LayersState:
        """Returns the state before the first update."""
        geometry = self._geometry
        shape = (geometry.rows, geometry.columns)
        return LayersState(
            origin=(geometry.origin_x, geometry.origin_y),
            obstacles=self._obstacle_layer.initial_costs(shape),
            voxels=(
                self._voxel_layer.initial_grids(shape) if "voxel_layer" in self._plugins else None
            ),
            static=(
                self._static_costs(self._static_map)
                if self._static_map is not None and "static_layer" in self._plugins
                else None
            ),
            plugins=self._layers.initial_states(),
        )

    def cleared(self, state: LayersState) -> LayersState:
        """Returns a state in its place that has forgotten all that was seen (clear_entirely)."""
        return replace(self.initial_state(), origin=state.origin)

    def updated(
        self,
        state: LayersState,
        *,
        scan: Scan | None,
        pose: Array,
        time_s: float,
        clouds: Mapping[str, PointCloud] = NO_CLOUDS,
        map_from_costmap: Array | None = None,
    ) -> LayersState:
        """Returns the state after one update cycle.

        scan: the newest one; None leaves what was seen as it is. pose: (3,) of the robot, x m, y m,
        yaw rad. clouds: the newest one of each sensor that sends points, by its name.
        map_from_costmap: (3,) where the frame of all these lies in the map's, in which the static
        map and the masks lie; None where they are one, as they must be unless the costmap rolls.
        """
        frame = SAME_FRAME if map_from_costmap is None else map_from_costmap
        cycle = self._observe(state, scan, clouds, pose, time_s, frame)
        master = self._reset_window(state, cycle)
        for name in self._plugins:
            master = self._writer.written(name, master, cycle)
        costs = master
        if self._keepout_comes_last:
            everywhere = cycle._replace(window=CellWindow.whole(master.shape))
            costs = self._writer.keepouts_written(master.copy(), everywhere)
        costs.flags.writeable = False
        costmap = Costmap(
            costs,
            *cycle.origin,
            self._geometry.resolution,
            tracks_unknown=self._settings.track_unknown_space,
            stamp_s=time_s,
        )
        is_restored = self._settings.static_layer.restore_cleared_footprint
        static = state.static if is_restored else cycle.static
        return LayersState(
            cycle.origin,
            cycle.obstacles,
            cycle.voxels,
            static,
            plugged=master,
            costmap=costmap,
            plugins=cycle.plugins,
        )

    def _static_costs(self, known: OccupancyMap) -> Costs:
        settings = self._settings
        return static_costs(
            known.occupancy,
            track_unknown_space=settings.track_unknown_space,
            lethal_cost_threshold=settings.lethal_cost_threshold,
            trinary_costmap=settings.trinary_costmap,
            unknown_cost_value=settings.unknown_cost_value,
            inscribed_obstacle_cost_value=settings.inscribed_obstacle_cost_value,
        )

    def _observe(
        self,
        state: LayersState,
        scan: Scan | None,
        clouds: Mapping[str, PointCloud],
        pose: Array,
        time_s: float,
        map_from_costmap: Array,
    ) -> Cycle:
        """Moves the grid, takes what was seen, frees the footprint, finds the window to write."""
        is_seen = "obstacle_layer" in self._plugins
        obstacles, *origin, touched = self._obstacle_layer.updated(
            state.obstacles, state.origin, scan=scan if is_seen else None, pose=pose
        )
        voxels = state.voxels
        if voxels is not None:
            voxels, bounds = self._voxel_layer.updated(
                voxels, state.origin, scan=scan, clouds=clouds, pose=pose
            )
            touched = _joined(touched, bounds)
        static = state.static
        grid = self._static_map
        is_cleared = self._settings.static_layer.footprint_clearing_enabled
        if static is not None and grid is not None and is_cleared:
            outline = place_outline(self._footprint, compose(map_from_costmap, pose))
            touched = _joined(touched, [*outline.min(axis=0), *outline.max(axis=0)])
            static = static.copy()
            fill_outline(Grid(static, *grid.frame), outline, FREE)
        seen = Seen(time_s, pose, (origin[0], origin[1]), scan, clouds)
        plugins, boxes = self._layers.observed(state.plugins, seen)
        for box in boxes:
            touched = _joined(touched, box)
        window = CellWindow.whole(obstacles.shape)
        if state.plugged is not None and not self._geometry.rolling_window:
            window = self._window_around(touched)
        return Cycle(
            pose,
            seen.origin,
            obstacles,
            voxels,
            static,
            window,
            seen,
            plugins,
            map_from_costmap,
        )

    def _window_around(self, touched: Array) -> CellWindow:
        """Returns the cells within the inflation's reach of a box min_x, min_y, max_x, max_y, m."""
        geometry = self._geometry
        if not np.all(np.isfinite(touched)):
            return CellWindow(0, 0, 0, 0)
        reach = self._settings.inflation_layer.inflation_radius
        origin = np.array([geometry.origin_x, geometry.origin_y])
        low = np.floor((touched[:2] - reach - origin) / geometry.resolution).astype(int)
        high = np.floor((touched[2:] + reach - origin) / geometry.resolution).astype(int) + 1
        limits = np.array([geometry.columns, geometry.rows])
        first, last = np.clip(low, 0, limits), np.clip(high, 0, limits)
        return CellWindow(int(first[1]), int(last[1]), int(first[0]), int(last[0]))

    def _reset_window(self, state: LayersState, cycle: Cycle) -> Costs:
        plugged = state.plugged
        if plugged is None or cycle.window == CellWindow.whole(cycle.obstacles.shape):
            return np.full(cycle.obstacles.shape, self._default_cost, np.uint8)
        master = plugged.copy()
        master[cycle.window.slices] = self._default_cost
        return master


def local_layers(
    settings: LocalCostmapSettings,
    *,
    lidar: RangeSensor,
    footprint: Array,
    static_map: OccupancyMap | None = None,
    masks: Sequence[FilterMask] = (),
) -> LayeredCostmap:
    """Returns the layers of a rolling local costmap; arguments as for `LayeredCostmap`."""
    geometry = GridGeometry(
        int(settings.height / settings.resolution),
        int(settings.width / settings.resolution),
        *FIRST_ORIGIN,
        settings.resolution,
        rolling_window=True,
    )
    return LayeredCostmap(
        settings,
        geometry,
        lidar=lidar,
        footprint=footprint,
        static_map=static_map,
        masks=masks,
    )


def _joined(box: Array, other: Array | Sequence[float]) -> Array:
    """Returns the box around two boxes min_x, min_y, max_x, max_y m."""
    return np.concatenate([np.minimum(box[:2], other[:2]), np.maximum(box[2:], other[2:])])
