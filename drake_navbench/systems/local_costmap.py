"""The rolling local costmap: obstacle layer and inflation layer around the robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_navbench.immutable import Immutable
from drake_navbench.kernels.footprint import footprint_radii
from drake_navbench.kernels.grid import FREE, NO_INFORMATION, Costmap
from drake_navbench.kernels.inflation import inflate
from drake_navbench.kernels.obstacle_layer import update_obstacle_layer
from drake_navbench.log import Scan
from drake_navbench.robot import LidarSettings, LocalCostmapSettings

# Where a rolling costmap lies before its first update; it fixes the lattice of its cells.
FIRST_ORIGIN = (0.0, 0.0)


@dataclass(frozen=True, eq=False)
class _LayerState(Immutable):
    """The obstacle layer's own persistent grid, and the costmap made from it."""

    obstacles: NDArray[np.uint8]
    origin: tuple[float, float] = FIRST_ORIGIN
    costmap: Costmap | None = None


class LocalCostmap(LeafSystem):
    """Nav2's local costmap with an obstacle layer and an inflation layer.

    Inputs `state` [x m, y m, yaw rad, ...], the odometry, and `scan` (Scan or None). Output
    `costmap` (Costmap, or None before the first update). Updates run at update_frequency, the first
    at `offset_s`, and take the newest scan; without one there is no costmap yet.

    footprint: (K, 2) padded outline in the base frame, m.
    """

    def __init__(
        self,
        settings: LocalCostmapSettings,
        lidar: LidarSettings,
        *,
        footprint: NDArray[np.float64],
        offset_s: float,
    ) -> None:
        super().__init__()
        self._settings = settings
        self._lidar = lidar
        self._footprint = np.ascontiguousarray(footprint)
        self._inscribed_radius, _ = footprint_radii(self._footprint)
        self._default_cost = NO_INFORMATION if settings.track_unknown_space else FREE
        shape = (
            int(settings.height / settings.resolution),
            int(settings.width / settings.resolution),
        )
        empty = _LayerState(np.full(shape, self._default_cost, dtype=np.uint8))
        self._layers = self.DeclareAbstractState(AbstractValue.Make(empty))
        self._state_port = self.DeclareVectorInputPort("state", 5)
        self._scan_port = self.DeclareAbstractInputPort("scan", AbstractValue.Make(object()))
        self.DeclareAbstractOutputPort(
            "costmap",
            lambda: AbstractValue.Make(object()),
            self._calc_costmap,
            prerequisites_of_calc={self.abstract_state_ticket(self._layers)},
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            1.0 / settings.update_frequency, offset_s, self._on_update
        )

    def _calc_costmap(self, context: Context, output: AbstractValue) -> None:
        output.set_value(context.get_abstract_state(self._layers).get_value().costmap)

    def _on_update(self, context: Context, state: State) -> None:
        scan = self._scan_port.Eval(context)
        if scan is None:
            return
        before = context.get_abstract_state(self._layers).get_value()
        pose = self._state_port.Eval(context)[:3]
        after = self._updated(before, scan, pose, context.get_time())
        state.get_mutable_abstract_state(self._layers).set_value(after)

    def _updated(
        self, layers: _LayerState, scan: Scan, pose: NDArray[np.float64], time_s: float
    ) -> _LayerState:
        settings = self._settings
        update = update_obstacle_layer(
            layers.obstacles,
            layers.origin,
            resolution=settings.resolution,
            robot_pose=pose,
            footprint=self._footprint,
            sensor_pose=scan.sensor_pose,
            angles=scan.angles_rad,
            ranges=scan.ranges_m,
            range_min=self._lidar.range_min_m,
            range_max=self._lidar.range_max_m,
            default_cost=self._default_cost,
            **settings.obstacle_layer.model_dump(),
        )
        costs = inflate(
            update.costs,
            resolution=settings.resolution,
            inscribed_radius=self._inscribed_radius,
            **settings.inflation_layer.model_dump(),
        )
        costmap = Costmap(
            costs,
            update.origin_x,
            update.origin_y,
            settings.resolution,
            tracks_unknown=settings.track_unknown_space,
            stamp_s=time_s,
        )
        return _LayerState(update.costs, (update.origin_x, update.origin_y), costmap)
