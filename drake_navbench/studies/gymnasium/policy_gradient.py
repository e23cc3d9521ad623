"""Proximal policy optimization in numpy: two small networks, their gradients, Adam.

Source: J. Schulman et al., "Proximal Policy Optimization Algorithms", 2017; the advantages are
those of "High-Dimensional Continuous Control Using Generalized Advantage Estimation", 2016.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controllers.learned.network import Network

Array = NDArray[np.float64]

ADAM_DECAY_1 = 0.9
ADAM_DECAY_2 = 0.999
ADAM_GUARD = 1e-8
VARIANCE_GUARD = 1e-8


@dataclass(frozen=True)
class PolicyGradientSettings:
    """Settings of the optimization; their names are those of the paper where it has one."""

    discount: float = 0.99
    gae_lambda: float = 0.95
    clip_ratio: float = 0.2
    epochs: int = 8
    minibatch_size: int = 256
    learning_rate: float = 6e-4
    entropy_weight: float = 0.002
    max_gradient_norm: float = 0.5
    hidden_count: int = 64
    initial_std: float = 0.5
    min_std: float = 0.08


class Batch:
    """A batch of N steps, (N, ...) each: inputs, actions, their log probabilities, and targets."""

    def __init__(
        self,
        inputs: Array,
        actions: Array,
        log_probabilities: Array,
        advantages: Array,
        returns: Array,
    ) -> None:
        self.inputs, self.actions, self.log_probabilities = inputs, actions, log_probabilities
        self.advantages, self.returns = advantages, returns


def advantages_and_returns(
    rewards: Array,
    values: Array,
    ended: Array,
    last_values: Array,
    *,
    discount: float,
    decay: float,
) -> tuple[Array, Array]:
    """Returns (T, E) generalized advantages, and advantages + values.

    rewards, values: (T, E). ended: (T, E) whether the episode ended with the step; what is worth
    after a truncation is in its reward. last_values: (E,) after the last step.
    """
    advantages = np.empty_like(rewards)
    following, next_values = np.zeros(rewards.shape[1]), last_values
    for t in range(rewards.shape[0] - 1, -1, -1):
        goes_on = 1.0 - ended[t]
        delta = rewards[t] + discount * next_values * goes_on - values[t]
        following = delta + discount * decay * goes_on * following
        advantages[t], next_values = following, values[t]
    return advantages, advantages + values


class Learner:
    """Policy, value and spread of the actions, with Adam's moments of their gradients.

    The policy's mean is its network's output; the spread is one number an action.
    """

    def __init__(
        self, input_count: int, action_count: int, settings: PolicyGradientSettings, seed: int
    ) -> None:
        self.settings = settings
        self.generator = np.random.default_rng(seed)
        hidden = settings.hidden_count
        self.policy = self._network([input_count, hidden, hidden, action_count], last_gain=0.01)
        self.value = self._network([input_count, hidden, hidden, 1], last_gain=1.0)
        self.log_std = np.full(action_count, math.log(settings.initial_std))
        parameters = self._parameters()
        self._first = [np.zeros_like(p) for p in parameters]
        self._second = [np.zeros_like(p) for p in parameters]
        self._updates = 0

    def act(self, inputs: Array) -> tuple[Array, Array, Array]:
        """Returns drawn actions (E, A), their log probabilities (E,), and values (E,)."""
        mean = self.policy(inputs)
        actions = mean + np.exp(self.log_std) * self.generator.standard_normal(mean.shape)
        return actions, self._log_probability(mean, actions), self.value(inputs)[:, 0]

    def learn(self, batch: Batch, *, learning_rate: float) -> None:
        """Improves the networks by a batch, in several passes over shuffled parts of it."""
        count = len(batch.inputs)
        for _ in range(self.settings.epochs):
            order = self.generator.permutation(count)
            for begin in range(0, count, self.settings.minibatch_size):
                chosen = order[begin : begin + self.settings.minibatch_size]
                self._descend(self.gradients(batch, chosen), learning_rate)

    def gradients(self, batch: Batch, chosen: NDArray[np.intp]) -> list[Array]:
        """Returns the gradient of the loss over some of a batch, one array a parameter."""
        settings = self.settings
        inputs, actions = batch.inputs[chosen], batch.actions[chosen]
        advantages = batch.advantages[chosen]
        advantages = (advantages - advantages.mean()) / (advantages.std() + VARIANCE_GUARD)
        mean, policy_hidden = _forward(self.policy, inputs)
        std = np.exp(self.log_std)
        deviation = (actions - mean) / std
        ratio = np.exp(self._log_probability(mean, actions) - batch.log_probabilities[chosen])
        is_clipped = np.where(
            advantages > 0.0, ratio > 1.0 + settings.clip_ratio, ratio < 1.0 - settings.clip_ratio
        )
        # d loss / d log probability of each sample.
        slope = np.where(is_clipped, 0.0, -advantages * ratio) / len(chosen)
        policy_gradients = _backward(
            self.policy, inputs, policy_hidden, slope[:, None] * deviation / std
        )
        std_gradient = (slope[:, None] * (deviation**2 - 1.0)).sum(axis=0) - settings.entropy_weight
        values, value_hidden = _forward(self.value, inputs)
        value_slope = (values[:, 0] - batch.returns[chosen]) / len(chosen)
        value_gradients = _backward(self.value, inputs, value_hidden, value_slope[:, None])
        return [*policy_gradients, std_gradient, *value_gradients]

    def _log_probability(self, mean: Array, actions: Array) -> Array:
        deviation = (actions - mean) / np.exp(self.log_std)
        log_density = -0.5 * deviation**2 - self.log_std - 0.5 * math.log(2.0 * math.pi)
        return log_density.sum(axis=1)

    def _descend(self, gradients: Sequence[Array], learning_rate: float) -> None:
        norm = math.sqrt(sum(float((g**2).sum()) for g in gradients))
        scale = min(1.0, self.settings.max_gradient_norm / (norm + ADAM_GUARD))
        self._updates += 1
        correction_1 = 1.0 - ADAM_DECAY_1**self._updates
        correction_2 = 1.0 - ADAM_DECAY_2**self._updates
        for parameter, gradient, first, second in zip(
            self._parameters(), gradients, self._first, self._second, strict=True
        ):
            gradient = scale * gradient
            first += (1.0 - ADAM_DECAY_1) * (gradient - first)
            second += (1.0 - ADAM_DECAY_2) * (gradient**2 - second)
            root = np.sqrt(second / correction_2) + ADAM_GUARD
            parameter -= learning_rate * first / correction_1 / root
        np.maximum(self.log_std, math.log(self.settings.min_std), out=self.log_std)

    def _parameters(self) -> list[Array]:
        """Returns the arrays that are learned, in the order of `gradients`."""
        return [*_arrays(self.policy), self.log_std, *_arrays(self.value)]

    def _network(self, sizes: Sequence[int], *, last_gain: float) -> Network:
        gains = [math.sqrt(2.0), math.sqrt(2.0), last_gain]
        arrays: list[Array] = []
        for inputs, outputs, gain in zip(sizes[:-1], sizes[1:], gains, strict=True):
            drawn = self.generator.standard_normal((max(inputs, outputs), min(inputs, outputs)))
            basis, _ = np.linalg.qr(drawn)
            basis = basis if inputs >= outputs else basis.T
            arrays += [gain * basis, np.zeros(outputs)]
        return Network(*arrays)


def _arrays(network: Network) -> list[Array]:
    return [getattr(network, field.name) for field in fields(Network)]


def _forward(network: Network, inputs: Array) -> tuple[Array, tuple[Array, Array]]:
    """Returns the outputs, and the activations of the hidden layers."""
    first = np.tanh(inputs @ network.weight_1 + network.bias_1)
    second = np.tanh(first @ network.weight_2 + network.bias_2)
    return second @ network.weight_3 + network.bias_3, (first, second)


def _backward(
    network: Network, inputs: Array, hidden: tuple[Array, Array], slope: Array
) -> list[Array]:
    """Returns the gradient for each array of a network from that for its outputs."""
    first, second = hidden
    slope_2 = (slope @ network.weight_3.T) * (1.0 - second**2)
    slope_1 = (slope_2 @ network.weight_2.T) * (1.0 - first**2)
    return [
        inputs.T @ slope_1,
        slope_1.sum(axis=0),
        first.T @ slope_2,
        slope_2.sum(axis=0),
        second.T @ slope,
        slope.sum(axis=0),
    ]
