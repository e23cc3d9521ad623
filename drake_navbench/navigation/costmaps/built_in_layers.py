"""Nav2's layers that see no obstacles, and its keepout filter.

Source: nav2_costmap_2d (StaticLayer, DenoiseLayer, InflationLayer, KeepoutFilter).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.denoise import denoise
from drake_navbench.kernels.footprint import footprint_radii
from drake_navbench.kernels.grid import FREE, INSCRIBED, NO_INFORMATION, Grid
from drake_navbench.kernels.immutable import Immutable
from drake_navbench.kernels.inflation import inflate
from drake_navbench.kernels.inflation_wave import inflate_by_wave
from drake_navbench.kernels.layer_grid import MergeRule, fill_outline, merge_layer
from drake_navbench.kernels.poses import compose, place_outline
from drake_navbench.kernels.rasterize import MASK_UNKNOWN, apply_keepout, mask_costs
from drake_navbench.kernels.static_layer import sample_static, static_costs
from drake_navbench.navigation.costmaps.filter_masks import FilterMask
from drake_navbench.navigation.costmaps.layer_plugin import (
    LayerParameters,
    LayerSetup,
    Observed,
    Seen,
)
from drake_navbench.plugins.releases import ReadBy, Release, before, since
from drake_navbench.typed_files.quantities import Count, Length, Number
from drake_navbench.typed_files.typed_yaml import QuietModel
from drake_navbench.typed_files.usual_values import not_negative, one_of, positive, unsigned_up_to

Costs = NDArray[np.uint8]

NO_OVERRIDE = -1


class StaticLayerParameters(LayerParameters):
    """Nav2's static layer: the map."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "restore_cleared_footprint": since(Release.KILTED, before(Release.KILTED, False)),
    }

    plugin: Literal["nav2_costmap_2d::StaticLayer"] = "nav2_costmap_2d::StaticLayer"
    footprint_clearing_enabled: bool = Field(False, description="Free the cells under the robot.")
    restore_cleared_footprint: bool = Field(
        True, description="Mark freed cells again once the robot has left them."
    )


class DenoiseLayerParameters(LayerParameters):
    """Nav2's denoise layer; it belongs before the inflation layer."""

    plugin: Literal["nav2_costmap_2d::DenoiseLayer"] = "nav2_costmap_2d::DenoiseLayer"
    minimal_group_size: Annotated[Count, not_negative("as 0")] = Field(
        2, description="Size below which a group of occupied cells is freed [cells]."
    )
    group_connectivity_type: Annotated[Literal[4, 8], one_of((4, 8), 8)] = Field(
        8,
        description="Neighbourhood that makes a group: 4 joins cells along edges, 8 at "
        "corners too.",
    )


# The inflation layer of Kilted, as Lyrical ships it.
LEGACY_INFLATION = "nav2_costmap_2d::LegacyInflationLayer"


class InflationLayerParameters(LayerParameters, QuietModel):
    """Nav2's inflation layer."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {"custom_inscribed_radius": since(Release.LYRICAL)}

    quiet: ClassVar = frozenset({"custom_inscribed_radius"})

    plugin: Literal["nav2_costmap_2d::InflationLayer", "nav2_costmap_2d::LegacyInflationLayer"] = (
        "nav2_costmap_2d::InflationLayer"
    )
    inflation_radius: Annotated[Length, not_negative("as 0, nothing is inflated")] = Field(
        0.55, description="Distance from obstacles up to which cells are inflated [m]."
    )
    cost_scaling_factor: Annotated[Number, positive("all cells within the radius cost 252")] = (
        Field(10.0, ge=0.0, description="Rate at which the cost falls with distance [1/m].")
    )
    inflate_unknown: bool = Field(False, description="Inflate into unknown cells.")
    inflate_around_unknown: bool = Field(
        False, description="Inflate around unknown cells, as around lethal ones."
    )
    custom_inscribed_radius: Number = Field(
        -1.0,
        le=100.0,
        description="Distance from obstacles up to which cells have the inscribed cost [m]; "
        "negative, or with the legacy layer: the outline's inscribed radius.",
    )


class KeepoutFilterParameters(LayerParameters):
    """Nav2's keepout filter; the areas come from the scenario's filters of type keepout."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "override_lethal_cost": since(Release.JAZZY),
        "lethal_override_cost": since(Release.JAZZY),
    }

    plugin: Literal["nav2_costmap_2d::KeepoutFilter"] = "nav2_costmap_2d::KeepoutFilter"
    override_lethal_cost: bool = Field(
        False, description="Let a robot that stands in a keepout area drive out."
    )
    lethal_override_cost: Annotated[int, unsigned_up_to(252)] = Field(
        252, ge=0, le=252, description="Cost of keepout cells while the robot stands in one."
    )


