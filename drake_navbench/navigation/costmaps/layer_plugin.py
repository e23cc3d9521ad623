"""The contract of a costmap layer, as nav2_costmap_2d's Layer.

Once a cycle every layer first gets the observations and returns the box it may have touched
(`observe`, Nav2's updateBounds). Then each writes into the costs, in the order of `plugins`
(`write`, Nav2's updateCosts). A layer's memory is its state, which is never changed in place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import EntryPoint
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drake_navbench.kernels.grid import Grid
from drake_navbench.kernels.inflation import CellWindow
from drake_navbench.kernels.scan import Scan
from drake_navbench.navigation.costmaps.costmap_rules import CostmapRules
from drake_navbench.navigation.costmaps.filter_masks import FilterMask
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.navigation.costmaps.sensor import RangeSensor
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.plugins.parameters import PluginParameters

if TYPE_CHECKING:
    from drake_navbench.navigation.costmaps.point_cloud import PointCloud
    from drake_navbench.navigation.costmaps.range_reading import RangeReading

NOTHING: Mapping[str, Any] = MappingProxyType({})


class LayerParameters(PluginParameters):
    """Base of the parameters of a layer."""

    enabled: bool = Field(True, description="Let the layer write into the costmap.")

    def own_values(self) -> dict[str, Any]:
        """Returns the parameters of this kind of layer alone, by name."""
        return self.model_dump(exclude={"plugin", "enabled"})


class LayerSetup(NamedTuple):
    """The facts of a whole trial that a layer is made from.

    rows, columns: size of the costmap, cells. resolution: cell edge, m. rolling_window: whether it
    follows the robot. footprint: (K, 2) padded outline in the base frame, m. default_cost: cost of
    a cell of which nothing is known. rules: the rules of the whole costmap. static_map: the map in
    the frame of the costmap, None without a map. keepouts: the masks of the keepout filter.
    """

    rows: int
    columns: int
    resolution: float
    rolling_window: bool
    footprint: NDArray[np.float64]
    default_cost: int
    lidar: RangeSensor
    rules: CostmapRules = CostmapRules()
    static_map: OccupancyMap | None = None
    keepouts: Sequence[FilterMask] = ()


class Seen(NamedTuple):
    """The inputs of one cycle, all in the frame of the costmap.

    time_s: time of the cycle, s. pose: (3,) of the robot, x m, y m, yaw rad. origin: lower left
    corner of cell (0, 0) in this cycle, m. scan: the newest one, None where there is none yet.
    clouds: clouds of sensors that send points, by name. map_from_costmap: (3,) pose of the
    costmap's frame in the map's, x m, y m, yaw rad. window: the cells that are written anew in this
    cycle; all of them while the layers observe. ranges: readings of the range sensors by name, the
    oldest first: all those since the last cycle, and perhaps older ones.
    """

    time_s: float
    pose: NDArray[np.float64]
    origin: tuple[float, float]
    scan: Scan | None
    clouds: Mapping[str, PointCloud]
    map_from_costmap: NDArray[np.float64]
    window: CellWindow
    ranges: Mapping[str, Sequence[RangeReading]] = NOTHING

    @property
    def slices(self) -> tuple[slice, slice]:
        """The window as a part of an array [row, column]."""
        return self.window.slices


class Observed(NamedTuple):
    """The result of a layer's `observe`.

    state: handed to `write` and to the next `observe`. touched: box min_x, min_y, max_x, max_y m
    around the cells whose costs `write` may change, None for none. A costmap that stays where it is
    writes only this box anew, joined with those of other layers and grown by the inflation; a
    rolling one always writes all cells.
    """

    state: Any
    touched: tuple[float, float, float, float] | None = None


class Layer(Protocol):
    """A layer of a costmap, made from its Parameters and a LayerSetup; pure.

    A class with `stays_in_window = True` promises that `write` changes costs only within
    `seen.window`; `write` then gets the costs themselves, not a copy. A class with a method
    `is_current(state)` can say that the costmap is not to be relied on: the controller then waits
    for it.
    """

    def initial_state(self) -> Any:
        """Returns the state before the first cycle, and after the costmap was cleared."""
        ...

    def observe(self, state: Any, seen: Seen) -> Observed:
        """Processes a cycle's observations; `state` stays unchanged."""
        ...

    def write(self, state: Any, grid: Grid, seen: Seen) -> NDArray[np.uint8]:
        """Returns the costs (rows, columns) uint8 with the layer's own.

        grid: the result of the layers before, which may be written to and returned; a copy, unless
        the layer stays in the window. Only cells within `seen.window` are taken over.
        """
        ...


COSTMAP_LAYERS = PluginKind(
    noun="costmap layer",
    group="drake_navbench.costmap_layers",
    members=("Parameters", "initial_state", "observe", "write"),
    guide="docs/plugins.md",
    parameters=LayerParameters,
    built_in={
        name: EntryPoint(name, f"drake_navbench.navigation.costmaps.{place}", "")
        for name, place in (
            ("nav2_costmap_2d::StaticLayer", "built_in_layers:StaticLayer"),
            ("nav2_costmap_2d::DenoiseLayer", "built_in_layers:DenoiseLayer"),
            ("nav2_costmap_2d::InflationLayer", "built_in_layers:InflationLayer"),
            ("nav2_costmap_2d::LegacyInflationLayer", "built_in_layers:InflationLayer"),
            ("nav2_costmap_2d::KeepoutFilter", "built_in_layers:KeepoutFilter"),
            ("nav2_costmap_2d::ObstacleLayer", "observation_layers:ObstacleLayer"),
            ("nav2_costmap_2d::VoxelLayer", "observation_layers:VoxelLayer"),
            ("nav2_costmap_2d::RangeSensorLayer", "range_sensor_layer:RangeSensorLayer"),
            (
                "spatio_temporal_voxel_layer::SpatioTemporalVoxelLayer",
                "spatio_temporal_layer:SpatioTemporalVoxelLayer",
            ),
        )
    },
    has_own_blocks=True,
)
"""The layers, ours and those of others, each by the type that a file gives as `plugin`."""
