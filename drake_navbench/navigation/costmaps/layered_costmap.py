"""A costmap made of layers and filters, as a pure function of its state and the observations.

Source: nav2_costmap_2d (LayeredCostmap). As there, a costmap that stays where it is updates the
window that the sensors touched, grown by the reach of the inflation; other cells do not change. A
rolling one is computed anew as a whole at every update. Nav2 would not change the cells beyond the
sensors' reach. The two differ only along the edges of the window, where an obstacle has just
rolled in or out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import FREE, NO_INFORMATION, Costmap, Grid
from drake_navbench.kernels.immutable import Immutable
from drake_navbench.kernels.inflation import CellWindow
from drake_navbench.kernels.layer_grid import rolled_origin
from drake_navbench.kernels.scan import Scan
from drake_navbench.navigation.costmaps.built_in_layers import (
    KeepoutFilterParameters,
    StaticLayerParameters,
)
from drake_navbench.navigation.costmaps.costmap_settings import (
    CostmapSettings,
    LocalCostmapSettings,
)
from drake_navbench.navigation.costmaps.filter_masks import FilterMask
from drake_navbench.navigation.costmaps.layer_plugin import (
    COSTMAP_LAYERS,
    NOTHING,
    Layer,
    LayerSetup,
    Observed,
    Seen,
)
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.navigation.costmaps.point_cloud import PointCloud
from drake_navbench.navigation.costmaps.range_reading import RangeReading
from drake_navbench.navigation.costmaps.sensor import RangeSensor

Costs = NDArray[np.uint8]

# Where a rolling costmap lies before its first update; it fixes the lattice of its cells.
FIRST_ORIGIN = (0.0, 0.0)
# Where the costmap lies in the map's frame, unless told otherwise.
SAME_FRAME = np.zeros(3)
Box = NDArray[np.float64]


class GridGeometry(NamedTuple):
    """The grid of a costmap: number of cells, lower left corner m and cell edge m.

    rolling_window: whether the grid follows the robot.
    """

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
    """The state of a costmap; grids are (rows, columns) uint8.

    origin: lower left corner of cell (0, 0), m. layers: the states of the layers, by name.
    plugged: the result of the layers, before the filters; None before the first update.
    costmap: the result; None before the first update.
    """

    origin: tuple[float, float]
    layers: Mapping[str, Any]
    plugged: Costs | None = None
    costmap: Costmap | None = None


class LayeredCostmap:
    """The layers and filters of one costmap; the object itself never changes.

    footprint: (K, 2) padded outline in the base frame, m. static_map: the map of the static layer,
    in the frame of the costmap. masks: masks of all filters; the costmap uses those of keepouts.
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
        self._is_short = settings.is_before_lyrical
        self._whole = CellWindow.whole((geometry.rows, geometry.columns))
        self._default_cost = NO_INFORMATION if settings.track_unknown_space else FREE
        setup = LayerSetup(
            rows=geometry.rows,
            columns=geometry.columns,
            resolution=geometry.resolution,
            rolling_window=geometry.rolling_window,
            footprint=np.ascontiguousarray(footprint),
            default_cost=self._default_cost,
            lidar=lidar,
            rules=settings,
            static_map=static_map,
            keepouts=[mask for mask in masks if mask.type == "keepout"],
        )
        self._layers = _stack(settings.plugins, settings, setup)
        filters = [name for name in settings.filters if name == "keepout_filter"]
        self._filters = _stack(filters, settings, setup)

    def initial_state(self) -> LayersState:
        """Returns the state before the first update."""
        geometry = self._geometry
        return LayersState(
            origin=(geometry.origin_x, geometry.origin_y), layers=self._layers.initial_states()
        )

    def cleared(self, state: LayersState) -> LayersState:
        """Returns a state at the same place without any observations (clear_entirely)."""
        return replace(self.initial_state(), origin=state.origin)

    def updated(
        self,
        state: LayersState,
        *,
        scan: Scan | None,
        pose: Array,
        time_s: float,
        clouds: Mapping[str, PointCloud] = NOTHING,
        ranges: Mapping[str, Sequence[RangeReading]] = NOTHING,
        map_from_costmap: Array | None = None,
    ) -> LayersState:
        """Returns the state after one update cycle.

        scan: the newest one; None changes nothing. pose: (3,) of the robot, x m, y m, yaw rad.
        clouds: the newest cloud of each sensor that sends points, by its name. ranges: the readings
        of each range sensor by its name, at least those since the update before. All these are in
        the costmap's frame. map_from_costmap: (3,) the pose of that frame in the frame of the
        static map and the masks; None: the two frames are one. Only a rolling costmap may have
        another.
        """
        geometry = self._geometry
        frame = SAME_FRAME if map_from_costmap is None else map_from_costmap
        origin = self._origin(state, pose)
        seen = Seen(time_s, pose, origin, scan, clouds, frame, self._whole, ranges)
        layers, boxes = self._layers.observed(state.layers, seen)
        if state.plugged is not None and not geometry.rolling_window:
            seen = seen._replace(window=self._window_around(boxes))
        grid = Grid(self._reset(state.plugged, seen), *origin, geometry.resolution)
        plugged = self._layers.written(layers, grid, seen)
        costs = plugged
        if self._filters:
            own = grid._replace(costs=plugged.copy())
            costs = self._filters.written(
                self._filters.initial_states(), own, seen._replace(window=self._whole)
            )
        costs.flags.writeable = False
        costmap = Costmap(
            costs,
            *origin,
            geometry.resolution,
            tracks_unknown=self._settings.track_unknown_space,
            stamp_s=time_s,
            is_current=self._layers.are_current(layers),
        )
        return LayersState(origin, layers, plugged=plugged, costmap=costmap)

    def _origin(self, state: LayersState, pose: Array) -> tuple[float, float]:
        """Returns the lower left corner of cell (0, 0) in this cycle, m."""
        geometry = self._geometry
        if not geometry.rolling_window:
            return state.origin
        return rolled_origin(
            state.origin,
            (geometry.rows, geometry.columns),
            resolution=geometry.resolution,
            robot_pose=pose,
            is_short=self._is_short,
        )

    def _window_around(self, boxes: Sequence[Array]) -> CellWindow:
        """Returns the cells within the inflation's reach of boxes min_x, min_y, max_x, max_y, m.

        As in Nav2, what lies off the grid counts as in its outermost cells.
        """
        if not boxes:
            return CellWindow(0, 0, 0, 0)
        geometry = self._geometry
        touched = np.array(boxes)
        reach = self._settings.inflation_layer.inflation_radius
        origin = np.array([geometry.origin_x, geometry.origin_y])
        low = touched[:, :2].min(axis=0) - reach - origin
        high = touched[:, 2:].max(axis=0) + reach - origin
        outermost = np.array([geometry.columns, geometry.rows]) - 1
        first = np.clip(np.floor(low / geometry.resolution).astype(int), 0, outermost)
        last = np.clip(np.floor(high / geometry.resolution).astype(int), 0, outermost) + 1
        return CellWindow(int(first[1]), int(last[1]), int(first[0]), int(last[0]))

    def _reset(self, plugged: Costs | None, seen: Seen) -> Costs:
        """Returns a copy of the layers' last costs with the window set to the default cost."""
        if plugged is None or seen.window == self._whole:
            shape = (self._geometry.rows, self._geometry.columns)
            return np.full(shape, self._default_cost, np.uint8)
        master = plugged.copy()
        master[seen.slices] = self._default_cost
        return master


