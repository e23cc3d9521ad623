"""Times of one MPPI cycle: 2000 x 56 samples, nav2_bringup's critics, 60 x 60 costmap."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import straight_plan

from drake_navbench.controller import ControllerSetup, NoiseKey, Observation
from drake_navbench.controllers.mppi import ModelPredictivePathIntegral, MppiParameters
from drake_navbench.kernels.footprint import circle_footprint, footprint_radii, pad_footprint
from drake_navbench.kernels.grid import Costmap

ROUNDS = 300
BRINGUP = {
    "batch_size": 2000,
    "critics": [
        "ConstraintCritic",
        "CostCritic",
        "GoalCritic",
        "GoalAngleCritic",
        "PathAlignCritic",
        "PathFollowCritic",
        "PathAngleCritic",
        "PreferForwardCritic",
    ],
    "CostCritic": {"near_goal_distance": 1.0},
    "PathAlignCritic": {"cost_weight": 14.0, "max_path_occupancy_ratio": 0.05},
    "PathFollowCritic": {"offset_from_furthest": 5},
    "PathAngleCritic": {"cost_weight": 2.0, "max_angle_to_furthest": 1.0},
}


def observation(step: int) -> Observation:
    """A straight plan of 1.45 m beside a patch of inflated cost, driven at 0.4 m/s."""
    costs = np.zeros((60, 60), np.uint8)
    costs[36:50, 34:48] = 90
    plan = straight_plan(1.45)
    return Observation(
        time_s=0.0,
        pose=np.array([0.0, 0.03, 0.1]),
        twist=np.array([0.4, 0.0]),
        plan=plan,
        plan_id=1,
        costmap=Costmap(costs, -1.5, -1.5, 0.05),
        goal=plan[-1],
        noise_key=NoiseKey(1, 0, step),
    )


@pytest.mark.parametrize(
    ("regenerates", "polishes"),
    [(False, False), (True, False), (True, True)],
    ids=["sampler_fixed_noise", "sampler_new_noise", "polished_new_noise"],
)
def test_cycle(benchmark, regenerates, polishes):
    footprint = pad_footprint(circle_footprint(0.22), 0.01)
    inscribed_radius_m, circumscribed_radius_m = footprint_radii(footprint)
    setup = ControllerSetup(
        0.05, footprint, inscribed_radius_m, circumscribed_radius_m, inflation_radius_m=0.7
    )
    parameters = MppiParameters(
        **BRINGUP, regenerate_noises=regenerates, polish={"enabled": polishes}
    )
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
