"""Trains weights of the controller `learned` with stable-baselines3, and says how well they drive.

python train.py weights.npz               trains, then drives 200 tasks that training has not seen
python train.py weights.npz --evaluate    drives the tasks by the weights in the file
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from drake_navbench.controllers.learned.features import FEATURE_COUNT
from drake_navbench.controllers.learned.network import (
    ACTION_COUNT,
    Network,
    load_network,
    save_network,
)
from drake_navbench.studies.gymnasium.environment import NavigationEnvironment
from drake_navbench.studies.gymnasium.policy_view import PolicyView

ENVIRONMENTS = 16
HIDDEN_COUNT = 64
# Seeds of the tasks that are driven after training; those of training are smaller.
FIRST_EVALUATION_SEED = 2**40
TASKS = {"max_obstacles": 12, "max_radius_m": 0.7, "passage_m": 1.1}


class PolicyEnvironment(gymnasium.Wrapper):
    """The environment with the features of `learned` for observations, actions from -1 to 1."""

    def __init__(self) -> None:
        inner = NavigationEnvironment("empty", tasks="random", random_tasks=TASKS, timeout_s=40.0)
        super().__init__(inner)
        self._view = PolicyView(inner)
        box = gymnasium.spaces.Box
        self.observation_space = box(-np.inf, np.inf, (FEATURE_COUNT,), dtype=np.float32)
        self.action_space = box(-1.0, 1.0, (ACTION_COUNT,), dtype=np.float32)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None):
        seen, info = self.env.reset(seed=seed, options=options)
        return self._view.inputs(seen).astype(np.float32), info

    def step(self, action):
        seen, *others = self.env.step(self._view.command(action))
        return self._view.inputs(seen).astype(np.float32), *others


def train(steps: int, seed: int) -> Network:
    """Returns the policy after `steps` steps of PPO; tasks begin with the seed."""
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor
    from torch import nn

    model = PPO(
        "MlpPolicy",
        VecMonitor(DummyVecEnv([PolicyEnvironment] * ENVIRONMENTS)),
        learning_rate=lambda left: 6e-4 * max(left, 0.02),
        n_steps=128,
        batch_size=256,
        n_epochs=8,
        ent_coef=0.002,
        policy_kwargs={
            "net_arch": [HIDDEN_COUNT, HIDDEN_COUNT],
            "activation_fn": nn.Tanh,
            "log_std_init": float(np.log(0.5)),
        },
        seed=seed,
        device="cpu",
        verbose=1,
    )
    model.learn(steps)
    hidden = model.policy.mlp_extractor.policy_net
    return network_of([hidden[0], hidden[2], model.policy.action_net])


def network_of(layers) -> Network:
    """Returns the network of three linear layers of PyTorch, weights (outputs, inputs)."""
    arrays = []
    for layer in layers:
        arrays += [layer.weight.detach().numpy().T, layer.bias.detach().numpy()]
    return Network(*(array.astype(np.float64) for array in arrays))


def success_rate(network: Network, episodes: int) -> float:
    """Returns the share of new tasks in which a policy reaches the goal."""
    environment = PolicyEnvironment()
    reached = 0
    for episode in range(episodes):
        inputs, _ = environment.reset(seed=FIRST_EVALUATION_SEED + episode)
        is_over = False
        while not is_over:
            inputs, _, terminated, truncated, info = environment.step(network(inputs))
            is_over = terminated or truncated
        reached += info["is_success"]
    environment.close()
    return reached / episodes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("weights", type=Path, help="file .npz of the weights")
    parser.add_argument("--steps", type=int, default=400_000, help="of training (400000)")
    parser.add_argument("--seed", type=int, default=0, help="of training (0)")
    parser.add_argument("--episodes", type=int, default=200, help="tasks that are driven (200)")
    parser.add_argument("--evaluate", action="store_true", help="train nothing")
    arguments = parser.parse_args()
    if not arguments.evaluate:
        save_network(train(arguments.steps, arguments.seed), arguments.weights)
    rate = success_rate(load_network(arguments.weights), arguments.episodes)
    print(
        f"{arguments.weights}: the goal is reached in {100 * rate:.1f}% of {arguments.episodes} "
        "new tasks"
    )


if __name__ == "__main__":
    main()
