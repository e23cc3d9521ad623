"""What the strip of charts below a replay shows of a trial, as plain numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from drake_navbench.log import Outcome, TrialLog

# A line of the strip is some 1000 pixels long; a race has several of them.
MAX_POINTS = 400
DECIMALS = 3


def strip_of(log: TrialLog) -> Mapping[str, Any]:
    """Returns time s, v m/s, w rad/s, clearance m and compute time ms, when and whether it failed.

    Between two shown moments the largest compute time and the smallest clearance count: peaks are
    what they are looked at for. None stands where there is no value.
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


def _rounded(values: NDArray[np.float64]) -> list[float | None]:
    return [
        value if math.isfinite(value) else None for value in np.round(values, DECIMALS).tolist()
    ]
