"""The commands and the measured motion in a recording, from which a robot's drive is fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drake_navbench.kernels.arrays import Array
from drake_navbench.ros2.recordings.recorded_columns import Column
from drake_navbench.ros2.recordings.recorded_motion import RecordedMotion


@dataclass(frozen=True, eq=False)
class DriveData:
    """Commands and motion on one clock.

    time_s: (N,) rising. pose: (N, 3) x m, y m, yaw rad. twist: (N, 3) v m/s, w rad/s, vy m/s.
    command_time_s: (M,) rising. commands: (M, 3) v m/s, w rad/s, vy m/s.
    """

    time_s: Array
    pose: Array
    twist: Array
    command_time_s: Array
    commands: Array

    def within(self, begin_s: float, end_s: float) -> DriveData:
        """Returns the part between two times, with the commands before it that still hold."""
        rows = (self.time_s >= begin_s) & (self.time_s <= end_s)
        given = self.command_time_s <= end_s
        return DriveData(
            self.time_s[rows],
            self.pose[rows],
            self.twist[rows],
            self.command_time_s[given],
            self.commands[given],
        )


def drive_data(columns: Mapping[str, Column], motion: RecordedMotion) -> DriveData | None:
    """Returns commands and motion from a recording; None where it has no commands."""
    column = columns.get("command")
    if column is None or not column.values:
        return None
    times = motion.clock.times(column)
    order = np.argsort(times, kind="stable")
    return DriveData(
        motion.time_s,
        motion.pose,
        motion.twist,
        times[order],
        np.array(column.values, dtype=float).reshape(-1, 3)[order],
    )
