"""The base of sensors that meet shapes with their heights: sonars, depth cameras, flat lidars."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, State

from drake_navbench.kernels.depth_casting import Solids
from drake_navbench.navigation.mission import FloorSwitch
from drake_navbench.trial.systems.floor_aware import FloorAware, FloorClock
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import STATE_SIZE, declare_object_input, value_or_none

# The solids of a floor, and its bounds: least x, least y, largest x, largest y, m.
SolidsOfFloor = tuple[Solids, tuple[float, float, float, float]]


class ShapeSensors(FloorAware):
    """Base of sensors that look once in their period, the first time at t = 0.

    Input `state` [x m, y m, yaw rad, ...] of the base, world frame; `odometry`, the same by the
    odometry (not connected: equal to `state`); `moving` (Solids of moving bodies; need not be
    connected). The output holds what each sensor has seen, by its name; it is empty before the
    first look and again on another floor.

    periods_s: name and period, s, of each sensor. output: name of the output port. floor_clock: the
    clock of the floors, None where there is one.
    """

    def __init__(
        self,
        periods_s: Iterable[tuple[str, float]],
        *,
        output: str,
        floor_clock: FloorClock | None,
    ) -> None:
        super().__init__()
        if floor_clock is not None:
            self._declare_floors(floor_clock)
        none: Mapping[str, Any] = {}
        self._seen = self.DeclareAbstractState(AbstractValue.Make(none))
        self._state_port = self.DeclareVectorInputPort("state", STATE_SIZE)
        self._odometry_port = self.DeclareVectorInputPort("odometry", STATE_SIZE)
        self._moving_port = declare_object_input(self, "moving")
        self.DeclareStateOutputPort(output, self._seen)
        look = weakly_bound(self._on_look)
        for name, period_s in periods_s:
            self.DeclarePeriodicUnrestrictedUpdateEvent(period_s, 0.0, partial(look, name))

    def _on_look(self, name: str, context: Context, state: State) -> None:
        seen = state.get_mutable_abstract_state(self._seen)
        before: Mapping[str, Any] = seen.get_value()
        seen.set_value({**before, name: self._look(name, context, before.get(name))})

    def _on_floor(self, context: Context, state: State, switch: FloorSwitch) -> None:
        none: Mapping[str, Any] = {}
        state.get_mutable_abstract_state(self._seen).set_value(none)

    def _look(self, name: str, context: Context, before: Any) -> Any:
        """Returns the output of a sensor after a look; before: the one that it had, or None."""
        raise NotImplementedError

    def _in_sight(
        self, standing: Solids, floors: Sequence[SolidsOfFloor], context: Context
    ) -> Solids:
        """Returns the solids that a sensor can meet, standing and moving.

        standing: where there is one floor; of several floors, that of the robot counts.
        """
        moving = value_or_none(self._moving_port, context)
        if floors:
            standing, bounds = floors[self._floor(context)]
            moving = None if moving is None else moving.within(bounds)
        return standing if moving is None else standing.joined(moving)
