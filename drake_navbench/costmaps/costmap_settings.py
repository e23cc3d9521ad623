"""The settings of the costmaps: their layers and filters under the names of Nav2's parameters.

A costmap lists its layers in `plugins`, in the order in which they write, and in `filters` the
filters of the finished costs. Each layer and filter has its parameters under its own name; the
block of a layer that is not built in may have any name, and says by `plugin` which one it is.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, get_args

from pydantic import Field, WithJsonSchema, model_validator

from drake_navbench.costmaps.grid_size import require_grid_size
from drake_navbench.costmaps.layer_plugin import COSTMAP_LAYERS
from drake_navbench.costmaps.observation_source import ObservationSourceSettings
from drake_navbench.costmaps.sensing_fields import VoxelFields
from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.plugins.parameters import PluginBlocks
from drake_navbench.releases import NEWEST_RELEASE, Release
from drake_navbench.typed_files.quantities import CellSize, Count, Frequency, Length, Number
from drake_navbench.typed_files.typed_yaml import FrozenModel

BuiltInLayer = Literal[
    "static_layer",
    "obstacle_layer",
    "voxel_layer",
    "denoise_layer",
    "inflation_layer",
    "keepout_filter",
]
LayerName = Annotated[
    str, WithJsonSchema({"anyOf": [{"enum": [*get_args(BuiltInLayer)]}, {"type": "string"}]})
]
"Type of the layer: one of ours, or the name of a block with `plugin`."
FilterName = Literal["keepout_filter", "speed_filter", "binary_filter"]


class StaticLayerSettings(FrozenModel):
    """Nav2's static layer: the map."""

    enabled: bool = Field(True, description="Let the layer write into the costmap.")
    footprint_clearing_enabled: bool = Field(False, description="Free the cells under the robot.")
    restore_cleared_footprint: bool = Field(
        True, description="Mark freed cells again once the robot has left them."
    )


class ObstacleLayerSettings(FrozenModel):
    """Nav2's obstacle layer with one scan source that marks and clears."""

    enabled: bool = Field(True, description="Let the layer write into the costmap.")
    obstacle_min_range: Length = Field(
        0.0, ge=0.0, description="Least distance of a hit that marks [m]."
    )
    obstacle_max_range: Length = Field(
        2.5, gt=0.0, description="Largest distance of a hit that marks [m]."
    )
    raytrace_min_range: Length = Field(
        0.0, ge=0.0, description="Distance at which clearing along a beam starts [m]."
    )
    raytrace_max_range: Length = Field(
        3.0, gt=0.0, description="Distance at which clearing along a beam ends [m]."
    )
    footprint_clearing_enabled: bool = Field(True, description="Free the cells under the robot.")
    inf_is_valid: bool = Field(
        False, description="Let beams without a hit clear up to the sensor's range."
    )
    combination_method: Literal[0, 1, 2] = Field(
        1,
        description="How costs are written: 0 overwrites, 1 takes the larger cost, 2 as 1 but "
        "keeps unknown cells.",
    )


def _one_scan() -> dict[str, ObservationSourceSettings]:
    """Returns the sources of Nav2's bringup: a scan that marks and clears."""
    return {"scan": ObservationSourceSettings(clearing=True, max_obstacle_height=2.0)}


class VoxelLayerSettings(VoxelFields):
    """Nav2's voxel layer."""

    enabled: bool = Field(True, description="Let the layer write into the costmap.")
    observation_sources: dict[str, ObservationSourceSettings] = Field(
        default_factory=_one_scan, description="Names of the observation sources, in order."
    )


class DenoiseLayerSettings(FrozenModel):
    """Nav2's denoise layer; it belongs before the inflation layer."""

    enabled: bool = Field(True, description="Let the layer write into the costmap.")
    minimal_group_size: Count = Field(
        2, ge=0, description="Size below which a group of occupied cells is freed [cells]."
    )
    group_connectivity_type: Literal[4, 8] = Field(
        8,
        description="Neighbourhood that makes a group: 4 joins cells along edges, 8 at "
        "corners too.",
    )


class InflationLayerSettings(FrozenModel):
    """Nav2's inflation layer."""

    enabled: bool = Field(True, description="Let the layer write into the costmap.")
    inflation_radius: Length = Field(
        0.55, ge=0.0, description="Distance from obstacles up to which cells are inflated [m]."
    )
    cost_scaling_factor: Number = Field(
        10.0, gt=0.0, description="Rate at which the cost falls with distance [1/m]."
    )
    inflate_unknown: bool = Field(False, description="Inflate into unknown cells.")
    inflate_around_unknown: bool = Field(
        False, description="Inflate around unknown cells, as around lethal ones."
    )


class KeepoutFilterSettings(FrozenModel):
    """Nav2's keepout filter; the areas come from the scenario's filters of type keepout."""

    enabled: bool = Field(True, description="Let the filter act.")
    override_lethal_cost: bool = Field(
        False, description="Let a robot that stands in a keepout area drive out."
    )
    lethal_override_cost: int = Field(
        252, ge=0, le=252, description="Cost of keepout cells while the robot stands in one."
    )


class SpeedFilterSettings(FrozenModel):
    """Nav2's speed filter; the areas come from filters of type speed_percent or speed_absolute."""

    enabled: bool = Field(True, description="Let the filter act.")


class BinaryFilterSettings(FrozenModel):
    """Nav2's binary filter; the areas come from the scenario's filters of type binary."""

    enabled: bool = Field(True, description="Let the filter act.")
    default_state: bool = Field(False, description="State where the mask does not flip it.")
    flip_threshold: Number = Field(50.0, description="Mask value above which the state is flipped.")