@dataclass(frozen=True, eq=False)
class StaticState(Immutable):
    """The map's costs on its own grid, (rows, columns) uint8.

    kept: the costs with which the next cycle begins. shown: the costs of this cycle. is_written:
    whether the whole map was written since the costmap was cleared.
    """

    kept: Costs
    shown: Costs
    is_written: bool = False


class StaticLayer:
    """Nav2's static layer: the map.

    On the map's own grid Nav2 frees the cells under the robot only when it writes the whole map: in
    the first cycle, and after the costmap was cleared.
    """

    Parameters: ClassVar[type[StaticLayerParameters]] = StaticLayerParameters
    stays_in_window = True

    def __init__(self, parameters: StaticLayerParameters, setup: LayerSetup) -> None:
        known, rules = setup.static_map, setup.rules
        assert known is not None  # Without a map the costmap leaves this layer out.
        self._own = parameters
        self._setup = setup
        self._place = known.frame
        self._costs = static_costs(
            known.occupancy,
            track_unknown_space=rules.track_unknown_space,
            lethal_cost_threshold=rules.lethal_cost_threshold,
            trinary_costmap=rules.trinary_costmap,
            unknown_cost_value=rules.unknown_cost_value,
            inscribed_obstacle_cost_value=rules.inscribed_obstacle_cost_value,
        )

    def initial_state(self) -> StaticState:
        """See `Layer`."""
        return StaticState(self._costs, self._costs)

    def observe(self, state: StaticState, seen: Seen) -> Observed:
        """See `Layer`: the cells under the robot are freed, for this cycle or for good."""
        is_in_place = state.is_written and not self._setup.rolling_window
        if is_in_place or not self._own.footprint_clearing_enabled:
            return Observed(state)
        outline = place_outline(self._setup.footprint, compose(seen.map_from_costmap, seen.pose))
        shown = state.kept.copy()
        fill_outline(Grid(shown, *self._place), outline, FREE)
        kept = state.kept if self._own.restore_cleared_footprint else shown
        (left, low), (right, high) = outline.min(axis=0), outline.max(axis=0)
        return Observed(StaticState(kept, shown, is_written=True), (left, low, right, high))

    def write(self, state: StaticState, grid: Grid, seen: Seen) -> Costs:
        """See `Layer`."""
        window, use_maximum = seen.slices, self._setup.rules.use_maximum
        if not self._setup.rolling_window:
            rule = MergeRule.MAX if use_maximum else MergeRule.TRUE_OVERWRITE
            merge_layer(grid.costs[window], state.shown[window], rule)
        else:
            known = Grid(state.shown, *self._place)
            sample_static(grid, known, seen.map_from_costmap, use_maximum)
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

    Parameters: ClassVar[type[DenoiseLayerParameters]] = DenoiseLayerParameters

    def __init__(self, parameters: DenoiseLayerParameters, setup: LayerSetup) -> None:
        self._parameters = parameters.own_values()
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
    """Nav2's inflation layer; up to Kilted, and in its legacy form, costs spread cell by cell."""

    Parameters: ClassVar[type[InflationLayerParameters]] = InflationLayerParameters

    def __init__(self, parameters: InflationLayerParameters, setup: LayerSetup) -> None:
        self._parameters = parameters.own_values()
        # Quiet: among the values only where it differs from its default.
        self._parameters.pop("custom_inscribed_radius", None)
        is_wave = setup.rules.is_before_lyrical or parameters.plugin == LEGACY_INFLATION
        self._inflate = inflate_by_wave if is_wave else inflate
        custom = parameters.custom_inscribed_radius
        is_custom = custom >= 0.0 and not is_wave
        self._inscribed_radius = custom if is_custom else footprint_radii(setup.footprint)[0]

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

    Parameters: ClassVar[type[KeepoutFilterParameters]] = KeepoutFilterParameters

    def __init__(self, parameters: KeepoutFilterParameters, setup: LayerSetup) -> None:
        self._settings = parameters
        self._masks = [(mask, mask_costs(mask.grid.occupancy)) for mask in setup.keepouts]

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
