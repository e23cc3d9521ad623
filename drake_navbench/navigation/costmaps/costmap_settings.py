"""The settings of the costmaps: their layers and filters under the names of Nav2's parameters.

A costmap lists its layers in `plugins`, in the order in which they write, and in `filters` the
filters of the finished costs. Each layer and filter has its parameters under its own name; the
block of a layer that is not built in may have any name, and says by `plugin` which one it is.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import Field, WithJsonSchema, model_validator

from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.navigation.costmaps.built_in_layers import (
    DenoiseLayerParameters,
    InflationLayerParameters,
    KeepoutFilterParameters,
    StaticLayerParameters,
)
from drake_navbench.navigation.costmaps.costmap_rules import CostmapRules
from drake_navbench.navigation.costmaps.filter_masks import FilterName
from drake_navbench.navigation.costmaps.grid_size import require_grid_size
from drake_navbench.navigation.costmaps.layer_plugin import COSTMAP_LAYERS
from drake_navbench.navigation.costmaps.observation_layers import (
    ObstacleLayerParameters,
    VoxelLayerParameters,
)
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.plugins.parameters import PluginBlocks
from drake_navbench.typed_files.quantities import CellSize, Length, Number
from drake_navbench.typed_files.typed_yaml import FrozenModel
from drake_navbench.typed_files.usual_values import not_negative

LAYERS = (
    "static_layer",
    "obstacle_layer",
    "voxel_layer",
    "denoise_layer",
    "inflation_layer",
    "keepout_filter",
)
"""The layers that every costmap has under a name of its own."""
LayerName = Annotated[str, WithJsonSchema({"anyOf": [{"enum": [*LAYERS]}, {"type": "string"}]})]
"""The name of a layer: one of `LAYERS`, or that of a block with `plugin`."""


class SpeedFilterSettings(FrozenModel):
    """Nav2's speed filter; the areas come from filters of type speed_percent or speed_absolute."""

    enabled: bool = Field(True, description="Let the filter act.")


class BinaryFilterSettings(FrozenModel):
    """Nav2's binary filter; the areas come from the scenario's filters of type binary."""

    enabled: bool = Field(True, description="Let the filter act.")
    default_state: bool = Field(False, description="State where the mask does not flip it.")
    flip_threshold: Number = Field(50.0, description="Mask value above which the state is flipped.")


class CostmapSettings(CostmapRules, PluginBlocks):
    """The settings that the local and the global costmap have in common."""

    PLUGINS: ClassVar[PluginKind] = COSTMAP_LAYERS

    static_layer: StaticLayerParameters = Field(default_factory=StaticLayerParameters)
    obstacle_layer: ObstacleLayerParameters = Field(default_factory=ObstacleLayerParameters)
    voxel_layer: VoxelLayerParameters = Field(default_factory=VoxelLayerParameters)
    denoise_layer: DenoiseLayerParameters = Field(default_factory=DenoiseLayerParameters)
    inflation_layer: InflationLayerParameters = Field(default_factory=InflationLayerParameters)
    keepout_filter: KeepoutFilterParameters = Field(default_factory=KeepoutFilterParameters)
    speed_filter: SpeedFilterSettings = Field(default_factory=SpeedFilterSettings)
    binary_filter: BinaryFilterSettings = Field(default_factory=BinaryFilterSettings)
    plugins: list[LayerName] = Field(
        ["static_layer", "obstacle_layer", "inflation_layer"],
        description="Layers in the order in which they write; filters among them are inflated, "
        "too.",
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
        known = (*LAYERS, *self.plugin_blocks)
        for name in self.plugins:
            if name not in known:
                raise ValueError(
                    f"plugins: got {name!r}, expected a layer of ours or the name of a block "
                    f"with `plugin`{nearest_name_hint(name, known)}"
                )
        return self

    def block(self, name: str) -> Any:
        """Returns the parameters of a layer or filter that `plugins` or `filters` lists."""
        return self.plugin_blocks[name] if name in self.plugin_blocks else getattr(self, name)

    def is_active(self, name: str) -> bool:
        """Whether a layer or filter is listed and enabled."""
        if name not in (*self.plugins, *self.filters):
            return False
        return bool(self.block(name).enabled)


class LocalCostmapSettings(CostmapSettings):
    """Nav2's rolling local costmap, with an obstacle layer in place of bringup's voxel layer."""

    width: int = Field(5, gt=0, le=200, description="Length of the window along x [m].")
    height: int = Field(5, gt=0, le=200, description="Length of the window along y [m].")
    resolution: CellSize = Field(0.1, description="Cell edge [m].")
    footprint_padding: Annotated[
        Length, not_negative("the costmaps take the robot for smaller than its footprint")
    ] = Field(0.01, description="Padding added to the footprint on all sides [m].")
    plugins: list[LayerName] = Field(
        ["obstacle_layer", "inflation_layer"],
        description="Layers in the order in which they write; filters among them are inflated, "
        "too.",
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
    """The grid on which the global planner searches.

    It is the map's grid where there is a map, or a window of its own size that rolls with the
    robot, beyond which nothing is planned.
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
