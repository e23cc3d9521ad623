"""What the tables tell of each value: a profile of the emulated error."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from drake_navbench.identification.folds import Fit
from drake_navbench.identification.minimum import slices_of, snapped
from drake_navbench.identification.ranges import grid_of, place_of
from drake_navbench.identification.unknowns import Block
from drake_navbench.tuning.search_space import Dimension

Array = NDArray[np.float64]

OTHERS_LOG2 = 7
# Besides, values within this much of those found, as a share of their ranges.
NEAR = 0.15
# An error no farther above the least than this many left-out residuals is as good.
RESIDUALS = 2.0
# A value is found where no more than this share of the searched range is as good.
FOUND_SHARE = 0.5


class Profile(NamedTuple):
    """What is known of one value.

    found: of the best settings that were driven. low, high: between which the others are as good;
    of one of several choices the first and last as good in `as_good`. share: of the range that lies
    between, of choices those that are as good.
    """

    name: str
    found: Any
    low: Any
    high: Any
    as_good: tuple[Any, ...]
    share: float

    @property
    def is_told(self) -> bool:
        """Whether the tables tell it, at least from half of the range."""
        return self.share <= FOUND_SHARE


def profiles(blocks: Sequence[Block], block: Block, fit: Fit) -> list[Profile]:
    """Returns what is known of every unknown of a block; blocks: all, in the order of a point.

    A value is as good as the best where the emulated error of the cells that tell of the block,
    minimised over its other unknowns, is at most two left-out residuals above its least. Where the
    emulator cannot foretell errors, everything is as good.
    """
    told = [cell for cell in fit.cells if block.is_told_by(cell)]
    part = slices_of(blocks)[list(blocks).index(block)]
    residual = fit.emulator.left_out_residual(told)
    candidates = _candidates(fit.point, part)
    found = []
    for index, dimension in enumerate(block.dimensions, start=part.start):
        values = grid_of(dimension)
        is_good = np.full(len(values), True)
        if residual is not None:
            least = np.empty(len(values))
            for number, value in enumerate(values):
                candidates[:, index] = place_of(dimension, value)
                errors = fit.emulator.expected_errors(snapped(blocks, candidates), told)
                least[number] = errors.min()
            candidates = _candidates(fit.point, part)
            is_good = least <= least.min() + RESIDUALS * residual
        good = [value for value, chosen in zip(values, is_good, strict=True) if chosen]
        found.append(_profile(dimension, fit.settings.of_block(block)[dimension.name], good))
    return found


def share_of_all(dimension: Dimension, found: Sequence[Profile]) -> float:
    """Returns the share of a dimension's range that several profiles of it take together."""
    good = {value for profile in found for value in profile.as_good}
    low, high = min(profile.low for profile in found), max(profile.high for profile in found)
    return _share(dimension, low, high, good)


def _share(dimension: Dimension, low: Any, high: Any, as_good: Collection[Any]) -> float:
    if dimension.choices:
        return len(as_good) / len(dimension.choices)
    return place_of(dimension, high) - place_of(dimension, low)


def _candidates(point: Array, part: slice) -> Array:
    """Returns points that differ from one in a part: all over the range, and near it."""
    count = part.stop - part.start
    places = np.asarray(qmc.Sobol(count, seed=0).random_base2(OTHERS_LOG2))
    candidates = np.repeat(point[None], 1 + 2 * len(places), axis=0)
    candidates[1 : 1 + len(places), part] = places
    near = point[part] + NEAR * (2.0 * places - 1.0)
    candidates[1 + len(places) :, part] = near.clip(0.0, 1.0)
    return candidates


def _profile(dimension: Dimension, here: Any, good: Sequence[Any]) -> Profile:
    low, high = (here, here) if dimension.choices else (min(*good, here), max(*good, here))
    as_good = tuple(good) if dimension.choices else ()
    return Profile(dimension.name, here, low, high, as_good, _share(dimension, low, high, as_good))
