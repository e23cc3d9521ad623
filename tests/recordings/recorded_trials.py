"""Short trials with everything that a log can hold, to be exported."""

from __future__ import annotations

from functools import lru_cache

from drake_navbench.logs.log import TrialLog
from drake_navbench.trial.trial import run_trial


@lru_cache(maxsize=1)
def short_trial() -> TrialLog:
    """Returns a trial of less than a second with scans, costmaps and trajectories; noisy pose."""
    return run_trial("restricted_small", "rpp", seed=3, wants_diagnostics=True)
