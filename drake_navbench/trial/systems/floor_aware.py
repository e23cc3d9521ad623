"""The response of a system to the robot's arrival on another floor."""

from __future__ import annotations

from typing import NamedTuple

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_navbench.inputs.timeline import SLACK_S
from drake_navbench.navigation.mission import FloorSwitch
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import declare_object_input, read_object


class FloorClock(NamedTuple):
    """The instants at which systems check for a change of floor: offset_s + k period_s, s."""

    period_s: float
    offset_s: float


class FloorAware(LeafSystem):
    """Base of systems that know of floors.

    A change of floor is announced before it is due. At its instant all systems meet it at once,
    each by its `_on_floor`, and all of them still see the state from before.
    """

    knows_floors = False

    def _declare_floors(self, clock: FloorClock) -> None:
        """Declares the input `floor_switch` (FloorSwitch or None), read at the clock's instants."""
        self.knows_floors = True
        self._switch_port = declare_object_input(self, "floor_switch")
        self._last_switch = self.DeclareAbstractState(AbstractValue.Make(object()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            clock.period_s, clock.offset_s, weakly_bound(self._on_floor_clock)
        )

    def _on_floor_clock(self, context: Context, state: State) -> None:
        switch: FloorSwitch | None = read_object(self._switch_port, context)
        if switch is None or context.get_time() < switch.time_s - SLACK_S:
            return
        before = self._switch_met(context)
        if before is None or switch.number > before.number:
            state.get_mutable_abstract_state(self._last_switch).set_value(switch)
            self._on_floor(context, state, switch)

    def floor_changes(self, context: Context) -> int:
        """Returns the number of changes of floor so far."""
        switch = self._switch_met(context)
        return 0 if switch is None else switch.number

    def _switch_met(self, context: Context) -> FloorSwitch | None:
        """Returns the last change of floor, None before the first and where there are no floors."""
        if not self.knows_floors:
            return None
        last = context.get_abstract_state(self._last_switch).get_value()
        return last if isinstance(last, FloorSwitch) else None

    def _floor(self, context: Context) -> int:
        """Returns the index of the floor that the robot is on."""
        switch = self._switch_met(context)
        return 0 if switch is None else switch.floor

    def _on_floor(self, context: Context, state: State, switch: FloorSwitch) -> None:
        """Makes the state that of the new floor."""
        raise NotImplementedError
