"""The Savitzky-Golay filter over the control sequence (utils::savitskyGolayFilter)."""

from __future__ import annotations

import numpy as np
from numba import njit

from drake_navbench.controllers.mppi.critics.batch import Float32Array

HISTORY = 4
# Below this many filtered columns Nav2 leaves the sequence alone.
MIN_FILTERED_COLUMNS = 20
_QUADRATIC = np.array([-21, 14, 39, 54, 59, 54, 39, 14, -21], np.float32) / np.float32(231)
_LINEAR = np.full(9, 1 / 9, np.float32)


def smooth(controls: Float32Array, history: Float32Array, *, order: int) -> Float32Array:
    """Returns the smoothed sequences; too short ones unchanged.

    controls: (3, N). history: (3, 4), the sequence's columns -4 .. -1. order: 1 or 2, else 2.
    The last column stays, and stands in for those behind it.
    """
    if not filters(controls.shape[1]):
        return controls
    return _smooth(controls, history, _LINEAR if order == 1 else _QUADRATIC)


def smooth_in_place(controls: Float32Array, history: Float32Array) -> Float32Array:
    """Returns the sequences smoothed as up to Iron, where the filter reads values it has filtered.

    The last column is filtered, too, the fifth from the end is not.
    """
    if not filters(controls.shape[1]):
        return controls
    return _smooth_in_place(controls, history, _QUADRATIC)


def filters(steps: int) -> bool:
    """Whether a sequence of `steps` columns is long enough to be smoothed."""
    return steps - 1 >= MIN_FILTERED_COLUMNS


@njit(cache=True)
def _smooth_in_place(controls, history, taps):
    axes, steps = controls.shape
    smoothed = controls.copy()
    for axis in range(axes):
        row = smoothed[axis]
        for t in range(steps):
            if t == steps - HISTORY - 1:
                continue
            total = np.float32(0)
            for k in range(taps.shape[0]):
                i = t + k - HISTORY
                if i < 0:
                    total += taps[k] * history[axis, HISTORY + i]
                else:
                    total += taps[k] * row[min(i, steps - 1)]
            row[t] = total
    return smoothed


@njit(cache=True)
def _smooth(controls, history, taps):
    axes, steps = controls.shape
    smoothed = controls.copy()
    for axis in range(axes):
        for t in range(steps - 1):
            total = np.float32(0)
            for k in range(taps.shape[0]):
                i = t + k - HISTORY
                later = controls[axis, min(max(i, 0), steps - 1)]
                value = history[axis, HISTORY + i] if i < 0 else later
                total += taps[k] * value
            smoothed[axis, t] = total
    return smoothed
