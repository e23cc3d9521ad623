"""Finds the worst trial of a results folder, the one to look at first."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drake_navbench.analysis.folder_analysis import analyse_folder
from drake_navbench.errors import InputError
from drake_navbench.logs.header import has_samples, read_info
from drake_navbench.logs.outcome import FROM_WORST, Outcome


def worst_trial(folder: Path) -> Path:
    """Returns the log of the trial that ended worst; of several, the one nearest to an obstacle.

    Ranked by outcome, then by the smallest clearance, then by time. Trials without a sample cannot
    be shown and are left out. Raises InputError where none is left.
    """
    rows = {
        folder / entry.path: entry.row
        for scenario in analyse_folder(folder).scenarios
        for entry in scenario.trials
    }
    shown = [path for path in rows if has_samples(path)]
    if not shown:
        raise InputError(f"{folder}: none of its trials has a sample to show")
    return min(shown, key=lambda path: (*_rank(rows[path], read_info(path)), path))


def _rank(row: Mapping[str, Any], info: Mapping[str, Any]) -> tuple[int, float, float]:
    """Returns a sorting key of a trial: the worse the trial, the smaller its key.

    First counts the outcome, then the smallest clearance, then the duration: longer is worse. The
    scenario's expected outcome counts as success: to give up an impossible task is right.
    """
    is_right = row["outcome"] == info["scenario"].get("expected_outcome")
    outcome = Outcome.SUCCEEDED if is_right else row["outcome"]
    clearance_m = row["min_clearance_m"]
    nearest_m = math.inf if math.isnan(clearance_m) else clearance_m
    return FROM_WORST.index(outcome), nearest_m, -info["end_time_s"]
