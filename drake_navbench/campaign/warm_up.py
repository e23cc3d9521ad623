"""Compiles the kernels once for an installation, and starts the server of the workers."""

from __future__ import annotations

from drake_navbench.kernels.angles import wrap
from drake_navbench.workers import start_server

# Imported by the server from which the workers are forked; see that module.
PRELOAD_MODULE = "drake_navbench.campaign.worker_preload"
# Together they plan with a smoother and with filters, and recover.
WARM_UP_SCENARIOS = ("one_obstacle", "speed_zone", "dead_end")
WARM_UP_S = 0.1


def start_worker_server() -> None:
    """Starts the server that workers are forked from; it loads while the caller goes on."""
    start_server([PRELOAD_MODULE])


def kernels_are_cold() -> bool:
    """Returns whether this installation has not compiled its kernels yet."""
    wrap(0.0)
    return bool(wrap.stats.cache_misses)


def warm_up() -> None:
    """Drives every default controller for a moment, so that all kernels are compiled."""
    from drake_navbench.inputs.presets import default_presets, load_preset
    from drake_navbench.inputs.scenario import load_scenario
    from drake_navbench.trial.trial import DEFAULT_ROBOT, TrialSpec, simulate

    for name in WARM_UP_SCENARIOS:
        scenario = load_scenario(name).model_copy(update={"timeout_s": WARM_UP_S})
        robot = scenario.load_robot(DEFAULT_ROBOT)
        for preset in default_presets():
            simulate(TrialSpec(scenario, robot, load_preset(preset), seed=0))
