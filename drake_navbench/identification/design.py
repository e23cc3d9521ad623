"""Where the trials of an identification lie in the space of all unknowns.

What a controller does in a scenario is a function of the base, the scenario's layout and its own
settings. So a point that has a value for every unknown serves every scenario, every controller and
whatever is held out: all fits learn from the same trials, which know nothing of any table.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from drake_navbench.identification.ranges import place_of, value_at
from drake_navbench.identification.unknowns import Block, Settings

Array = NDArray[np.float64]


def dimension_count(blocks: Sequence[Block]) -> int:
    """Returns how many unknowns some blocks have."""
    return sum(len(block.dimensions) for block in blocks)


def design_points(blocks: Sequence[Block], count: int, seed: int) -> Array:
    """Returns (count, D) Sobol points of the unit cube; more of them begin with the same ones."""
    sobol = qmc.Sobol(dimension_count(blocks), rng=np.random.default_rng(seed))
    with warnings.catch_warnings():
        # Numbers that are no power of two are a little less even.
        warnings.simplefilter("ignore", UserWarning)
        return np.asarray(sobol.random(count))


def settings_at(blocks: Sequence[Block], point: Array) -> Settings:
    """Returns the settings at a point (D,) of the unit cube, block after block."""
    settings = Settings()
    first = 0
    for block in blocks:
        last = first + len(block.dimensions)
        values = {
            dimension.name: value_at(dimension, float(place))
            for dimension, place in zip(block.dimensions, point[first:last], strict=True)
        }
        settings = settings.with_block(block, values)
        first = last
    return settings


def point_of(blocks: Sequence[Block], settings: Settings) -> Array:
    """Returns the point (D,) of settings that have a value for every unknown of the blocks.

    It is that of the rounded values which were driven.
    """
    return np.array(
        [
            place_of(dimension, settings.of_block(block)[dimension.name])
            for block in blocks
            for dimension in block.dimensions
        ]
    )
