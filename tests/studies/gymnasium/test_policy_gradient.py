"""The learner: advantages by hand, gradients against differences, the same bytes again."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drake_navbench.controllers.learned.features import FEATURE_COUNT
from drake_navbench.controllers.learned.network import load_network
from drake_navbench.studies.gymnasium.policy_gradient import (
    Batch,
    Learner,
    PolicyGradientSettings,
    advantages_and_returns,
)
from drake_navbench.studies.gymnasium.training import (
    TrainingSettings,
    success_rate_of_file,
    train,
)


def test_advantages_look_ahead_to_the_end_of_the_episode():
    # One environment; the first episode ends with its second step.
    advantages, returns = advantages_and_returns(
        np.array([[1.0], [2.0], [4.0]]),
        np.array([[0.5], [1.0], [2.0]]),
        np.array([[0.0], [1.0], [0.0]]),
        np.array([8.0]),
        discount=0.5,
        decay=0.5,
    )
    # 4 + 0.5 * 8 - 2 = 6; 2 - 1 = 1; 1 + 0.5 * 1 - 0.5 + 0.25 * 1 = 1.25.
    assert advantages.ravel().tolist() == [1.25, 1.0, 6.0]
    assert returns.ravel().tolist() == [1.75, 2.0, 8.0]


def loss(learner: Learner, batch: Batch) -> float:
    """The clipped objective of the paper, written down once more."""
    settings = learner.settings
    std = np.exp(learner.log_std)
    deviation = (batch.actions - learner.policy(batch.inputs)) / std
    log_density = -0.5 * deviation**2 - learner.log_std - 0.5 * math.log(2.0 * math.pi)
    ratio = np.exp(log_density.sum(axis=1) - batch.log_probabilities)
    advantages = (batch.advantages - batch.advantages.mean()) / (batch.advantages.std() + 1e-8)
    clipped = np.clip(ratio, 1.0 - settings.clip_ratio, 1.0 + settings.clip_ratio)
    objective = np.minimum(ratio * advantages, clipped * advantages).mean()
    error = learner.value(batch.inputs)[:, 0] - batch.returns
    return -objective - settings.entropy_weight * learner.log_std.sum() + 0.5 * (error**2).mean()


def test_the_gradients_are_those_of_the_objective():
    settings = PolicyGradientSettings(hidden_count=4, initial_std=0.7)
    learner = Learner(3, 2, settings, seed=1)
    generator = np.random.default_rng(2)
    inputs = generator.standard_normal((40, 3))
    actions, log_probabilities, _ = learner.act(inputs)
    # Some ratios lie beyond the clip.
    log_probabilities = log_probabilities + 0.3 * generator.standard_normal(40)
    batch = Batch(inputs, actions, log_probabilities, *generator.standard_normal((2, 40)))
    gradients = learner.gradients(batch, np.arange(40))
    for parameter, gradient in zip(learner._parameters(), gradients, strict=True):
        expected = np.empty(parameter.shape)
        for place in np.ndindex(parameter.shape):
            kept = parameter[place]
            parameter[place] = kept + 1e-6
            above = loss(learner, batch)
            parameter[place] = kept - 1e-6
            expected[place] = (above - loss(learner, batch)) / 2e-6
            parameter[place] = kept
        np.testing.assert_allclose(gradient, expected, atol=1e-6)


def test_a_learner_finds_the_action_that_pays():
    learner = Learner(1, 1, PolicyGradientSettings(hidden_count=8), seed=0)
    inputs = np.ones((64, 1))
    for _ in range(60):
        actions, log_probabilities, values = learner.act(inputs)
        returns = -((actions[:, 0] - 0.7) ** 2)
        learner.learn(
            Batch(inputs, actions, log_probabilities, returns - values, returns),
            learning_rate=0.01,
        )
    assert learner.policy(np.ones((1, 1))).item() == pytest.approx(0.7, abs=0.05)


def test_the_same_settings_train_the_same_policy():
    settings = TrainingSettings(steps=64, environments=2, horizon=16)
    told = []
    first, second = (train(settings, on_progress=told.append) for _ in range(2))
    assert first.weight_3.tobytes() == second.weight_3.tobytes()
    assert [progress.steps for progress in told] == [32, 64, 32, 64]
    assert first.weight_1.shape[0] == FEATURE_COUNT


@pytest.mark.long
def test_a_short_training_learns_to_reach_most_goals(tmp_path):
    settings = TrainingSettings(steps=150_000)
    told = []
    train(settings, on_progress=told.append)
    assert told[-1].success > 0.8


@pytest.mark.long
def test_the_policy_that_is_shipped_reaches_nine_of_ten_goals_that_it_has_not_seen():
    from drake_navbench.controllers.learned.parameters import WEIGHTS_FOLDER

    path = WEIGHTS_FOLDER / "navigation.npz"
    assert load_network(path).bias_3.size == 2
    assert success_rate_of_file(TrainingSettings(), path, 300) >= 0.9
