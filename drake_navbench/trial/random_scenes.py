"""Random scenes: inputs of a controller in one cycle, with obstacles near a winding plan."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import ControllerSetup, Observation
from drake_navbench.kernels.grid import LETHAL, Costmap
from drake_navbench.kernels.inflation import inflate
from drake_navbench.kernels.noise import NoiseKey

# Steps that divide no lookahead distance: where a sum of steps would equal one, rounding decides.
PLAN_STEPS_M = (0.03, 0.07)
# The plan's reach as a share of half the costmap's side; beyond 1 some path handlers would cut it.
PLAN_SHARE = 0.8
MAX_OBSTACLES = 5
STREAM_OF_CONTROLLERS = 1


def random_scenes(setup: ControllerSetup, count: int, *, seed: int = 0) -> Iterator[Observation]:
    """Yields observations of a robot close to a winding plan, at random speeds.

    The costmap is square and centred at the robot, snapped to cells as a rolling one is.
    """
    random = np.random.default_rng(seed)
    for index in range(count):
        pose = np.array([*random.uniform(-5.0, 5.0, 2), random.uniform(-np.pi, np.pi)])
        costmap = _costmap(random, setup, pose, time_s=0.05 * index)
        plan = _plan(random, setup, pose)
        yield Observation(
            time_s=0.05 * index,
            pose=pose + np.array([*random.normal(0.0, 0.05, 2), random.normal(0.0, 0.2)]),
            twist=np.array(
                [
                    random.uniform(0.0, setup.max_linear_velocity_mps),
                    random.uniform(-0.5, 0.5) * setup.max_angular_velocity_radps,
                ]
            ),
            plan=plan,
            plan_id=index,
            costmap=costmap,
            goal=plan[-1],
            noise_key=NoiseKey(seed, STREAM_OF_CONTROLLERS, index),
            global_plan=plan,
        )


def _plan(
    random: np.random.Generator, setup: ControllerSetup, pose: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Returns (N, 3) poses along a curve whose curvature changes steadily."""
    length_m = random.uniform(0.4, PLAN_SHARE * 0.5 * setup.costmap_size_m)
    step_m = random.uniform(*PLAN_STEPS_M)
    lengths = np.arange(0.0, length_m, step_m)
    curvatures = np.interp(lengths, [0.0, length_m], random.uniform(-1.0, 1.0, 2))
    yaws = pose[2] + random.normal(0.0, 0.4) + np.cumsum(curvatures) * step_m
    steps = step_m * np.column_stack([np.cos(yaws), np.sin(yaws)])
    points = pose[:2] + np.vstack([np.zeros(2), np.cumsum(steps[:-1], axis=0)])
    return np.ascontiguousarray(np.column_stack([points, np.arctan2(np.sin(yaws), np.cos(yaws))]))


def _costmap(
    random: np.random.Generator, setup: ControllerSetup, pose: NDArray[np.float64], *, time_s: float
) -> Costmap:
    resolution = setup.costmap_resolution_m
    cells = round(setup.costmap_size_m / resolution)
    origin = np.floor((pose[:2] - 0.5 * setup.costmap_size_m) / resolution) * resolution
    costs = np.zeros((cells, cells), np.uint8)
    for _ in range(random.integers(0, MAX_OBSTACLES + 1)):
        row, column = random.integers(0, cells, 2)
        height, width = random.integers(1, 10, 2)
        costs[row : row + height, column : column + width] = LETHAL
    inflated = inflate(
        costs,
        resolution=resolution,
        inscribed_radius=setup.inscribed_radius_m,
        inflation_radius=setup.inflation_radius_m,
        cost_scaling_factor=setup.inflation_cost_scaling_factor,
    )
    return Costmap(inflated, float(origin[0]), float(origin[1]), resolution, stamp_s=time_s)
