"""Experiments behind docs/reproduction.md that no parameter can make.

`python docs/reproduction_experiments.py` prints the published metrics of each.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from drake_navbench.analysis.published import published_metrics
from drake_navbench.controller import Controller, Decision, Observation
from drake_navbench.controllers.mppi import ModelPredictivePathIntegral
from drake_navbench.presets import Preset, load_preset
from drake_navbench.scenario import Scenario, load_scenario
from drake_navbench.trial import run_trial

SHOWN = ("time_taken", "avg_linear_speed", "avg_heading_error", "rms_linear_jerk", "abort_time")
SEED = 1

# When the wall is out of MPPI's sight, s: shortly before the published trials end.
BLIND_FROM_S = {"restricted_small": 4.8, "restricted_large": 11.3}
BLIND_FOR_S = 0.3
# The side walls of restricted_small are longer than this along x, m; the others are not.
SHORTEST_SIDE_WALL_M = 1.0


@dataclass(frozen=True, eq=False)
class PresetOf(Preset):
    """A preset that is driven by another class than the registered one."""

    plugin: type[Controller] = ModelPredictivePathIntegral

    @property
    def controller_class(self) -> type[Controller]:
        """The class given."""
        return self.plugin


def blinded_mppi(blind_from_s: float) -> PresetOf:
    """Returns mppi_nav2 from which the local costmap hides all obstacles for a moment."""

    class BlindMppi(ModelPredictivePathIntegral):
        def step(self, observation: Observation, memory) -> Decision:
            if blind_from_s <= observation.time_s < blind_from_s + BLIND_FOR_S:
                costmap = observation.costmap
                empty = replace(costmap, costs=np.zeros_like(costmap.costs))
                observation = replace(observation, costmap=empty)
            return super().step(observation, memory)

    original = load_preset("mppi_nav2")
    values = {field.name: getattr(original, field.name) for field in fields(original)}
    return PresetOf(**values, plugin=BlindMppi)


def without_side_walls() -> Scenario:
    """Returns restricted_small with its front and back walls only."""
    scenario = load_scenario("restricted_small")
    kept = [
        wall
        for wall in scenario.world.obstacles
        if wall.max[0] - wall.min[0] < SHORTEST_SIDE_WALL_M
    ]
    return scenario.model_copy(
        update={"world": scenario.world.model_copy(update={"obstacles": kept})}
    )


def show(title: str, scenario: str | Scenario, preset: str | Preset) -> None:
    """Drives one trial and prints its published metrics and its end."""
    log = run_trial(scenario, preset, SEED)
    metrics = published_metrics(log)
    numbers = ", ".join(f"{name} {metrics[name]:.3f}" for name in SHOWN)
    print(f"{title}: {numbers}; {log.info['reason']}")


def main() -> None:
    """Runs every experiment."""
    for name, blind_from_s in BLIND_FROM_S.items():
        show(f"mppi_nav2 in {name}", name, "mppi_nav2")
        show(f"mppi_nav2 in {name}, blind for 0.3 s", name, blinded_mppi(blind_from_s))
    show("teb in restricted_small", "restricted_small", "teb")
    show("teb in restricted_small without side walls", without_side_walls(), "teb")


if __name__ == "__main__":
    main()
