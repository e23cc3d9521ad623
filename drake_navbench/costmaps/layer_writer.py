"""What each layer and filter of a costmap writes into the master grid, one after another.

Source: nav2_costmap_2d, updateCosts of its layers and process of its filters.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.costmaps.costmap_settings import CostmapSettings
from drake_navbench.costmaps.filter_masks import FilterMask
from drake_navbench.costmaps.layer_plugin import Seen
from drake_navbench.costmaps.map_file import OccupancyMap
from drake_navbench.costmaps.plugin_layers import PluginLayers
from drake_navbench.costmaps.voxel_layer import VoxelGrids
from drake_navbench.kernels.denoise import denoise
from drake_navbench.kernels.grid import INSCRIBED, NO_INFORMATION, Grid
from drake_navbench.kernels.inflation import CellWindow, inflate
from drake_navbench.kernels.inflation_wave import inflate_by_wave
from drake_navbench.kernels.layer_grid import MergeRule, merge_layer
from drake_navbench.kernels.poses import compose
from drake_navbench.kernels.rasterize import MASK_UNKNOWN, apply_keepout, mask_costs
from drake_navbench.kernels.static_layer import sample_static

Costs = NDArray[np.uint8]
Array = NDArray[np.float64]

NO_OVERRIDE = -1


class Cycle(NamedTuple):
    """What the layers write from in one cycle.

    pose: (3,) of the robot, x m, y m, yaw rad. origin: lower left corner of the costmap, m.
    obstacles: (rows, columns) of the obstacle layer. voxels, static: None where there is no such
    layer. window: where they may write. plugins: the new states of the layers that are not built
    in. map_from_costmap: (3,) where the costmap's frame lies in the map's.
    """

    pose: Array
    origin: tuple[float, float]
    obstacles: Costs
    voxels: VoxelGrids | None
    static: Costs | None
    window: CellWindow
    seen: Seen
    plugins: Mapping[str, Any]
    map_from_costmap: Array


class LayerWriter:
    """Writes the layers and filters of one costmap; the object itself never changes.

    layers: those that are not built in. resolution: cell edge, m. default_cost: of a cell that no
    layer has written. inscribed_radius: of the padded outline, m. static_map: what the static layer
    shows, None where there is none. keepouts: the masks of the keepout filter.
    """

    def __init__(
        self,
        settings: CostmapSettings,
        layers: PluginLayers,
        *,
        resolution: float,
        rolling_window: bool,
        default_cost: int,
        inscribed_radius: float,
        static_map: OccupancyMap | None,
        keepouts: Sequence[FilterMask],
    ) -> None:
        self._settings = settings
        self._layers = layers
        self._resolution = resolution
        self._rolling_window = rolling_window
        self._default_cost = default_cost
        self._inscribed_radius = inscribed_radius
        self._static_map = static_map
        self._keepouts = [(mask, mask_costs(mask.grid.occupancy)) for mask in keepouts]
        self._built_in: Mapping[str, Callable[[Costs, Cycle], Costs]] = {
            "static_layer": self._write_static,
            "obstacle_layer": self._write_obstacles,
            "voxel_layer": self._write_voxels,
            "denoise_layer": self._without_noise,
            "inflation_layer": self._inflated,
            "keepout_filter": self.keepouts_written,
        }

    def written(self, name: str, master: Costs, cycle: Cycle) -> Costs:
        """Returns the master grid after a layer or filter wrote within the cycle's window.

        master: (rows, columns); may be changed in place.
        """
        if name in self._layers:
            return self._write_plugin(name, master, cycle)
        return self._built_in[name](master, cycle)

    def keepouts_written(self, master: Costs, cycle: Cycle) -> Costs:
        """Returns the master grid after the keepout filter wrote; see `written`."""
        resolution = self._resolution
        part = np.ascontiguousarray(master[cycle.window.slices])
        for mask, costs in self._keepouts:
            apply_keepout(
                Grid(
                    part,
                    cycle.origin[0] + cycle.window.first_column * resolution,
                    cycle.origin[1] + cycle.window.first_row * resolution,
                    resolution,
                ),
                Grid(costs, *mask.grid.frame),
                cycle.map_from_costmap,
                self._override_cost(mask, compose(cycle.map_from_costmap, cycle.pose)),
            )
        master[cycle.window.slices] = part
        return master

    def _write_static(self, master: Costs, cycle: Cycle) -> Costs:
        window = cycle.window.slices
        static, grid = cycle.static, self._static_map
        assert static is not None  # Or the layer were not among the plugins.
        assert grid is not None
        if not self._rolling_window:
            rule = MergeRule.MAX if self._settings.use_maximum else MergeRule.TRUE_OVERWRITE
            merge_layer(master[window], static[window], rule)
            return master
        sample_static(
            Grid(master, *cycle.origin, self._resolution),
            Grid(static, *grid.frame),
            cycle.map_from_costmap,
            self._settings.use_maximum,
        )
        return master

    def _write_obstacles(self, master: Costs, cycle: Cycle) -> Costs:
        window = cycle.window.slices
        rule = MergeRule(self._settings.obstacle_layer.combination_method)
        merge_layer(master[window], cycle.obstacles[window], rule)
        return master

    def _write_voxels(self, master: Costs, cycle: Cycle) -> Costs:
        window = cycle.window.slices
        rule = MergeRule(self._settings.voxel_layer.combination_method)
        assert cycle.voxels is not None  # Or the layer were not among the plugins.
        merge_layer(master[window], cycle.voxels.costs[window], rule)
        return master

    def _write_plugin(self, name: str, master: Costs, cycle: Cycle) -> Costs:
        grid = Grid(master.copy(), *cycle.origin, self._resolution)
        written = self._layers.written(name, cycle.plugins[name], grid, cycle.seen)
        window = cycle.window.slices
        master[window] = written[window]
        return master

    def _without_noise(self, master: Costs, cycle: Cycle) -> Costs:
        window = cycle.window.slices
        master[window] = denoise(
            np.ascontiguousarray(master[window]),
            unknown_is_obstacle=self._default_cost != NO_INFORMATION,
            **self._settings.denoise_layer.model_dump(exclude={"enabled"}),
        )
        return master

    def _inflated(self, master: Costs, cycle: Cycle) -> Costs:
        spread = inflate_by_wave if self._settings.is_before_lyrical else inflate
        return spread(
            master,
            resolution=self._resolution,
            inscribed_radius=self._inscribed_radius,
            window=cycle.window,
            **self._settings.inflation_layer.model_dump(exclude={"enabled"}),
        )

    def _override_cost(self, mask: FilterMask, pose: Array) -> int:
        """Returns what is written in place of the mask's costs while the robot stands in it."""
        settings = self._settings.keepout_filter
        value = mask.value_at(pose[:2]) if settings.override_lethal_cost else None
        if value is None or value == MASK_UNKNOWN:
            return NO_OVERRIDE
        is_inside = mask_costs(np.array(value, np.int8)) >= INSCRIBED
        return settings.lethal_override_cost if is_inside else NO_OVERRIDE
