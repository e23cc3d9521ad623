"""Gaussian processes on the unit cube: what some trials foretell of others.

Squared exponential kernel with a length scale for every dimension, of amplitude one, and noise
(C. E. Rasmussen, C. K. I. Williams, "Gaussian Processes for Machine Learning", 2006: prediction eq.
2.25 and 2.26, evidence 5.8 and its slopes 5.9, left-out predictions 5.12).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.optimize import minimize

Array = NDArray[np.float64]

# Beliefs about length scales, in widths of the range, and about noise, as a share of the spread.
LENGTH, LENGTH_FACTOR, NOISE, NOISE_FACTOR = 1.5, 3.0, 0.1, 5.0
LOG_BOUNDS = (-5.0, 3.0)
JITTER = 1e-8
IMPOSSIBLE = 1e6


class Kernel(NamedTuple):
    """lengths: (D,). noise: as a share of the values' spread."""

    lengths: Array
    noise: float


class Foretold(NamedTuple):
    """means, deviations: (K,) of a normal distribution for each of K points."""

    means: Array
    deviations: Array


def fit_kernel(points: Array, values: Array) -> Kernel:
    """Returns the most probable kernel for (N, D) points of the unit cube and their (N,) values."""
    count = points.shape[1]
    targets = _standardised(values)
    apart = (points[:, None, :] - points[None, :, :]) ** 2
    centre = np.array([math.log(LENGTH)] * count + [math.log(NOISE)])
    width = np.array([math.log(LENGTH_FACTOR)] * count + [math.log(NOISE_FACTOR)])

    def improbability(logs: Array) -> tuple[float, Array]:
        beliefs = (logs - centre) / width
        found = _evidence(apart, targets, logs)
        if found is None:
            return IMPOSSIBLE, np.zeros_like(logs)
        value, slopes = found
        return value + 0.5 * float(beliefs @ beliefs), slopes + beliefs / width

    logs = minimize(
        improbability, centre, method="L-BFGS-B", jac=True, bounds=[LOG_BOUNDS] * (count + 1)
    ).x
    return Kernel(np.exp(logs[:-1]), math.exp(logs[-1]))


@dataclass(frozen=True)
class GaussianProcess:
    """A kernel that knows (N, D) points and their (N,) values."""

    kernel: Kernel
    points: Array
    values: Array

    def foretell(self, points: Array) -> Foretold:
        """Returns what is foretold of (K, D) points, without noise of their own."""
        offset, scale = _spread(self.values)
        weights, inverse = self._solved
        near = _covariance(points, self.points, self.kernel.lengths)
        variances = 1.0 - np.einsum("ij,ij->i", near @ inverse, near)
        return Foretold(
            offset + scale * (near @ weights), scale * np.sqrt(np.maximum(variances, 0.0))
        )

    def foretell_left_out(self) -> Foretold:
        """Returns what all other points foretell of each of its own, (N,)."""
        scale = _spread(self.values)[1]
        weights, inverse = self._solved
        own = np.diag(inverse)
        return Foretold(self.values - scale * weights / own, scale / np.sqrt(own))

    @cached_property
    def _solved(self) -> tuple[Array, Array]:
        """The weights of the points and the inverse of their covariance."""
        covariance = _covariance(self.points, self.points, self.kernel.lengths)
        covariance[np.diag_indices_from(covariance)] += self.kernel.noise**2 + JITTER
        inverse = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
        return inverse @ _standardised(self.values), inverse


def _evidence(apart: Array, targets: Array, logs: Array) -> tuple[float, Array] | None:
    """Returns the negative log evidence and its slopes by the logs; None where singular.

    apart: (N, N, D) squared distances.
    """
    lengths, noise = np.exp(logs[:-1]), math.exp(logs[-1])
    smooth = np.exp(-0.5 * (apart @ (1.0 / lengths**2)))
    covariance = smooth.copy()
    covariance[np.diag_indices_from(covariance)] += noise**2 + JITTER
    try:
        factor = cho_factor(covariance, lower=True)
    except LinAlgError:
        return None
    inverse = cho_solve(factor, np.eye(len(targets)))
    weights = inverse @ targets
    value = 0.5 * float(targets @ weights) + float(np.log(np.diag(factor[0])).sum())
    beyond = inverse - np.outer(weights, weights)
    by_length = 0.5 * np.tensordot(beyond * smooth, apart, axes=2) / lengths**2
    return value, np.append(by_length, np.trace(beyond) * noise**2)


def _covariance(first: Array, second: Array, lengths: Array) -> Array:
    a, b = first / lengths, second / lengths
    apart = (a * a).sum(axis=1)[:, None] + (b * b).sum(axis=1)[None, :] - 2.0 * (a @ b.T)
    return np.asarray(np.exp(-0.5 * np.maximum(apart, 0.0)))


def _spread(values: Array) -> tuple[float, float]:
    return float(values.mean()), float(values.std()) or 1.0


def _standardised(values: Array) -> Array:
    offset, scale = _spread(values)
    return np.asarray((values - offset) / scale)
