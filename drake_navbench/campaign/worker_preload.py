"""Loads everything that trials, metrics and the report need when imported.

multiprocessing's fork server imports this module once and forks every worker from itself, so that
no worker spends time on imports or on reading compiled kernels. Nothing else should import it.
"""

import signal

import drake_navbench.analysis.folder_analysis  # noqa: F401
from drake_navbench.analysis.metrics.registry import installed_metrics
from drake_navbench.campaign.warm_up import warm_up

# Ctrl-C reaches the whole process group; what it means is for the command alone to decide.
signal.signal(signal.SIGINT, signal.SIG_IGN)
installed_metrics()
warm_up()
