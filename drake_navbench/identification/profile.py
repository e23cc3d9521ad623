"""What a search tells of each value: a profile of a surrogate of its error.

The surrogate is a Gaussian process with a squared exponential kernel and a length scale for every
dimension (C. E. Rasmussen, C. K. I. Williams, "Gaussian Processes for Machine Learning", 2006, eq.
2.25, 5.8 and 5.9; left-out residuals: eq. 5.12).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.optimize import minimize
from scipy.stats import qmc

from drake_navbench.identification.ranges import grid_of, place_of
from drake_navbench.identification.search import Evaluation, best_of
from drake_navbench.tuning.search_space import Dimension

Array = NDArray[np.float64]

OTHERS_LOG2 = 9
# An error no farther above the least than this many left-out residuals is as good.
RESIDUALS = 2.0
# A value is found where no more than this share of the searched range is as good.
FOUND_SHARE = 0.5
# Of a surrogate that tells nothing: its left-out residuals are as large as the errors' own spread.
LEAST_EXPLAINED = 0.25
# Beliefs about length scales, in widths of the range, and about noise, as a share of the spread.
LENGTH, LENGTH_FACTOR, NOISE, NOISE_FACTOR = 0.6, 3.0, 0.1, 5.0
JITTER = 1e-8


class Profile(NamedTuple):
    """What is known of one value.

    found: of the best evaluation. low, high: between which the others are as good; of one of
    several choices the first and last as good in `as_good`. share: of the range that lies between,
    of choices those that are as good.
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


def profiles(dimensions: Sequence[Dimension], evaluations: list[Evaluation]) -> list[Profile]:
    """Returns what is known of every dimension.

    A value is as good as the best where the surrogate's error, minimised over all other
    dimensions, is at most two left-out residuals above its least. Where the surrogate cannot
    foretell the evaluations, everything is as good.
    """
    best = best_of(evaluations)
    points = np.array(
        [[place_of(d, e.values[d.name]) for d in dimensions] for e in evaluations], dtype=float
    )
    errors = np.array([evaluation.error for evaluation in evaluations])
    surrogate = fit_surrogate(points, errors)
    others = np.vstack([_sobol(len(dimensions)), points])
    found = []
    for index, dimension in enumerate(dimensions):
        values = grid_of(dimension)
        if surrogate is None:
            is_good = np.full(len(values), True)
        else:
            least = np.array(
                [
                    surrogate.mean(_with(others, index, place_of(dimension, value))).min()
                    for value in values
                ]
            )
            is_good = least <= least.min() + RESIDUALS * surrogate.residual
        good = [value for value, chosen in zip(values, is_good, strict=True) if chosen]
        here = best.values[dimension.name]
        low, high = (here, here) if dimension.choices else (min(*good, here), max(*good, here))
        as_good = tuple(good) if dimension.choices else ()
        share = _share(dimension, low, high, as_good)
        found.append(Profile(dimension.name, here, low, high, as_good, share))
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


@dataclass(frozen=True)
class Surrogate:
    """A Gaussian process. residual: root mean square of its left-out residuals."""

    points: Array
    weights: Array
    lengths: Array
    offset: float
    scale: float
    residual: float

    def mean(self, points: Array) -> Array:
        """Returns its mean at (K, D) points of the unit cube, (K,)."""
        kernel = _kernel(points, self.points, self.lengths)
        return np.asarray(self.offset + self.scale * kernel @ self.weights)


def fit_surrogate(points: Array, errors: Array) -> Surrogate | None:
    """Fits (N, D) points of the unit cube and their (N,) errors; None where it foretells nothing.

    Length scales and noise are the most probable ones.
    """
    offset, scale = float(errors.mean()), float(errors.std())
    if scale == 0.0:
        return None
    targets = (errors - offset) / scale
    count = points.shape[1]
    centre = np.array([math.log(LENGTH)] * count + [math.log(NOISE)])
    width = np.array([math.log(LENGTH_FACTOR)] * count + [math.log(NOISE_FACTOR)])

    def improbability(logs: Array) -> float:
        solved = _solved(points, targets, logs)
        if solved is None:
            return 1e6
        factor, weights = solved
        evidence = 0.5 * targets @ weights + np.log(np.diag(factor)).sum()
        return float(evidence + 0.5 * (((logs - centre) / width) ** 2).sum())

    logs = minimize(improbability, centre, method="L-BFGS-B", bounds=[(-5.0, 3.0)] * (count + 1)).x
    solved = _solved(points, targets, logs)
    if solved is None:
        return None
    factor, weights = solved
    inverse = cho_solve((factor, True), np.eye(len(targets)))
    residual = float(np.sqrt(np.mean((weights / np.diag(inverse)) ** 2)))
    if residual**2 > 1.0 - LEAST_EXPLAINED:
        return None
    return Surrogate(points, weights, np.exp(logs[:-1]), offset, scale, residual * scale)


def _solved(points: Array, targets: Array, logs: Array) -> tuple[Array, Array] | None:
    """Returns the kernel's Cholesky factor and the weights of the points; None where singular."""
    kernel = _kernel(points, points, np.exp(logs[:-1]))
    kernel[np.diag_indices_from(kernel)] += math.exp(2.0 * logs[-1]) + JITTER
    try:
        factor, _ = cho_factor(kernel, lower=True)
    except LinAlgError:
        return None
    return np.tril(factor), cho_solve((factor, True), targets)


def _kernel(first: Array, second: Array, lengths: Array) -> Array:
    apart = (first[:, None, :] - second[None, :, :]) / lengths
    return np.asarray(np.exp(-0.5 * (apart**2).sum(axis=2)))


def _sobol(count: int) -> Array:
    return np.asarray(qmc.Sobol(count, seed=0).random_base2(OTHERS_LOG2))


def _with(points: Array, index: int, place: float) -> Array:
    changed = points.copy()
    changed[:, index] = place
    return changed
