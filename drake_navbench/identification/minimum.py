"""Where a function of all unknowns is least, one block of them after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from drake_navbench.identification.ranges import place_of, value_at
from drake_navbench.identification.unknowns import Block

Array = NDArray[np.float64]
Errors = Callable[[Array, Block], Array]
"""From (K, D) points and the block in which they differ to (K,) errors."""

# Of each generation, for every unknown of the block; and generations.
MEMBERS, GENERATIONS = 8, 20


def least_error_point(
    errors: Errors, blocks: Sequence[Block], start: Array, *, sweeps: int, seed: int
) -> Array:
    """Returns the point (D,) that is found from a start, as it would be driven.

    errors: may leave out what does not depend on the block.
    """
    point = snapped(blocks, start[None])[0]
    slices = slices_of(blocks)
    for sweep in range(sweeps):
        for number, (block, part) in enumerate(zip(blocks, slices, strict=True)):
            point[part] = _least_in_block(
                errors, blocks, point, block, part, seed=seed + sweep * len(blocks) + number
            )
    return point


def slices_of(blocks: Sequence[Block]) -> list[slice]:
    """Returns where in a point (D,) each block lies."""
    ends = np.cumsum([len(block.dimensions) for block in blocks]).tolist()
    return [slice(end - len(b.dimensions), end) for b, end in zip(blocks, ends, strict=True)]


def snapped(blocks: Sequence[Block], points: Array) -> Array:
    """Returns points (K, D) where values that can be driven lie: whole numbers and choices."""
    snapped = points.copy()
    dimensions = [dimension for block in blocks for dimension in block.dimensions]
    for index, dimension in enumerate(dimensions):
        if dimension.is_whole or dimension.choices:
            places = points[:, index].clip(0.0, 1.0).tolist()
            snapped[:, index] = [place_of(dimension, value_at(dimension, p)) for p in places]
    return snapped


def _least_in_block(
    errors: Errors, blocks: Sequence[Block], point: Array, block: Block, part: slice, *, seed: int
) -> Array:
    def errors_of(members: Array) -> Array:
        candidates = np.repeat(point[None], members.shape[1], axis=0)
        candidates[:, part] = members.T
        return errors(snapped(blocks, candidates), block)

    count = len(block.dimensions)
    found = differential_evolution(
        errors_of,
        [(0.0, 1.0)] * count,
        x0=point[part],
        popsize=MEMBERS,
        maxiter=GENERATIONS,
        init="sobol",
        polish=False,
        updating="deferred",
        vectorized=True,
        rng=np.random.default_rng(seed),
    )
    best = point.copy()
    best[part] = found.x
    return snapped(blocks, best[None])[0, part]
