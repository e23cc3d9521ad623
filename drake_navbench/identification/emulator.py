"""What driven settings foretell of others: an emulator of every cell's deviation from its table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from drake_navbench.identification.gaussian_process import (
    Foretold,
    GaussianProcess,
    Kernel,
    fit_kernel,
)
from drake_navbench.identification.scores import MOST_ERROR, deviation_of
from drake_navbench.identification.targets import Cell, Targets
from drake_navbench.identification.unknowns import Block

Array = NDArray[np.float64]
Places = NDArray[np.int64]


class Driven(NamedTuple):
    """Settings that were driven.

    points: (N, D) of the unit cube of all unknowns. deviations: by cell (N,); of settings that
    could not be driven as far off as can be, so that nothing is looked for near them.
    """

    points: Array
    deviations: Mapping[Cell, Array]

    def errors(self, cells: Iterable[Cell]) -> Array:
        """Returns the mean errors of some cells, (N,)."""
        return np.mean([np.abs(self.deviations[cell]) for cell in cells], axis=0)

    def and_also(self, more: Driven) -> Driven:
        """Returns both, the cells of `more` only."""
        return Driven(
            np.vstack([self.points, more.points]),
            {
                cell: np.concatenate([self.deviations[cell], others])
                for cell, others in more.deviations.items()
            },
        )


def driven_of(
    points: Array, found: Sequence[Mapping[Cell, float]], cells: Iterable[Cell], targets: Targets
) -> Driven:
    """Returns what settings have come to; found: their numbers, of the cells that were driven."""
    return Driven(
        points,
        {
            cell: np.array(
                [deviation_of(cell, numbers.get(cell, np.nan), targets) for numbers in found]
            )
            for cell in cells
        },
    )


def kernels_of(driven: Driven, places: Mapping[Cell, Places]) -> dict[Cell, Kernel]:
    """Returns the most probable kernel of each cell; places: of the unknowns that it hangs on."""
    return {
        cell: fit_kernel(driven.points[:, places[cell]], deviations)
        for cell, deviations in driven.deviations.items()
    }


def places_of(blocks: Sequence[Block], cells: Iterable[Cell]) -> dict[Cell, Places]:
    """Returns by cell which unknowns of a point (D,) it hangs on."""
    owners = [block for block in blocks for _ in block.dimensions]
    return {
        cell: np.array([i for i, block in enumerate(owners) if block.is_told_by(cell)], dtype=int)
        for cell in cells
    }


@dataclass(frozen=True)
class Emulator:
    """A Gaussian process a cell, which knows what was driven. places: as from `places_of`."""

    driven: Driven
    processes: Mapping[Cell, GaussianProcess]
    places: Mapping[Cell, Places]

    def expected_errors(self, points: Array, cells: Sequence[Cell]) -> Array:
        """Returns (K,) the mean error of some cells that is expected at (K, D) points.

        What is unknown of a deviation counts: it may be as wrong as it may be right.
        """
        total = np.zeros(len(points))
        for cell in cells:
            foretold = self.processes[cell].foretell(points[:, self.places[cell]])
            total += _expected_size(foretold)
        return total / len(cells)

    def left_out_residual(self, cells: Sequence[Cell]) -> float | None:
        """Returns how far off the mean error of some cells is foretold by all other points.

        The root mean square in the better half of the points; None where it is no better than
        always to foretell their mean.
        """
        left_out = [self.processes[cell].foretell_left_out() for cell in cells]
        foretold = np.mean([_expected_size(one) for one in left_out], axis=0)
        errors = self.driven.errors(cells)
        is_better = errors <= np.median(errors)
        residual = float(np.sqrt(np.mean((errors - foretold)[is_better] ** 2)))
        return residual if residual < float(errors.std()) else None


def emulator_of(
    driven: Driven, kernels: Mapping[Cell, Kernel], places: Mapping[Cell, Places]
) -> Emulator:
    """Returns the emulator that knows what was driven."""
    processes = {
        cell: GaussianProcess(kernels[cell], driven.points[:, places[cell]], deviations)
        for cell, deviations in driven.deviations.items()
    }
    return Emulator(driven, processes, places)


def _expected_size(foretold: Foretold) -> Array:
    """Returns the mean of a folded normal distribution, no more than the most an error counts."""
    means, deviations = foretold.means, np.maximum(foretold.deviations, 1e-9)
    ratio = means / deviations
    mean = deviations * np.sqrt(2.0 / np.pi) * np.exp(-0.5 * ratio**2) + means * erf(
        ratio / np.sqrt(2.0)
    )
    return np.asarray(np.minimum(mean, MOST_ERROR))
