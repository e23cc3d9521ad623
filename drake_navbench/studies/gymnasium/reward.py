"""The reward of a step. Over an episode its terms add up to quantities that metrics measure."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drake_navbench.kernels.angles import wrap
from drake_navbench.typed_files.quantities import Length, Number
from drake_navbench.typed_files.typed_yaml import FrozenModel


class RewardWeights(FrozenModel):
    """The weights of the reward's terms."""

    progress: Number = Field(
        1.0,
        description="Each metre that the robot comes nearer to the goal (goal_traversal_ratio).",
    )
    heading: Number = Field(
        0.5, description="Each radian that the heading comes nearer to the goal's, near the goal."
    )
    heading_within_m: Length = Field(
        0.5, gt=0.0, description="Distance to the goal below which the heading counts [m]."
    )
    time: Number = Field(-0.05, description="Each second (time_to_goal_s).")
    nearness: Number = Field(
        -0.5, description="Each second at clearance 0, less with more clearance (min_clearance_m)."
    )
    near_m: Length = Field(0.3, gt=0.0, description="Clearance from which `nearness` is 0 [m].")
    turning: Number = Field(
        -0.01, description="Each rad/s by which the commanded yaw rate changes (smoothness)."
    )
    reached: Number = Field(5.0, description="For reaching the goal (success_rate).")
    collided: Number = Field(
        -5.0, description="For touching something, besides `time` for all of the episode's rest."
    )


class Moment(NamedTuple):
    """The state from which a reward is computed: at a step's end, or at an episode's start.

    distance_m, heading_error_rad: from the true pose to the goal. clearance_m: clearance of the
    true outline.
    """

    distance_m: float
    heading_error_rad: float
    clearance_m: float


def moment(pose: NDArray[np.float64], goal: NDArray[np.float64], clearance_m: float) -> Moment:
    """Returns the moment of a pose (3,) on the way to a goal (3,), x m, y m, yaw rad."""
    heading_error = abs(float(wrap(goal[2] - pose[2])))
    return Moment(math.hypot(goal[0] - pose[0], goal[1] - pose[1]), heading_error, clearance_m)


def step_reward(
    weights: RewardWeights,
    before: Moment,
    after: Moment,
    *,
    duration_s: float,
    turn_change_radps: float,
    has_reached: bool,
    has_collided: bool,
    time_left_s: float,
) -> float:
    """Returns the reward of a step; time_left_s: from the step's end to the episode's time limit.

    progress (d - d') + heading (h - h') + time dt + nearness max(0, 1 - c'/near_m) dt
    + turning |dw| + reached or collided, with h = |heading error| exp(-(d/heading_within_m)^2 / 2).
    A touch also costs `time` for the time left: else who touches something at once would be better
    off than who stands still, clear of obstacles, until the time limit.
    """
    nearness = max(0.0, 1.0 - after.clearance_m / weights.near_m)
    reward = weights.progress * (before.distance_m - after.distance_m)
    reward += weights.heading * (_heading_left(weights, before) - _heading_left(weights, after))
    reward += (weights.time + weights.nearness * nearness) * duration_s
    reward += weights.turning * abs(turn_change_radps)
    touch = weights.collided + min(weights.time, 0.0) * time_left_s
    return reward + weights.reached * has_reached + touch * has_collided


def _heading_left(weights: RewardWeights, at: Moment) -> float:
    return at.heading_error_rad * math.exp(-0.5 * (at.distance_m / weights.heading_within_m) ** 2)
