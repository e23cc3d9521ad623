"""A benchmark for mobile-robot controllers on Drake's systems framework.

`run_trial` and `run_benchmark` do in Python what `drake-navbench run` does in a shell.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from drake_navbench.processes.instruction_set import hold_to_baseline
from drake_navbench.processes.version import __version__

if TYPE_CHECKING:
    from drake_navbench.campaign.benchmark import run_benchmark
    from drake_navbench.campaign.run_results import Results
    from drake_navbench.logs.log import TrialLog
    from drake_navbench.trial.trial import open_trial, run_trial

# numpy and numba read the environment when they are imported, so it is set before either.
hold_to_baseline()

__all__ = ["Results", "TrialLog", "__version__", "open_trial", "run_benchmark", "run_trial"]

_HOMES = {
    "Results": "drake_navbench.campaign.run_results",
    "TrialLog": "drake_navbench.logs.log",
    "open_trial": "drake_navbench.trial.trial",
    "run_benchmark": "drake_navbench.campaign.benchmark",
    "run_trial": "drake_navbench.trial.trial",
}


def __getattr__(name: str) -> Any:
    # Drake and numba take seconds to import; `--help` must not wait for them.
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOMES[name]), name)
