"""Compiles the kernels, once for an installation, and starts the server of the workers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drake_navbench.kernels.angles import wrap
from drake_navbench.processes.workers import start_server

if TYPE_CHECKING:
    from drake_navbench.trial.spec import TrialSpec

# Imported by the server from which the workers are forked; see that module.
PRELOAD_MODULE = "drake_navbench.campaign.worker_preload"
# One for each built-in controller that no default column drives.
WARM_UP_PRESETS = ("graceful", "rotation_shim", "vector_pursuit")
# Together they plan with a smoother and with filters, recover, and begin with a turn.
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
    """Drives every built-in controller for a moment, so that all kernels are compiled."""
    from drake_navbench.inputs.presets import default_presets
    from drake_navbench.trial.trial import simulate

    for preset in (*default_presets(), *WARM_UP_PRESETS):
        for spec in warm_up_specs(preset):
            simulate(spec)


def warm_up_specs(preset: str) -> list[TrialSpec]:
    """Returns the short trials that have the kernels of a preset compiled."""
    from drake_navbench.inputs.presets import load_preset
    from drake_navbench.inputs.scenario import load_scenario
    from drake_navbench.trial.spec import TrialSpec
    from drake_navbench.trial.trial import DEFAULT_ROBOT

    scenarios = [load_scenario(name) for name in WARM_UP_SCENARIOS]
    return [
        TrialSpec(
            scenario.model_copy(update={"timeout_s": WARM_UP_S}),
            scenario.load_robot(DEFAULT_ROBOT),
            load_preset(preset),
            seed=0,
        )
        for scenario in scenarios
    ]
