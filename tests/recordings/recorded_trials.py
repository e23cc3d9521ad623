"""Short trials with everything that a log can hold, to be exported."""

from __future__ import annotations

import dataclasses
from functools import lru_cache

from drake_navbench.logs.log import TrialLog
from drake_navbench.trial.trial import run_trial


@lru_cache(maxsize=1)
def short_trial() -> TrialLog:
    """Returns a trial of less than a second with scans, costmaps and trajectories; noisy pose."""
    return run_trial("restricted_small", "rpp", seed=3, wants_diagnostics=True)


def with_info(log: TrialLog, **info: object) -> TrialLog:
    """Returns the log with other entries in its header."""
    return dataclasses.replace(log, info=dict(log.info) | info)
