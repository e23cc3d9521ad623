"""The layers and the keepout filter that every costmap has under names of their own.

Source: nav2_costmap_2d (StaticLayer, DenoiseLayer, InflationLayer, KeepoutFilter).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_navbench.costmaps.costmap_settings import (
    CostmapSettings,
    KeepoutFilterSettings,
    ObstacleLayerSettings,
    VoxelLayerSettings,
)
from drake_navbench.costmaps.filter_masks import FilterMask
from drake_navbench.costmaps.layer_plugin import COSTMAP_LAYERS, Layer, LayerSetup, Observed, Seen
from drake_navbench.costmaps.map_file import OccupancyMap
from drake_navbench.costmaps.observation_layers import (
    ObstacleLayer,
    ObstacleLayerParameters,
    VoxelLayer,
    VoxelLayerParameters,
)
from drake_navbench.costmaps.observation_source import BufferedSourceSettings
from drake_navbench.costmaps.sensor import RangeSensor
from drake_navbench.kernels.denoise import denoise
from drake_navbench.kernels.footprint import footprint_radii
from drake_navbench.kernels.grid import FREE, INSCRIBED, NO_INFORMATION, Grid
from drake_navbench.kernels.inflation import inflate
from drake_navbench.kernels.inflation_wave import inflate_by_wave
from drake_navbench.kernels.layer_grid import MergeRule, fill_outline, merge_layer
from drake_navbench.kernels.poses import compose, place_outline
from drake_navbench.kernels.rasterize import MASK_UNKNOWN, apply_keepout, mask_costs
from drake_navbench.kernels.static_layer import sample_static, static_costs
from drake_navbench.typed_files.immutable import Immutable

Costs = NDArray[np.uint8]
Array = NDArray[np.float64]

NO_OVERRIDE = -1


def make_layer(
    name: str,
    settings: CostmapSettings,
    setup: LayerSetup,
    *,
    static_map: OccupancyMap | None,
    keepouts: Sequence[FilterMask],
) -> Layer:
    """Returns the layer that `plugins` names: a block's, or one of ours.

    static_map: that of the static layer. keepouts: the masks of the keepout filter. Raises
    InputError where the plugin of a block cannot be made.
    """
    if name in settings.plugin_blocks:
        block = settings.plugin_blocks[name]
        layer: Layer = COSTMAP_LAYERS.make(block.plugin, block, setup)
        return layer
    if name == "static_layer":
        assert static_map is not None  # Else the layer is left out.
        return StaticLayer(settings, setup, static_map)
    if name == "keepout_filter":
        return KeepoutFilter(settings.keepout_filter, keepouts)
    if name == "obstacle_layer":
        return ObstacleLayer(_of_one_scan(settings.obstacle_layer, setup.lidar), setup)
    if name == "voxel_layer":
        return VoxelLayer(_unbuffered(settings.voxel_layer), setup)
    if name == "denoise_layer":
        return DenoiseLayer(settings, setup)
    return InflationLayer(settings, setup)


def _of_one_scan(settings: ObstacleLayerSettings, lidar: RangeSensor) -> ObstacleLayerParameters:
    """Returns the parameters of a layer whose one source is the robot's scan, at its own height."""
    own = settings.model_dump(exclude={"enabled"})
    of_layer = {
        name: own.pop(name) for name in ("footprint_clearing_enabled", "combination_method")
    }
    heights = {"min_obstacle_height": lidar.height_m, "max_obstacle_height": lidar.height_m}
    scan = BufferedSourceSettings(clearing=True, **heights, **own)
    return ObstacleLayerParameters(
        plugin="nav2_costmap_2d::ObstacleLayer",
        observation_sources={"scan": scan},
        **heights,
        **of_layer,
    )


def _unbuffered(settings: VoxelLayerSettings) -> VoxelLayerParameters:
    """Returns the same parameters, with sources that keep no reading but the newest."""
    return VoxelLayerParameters(
        plugin="nav2_costmap_2d::VoxelLayer", **settings.model_dump(exclude={"enabled"})
    )


@dataclass(frozen=True, eq=False)
class StaticState(Immutable):
    """The map's costs on its own grid, (rows, columns) uint8.

    kept: those that the next cycle begins with. shown: those of this cycle.
    """

    kept: Costs
    shown: Costs


