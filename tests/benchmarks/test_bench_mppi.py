"""Times of one MPPI cycle: 2000 x 56 samples, nav2_bringup's critics, 60 x 60 costmap."""

from __future__ import annotations

import numpy as np
import pytest
from controller_scenes import observe, setup_of
from scenes import straight_plan

from drake_navbench.controller import NoiseKey, Observation
from drake_navbench.controllers.mppi import ModelPredictivePathIntegral
from drake_navbench.inputs.presets import load_preset
from drake_navbench.kernels.footprint import circle_footprint, pad_footprint
from drake_navbench.kernels.grid import Costmap

ROUNDS = 300


def observation(step: int) -> Observation:
    """A straight plan of 1.45 m beside a patch of inflated cost, driven at 0.4 m/s."""
    costs = np.zeros((60, 60), np.uint8)
    costs[36:50, 34:48] = 90
    return observe(
        straight_plan(1.45),
        pose=(0.0, 0.03, 0.1),
        twist=(0.4, 0.0),
        costmap=Costmap(costs, -1.5, -1.5, 0.05),
        noise_key=NoiseKey(1, 0, step),
    )


@pytest.mark.parametrize(
    ("regenerates", "polishes"),
    [(False, False), (True, False), (True, True)],
    ids=["sampler_fixed_noise", "sampler_new_noise", "polished_new_noise"],
)
def test_cycle(benchmark, regenerates, polishes):
    setup = setup_of(pad_footprint(circle_footprint(0.22), 0.01), inflation_radius_m=0.7)
    bringup = load_preset("mppi_bringup").parameters
    polish = bringup.polish.model_copy(update={"enabled": polishes})
    parameters = bringup.model_copy(update={"regenerate_noises": regenerates, "polish": polish})
    controller = ModelPredictivePathIntegral(parameters, setup)
    memory = controller.initial_memory()
    for step in range(10):
        memory = controller.step(observation(step), memory).memory
    observations = iter([observation(step) for step in range(10, ROUNDS + 20)])
    benchmark.pedantic(
        lambda seen: controller.step(seen, memory),
        setup=lambda: ((next(observations),), {}),
        rounds=ROUNDS,
        warmup_rounds=5,
    )
