"""Parabolas fitted to a window of samples, for derivatives of noisy signals.

The same numbers, to the last bit, as scipy.signal.savgol_filter, whose module takes more than a
second to import in every process that measures a trial.
"""

from __future__ import annotations

from math import factorial

import numpy as np

from drake_navbench.kernels.arrays import Array

PARABOLA = 2


def parabola_derivatives(values: Array, width: int, period_s: float) -> tuple[Array, Array, Array]:
    """Returns value, first and second derivative, (N,) each, of the parabola around each sample.

    values: (N,) on an even grid with a period in s. width: samples of a window, odd, 3 to N. At the
    first and last width // 2 samples the parabola of the first and last window counts. Source:
    Savitzky & Golay 1964.
    """
    # Imported when something is measured: a campaign's own process needs neither.
    from scipy.linalg import lstsq
    from scipy.ndimage import convolve1d

    half = width // 2
    # Times of the window's samples, in periods, in the order in which a convolution takes them.
    powers = np.arange(half, -half - 1.0, -1.0) ** np.arange(PARABOLA + 1)[:, np.newaxis]
    first, last = (_fit(values[end]) for end in (slice(width), slice(-width, None)))
    found = []
    for order in range(PARABOLA + 1):
        derivative = np.zeros(PARABOLA + 1)
        derivative[order] = factorial(order) / period_s**order
        weights = lstsq(powers, derivative)[0]
        fitted = convolve1d(values, weights, mode="constant")
        fitted[:half] = first.deriv(order)(np.arange(half)) / period_s**order
        fitted[-half:] = last.deriv(order)(np.arange(half + 1, width)) / period_s**order
        found.append(fitted)
    value, velocity, acceleration = found
    return value, velocity, acceleration


def _fit(window: Array) -> np.poly1d:
    """Returns the parabola through a window, of the time in periods since its first sample."""
    return np.poly1d(np.polyfit(np.arange(len(window)), window, PARABOLA))
