"""Nav2's speed filter: areas in which the robot must drive more slowly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import SpeedLimit
from drake_navbench.kernels.rasterize import MASK_UNKNOWN
from drake_navbench.navigation.costmaps.filter_masks import FilterMask
from drake_navbench.trial.systems.mask_filter import FilterState, MaskFilter
from drake_navbench.trial.systems.ports import declare_state_part_output

FULL_SPEED_PERCENT = 100.0


@dataclass(frozen=True)
class SpeedFilterState(FilterState):
    """The speed limit in force, a SpeedLimit or None, and its changes."""

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


class SpeedFilter(MaskFilter):
    """Limits the speed by the mask; a further output is `speed_limit` (SpeedLimit or None)."""

    Kept: ClassVar[type[FilterState]] = SpeedFilterState
    AT_START = None

    def __init__(self, mask: FilterMask, **more: Any) -> None:
        super().__init__(mask, **more)
        declare_state_part_output(self, "speed_limit", self._state, lambda state: state.value)

    def value_at(
        self, mask: FilterMask, position: NDArray[np.float64], last: SpeedLimit | None
    ) -> SpeedLimit | None:
        """Returns the limit at (2,) m; last: the one in force."""
        return speed_limit_at(mask, position, last=last)


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
