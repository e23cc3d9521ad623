"""Trains the policy of the preset `learned` in the environment, and says how well it drives."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controllers.learned.features import (
    FEATURE_COUNT,
    SECTOR_COUNT,
    features,
    outline_radii,
    sector_closeness,
)
from drake_navbench.controllers.learned.network import (
    ACTION_COUNT,
    Network,
    load_network,
    save_network,
)
from drake_navbench.studies.gymnasium.environment import NavigationEnvironment, Seen
from drake_navbench.studies.gymnasium.policy_gradient import (
    Batch,
    Learner,
    PolicyGradientSettings,
    advantages_and_returns,
)

Array = NDArray[np.float64]

# Of training; those of evaluations begin behind all of them.
FIRST_TRAINING_SEED = 0
FIRST_EVALUATION_SEED = 2**40
EPISODES_SHOWN = 200
# The learning rate falls to this share of what it began with.
LEAST_RATE = 0.02


@dataclass(frozen=True)
class TrainingSettings:
    """steps: of the environment, over all episodes. environments: that are driven side by side.

    horizon: steps of each between two updates.
    """

    steps: int = 400_000
    environments: int = 16
    horizon: int = 128
    seed: int = 0
    timeout_s: float = 40.0
    max_obstacles: int = 12
    max_radius_m: float = 0.7
    passage_m: float = 1.1


class Progress(NamedTuple):
    """The progress of training after an update that used `steps_in_update` steps.

    steps: all steps so far. success, contact: shares of the episodes that ended lately.
    mean_return: the mean over the same episodes.
    """

    steps: int
    steps_in_update: int
    success: float
    contact: float
    mean_return: float
    elapsed_s: float


class PolicyView:
    """Turns observations into the network's inputs, and the network's outputs into commands."""

    def __init__(self, environment: NavigationEnvironment) -> None:
        robot = environment.robot
        lidar, drive = robot.lidar, robot.drive
        angles = lidar.beam_angles
        self._directions = np.column_stack([np.cos(angles), np.sin(angles)])
        self._sensor_pose = lidar.pose
        self._range_min_m, self._range_max_m = lidar.range_min_m, lidar.range_max_m
        self._radii = outline_radii(robot.outline, SECTOR_COUNT)
        self.limits = np.array([drive.max_linear_velocity_mps, drive.max_angular_velocity_radps])

    def inputs(self, seen: Seen) -> Array:
        """Returns (F,) the features of an observation."""
        ranges = seen["lidar"].astype(np.float64)
        # A hit nearer than the least range still lies in the direction of its beam.
        distances = np.maximum(ranges, self._range_min_m)
        points = (distances[:, None] * self._directions)[ranges < self._range_max_m]
        x, y, yaw = self._sensor_pose
        cos_yaw, sin_yaw = np.cos(yaw), np.sin(yaw)
        turned = points @ np.array([[cos_yaw, sin_yaw], [-sin_yaw, cos_yaw]]) + [x, y]
        closeness = sector_closeness(turned, 0.0, 0.0, 0.0, self._radii, 0.0)
        goal, twist = seen["goal"].astype(np.float64), seen["twist"].astype(np.float64)
        return features(closeness, goal, twist, self.limits)

    def command(self, action: Array) -> NDArray[np.float32]:
        """Returns the command for an output of the network, each 1 at the limit."""
        return (np.clip(action, -1.0, 1.0) * self.limits).astype(np.float32)


def training_environment(settings: TrainingSettings) -> NavigationEnvironment:
    """Returns an environment with tasks drawn at random, as training sees them."""
    return NavigationEnvironment(
        "empty",
        tasks="random",
        random_tasks={
            "max_obstacles": settings.max_obstacles,
            "max_radius_m": settings.max_radius_m,
            "passage_m": settings.passage_m,
        },
        timeout_s=settings.timeout_s,
    )


def train(
    settings: TrainingSettings,
    gradient_settings: PolicyGradientSettings | None = None,
    *,
    on_progress: Callable[[Progress], None] = lambda progress: None,
) -> Network:
    """Returns the policy after all steps; the same settings give the same one."""
    gradient_settings = gradient_settings or PolicyGradientSettings()
    learner = Learner(FEATURE_COUNT, ACTION_COUNT, gradient_settings, settings.seed)
    crew = _Crew(settings)
    started = time.perf_counter()
    per_update = settings.environments * settings.horizon
    for update in range(max(1, settings.steps // per_update)):
        batch = crew.collect(learner, settings.horizon)
        left = 1.0 - update * per_update / settings.steps
        learner.learn(batch, learning_rate=gradient_settings.learning_rate * max(left, LEAST_RATE))
        elapsed_s = time.perf_counter() - started
        success, contact, mean_return = crew.lately()
        progress = Progress(
            (update + 1) * per_update, per_update, success, contact, mean_return, elapsed_s
        )
        on_progress(progress)
    return learner.policy


class _Crew:
    """The environments of a training, each with the features of its present observation."""

    def __init__(self, settings: TrainingSettings) -> None:
        self._environments = [training_environment(settings) for _ in range(settings.environments)]
        self._view = PolicyView(self._environments[0])
        self._next_seed = FIRST_TRAINING_SEED
        self._inputs = np.array([self._begin(e) for e in self._environments])
        self._returns = np.zeros(settings.environments)
        self._ended: list[tuple[float, float, float]] = []

    def collect(self, learner: Learner, horizon: int) -> Batch:
        """Drives every environment for `horizon` steps; returns these steps as a batch."""
        count = len(self._environments)
        shape = (horizon, count)
        inputs, actions = np.empty((*shape, FEATURE_COUNT)), np.empty((*shape, ACTION_COUNT))
        rewards, values, ended = np.empty(shape), np.empty(shape), np.zeros(shape)
        log_probabilities = np.empty(shape)
        discount = learner.settings.discount
        for t in range(horizon):
            inputs[t] = self._inputs
            actions[t], log_probabilities[t], values[t] = learner.act(self._inputs)
            for k in range(count):
                rewards[t, k], ended[t, k] = self._step(k, actions[t, k], learner, discount)
        last_values = learner.value(self._inputs)[:, 0]
        advantages, returns = advantages_and_returns(
            rewards,
            values,
            ended,
            last_values,
            discount=discount,
            decay=learner.settings.gae_lambda,
        )
        return Batch(
            inputs.reshape(-1, FEATURE_COUNT),
            actions.reshape(-1, ACTION_COUNT),
            log_probabilities.ravel(),
            advantages.ravel(),
            returns.ravel(),
        )

    def _step(self, k: int, action: Array, learner: Learner, discount: float) -> tuple[float, bool]:
        environment = self._environments[k]
        seen, reward, terminated, truncated, info = environment.step(self._view.command(action))
        self._returns[k] += reward
        self._inputs[k] = self._view.inputs(seen)
        if truncated:
            # The episode is cut off here; the learner's value stands for the rewards that would
            # have followed.
            reward += discount * float(learner.value(self._inputs[k]).item())
        if terminated or truncated:
            has_collided = info["outcome"] == "collided"
            self._ended.append(
                (float(info["is_success"]), float(has_collided), float(self._returns[k]))
            )
            self._returns[k] = 0.0
            self._inputs[k] = self._begin(environment)
        return reward, terminated or truncated

    def _begin(self, environment: NavigationEnvironment) -> Array:
        seen, _ = environment.reset(seed=self._next_seed)
        self._next_seed += 1
        return self._view.inputs(seen)

    def lately(self) -> tuple[float, float, float]:
        """Returns the shares of success and contact and the mean return of the last episodes."""
        if not self._ended:
            return math.nan, math.nan, math.nan
        success, contact, mean_return = np.mean(self._ended[-EPISODES_SHOWN:], axis=0).tolist()
        return success, contact, mean_return


def success_rate(
    network: Network, environment: NavigationEnvironment, seeds: Sequence[int]
) -> float:
    """Returns the share of episodes, one a seed, in which the policy reaches the goal."""
    view = PolicyView(environment)
    reached = 0
    for seed in seeds:
        seen, _ = environment.reset(seed=seed)
        is_over = False
        while not is_over:
            seen, _, terminated, truncated, info = environment.step(
                view.command(network(view.inputs(seen)))
            )
            is_over = terminated or truncated
        reached += info["is_success"]
    return reached / len(seeds)


def train_into_file(
    settings: TrainingSettings, path: Path, *, on_progress: Callable[[Progress], None]
) -> None:
    """Trains a policy and writes its weights."""
    save_network(train(settings, on_progress=on_progress), path)


def success_rate_of_file(settings: TrainingSettings, path: Path, episodes: int) -> float:
    """Returns the success rate of the weights in a file, over tasks that training has not seen.

    Raises InputError where the file holds no weights.
    """
    seeds = range(FIRST_EVALUATION_SEED, FIRST_EVALUATION_SEED + episodes)
    return success_rate(load_network(path), training_environment(settings), seeds)
