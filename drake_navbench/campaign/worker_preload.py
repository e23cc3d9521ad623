"""Imports, as a side effect, all modules that trials, metrics and the report need.

multiprocessing's fork server imports this module once and forks every worker from itself, so that
no worker spends time on imports. Nothing else should import it.
"""

import signal

import drake_navbench.analysis.folder_analysis
import drake_navbench.trial.trial  # noqa: F401
from drake_navbench.analysis.metrics.registry import installed_metrics
from drake_navbench.inputs.presets import preset_files
from drake_navbench.kernels.angles import wrap

# Ctrl-C reaches the whole process group; only the command decides what it means.
signal.signal(signal.SIGINT, signal.SIG_IGN)
installed_metrics()
preset_files()
# With its first kernel numba prepares itself for 0.4 s, here once instead of in every worker.
wrap(0.0)
