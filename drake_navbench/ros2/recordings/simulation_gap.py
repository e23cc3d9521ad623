"""Gap between simulation and recording: the robot's model driven by the recorded commands.

The model starts with the pose and the velocity of the recorded robot and gets the same commands.
Its distance from the robot some seconds later is the simulation's error, not a controller's. The
model starts anew every few seconds, since errors add up.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drake_navbench.inputs.robot import Robot
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array
from drake_navbench.ros2.recordings.drive_data import DriveData
from drake_navbench.trial.open_loop import drive_open_loop

# The times after a start at which poses are compared, s.
HORIZONS_S = (1.0, 2.0, 5.0, 10.0)
START_PERIOD_S = 5.0
PERCENTILE = 95
# A sample this near to such a time stands for it, s.
NEAR_S = 0.1


class PoseGap(NamedTuple):
    """Errors of the pose at one time after a start. start_count: number of starts behind them."""

    horizon_s: float
    start_count: int
    position_median_m: float
    position_p95_m: float
    heading_median_deg: float
    heading_p95_deg: float


class SimulationGap(NamedTuple):
    """The differences between the robot's model and a recording.

    poses: errors of the pose, one entry a horizon. v_rms_mps, w_rms_radps: root mean square of the
    errors of linear and angular velocity over all starts. time_s: (N,) of the samples. recorded,
    simulated: the velocities (N, 3) of robot and model: v m/s, w rad/s, vy m/s.
    """

    poses: tuple[PoseGap, ...]
    v_rms_mps: float
    w_rms_radps: float
    time_s: Array
    recorded: Array
    simulated: Array


def simulation_gap(robot: Robot, data: DriveData) -> SimulationGap:
    """Returns the gap between a robot's model and its recording; data: two samples or more."""
    found: dict[float, list[tuple[float, float]]] = {horizon: [] for horizon in HORIZONS_S}
    errors, shown = [], np.full(data.twist.shape, np.nan)
    for first in _starts(data.time_s):
        past = int(np.searchsorted(data.time_s, data.time_s[first] + HORIZONS_S[-1] + NEAR_S))
        rows = slice(first, past)
        start = np.concatenate([data.pose[first], data.twist[first]])
        states = drive_open_loop(
            robot, start, data.time_s[rows], data.command_time_s, data.commands
        )
        errors.append(states[:, 3:] - data.twist[rows])
        until_next = int(np.searchsorted(data.time_s, data.time_s[first] + START_PERIOD_S))
        shown[first:until_next] = states[: until_next - first, 3:]
        since_s = data.time_s[rows] - data.time_s[first]
        for horizon_s, gaps in found.items():
            row = int(np.abs(since_s - horizon_s).argmin())
            if abs(since_s[row] - horizon_s) <= NEAR_S:
                gaps.append(_pose_error(states[row, :3], data.pose[first + row]))
    v_squared, w_squared, vy_squared = np.mean(np.concatenate(errors) ** 2, axis=0)
    v_rms, w_rms = np.sqrt(v_squared + vy_squared), np.sqrt(w_squared)
    poses = tuple(_summed(horizon_s, gaps) for horizon_s, gaps in found.items() if gaps)
    return SimulationGap(poses, float(v_rms), float(w_rms), data.time_s, data.twist, shown)


def _starts(time_s: Array) -> list[int]:
    """Returns the samples at which the model begins anew."""
    grid = np.arange(time_s[0], max(time_s[-1] - HORIZONS_S[0], time_s[0]) + 1e-9, START_PERIOD_S)
    return sorted(set(np.searchsorted(time_s, grid - 1e-9).tolist()))


def _pose_error(simulated: Array, recorded: Array) -> tuple[float, float]:
    """Returns the errors of position, m, and heading, deg."""
    distance = float(np.hypot(*(simulated - recorded)[:2]))
    return distance, abs(float(np.degrees(wrap(simulated[2] - recorded[2]))))


def _summed(horizon_s: float, gaps: Sequence[tuple[float, float]]) -> PoseGap:
    position, heading = np.array(gaps).T
    return PoseGap(
        horizon_s,
        len(gaps),
        float(np.median(position)),
        float(np.percentile(position, PERCENTILE)),
        float(np.median(heading)),
        float(np.percentile(heading, PERCENTILE)),
    )
