"""A trial as plain files: samples for a spreadsheet, trajectories for evo."""

from __future__ import annotations

import math
from pathlib import Path

from drake_navbench.csv_text import csv_text
from drake_navbench.logs.log import TrialLog

# Trajectory -> columns of a log; evo compares the second with the first.
TRAJECTORIES = {
    "truth": ("x_m", "y_m", "yaw_rad"),
    "estimate": ("estimated_x_m", "estimated_y_m", "estimated_yaw_rad"),
}


def csv_of(log: TrialLog) -> str:
    """Returns the samples as comma-separated values, one row a sample, columns as in the log."""
    return csv_text(log.samples)


def tum_of(log: TrialLog, trajectory: str) -> str:
    """Returns a trajectory in the format of the TUM RGB-D benchmark.

    A line a sample: time s, x m, y m, z m, quaternion x, y, z, w. trajectory: see `TRAJECTORIES`.
    Samples without a pose are left out.
    """
    columns = ["time_s", *TRAJECTORIES[trajectory]]
    lines = []
    for time_s, x, y, yaw in log.samples[columns].dropna().to_numpy().tolist():
        z_turn, w_turn = math.sin(0.5 * yaw), math.cos(0.5 * yaw)
        lines.append(f"{time_s!r} {x!r} {y!r} 0 0 0 {z_turn!r} {w_turn!r}\n")
    return "".join(lines)


def plain_paths(stem: Path) -> dict[str, Path]:
    """Returns the paths of a trial's files: 'csv' and each trajectory; stem: without suffix."""
    return {"csv": stem.with_name(f"{stem.name}.csv")} | {
        name: stem.with_name(f"{stem.name}_{name}.tum") for name in TRAJECTORIES
    }
