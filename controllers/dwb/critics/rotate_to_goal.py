"""RotateToGoal: near the goal first slow down, then only turn (Nav2's RotateToGoalCritic)."""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from numba import njit
from pydantic import Field

from drake_navbench.controllers.dwb.critics.base import Critic, Verdict
from drake_navbench.controllers.dwb.critics.parameters import CriticParameters
from drake_navbench.controllers.dwb.scene import Scene, Situation
from drake_navbench.kernels.angles import absolute_turns, wrap
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.path_pruning import arc_length
from drake_navbench.typed_files.quantities import Duration, Number

NOT_SLOWING, NOT_ROTATING = 1, 2
# Nav2 reads this parameter under a name that no file can spell, so its default always holds.
PATH_LENGTH_TOLERANCE_M = 1.0
NANOSECONDS_PER_SECOND = 1e9


class RotateToGoalParameters(CriticParameters):
    """Parameters of RotateToGoal, which also reads two parameters of the controller itself."""

    slowing_factor: Number = Field(
        5.0, description="Weight of the squared speed while the robot slows down."
    )
    lookahead_time: Duration = Field(
        -1.0,
        description="Time along the trajectory at which its yaw is compared with the goal's; "
        "negative: at its end [s].",
    )


class RotateToGoalMemory(NamedTuple):
    """Both flags hold until the next global plan.

    in_window: the goal's position was within tolerance. rotating: and the robot had slowed down.
    """

    in_window: bool = False
    rotating: bool = False


@njit(cache=True)
def yaws_at(poses, pose_counts, step_counts, step_s, time_s):
    """Returns (K,) rad: each trajectory's yaw at a time >= 0, on the shorter arc between poses.

    poses: (K, N, 3) x m, y m, yaw rad. pose_counts, step_counts, step_s: (K,) the poses and steps
    of each trajectory, and the length of its steps. Nav2 keeps the times of the poses as whole
    nanoseconds; the repeated end pose has the time of the end.
    """
    wanted = int(time_s * NANOSECONDS_PER_SECOND)
    yaws = np.empty(poses.shape[0])
    for k in range(poses.shape[0]):
        yaws[k] = poses[k, pose_counts[k] - 1, 2]
        elapsed_s = 0.0
        for i in range(step_counts[k]):
            earlier = int(elapsed_s * NANOSECONDS_PER_SECOND)
            elapsed_s += step_s[k]
            later = int(elapsed_s * NANOSECONDS_PER_SECOND)
            if wanted < later:
                ratio = (wanted - earlier) / (later - earlier)
                turn = wrap(poses[k, i + 1, 2] - poses[k, i, 2])
                yaws[k] = wrap(poses[k, i, 2] + ratio * turn)
                break
    return yaws


class RotateToGoal(Critic):
    """score = slowing_factor * speed^2 + yaw error while slowing down, yaw error while turning."""

    Parameters: ClassVar[type[CriticParameters]] = RotateToGoalParameters
    reasons: ClassVar[tuple[str, ...]] = (
        "Not slowing down near goal.",
        "Nonrotation command near goal.",
    )

    def initial_memory(self) -> RotateToGoalMemory:
        """Returns the memory far from the goal."""
        return RotateToGoalMemory()

    def reset(self, memory: RotateToGoalMemory) -> RotateToGoalMemory:
        """Clears both flags."""
        return RotateToGoalMemory()

    def prepare(self, situation: Situation, memory: RotateToGoalMemory) -> RotateToGoalMemory:
        """Sets `in_window` within the goal tolerance, then `rotating` once the robot is slow."""
        limits = self._controller_parameters
        dx, dy = situation.pose[0] - situation.goal[0], situation.pose[1] - situation.goal[1]
        in_window = memory.in_window or (
            dx * dx + dy * dy <= limits.xy_goal_tolerance**2
            # A plan that DWB cuts itself begins behind the robot; its length says nothing.
            and (limits.cuts_plan or arc_length(situation.plan) <= PATH_LENGTH_TOLERANCE_M)
        )
        is_slow = _speed_squared(situation) <= limits.trans_stopped_velocity**2
        return RotateToGoalMemory(in_window, memory.rotating or (in_window and is_slow))

    def score(self, scene: Scene, memory: RotateToGoalMemory) -> Verdict:
        """Returns 0 outside the window, else the yaw errors and which commands break a rule."""
        velocities = scene.trajectories.velocities
        if not memory.in_window:
            return Verdict(np.zeros(len(velocities)))
        yaw_error = absolute_turns(self._end_yaws(scene), scene.goal[2])
        speed_squared = velocities[:, 0] ** 2 + velocities[:, 1] ** 2
        if memory.rotating:
            moves = (velocities[:, 0] != 0.0) | (velocities[:, 1] != 0.0)
            return Verdict(yaw_error, np.where(moves, NOT_ROTATING, 0))
        too_fast = speed_squared >= _speed_squared(scene)
        scores = speed_squared * self._parameters.slowing_factor + yaw_error
        return Verdict(scores, np.where(too_fast, NOT_SLOWING, 0))

    def _end_yaws(self, scene: Scene) -> Array:
        window = scene.trajectories
        time_s = self._parameters.lookahead_time
        if time_s < 0.0:
            return scene.end_poses[:, 2]
        return yaws_at(window.poses, window.pose_counts, window.step_counts, window.step_s, time_s)


def _speed_squared(situation: Situation) -> float:
    return situation.twist[0] ** 2 + situation.twist[1] ** 2
