"""Nav2's speed filter: areas in which the robot must drive more slowly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, State

from drake_navbench.controller import SpeedLimit
from drake_navbench.costmaps.filter_masks import FilterMask
from drake_navbench.kernels.rasterize import MASK_UNKNOWN
from drake_navbench.navigation.mission import FloorSwitch
from drake_navbench.systems.floor_aware import FloorAware, FloorClock
from drake_navbench.systems.lifetime import weakly_bound
from drake_navbench.systems.ports import STATE_SIZE, declare_state_part_output
from drake_navbench.typed_files.immutable import Immutable

FULL_SPEED_PERCENT = 100.0


@dataclass(frozen=True)
class SpeedFilterState(Immutable):
    """The limit in force, and every change of it as (time s, limit)."""

    limit: SpeedLimit | None = None
    changes: tuple[tuple[float, SpeedLimit | None], ...] = ()

    def as_plain(self) -> list[dict[str, Any]]:
        """Returns the changes as JSON values, for the log."""
        return [
            {
                "time_s": time_s,
                "limit": None if limit is None else limit.value,
                "is_percentage": limit is not None and limit.is_percentage,
            }
            for time_s, limit in self.changes
        ]


class SpeedFilter(FloorAware):
    """Looks the speed limit up where the robot believes to be, once a period from `offset_s` on.

    Input `estimate` [x m, y m, ...], in the map frame. Outputs `speed_limit` (SpeedLimit or None)
    and `filter_state` (SpeedFilterState). In Nav2 the costmap that lists the filter runs it with
    each of its updates.

    floors: the mask of each floor, None for one without any, where there are several; their clock
    comes with them. There is no limit when the robot comes to another floor.
    """

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
        self._state = self.DeclareAbstractState(AbstractValue.Make(SpeedFilterState()))
        self._estimate_port = self.DeclareVectorInputPort("estimate", STATE_SIZE)
        declare_state_part_output(self, "speed_limit", self._state, lambda state: state.limit)
        self.DeclareStateOutputPort("filter_state", self._state)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            period_s, offset_s, weakly_bound(self._on_update)
        )

    def _on_update(self, context: Context, state: State) -> None:
        before: SpeedFilterState = context.get_abstract_state(self._state).get_value()
        mask = self._floors[self._floor(context)]
        if mask is not None:
            position = self._estimate_port.Eval(context)[:2]
            self._set(context, state, speed_limit_at(mask, position, last=before.limit))

    def _on_floor(self, context: Context, state: State, switch: FloorSwitch) -> None:
        self._set(context, state, None)

    def _set(self, context: Context, state: State, limit: SpeedLimit | None) -> None:
        before: SpeedFilterState = context.get_abstract_state(self._state).get_value()
        if limit != before.limit:
            changes = (*before.changes, (context.get_time(), limit))
            after = SpeedFilterState(limit, changes)
            state.get_mutable_abstract_state(self._state).set_value(after)


def speed_limit_at(
    mask: FilterMask, position: NDArray[np.float64], *, last: SpeedLimit | None
) -> SpeedLimit | None:
    """Returns the limit at (2,) m: base + multiplier * mask value, None where there is no limit.

    As Nav2's SpeedFilter: mask value 0 is no limit; off the mask and on unknown cells the `last`
    limit stays in force; a percentage above 100, a negative limit and a limit of 0 are no limit.
    """
    value = mask.value_at(position)
    if value is None or value == MASK_UNKNOWN:
        return last
    limit = mask.base + mask.multiplier * value
    is_percentage = mask.type == "speed_percent"
    if value == 0 or limit <= 0.0 or (is_percentage and limit > FULL_SPEED_PERCENT):
        return None
    return SpeedLimit(limit, is_percentage)
