"""Trials without randomness: all trials of a controller are then equal and count as one."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import pandas as pd

from drake_navbench.analysis.metrics.registry import unrepeatable_names

# The columns in which two trials may differ although they are equal in everything else.
NUMBERING = ("trial", "seed")


def repeated_cells(trials: pd.DataFrame) -> frozenset[tuple[str, str]]:
    """Returns (scenario, controller) of the cells whose trials are all equal.

    trials: rows as from `trial_row`. Trials are equal if all their metrics except compute times are
    equal to the last bit. A single trial is no repetition.
    """
    skipped = {*NUMBERING, *unrepeatable_names()}
    numbers = trials.select_dtypes("number")
    numbers = numbers[[name for name in numbers if name not in skipped]]
    values = numbers.to_numpy(dtype=float)
    cells = trials.groupby(["scenario", "controller"], sort=False).indices
    return frozenset(cell for cell, rows in cells.items() if _is_one_trial(values[rows]))


def repeated_controllers(repeated: Collection[tuple[str, str]], scenario: str) -> frozenset[str]:
    """Returns the controllers of a scenario whose trials are all equal."""
    return frozenset(controller for name, controller in repeated if name == scenario)


def _is_one_trial(rows: np.ndarray) -> bool:
    same = (rows == rows[0]) | (np.isnan(rows) & np.isnan(rows[0]))
    return len(rows) > 1 and rows.shape[1] > 0 and bool(same.all())
