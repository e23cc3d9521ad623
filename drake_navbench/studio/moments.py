"""A trial's log, moment by moment: where the robot is, its costmap, what its controller left."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.analysis.cost_colors import palette, palette_rows
from drake_navbench.logs.log import TrialLog

Array = NDArray[np.float64]
# Columns of the log that the table of a moment shows, with their names there.
SHOWN = {
    "v_mps": "speed [m/s]",
    "w_radps": "turn rate [rad/s]",
    "command_v_mps": "commanded speed [m/s]",
    "command_w_radps": "commanded turn rate [rad/s]",
    "clearance_m": "clearance [m]",
    "compute_time_ms": "compute time [ms]",
}
# So many samples of a cycle are drawn; more would be a blot.
MAX_SAMPLES = 60


class CostmapFrame(NamedTuple):
    """A local costmap: when it was updated, its lower left corner and cell edge, costs by row."""

    time_s: float
    x: float
    y: float
    edge_m: float
    costs: NDArray[np.uint8]


class Watched(NamedTuple):
    """A trial to be looked at.

    poses: (N, 3) in the world. values: by the names of the table, (N,) each. course: (M, 2) the
    first plans. cycles: time and diagnostics of each control cycle. offset: (N, 2) from the
    odometry frame, in which costmaps and diagnostics are, to the world at the robot, m.
    """

    title: str
    scenario: Mapping[str, Any]
    outline: Array
    times_s: Array
    poses: Array
    values: Mapping[str, Array]
    course: Array
    costmaps: tuple[CostmapFrame, ...]
    cycles: tuple[tuple[float, Mapping[str, Any]], ...]
    offset: Array
    is_drifting: bool


def read_watched(path: str) -> Watched:
    """Returns the trial of a log; raises InputError."""
    from drake_navbench.inputs.robot import Robot

    log = TrialLog.read(Path(path))
    samples = log.samples
    poses = samples[["x_m", "y_m", "yaw_rad"]].to_numpy(dtype=float)
    is_drifting = "odometry_x_m" in samples
    odometry = samples[["odometry_x_m", "odometry_y_m"]].to_numpy(float) if is_drifting else poses
    info = log.info
    outline = np.asarray(Robot.model_validate(dict(info["robot"])).outline, dtype=float)
    name = f"{info['scenario']['name']}, {info['controller']}, trial {info['trial']}"
    return Watched(
        f"{name}: {log.outcome}, {info['reason']}",
        {**info["scenario"], "world": {"obstacles": list(log.obstacles)}},
        outline,
        samples["time_s"].to_numpy(dtype=float),
        poses,
        {shown: samples[c].to_numpy(dtype=float) for c, shown in SHOWN.items() if c in samples},
        log.course[:, :2],
        tuple(
            CostmapFrame(c.stamp_s, c.origin_x, c.origin_y, c.resolution, np.asarray(c.costs))
            for c in log.costmaps
        ),
        log.diagnostics,
        poses[:, :2] - odometry[:, :2],
        is_drifting,
    )


class Moment(NamedTuple):
    """A moment of a trial: the number of its sample, the latest costmap and control cycle."""

    sample: int
    costmap: CostmapFrame | None
    cycle: Mapping[str, Any]


def moment_at(watched: Watched, time_s: float) -> Moment:
    """Returns the moment of a time, s."""
    index = max(bisect_right(watched.times_s, time_s + 1e-9) - 1, 0)
    costmap = bisect_right(watched.costmaps, time_s + 1e-9, key=lambda entry: entry.time_s) - 1
    cycle = bisect_right(watched.cycles, time_s + 1e-9, key=lambda entry: entry[0]) - 1
    return Moment(
        index,
        watched.costmaps[costmap] if costmap >= 0 else None,
        watched.cycles[cycle][1] if cycle >= 0 else {},
    )


def rows_of(watched: Watched, moment: Moment) -> list[tuple[str, str]]:
    """Returns the facts of a moment as names and values: motion, then diagnostics.

    What a decision was made of belongs at the end of this list, a row a critic or rule.
    """
    rows = [(name, f"{values[moment.sample]:.3g}") for name, values in watched.values.items()]
    for name, value in moment.cycle.items():
        if isinstance(value, bool | int | str):
            rows.append((name, str(value)))
        elif isinstance(value, float):
            rows.append((name, f"{value:.3g}"))
    return rows


def trajectories_of(moment: Moment) -> tuple[list[Array], Array | None]:
    """Returns the samples of a cycle, those with the lowest costs, and its prediction, (N, 2) m."""
    cycle = moment.cycle
    samples = [
        np.asarray(entry, dtype=float)[:, :2] for entry in cycle.get("sampled_trajectories", ())
    ]
    costs = np.asarray(cycle.get("sampled_costs", np.zeros(len(samples))), dtype=float)
    if len(costs) == len(samples):
        samples = [samples[i] for i in np.argsort(np.where(np.isnan(costs), np.inf, costs))]
    predicted = cycle.get("predicted_trajectory")
    shown = None if predicted is None else np.asarray(predicted, dtype=float).reshape(-1, 3)[:, :2]
    return samples[:MAX_SAMPLES], shown


def image_of(costmap: CostmapFrame) -> NDArray[np.uint32]:
    """Returns a costmap as (rows, columns) RGBA."""
    colors = np.ascontiguousarray(palette()).view(np.uint32).reshape(-1)
    return np.asarray(colors[palette_rows()[costmap.costs]])
