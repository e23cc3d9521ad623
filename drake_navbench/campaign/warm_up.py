"""Compiles every kernel once, and starts the server of the workers, before the trials start."""

from __future__ import annotations

from drake_navbench.kernels.angles import wrap
from drake_navbench.workers import start_server

# Imported by the server from which the workers are forked; see that module.
PRELOAD_MODULE = "drake_navbench.campaign.worker_preload"


def start_worker_server() -> None:
    """Starts the server that workers are forked from; it loads while the caller goes on."""
    start_server([PRELOAD_MODULE])


def kernels_are_cold() -> bool:
    """Returns whether this installation has not compiled its kernels yet."""
    wrap(0.0)
    return bool(wrap.stats.cache_misses)


def warm_up() -> None:
    """Runs every default controller for a moment, so that all kernels are compiled and loaded."""
    from drake_navbench.inputs.presets import default_presets, load_preset
    from drake_navbench.inputs.robot import load_robot
    from drake_navbench.inputs.scenario import load_scenario
    from drake_navbench.trial.spec import TrialSpec
    from drake_navbench.trial.trial import DEFAULT_ROBOT, simulate

    scenario = load_scenario("one_obstacle").model_copy(update={"timeout_s": 0.5})
    planned = load_scenario("speed_zone").model_copy(update={"timeout_s": 0.1})
    robot = load_robot(DEFAULT_ROBOT)
    for name in default_presets():
        simulate(TrialSpec(scenario, robot, load_preset(name), seed=0))
    simulate(TrialSpec(planned, robot, load_preset(default_presets()[0]), seed=0))
