"""A layered costmap as a system: the common part of the local and the global one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, State

from drake_navbench.kernels.immutable import Immutable
from drake_navbench.navigation.costmaps.layered_costmap import LayeredCostmap, LayersState
from drake_navbench.navigation.mission import FloorSwitch
from drake_navbench.navigation.task import ClearRequest
from drake_navbench.trial.systems.floor_aware import FloorAware, FloorClock
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import (
    POSE_SIZE,
    STATE_SIZE,
    declare_object_input,
    declare_state_part_output,
    read_object,
    value_or_none,
)


@dataclass(frozen=True, eq=False)
class _CostmapState(Immutable):
    """The state of the layers, and the last request to clear them that was met."""

    layers: LayersState
    clear_request: ClearRequest | None = None


class CostmapSystem(FloorAware):
    """Updates a layered costmap once a period, the first time at `offset_s`.

    Inputs `state` [x m, y m, yaw rad, ...], the robot's estimate of its pose in the costmap's
    frame, `scan` (Scan or None), `clouds` (PointCloud by the name of the sensor), `ranges` (the
    newest RangeReadings by the name of the sensor), `clear_request` (ClearRequest or None) and
    `map_from_odometry` (3,), the pose of the odometry frame in the map frame (not connected: the
    two are one); the last four need not be connected. Output `costmap` (Costmap, or None before
    there is one). Each update takes the newest scan; after a new request to clear, the next one
    starts from the map alone.

    is_in_map: whether the costmap lies in the map's frame, else in the odometry's.
    before_first_scan: the state of the layers until there is a scan; it may have no costmap.
    floors, floor_clock: the layers of each floor of a mission, and the instants of change; both or
    neither. On a new floor nothing has been seen yet.
    """

    def __init__(
        self,
        layers: LayeredCostmap,
        *,
        before_first_scan: LayersState,
        period_s: float,
        offset_s: float,
        is_in_map: bool = False,
        floors: Sequence[LayeredCostmap] = (),
        floor_clock: FloorClock | None = None,
    ) -> None:
        super().__init__()
        self._layers = layers
        self._floors = floors
        if floor_clock is not None:
            self._declare_floors(floor_clock)
        self._is_in_map = is_in_map
        first = _CostmapState(before_first_scan)
        self._layers_state = self.DeclareAbstractState(AbstractValue.Make(first))
        self._odometry_port = self.DeclareVectorInputPort("state", STATE_SIZE)
        self._scan_port = declare_object_input(self, "scan")
        self._clouds_port = declare_object_input(self, "clouds")
        self._ranges_port = declare_object_input(self, "ranges")
        self._clear_port = declare_object_input(self, "clear_request")
        self._map_port = self.DeclareVectorInputPort("map_from_odometry", POSE_SIZE)
        declare_state_part_output(
            self, "costmap", self._layers_state, lambda state: state.layers.costmap
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            period_s, offset_s, weakly_bound(self._on_update)
        )

    def _on_update(self, context: Context, state: State) -> None:
        scan = read_object(self._scan_port, context)
        if scan is None:
            return
        before = context.get_abstract_state(self._layers_state).get_value()
        request = value_or_none(self._clear_port, context)
        is_new = request is not None and request != before.clear_request
        own = self._floors[self._floor(context)] if self._floors else self._layers
        layers = own.cleared(before.layers) if is_new else before.layers
        map_from_odometry = value_or_none(self._map_port, context)
        own_from_odometry = map_from_odometry if self._is_in_map else None
        updated = own.updated(
            layers,
            scan=scan.placed_by_odometry(own_from_odometry),
            pose=self._odometry_port.Eval(context)[:3],
            time_s=context.get_time(),
            clouds={
                name: cloud.placed_by_odometry(own_from_odometry)
                for name, cloud in (value_or_none(self._clouds_port, context) or {}).items()
            },
            ranges={
                name: tuple(one.placed_by_odometry(own_from_odometry) for one in readings)
                for name, readings in (value_or_none(self._ranges_port, context) or {}).items()
            },
            map_from_costmap=None if self._is_in_map else map_from_odometry,
        )
        state.get_mutable_abstract_state(self._layers_state).set_value(
            _CostmapState(updated, request)
        )

    def _on_floor(self, context: Context, state: State, switch: FloorSwitch) -> None:
        before: _CostmapState = context.get_abstract_state(self._layers_state).get_value()
        anew = _CostmapState(self._before_first_scan(switch), before.clear_request)
        state.get_mutable_abstract_state(self._layers_state).set_value(anew)

    def _before_first_scan(self, switch: FloorSwitch) -> LayersState:
        """Returns the layers of a new floor until there is a scan."""
        return self._floors[switch.floor].initial_state()
