"""The selection of a controller's diagnostics that a recording keeps.

A controller that samples hundreds of trajectories leaves megabytes a cycle. Numbers, text and
flags are kept of every cycle; arrays now and then, trajectories with a few of their poses.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

# The time between two cycles of which arrays are kept, such as samples, s: replays show them as
# often.
ARRAY_PERIOD_S = 0.2
MAX_TRAJECTORY_POSES = 12
# Arrays are rounded to so many decimals: tenths of millimetres where they are lengths.
DECIMALS = 4


def is_array(value: Any) -> bool:
    """Returns whether a value of the diagnostics is an array; not every sample keeps arrays."""
    return isinstance(value, np.ndarray) and value.ndim > 0


def without_arrays(diagnostics: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the diagnostics without arrays: numbers, text and flags."""
    return {key: value for key, value in diagnostics.items() if not is_array(value)}


def with_thinned_arrays(diagnostics: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the diagnostics with fewer poses in (K, N, 3) trajectories and rounded numbers."""
    return {
        key: _thinned(value) if is_array(value) else value for key, value in diagnostics.items()
    }


def _thinned(array: np.ndarray) -> np.ndarray:
    if array.ndim == 3:
        count = array.shape[1]
        poses = np.linspace(0, count - 1, min(count, MAX_TRAJECTORY_POSES)).round().astype(int)
        array = array[:, poses]
    if np.issubdtype(array.dtype, np.floating):
        return np.round(array.astype(float), DECIMALS)
    return array.copy()
