"""The numbers of one trial that the strip of charts below a replay shows."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome

# The most points of a line: the strip is some 1000 pixels wide, and a race has several lines.
MAX_POINTS = 400
DECIMALS = 3
# A single slow cycle would flatten the curves of all others. So the axis of compute times ends at
# ROOM_ABOVE_MOST times the MOST_PERCENT-th percentile.
MOST_PERCENT, ROOM_ABOVE_MOST = 98.0, 3.0


def strip_of(log: TrialLog) -> Mapping[str, Any]:
    """Returns a trial's curves: `time` s, `v` m/s, `w` rad/s, `clearance` m, `compute` time ms.

    Each point has the largest compute time and the smallest clearance up to the next point, because
    readers look for these peaks. None stands for no value. `end`: time of the last sample, s.
    `failed`: whether the trial missed its goal.
    """
    columns: dict[str, tuple[pd.Series, Callable[[NDArray[np.float64]], float]]] = {
        "v": (log.samples["v_mps"], np.mean),
        "w": (log.samples["w_radps"], np.mean),
        "clearance": (log.samples["clearance_m"], np.min),
        "compute": (log.samples["compute_time_ms"], np.max),
    }
    starts = np.unique(np.linspace(0, len(log.samples), MAX_POINTS, endpoint=False).astype(int))
    ends = np.append(starts[1:], len(log.samples))
    parts = list(zip(starts, ends, strict=True))
    return {
        "time": _rounded(log.samples["time_s"].to_numpy()[starts]),
        **{
            name: _rounded(np.array([of(values.to_numpy()[a:b]) for a, b in parts]))
            for name, (values, of) in columns.items()
        },
        "end": float(log.samples["time_s"].iloc[-1]),
        "failed": log.outcome is not Outcome.SUCCEEDED,
    }


def compute_top_ms(curves: Sequence[Sequence[float | None]]) -> float | None:
    """Returns the upper end of the axis of compute times, ms; None without compute times.

    The page cuts off higher peaks and shows the value of the highest as a number.
    """
    known = [value for curve in curves for value in curve if value is not None]
    if not known:
        return None
    most = float(np.percentile(known, MOST_PERCENT))
    return round(min(max(known), ROOM_ABOVE_MOST * most), DECIMALS)


def _rounded(values: NDArray[np.float64]) -> list[float | None]:
    return [
        value if math.isfinite(value) else None for value in np.round(values, DECIMALS).tolist()
    ]