class StaticLayer:
    """Nav2's static layer: the map."""

    stays_in_window = True

    def __init__(self, settings: CostmapSettings, setup: LayerSetup, known: OccupancyMap) -> None:
        self._own = settings.static_layer
        self._use_maximum = settings.use_maximum
        self._setup = setup
        self._place = known.frame
        self._costs = static_costs(
            known.occupancy,
            track_unknown_space=settings.track_unknown_space,
            lethal_cost_threshold=settings.lethal_cost_threshold,
            trinary_costmap=settings.trinary_costmap,
            unknown_cost_value=settings.unknown_cost_value,
            inscribed_obstacle_cost_value=settings.inscribed_obstacle_cost_value,
        )

    def initial_state(self) -> StaticState:
        """See `Layer`."""
        return StaticState(self._costs, self._costs)

    def observe(self, state: StaticState, seen: Seen) -> Observed:
        """See `Layer`: the cells under the robot are freed, for this cycle or for good."""
        if not self._own.footprint_clearing_enabled:
            return Observed(state)
        outline = place_outline(self._setup.footprint, compose(seen.map_from_costmap, seen.pose))
        shown = state.kept.copy()
        fill_outline(Grid(shown, *self._place), outline, FREE)
        kept = state.kept if self._own.restore_cleared_footprint else shown
        (left, low), (right, high) = outline.min(axis=0), outline.max(axis=0)
        return Observed(StaticState(kept, shown), (left, low, right, high))

    def write(self, state: StaticState, grid: Grid, seen: Seen) -> Costs:
        """See `Layer`."""
        window = seen.slices
        if not self._setup.rolling_window:
            rule = MergeRule.MAX if self._use_maximum else MergeRule.TRUE_OVERWRITE
            merge_layer(grid.costs[window], state.shown[window], rule)
        else:
            known = Grid(state.shown, *self._place)
            sample_static(grid, known, seen.map_from_costmap, self._use_maximum)
        return grid.costs


class _LayerWithoutState:
    """A layer without observations: it changes the result of the layers before it."""

    stays_in_window = True

    def initial_state(self) -> None:
        """See `Layer`."""

    def observe(self, state: None, seen: Seen) -> Observed:
        """See `Layer`."""
        return Observed(None)


class DenoiseLayer(_LayerWithoutState):
    """Nav2's denoise layer."""

    def __init__(self, settings: CostmapSettings, setup: LayerSetup) -> None:
        self._parameters = settings.denoise_layer.model_dump(exclude={"enabled"})
        self._unknown_is_obstacle = setup.default_cost != NO_INFORMATION

    def write(self, state: None, grid: Grid, seen: Seen) -> Costs:
        """See `Layer`."""
        grid.costs[seen.slices] = denoise(
            np.ascontiguousarray(grid.costs[seen.slices]),
            unknown_is_obstacle=self._unknown_is_obstacle,
            **self._parameters,
        )
        return grid.costs


class InflationLayer(_LayerWithoutState):
    """Nav2's inflation layer; up to Kilted costs spread cell by cell."""

    def __init__(self, settings: CostmapSettings, setup: LayerSetup) -> None:
        self._parameters = settings.inflation_layer.model_dump(exclude={"enabled"})
        self._inflate = inflate_by_wave if settings.is_before_lyrical else inflate
        self._inscribed_radius = footprint_radii(setup.footprint)[0]

    def write(self, state: None, grid: Grid, seen: Seen) -> Costs:
        """See `Layer`."""
        return self._inflate(
            grid.costs,
            resolution=grid.resolution,
            inscribed_radius=self._inscribed_radius,
            window=seen.window,
            **self._parameters,
        )


class KeepoutFilter(_LayerWithoutState):
    """Nav2's keepout filter, among the layers or after them."""

    def __init__(self, settings: KeepoutFilterSettings, masks: Sequence[FilterMask]) -> None:
        self._settings = settings
        self._masks = [(mask, mask_costs(mask.grid.occupancy)) for mask in masks]

    def write(self, state: None, grid: Grid, seen: Seen) -> Costs:
        """See `Layer`."""
        window = seen.window
        part = np.ascontiguousarray(grid.costs[seen.slices])
        place = Grid(
            part,
            grid.origin_x + window.first_column * grid.resolution,
            grid.origin_y + window.first_row * grid.resolution,
            grid.resolution,
        )
        robot = compose(seen.map_from_costmap, seen.pose)
        for mask, costs in self._masks:
            own = Grid(costs, *mask.grid.frame)
            apply_keepout(place, own, seen.map_from_costmap, self._override_cost(mask, robot))
        grid.costs[seen.slices] = part
        return grid.costs

    def _override_cost(self, mask: FilterMask, pose: Array) -> int:
        """Returns the cost that replaces the mask's while the robot stands in it."""
        settings = self._settings
        value = mask.value_at(pose[:2]) if settings.override_lethal_cost else None
        if value is None or value == MASK_UNKNOWN:
            return NO_OVERRIDE
        is_inside = mask_costs(np.array(value, np.int8)) >= INSCRIBED
        return settings.lethal_override_cost if is_inside else NO_OVERRIDE