class CostmapSettings(PluginBlocks):
    """The settings that the local and the global costmap have in common."""

    PLUGINS: ClassVar[PluginKind] = COSTMAP_LAYERS

    nav2_release: Release = Field(
        NEWEST_RELEASE,
        description="Nav2 release whose rules apply: up to Kilted inflation spreads cell by "
        "cell, and a rolling window is offset by a quarter of a cell.",
    )
    track_unknown_space: bool = Field(
        False, description="Mark cells that no sensor has seen as unknown instead of free."
    )
    update_frequency: Frequency = Field(5.0, description="Updates [Hz].")
    lethal_cost_threshold: int = Field(
        100, ge=0, le=100, description="Occupancy from which a map cell is lethal [%]."
    )
    trinary_costmap: bool = Field(
        True, description="Read map cells as free or lethal only, without costs between."
    )
    unknown_cost_value: int = Field(
        255, ge=0, le=255, description="Byte that means unknown in a map."
    )
    inscribed_obstacle_cost_value: int = Field(
        99, ge=0, le=255, description="Byte that means inscribed in a map."
    )
    use_maximum: bool = Field(False, description="Let the map keep larger costs of earlier layers.")
    static_layer: StaticLayerSettings = Field(default_factory=StaticLayerSettings)
    obstacle_layer: ObstacleLayerSettings = Field(default_factory=ObstacleLayerSettings)
    voxel_layer: VoxelLayerSettings = Field(default_factory=VoxelLayerSettings)
    denoise_layer: DenoiseLayerSettings = Field(default_factory=DenoiseLayerSettings)
    inflation_layer: InflationLayerSettings = Field(default_factory=InflationLayerSettings)
    keepout_filter: KeepoutFilterSettings = Field(default_factory=KeepoutFilterSettings)
    speed_filter: SpeedFilterSettings = Field(default_factory=SpeedFilterSettings)
    binary_filter: BinaryFilterSettings = Field(default_factory=BinaryFilterSettings)
    plugins: list[LayerName] = Field(
        ["static_layer", "obstacle_layer", "inflation_layer"],
        description="Layers in the order in which they write; a filter among them is "
        "inflated, too.",
    )
    filters: list[FilterName] = Field(
        ["keepout_filter"], description="Filters that act on the finished costs, in order."
    )

    @model_validator(mode="after")
    def _check_each_once(self) -> CostmapSettings:
        listed = [*self.plugins, *self.filters]
        for name in listed:
            if listed.count(name) > 1:
                raise ValueError(f"plugins and filters: {name} is listed twice, expected once")
        known = (*get_args(BuiltInLayer), *self.plugin_blocks)
        for name in self.plugins:
            if name not in known:
                raise ValueError(
                    f"plugins: got {name!r}, expected a layer of ours or the name of a block "
                    f"with `plugin`{nearest_name_hint(name, known)}"
                )
        return self

    @property
    def is_before_lyrical(self) -> bool:
        """Whether the rules up to Kilted hold."""
        return self.nav2_release < Release.LYRICAL

    def is_active(self, name: str) -> bool:
        """Whether a layer or filter is listed and enabled."""
        if name not in (*self.plugins, *self.filters):
            return False
        if name in self.plugin_blocks:
            return self.plugin_blocks[name].enabled
        return getattr(self, name).enabled


class LocalCostmapSettings(CostmapSettings):
    """Nav2's rolling local costmap; where bringup has a voxel layer, an obstacle layer."""

    width: int = Field(5, gt=0, le=200, description="Length of the window along x [m].")
    height: int = Field(5, gt=0, le=200, description="Length of the window along y [m].")
    resolution: CellSize = Field(0.1, description="Cell edge [m].")
    footprint_padding: Length = Field(
        0.01, ge=0.0, description="Padding added to the footprint on all sides [m]."
    )
    plugins: list[LayerName] = Field(
        ["obstacle_layer", "inflation_layer"],
        description="Layers in the order in which they write; a filter among them is "
        "inflated, too.",
    )
    filters: list[FilterName] = Field(
        ["keepout_filter", "speed_filter", "binary_filter"],
        description="Filters that act on the finished costs, in order.",
    )

    @model_validator(mode="after")
    def _check_size(self) -> LocalCostmapSettings:
        _require_size(self)
        return self


class GlobalCostmapSettings(CostmapSettings):
    """The grid on which the global planner searches: that of the map, where there is one.

    Or a window of its own size that rolls with the robot, beyond which nothing is planned.
    """

    rolling_window: bool = Field(
        False, description="Let the costmap be a window that rolls with the robot, inside the map."
    )
    width: int = Field(5, gt=0, le=1000, description="Length along x of a rolling window [m].")
    height: int = Field(5, gt=0, le=1000, description="Length along y of a rolling window [m].")
    resolution: CellSize = Field(
        0.05, description="Edge length of a cell of a rolling window, or where there is no map [m]."
    )
    margin_m: Length = Field(
        2.0,
        gt=0.0,
        description="Free border around everything that is known, where there is no map [m].",
    )

    @model_validator(mode="after")
    def _check_size(self) -> GlobalCostmapSettings:
        if self.rolling_window:
            _require_size(self)
        return self


def _require_size(settings: LocalCostmapSettings | GlobalCostmapSettings) -> None:
    """Raises ValueError where a window would have too many cells."""
    columns, rows = settings.width / settings.resolution, settings.height / settings.resolution
    try:
        require_grid_size("width, height and resolution", columns, rows)
    except InputError as error:
        raise ValueError(str(error)) from error
