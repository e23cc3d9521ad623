"""Crowds of the models of people are as fast as Weidmann's, and form lanes in counterflow."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

SCRIPT = Path(__file__).parents[1] / "studies" / "people_models.py"


@pytest.fixture(scope="module")
def models():
    spec = importlib.util.spec_from_file_location("people_models", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_weidmanns_curve(models):
    # 1.34 (1 - exp(-1.913 (1 - 1 / 5.4))) = 1.34 (1 - 0.2104).
    assert models.weidmann_mps(1.0) == pytest.approx(1.058, abs=5e-4)
    assert models.weidmann_mps(5.4) == 0.0
    assert models.weidmann_mps(0.01) == pytest.approx(1.34)


def test_the_order_of_lanes(models):
    generator = np.random.default_rng(0)
    ways = np.repeat([1.0, -1.0], 20)
    sides_m = np.concatenate([np.linspace(-1.4, -0.2, 20), np.linspace(0.2, 1.4, 20)])
    assert models.lane_order(sides_m, ways, generator) == pytest.approx(1.0)
    mixed = [models.lane_order(sides_m, generator.permutation(ways), generator) for _ in range(40)]
    assert np.mean(mixed) == pytest.approx(0.0, abs=0.05)


@pytest.mark.long
@pytest.mark.parametrize("density_per_m2", [0.5, 1.0, 1.5, 2.0])
def test_with_the_time_gap_people_are_within_weidmanns_band(models, density_per_m2):
    flows = [
        models.flow("social_force", density_per_m2, seed, time_gap_s=models.TIME_GAP_S)
        for seed in models.SEEDS
    ]
    mean_mps = np.mean([flow.speed_mps for flow in flows])
    assert mean_mps == pytest.approx(models.weidmann_mps(density_per_m2), rel=models.BAND)


@pytest.mark.long
@pytest.mark.parametrize("model", ["social_force", "orca"])
def test_lanes_form_in_counterflow(models, model):
    flows = [models.flow(model, 1.0, seed, time_gap_s=0.0, is_counterflow=True) for seed in (0, 1)]
    assert np.mean([flow.lane_order for flow in flows]) > 0.4
    assert min(flow.speed_mps for flow in flows) > 0.7
