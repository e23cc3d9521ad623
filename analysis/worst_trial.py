"""Finds the worst trial of a results folder, the one to look at first."""

from __future__ import annotations

import math
from pathlib import Path

from drake_navbench.analysis.folder_analysis import find_logs
from drake_navbench.analysis.metrics.safety import min_clearance_m
from drake_navbench.errors import InputError
from drake_navbench.logs.log import Outcome, TrialLog

# The worst outcome first. A trial that gave up as expected counts as one that arrived.
FROM_WORST = (
    Outcome.ERROR,
    Outcome.COLLIDED,
    Outcome.TIMED_OUT,
    Outcome.ABORTED,
    Outcome.SUCCEEDED,
)


def worst_trial(folder: Path) -> Path:
    """Returns the log of the trial that ended worst; of several, the one nearest to an obstacle.

    Ranked by outcome, then by the smallest clearance, then by time. Trials without a sample cannot
    be shown and are left out. Raises InputError where none is left.
    """
    _, files = find_logs(folder)
    ranks = []
    for path in sorted(path for paths in files.values() for path in paths):
        try:
            log = TrialLog.read(path)
        except InputError:
            continue
        if not log.samples.empty:
            ranks.append((*_rank(log), path))
    if not ranks:
        raise InputError(f"{folder}: none of its trials has a sample to show")
    return min(ranks)[-1]


def _rank(log: TrialLog) -> tuple[int, float, float]:
    """Returns a sorting key of a trial: the worse the trial, the smaller its key.

    First counts the outcome, then the smallest clearance, then the duration: longer is worse. The
    scenario's expected outcome counts as success.
    """
    outcome = log.outcome
    if outcome == log.info["scenario"].get("expected_outcome"):
        outcome = Outcome.SUCCEEDED
    clearance_m = min_clearance_m.measure(log).value
    if math.isnan(clearance_m):
        clearance_m = math.inf
    return FROM_WORST.index(outcome), clearance_m, -log.end_time_s