def _stack(names: Iterable[str], settings: CostmapSettings, setup: LayerSetup) -> LayerStack:
    """Returns the layers of these names that are enabled and have something to write."""
    blocks = {name: settings.block(name) for name in names if settings.is_active(name)}
    have_input: dict[type, bool] = {
        StaticLayerParameters: setup.static_map is not None,
        KeepoutFilterParameters: bool(setup.keepouts),
    }
    return LayerStack(
        {
            name: COSTMAP_LAYERS.make(block.plugin, block, setup)
            for name, block in blocks.items()
            if have_input.get(type(block), True)
        }
    )


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


class LayerStack:
    """The layers of one costmap by name, in the order in which they write; it never changes."""

    def __init__(self, layers: Mapping[str, Layer]) -> None:
        self._layers = dict(layers)

    def __len__(self) -> int:
        return len(self._layers)

    def initial_states(self) -> dict[str, Any]:
        """Returns the states before the first cycle, by name."""
        return {name: layer.initial_state() for name, layer in self._layers.items()}

    def observed(self, states: Mapping[str, Any], seen: Seen) -> tuple[dict[str, Any], list[Box]]:
        """Returns the new states by name, and the boxes min_x, min_y, max_x, max_y m touched."""
        after: dict[str, Any] = {}
        boxes = []
        for name, layer in self._layers.items():
            observed = layer.observe(states[name], seen)
            if not isinstance(observed, Observed):
                raise TypeError(f"costmap layer {name}: got {observed!r}, expected an Observed")
            after[name] = observed.state
            if observed.touched is not None:
                boxes.append(_box(name, observed.touched))
        return after, boxes

    def are_current(self, states: Mapping[str, Any]) -> bool:
        """Returns whether all layers report that their data are up to date."""
        return all(
            layer.is_current(states[name])
            for name, layer in self._layers.items()
            if hasattr(layer, "is_current")
        )

    def written(self, states: Mapping[str, Any], grid: Grid, seen: Seen) -> Costs:
        """Returns the costs (rows, columns) after all layers wrote within the window of `seen`.

        grid: the costs before; changed in place.
        """
        costs: Costs = grid.costs
        _, *place = grid
        for name, layer in self._layers.items():
            if getattr(layer, "stays_in_window", False):
                costs = layer.write(states[name], Grid(costs, *place), seen)
                continue
            own = layer.write(states[name], Grid(costs.copy(), *place), seen)
            _require_costs(name, own, costs.shape)
            costs[seen.slices] = own[seen.slices]
        return costs


def _require_costs(name: str, written: Any, shape: tuple[int, ...]) -> None:
    is_array = isinstance(written, np.ndarray) and written.dtype == np.uint8
    if not is_array or written.shape != shape:
        got = f"{written.dtype} {written.shape}" if hasattr(written, "shape") else written
        raise ValueError(f"costmap layer {name}: got {got}, expected costs uint8 {shape}")


def _box(name: str, touched: Any) -> Box:
    box = np.array(touched, dtype=np.float64)
    if box.shape != (4,) or not all(map(math.isfinite, box.tolist())):
        raise ValueError(f"costmap layer {name}: touched {box}, expected four finite numbers")
    return box
