"""The example that trains weights of `learned`: what its policy sees, what it writes."""

from __future__ import annotations

import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from drake_navbench.controllers.learned.features import FEATURE_COUNT
from drake_navbench.controllers.learned.network import load_network, save_network
from drake_navbench.controllers.learned.parameters import WEIGHTS_FOLDER

FILE = Path(__file__).parents[3] / "examples" / "learned_policy" / "train.py"
EXAMPLE = SimpleNamespace(**runpy.run_path(str(FILE)))
SHIPPED = WEIGHTS_FOLDER / "navigation.npz"


def test_the_policy_sees_the_features_and_commands_shares_of_the_limits():
    environment = EXAMPLE.PolicyEnvironment()
    check_env(environment, skip_render_check=True)
    seen, _ = environment.reset(seed=5)
    assert seen.shape == (FEATURE_COUNT,)
    # From rest, half of 2 rad/s: the last feature is the yaw rate as a share of the limit.
    for _ in range(30):
        seen, _, terminated, _, _ = environment.step(np.array([0.0, 0.5], dtype=np.float32))
        assert not terminated
    assert seen[-1] == pytest.approx(0.5, abs=0.05)
    environment.close()


def linear(weight, bias):
    """A layer of PyTorch, whose arrays are read by `detach().numpy()`."""

    def tensor(values):
        return SimpleNamespace(detach=lambda: SimpleNamespace(numpy=lambda: values))

    return SimpleNamespace(weight=tensor(weight), bias=tensor(bias))


def test_the_layers_of_a_policy_become_the_file_that_the_controller_reads(tmp_path):
    generator = np.random.default_rng(0)
    shapes = [(64, FEATURE_COUNT), (64, 64), (2, 64)]
    layers = [(generator.standard_normal(s), generator.standard_normal(s[0])) for s in shapes]
    path = tmp_path / "mine.npz"
    save_network(EXAMPLE.network_of([linear(*layer) for layer in layers]), path)
    inputs = generator.standard_normal(FEATURE_COUNT)
    (w1, b1), (w2, b2), (w3, b3) = layers
    expected = w3 @ np.tanh(w2 @ np.tanh(w1 @ inputs + b1) + b2) + b3
    np.testing.assert_allclose(load_network(path)(inputs), expected, rtol=1e-5, atol=1e-5)


@pytest.mark.long
def test_a_training_writes_weights_that_drive(tmp_path):
    pytest.importorskip("stable_baselines3")
    path = tmp_path / "mine.npz"
    save_network(EXAMPLE.train(4096, seed=0), path)
    assert 0.0 <= EXAMPLE.success_rate(load_network(path), 4) <= 1.0


@pytest.mark.long
def test_the_policy_that_is_shipped_reaches_nine_of_ten_goals_that_it_has_not_seen():
    assert EXAMPLE.success_rate(load_network(SHIPPED), 300) >= 0.9
