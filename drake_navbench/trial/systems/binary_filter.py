"""Nav2's binary filter: areas in which a switch is thrown, such as that of a warning light."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.rasterize import MASK_UNKNOWN
from drake_navbench.navigation.costmaps.costmap_settings import BinaryFilterSettings
from drake_navbench.navigation.costmaps.filter_masks import FilterMask
from drake_navbench.trial.systems.mask_filter import FilterState, MaskFilter


@dataclass(frozen=True)
class BinaryFilterState(FilterState):
    """Whether the switch is on, and its changes."""

    def as_plain(self) -> list[dict[str, Any]]:
        """Returns the changes as JSON values, for the log."""
        return [{"time_s": time_s, "is_on": is_on} for time_s, is_on in self.changes]


class BinaryFilter(MaskFilter):
    """A switch set by the mask.

    It is off until its first update, as in Jazzy and Lyrical; other releases begin with the default
    state.
    """

    Kept: ClassVar[type[FilterState]] = BinaryFilterState
    AT_START = False

    def __init__(self, mask: FilterMask, settings: BinaryFilterSettings, **more: Any) -> None:
        super().__init__(mask, **more)
        self._settings = settings

    def value_at(self, mask: FilterMask, position: NDArray[np.float64], last: bool) -> bool:
        """Returns whether the switch is on at (2,) m; last: whether it is on now."""
        return binary_state_at(mask, self._settings, position, last=last)


def binary_state_at(
    mask: FilterMask,
    settings: BinaryFilterSettings,
    position: NDArray[np.float64],
    *,
    last: bool,
) -> bool:
    """Returns the state at (2,) m, as Nav2's BinaryFilter.

    The state is the opposite of default_state where base + multiplier * mask value exceeds
    flip_threshold, default_state elsewhere and off the mask, and `last` on unknown cells.
    """
    value = mask.value_at(position)
    if value == MASK_UNKNOWN:
        return last
    is_flipped = value is not None and mask.base + mask.multiplier * value > settings.flip_threshold
    return settings.default_state != is_flipped
