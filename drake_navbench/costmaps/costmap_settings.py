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
"""One of ours, or the name of a block that has a `plugin`."""
FilterName = Literal["keepout_filter", "speed_filter", "binary_filter"]


class StaticLayerSettings(FrozenModel):
    """Nav2's static layer: the map."""

    enabled: bool = Field(True, description="Whether it writes at all.")
    footprint_clearing_enabled: bool = Field(False, description="Free the cells under the robot.")
    restore_cleared_footprint: bool = Field(
        True, description="Cells that were freed come back once the robot has gone."
    )


class ObstacleLayerSettings(FrozenModel):
    """Nav2's obstacle layer with one scan source that marks and clears."""

    enabled: bool = Field(True, description="Whether it writes at all.")
    obstacle_min_range: Length = Field(0.0, ge=0.0, description="Nearest hit that marks [m].")
    obstacle_max_range: Length = Field(2.5, gt=0.0, description="Farthest hit that marks [m].")
    raytrace_min_range: Length = Field(0.0, ge=0.0, description="Where clearing starts [m].")
    raytrace_max_range: Length = Field(3.0, gt=0.0, description="Where clearing ends [m].")
    footprint_clearing_enabled: bool = Field(True, description="Free the cells under the robot.")
    inf_is_valid: bool = Field(False, description="Beams without a hit clear up to the range.")
    combination_method: Literal[0, 1, 2] = Field(
        1, description="0 overwrites, 1 takes the larger cost, 2 as 1 but keeps unknown cells."
    )


def _one_scan() -> dict[str, ObservationSourceSettings]:
    """Returns the sources of Nav2's bringup: a scan that marks and clears."""
    return {"scan": ObservationSourceSettings(clearing=True, max_obstacle_height=2.0)}


class VoxelLayerSettings(VoxelFields):
    """Nav2's voxel layer."""

    enabled: bool = Field(True, description="Whether it writes at all.")
    observation_sources: dict[str, ObservationSourceSettings] = Field(
        default_factory=_one_scan, description="What it listens to, by name, in order."
    )


class DenoiseLayerSettings(FrozenModel):
    """Nav2's denoise layer; it belongs before the inflation layer."""

    enabled: bool = Field(True, description="Whether it writes at all.")
    minimal_group_size: Count = Field(2, ge=0, description="Smaller groups are freed [cells].")
    group_connectivity_type: Literal[4, 8] = Field(
        8, description="4 joins cells along edges, 8 at corners too."
    )


class InflationLayerSettings(FrozenModel):
    """Nav2's inflation layer."""

    enabled: bool = Field(True, description="Whether it writes at all.")
    inflation_radius: Length = Field(0.55, ge=0.0, description="Reach [m].")
    cost_scaling_factor: Number = Field(10.0, gt=0.0, description="Decay of the cost [1/m].")
    inflate_unknown: bool = Field(False, description="Graded costs may replace unknown cells.")
    inflate_around_unknown: bool = Field(False, description="Unknown cells are inflated too.")


class KeepoutFilterSettings(FrozenModel):
    """Nav2's keepout filter; the areas come from the scenario's filters of type keepout."""

    enabled: bool = Field(True, description="Whether it acts at all.")
    override_lethal_cost: bool = Field(
        False, description="A robot that stands in a keepout may drive out."
    )
    lethal_override_cost: int = Field(
        252, ge=0, le=252, description="Cost of keepouts while the robot stands in one."
    )


class SpeedFilterSettings(FrozenModel):
    """Nav2's speed filter; the areas come from filters of type speed_percent or speed_absolute."""

    enabled: bool = Field(True, description="Whether it acts at all.")


class BinaryFilterSettings(FrozenModel):
    """Nav2's binary filter; the areas come from the scenario's filters of type binary."""

    enabled: bool = Field(True, description="Whether it acts at all.")
    default_state: bool = Field(False, description="State where the mask does not flip it.")
    flip_threshold: Number = Field(50.0, description="Mask values above this flip the state.")


class CostmapSettings(PluginBlocks):
    """The settings that the local and the global costmap have in common."""

    PLUGINS: ClassVar[PluginKind] = COSTMAP_LAYERS

    nav2_release: Release = Field(
        NEWEST_RELEASE,
        description="Release whose rules hold: up to Kilted inflation spreads cell by cell, and a "
        "window that rolls lies a quarter of a cell off.",
    )
    track_unknown_space: bool = Field(False, description="Unseen cells are unknown, not free.")
    update_frequency: Frequency = Field(5.0, description="Updates [Hz].")
    lethal_cost_threshold: int = Field(
        100, ge=0, le=100, description="Occupancy from which a cell of the map is lethal [%]."
    )
    trinary_costmap: bool = Field(True, description="Cells of the map are free or lethal only.")
    unknown_cost_value: int = Field(
        255, ge=0, le=255, description="Byte that stands for unknown in a map."
    )
    inscribed_obstacle_cost_value: int = Field(
        99, ge=0, le=255, description="Byte that stands for an inscribed cell in a map."
    )
    use_maximum: bool = Field(False, description="The map keeps larger costs of layers before it.")
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
        description="Layers in the order in which they write; a filter among them is inflated too.",
    )
    filters: list[FilterName] = Field(
        ["keepout_filter"], description="What acts on the finished costs, in order."
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

    width: int = Field(5, gt=0, le=200, description="Extent along x [m].")
    height: int = Field(5, gt=0, le=200, description="Extent along y [m].")
    resolution: CellSize = Field(0.1, description="Cell edge [m].")
    footprint_padding: Length = Field(0.01, ge=0.0, description="Added to the outline [m].")
    plugins: list[LayerName] = Field(
        ["obstacle_layer", "inflation_layer"],
        description="Layers in the order in which they write; a filter among them is inflated too.",
    )
    filters: list[FilterName] = Field(
        ["keepout_filter", "speed_filter", "binary_filter"],
        description="What acts on the finished costs, in order.",
    )

    @model_validator(mode="after")
    def _check_size(self) -> LocalCostmapSettings:
        _require_size(self)
        return self


class GlobalCostmapSettings(CostmapSettings):
    """The grid on which the global planner searches: that of the map, where there is one.

    Or a window of its own size that rolls with the robot, beyond which nothing is planned.
    """

    rolling_window: bool = Field(False, description="A window around the robot, in any map.")
    width: int = Field(5, gt=0, le=1000, description="Extent along x of a window that rolls [m].")
    height: int = Field(5, gt=0, le=1000, description="Extent along y of a window that rolls [m].")
    resolution: CellSize = Field(
        0.05, description="Cell edge where there is no map, or a window that rolls [m]."
    )
    margin_m: Length = Field(
        2.0, gt=0.0, description="Free border around everything known, where there is no map [m]."
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
