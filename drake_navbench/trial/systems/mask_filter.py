"""The base of Nav2's costmap filters that act elsewhere than in a costmap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, State

from drake_navbench.kernels.immutable import Immutable
from drake_navbench.navigation.costmaps.filter_masks import FilterMask
from drake_navbench.navigation.mission import FloorSwitch
from drake_navbench.trial.systems.floor_aware import FloorAware, FloorClock
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import STATE_SIZE


@dataclass(frozen=True)
class FilterState(Immutable):
    """The value in force, and every change of it as (time s, value)."""

    value: Any
    changes: tuple[tuple[float, Any], ...] = ()

    def as_plain(self) -> list[dict[str, Any]]:
        """Returns the changes as JSON values, for the log."""
        raise NotImplementedError


class MaskFilter(FloorAware):
    """Looks a value up at the robot's estimated place, once a period from `offset_s` on.

    Input `estimate` [x m, y m, ...], in the map frame. Output `filter_state` (FilterState). In Nav2
    the costmap that lists the filter runs it with each of its updates.

    A subclass names the type of its state, `Kept`, and the value `AT_START`, which is in force
    again when the robot comes to another floor. Its `value_at` gives the value at a place.

    floors, floor_clock: the mask of each floor of a mission, None for a floor without one, and the
    instants of change; both or neither.
    """

    Kept: ClassVar[type[FilterState]]
    AT_START: ClassVar[Any]

    def __init__(
        self,
        mask: FilterMask,
        *,
        period_s: float,
        offset_s: float,
        floors: Sequence[FilterMask | None] = (),
        floor_clock: FloorClock | None = None,
    ) -> None:
        super().__init__()
        self._floors = floors or (mask,)
        if floor_clock is not None:
            self._declare_floors(floor_clock)
        self._state = self.DeclareAbstractState(AbstractValue.Make(self.Kept(self.AT_START)))
        self._estimate_port = self.DeclareVectorInputPort("estimate", STATE_SIZE)
        self.DeclareStateOutputPort("filter_state", self._state)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            period_s, offset_s, weakly_bound(self._on_update)
        )

    def value_at(self, mask: FilterMask, position: NDArray[np.float64], last: Any) -> Any:
        """Returns the value at (2,) m in the map frame; last: the value in force."""
        raise NotImplementedError

    def _on_update(self, context: Context, state: State) -> None:
        before: FilterState = context.get_abstract_state(self._state).get_value()
        mask = self._floors[self._floor(context)]
        if mask is not None:
            position = self._estimate_port.Eval(context)[:2]
            self._set(context, state, self.value_at(mask, position, before.value))

    def _on_floor(self, context: Context, state: State, switch: FloorSwitch) -> None:
        self._set(context, state, self.AT_START)

    def _set(self, context: Context, state: State, value: Any) -> None:
        before: FilterState = context.get_abstract_state(self._state).get_value()
        if value != before.value:
            after = self.Kept(value, (*before.changes, (context.get_time(), value)))
            state.get_mutable_abstract_state(self._state).set_value(after)
