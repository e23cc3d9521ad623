"""Speed of the Gymnasium environment: steps of 0.1 s with 360 beams."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

import drake_navbench.studies.gymnasium  # noqa: F401

STEPS = 200


@pytest.mark.parametrize("scenario", ["empty", "static_obstacles"])
def test_bench_environment(benchmark, scenario):
    environment = gymnasium.make(
        "drake_navbench/Navigation-v0", scenario=scenario, disable_env_checker=True
    )
    # On the spot, where nothing is near enough to end the episode.
    action = np.array([0.0, 0.3], dtype=np.float32)

    def drive():
        environment.reset(seed=1)
        for _ in range(STEPS):
            _, _, terminated, _, _ = environment.step(action)
            assert not terminated

    benchmark.pedantic(drive, rounds=10, warmup_rounds=1)
    benchmark.extra_info["steps_per_second"] = STEPS / benchmark.stats.stats.min


def test_bench_environment_reset(benchmark):
    environment = gymnasium.make(
        "drake_navbench/Navigation-v0", scenario="static_obstacles", disable_env_checker=True
    )
    benchmark(environment.reset, seed=1)
