"""The roll-out of every sampled twist (Nav2's dwb_plugins: Standard and LimitedAccel generator)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.controllers.dwb.velocity_samples import (
    combine_axes,
    project_velocity,
    sample_axes,
)
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array

if TYPE_CHECKING:
    from drake_navbench.controllers.dwb.kinematics import Kinematics
    from drake_navbench.controllers.dwb.parameters import DynamicWindowApproachParameters


class Trajectories(NamedTuple):
    """The window of one cycle: K sampled twists and their trajectories. Read-only views.

    They are valid until the next call of the generator that made them.

    twists: (K, 3) sampled vx m/s, vy m/s, wz rad/s, ascending, wz fastest.
    velocities: (K, 3) the commands: the twist, or the first simulated velocity.
    poses: (K, N, 3) x m, y m, yaw rad from the robot's pose on; row k holds pose_counts[k] of them
        (the last one twice where include_last_point), the rest is undefined.
    headings: (K, N, 2) cosine and sine of the poses' yaw, as the roll-out has them.
    pose_counts: (K,) int64. step_counts: (K,) int64 simulated steps. step_s: (K,) s each.
    """

    twists: Array
    velocities: Array
    poses: Array
    headings: Array
    pose_counts: NDArray[np.int64]
    step_counts: NDArray[np.int64]
    step_s: Array


@njit(cache=True)
def count_steps(twists, record, step_counts, step_s):
    """Writes the number and duration of the simulated steps of each twist; returns the most.

    record: (1,) `TrajectoryGenerator.record`.
    """
    settings = record[0]
    most = 1
    for k in range(twists.shape[0]):
        if settings.discretize_by_time:
            steps = math.ceil(settings.sim_time / settings.time_granularity)
        else:
            speed = math.hypot(twists[k, 0], twists[k, 1])
            by_distance = speed * settings.sim_time / settings.linear_granularity
            turn = abs(twists[k, 2]) * settings.sim_time
            steps = math.ceil(max(by_distance, turn / settings.angular_granularity))
        steps = max(1, int(steps))
        step_counts[k] = steps
        step_s[k] = settings.sim_time / steps
        most = max(most, steps)
    return most


@njit(cache=True)
def roll_out(pose, twist, kinematics, record, window):
    """Simulates every twist from a pose and a measured twist.

    pose: (x m, y m, yaw rad). twist: (vx, vy, wz). record: (1,) `TrajectoryGenerator.record`.
    window: Trajectories, whose velocities, poses and headings are written. Euler steps with the new
    velocity and the old yaw. Cosine and sine follow the yaw by rotating them, which costs no
    trigonometry while the yaw rate is constant and differs from theirs by about 1e-16 a step.
    """
    settings = record[0]
    limits_acceleration = settings.limits_acceleration
    twists, velocities, poses, headings = (
        window.twists,
        window.velocities,
        window.poses,
        window.headings,
    )
    for k in range(twists.shape[0]):
        x, y, yaw = pose
        vx, vy, wz = twist
        cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
        turn, cos_turn, sin_turn = 0.0, 1.0, 0.0
        step, step_count = window.step_s[k], window.step_counts[k]
        poses[k, 0, 0], poses[k, 0, 1], poses[k, 0, 2] = x, y, yaw
        headings[k, 0, 0], headings[k, 0, 1] = cos_yaw, sin_yaw
        for i in range(step_count):
            if limits_acceleration:
                vx = project_velocity(
                    vx, kinematics.acc_lim_x, kinematics.decel_lim_x, step, twists[k, 0]
                )
                vy = project_velocity(
                    vy, kinematics.acc_lim_y, kinematics.decel_lim_y, step, twists[k, 1]
                )
                wz = project_velocity(
                    wz, kinematics.acc_lim_theta, kinematics.decel_lim_theta, step, twists[k, 2]
                )
            else:
                vx, vy, wz = twists[k, 0], twists[k, 1], twists[k, 2]
            if i == 0:
                velocities[k, 0], velocities[k, 1], velocities[k, 2] = vx, vy, wz
            x += (vx * cos_yaw - vy * sin_yaw) * step
            y += (vx * sin_yaw + vy * cos_yaw) * step
            if wz * step != turn:
                turn = wz * step
                cos_turn, sin_turn = math.cos(turn), math.sin(turn)
            yaw = wrap(yaw + turn)
            cos_yaw, sin_yaw = (
                cos_yaw * cos_turn - sin_yaw * sin_turn,
                sin_yaw * cos_turn + cos_yaw * sin_turn,
            )
            poses[k, i + 1, 0], poses[k, i + 1, 1], poses[k, i + 1, 2] = x, y, yaw
            headings[k, i + 1, 0], headings[k, i + 1, 1] = cos_yaw, sin_yaw
        if settings.include_last_point:
            end = step_count + 1
            poses[k, end, 0], poses[k, end, 1], poses[k, end, 2] = x, y, yaw
            headings[k, end, 0], headings[k, end, 1] = cos_yaw, sin_yaw
        if not settings.limit_vel_cmd_in_traj:
            for axis in range(twists.shape[1]):
                velocities[k, axis] = twists[k, axis]


class TrajectoryGenerator:
    """Samples the dynamic window and rolls it out into buffers that it keeps.

    The buffers are sized by the largest window seen; results do not depend on them. record: (1,)
    the parameters, for the kernels.
    """

    def __init__(
        self, parameters: DynamicWindowApproachParameters, control_period_s: float
    ) -> None:
        standard = parameters.uses_standard_generator
        # With the Standard generator the velocity approaches the twist at the acceleration limits;
        # with LimitedAccel it has it from the first step on.
        self.record = parameters.as_record(limits_acceleration=standard)
        self._end_poses = 2 if parameters.include_last_point else 1
        sim_period_s = parameters.sim_period
        if sim_period_s is None:
            sim_period_s = control_period_s
        self._window_s = parameters.sim_time if standard else sim_period_s
        self._sample_counts = (
            parameters.vx_samples,
            parameters.vy_samples,
            parameters.vtheta_samples,
        )
        self._axes = np.empty((3, 2 * max(2, *self._sample_counts) + 1))
        self._resize(0, 0)

    def _resize(self, twist_capacity: int, pose_capacity: int) -> None:
        self._twists = np.empty((twist_capacity, 3))
        self._velocities = np.empty((twist_capacity, 3))
        self._step_counts = np.empty(twist_capacity, dtype=np.int64)
        self._step_s = np.empty(twist_capacity)
        self._poses = np.empty((twist_capacity, pose_capacity, 3))
        self._headings = np.empty((twist_capacity, pose_capacity, 2))

    def generate(
        self,
        pose: tuple[float, float, float],
        twist: tuple[float, float, float],
        kinematics: Kinematics,
    ) -> Trajectories:
        """Returns the window from a pose (x m, y m, yaw rad) and a measured twist (vx, vy, wz)."""
        counts = sample_axes(
            kinematics, twist, self._window_s, sample_counts=self._sample_counts, axes=self._axes
        )
        most_twists = counts[0] * counts[1] * counts[2]
        if most_twists > len(self._twists):
            self._resize(most_twists, self._poses.shape[1])
        count = combine_axes(kinematics, self._axes, counts, self._twists)
        twists, velocities = self._twists[:count], self._velocities[:count]
        step_counts, step_s = self._step_counts[:count], self._step_s[:count]
        most_steps = count_steps(twists, self.record, step_counts, step_s)
        # The start pose and, where wanted, the end pose once more.
        if most_steps + 2 > self._poses.shape[1]:
            self._poses = np.empty((len(self._twists), most_steps + 2, 3))
            self._headings = np.empty((len(self._twists), most_steps + 2, 2))
        poses, headings = self._poses[:count], self._headings[:count]
        pose_counts = step_counts + self._end_poses
        window = Trajectories(twists, velocities, poses, headings, pose_counts, step_counts, step_s)
        roll_out(pose, twist, kinematics, self.record, window)
        for array in window:
            array.flags.writeable = False
        return window
