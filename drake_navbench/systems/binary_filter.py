"""Nav2's binary filter: areas in which a switch is thrown, such as that of a warning light."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, State

from drake_navbench.costmaps.costmap_settings import BinaryFilterSettings
from drake_navbench.costmaps.filter_masks import FilterMask
from drake_navbench.kernels.rasterize import MASK_UNKNOWN
from drake_navbench.navigation.mission import FloorSwitch
from drake_navbench.systems.floor_aware import FloorAware, FloorClock
from drake_navbench.systems.lifetime import weakly_bound
from drake_navbench.systems.ports import STATE_SIZE
from drake_navbench.typed_files.immutable import Immutable


@dataclass(frozen=True)
class BinaryFilterState(Immutable):
    """The state of the switch, and every change of it as (time s, state)."""

    is_on: bool = False
    changes: tuple[tuple[float, bool], ...] = ()

    def as_plain(self) -> list[dict[str, Any]]:
        """Returns the changes as JSON values, for the log."""
        return [{"time_s": time_s, "is_on": is_on} for time_s, is_on in self.changes]


class BinaryFilter(FloorAware):
    """Looks the switch up where the robot believes to be, once a period from `offset_s` on.

    Input `estimate` [x m, y m, ...], in the map frame. Output `filter_state` (BinaryFilterState).
    As in Nav2 it starts switched off, whatever the default state, also on every other floor.

    floors: the mask of each floor, None for one without any, where there are several; their clock
    comes with them.
    """

    def __init__(
        self,
        mask: FilterMask,
        settings: BinaryFilterSettings,
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
        self._settings = settings
        self._state = self.DeclareAbstractState(AbstractValue.Make(BinaryFilterState()))
        self._estimate_port = self.DeclareVectorInputPort("estimate", STATE_SIZE)
        self.DeclareStateOutputPort("filter_state", self._state)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            period_s, offset_s, weakly_bound(self._on_update)
        )

    def _on_update(self, context: Context, state: State) -> None:
        before: BinaryFilterState = context.get_abstract_state(self._state).get_value()
        mask = self._floors[self._floor(context)]
        if mask is not None:
            position = self._estimate_port.Eval(context)[:2]
            is_on = binary_state_at(mask, self._settings, position, last=before.is_on)
            self._set(context, state, is_on)

    def _on_floor(self, context: Context, state: State, switch: FloorSwitch) -> None:
        self._set(context, state, False)

    def _set(self, context: Context, state: State, is_on: bool) -> None:
        before: BinaryFilterState = context.get_abstract_state(self._state).get_value()
        if is_on != before.is_on:
            changes = (*before.changes, (context.get_time(), is_on))
            after = BinaryFilterState(is_on, changes)
            state.get_mutable_abstract_state(self._state).set_value(after)


def binary_state_at(
    mask: FilterMask,
    settings: BinaryFilterSettings,
    position: NDArray[np.float64],
    *,
    last: bool,
) -> bool:
    """Returns the state at (2,) m, as Nav2's BinaryFilter.

    Flipped from default_state where base + multiplier * mask value exceeds flip_threshold; off the
    mask default_state; on unknown cells `last`.
    """
    value = mask.value_at(position)
    if value == MASK_UNKNOWN:
        return last
    is_flipped = value is not None and mask.base + mask.multiplier * value > settings.flip_threshold
    return settings.default_state != is_flipped
