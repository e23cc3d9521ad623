"""A trial's log, moment by moment: the robot's pose, its costmap, its controller's diagnostics."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.analysis.cost_colors import palette, palette_rows
from drake_navbench.kernels.arrays import Array

# At most this many samples of a cycle are drawn: more would be a blot.
MAX_SAMPLES = 60
TRAJECTORIES = frozenset({"sampled_trajectories", "predicted_trajectory"})
# A log has trajectories five times a second; older ones belong to another moment and are not shown.
MAX_LOOK_BACK = 20


class CostmapFrame(NamedTuple):
    """A local costmap: when it was updated, its lower left corner and cell edge, costs by row."""

    time_s: float
    x: float
    y: float
    edge_m: float
    costs: NDArray[np.uint8]


class Reasons(NamedTuple):
    """The reasons of a trial's decisions, from driving it again.

    decisions: the `time`, `sentence`, `columns`, `rows` and `notes` of each. cycles: as in Watched,
    with the arrays in the controller's diagnostics.
    """

    decisions: tuple[Mapping[str, Any], ...]
    cycles: tuple[tuple[float, Mapping[str, Any]], ...]


class Watched(NamedTuple):
    """A trial to watch.

    poses: (N, 3) in the world. values: by the names of the table, (N,) each. course: (M, 2) the
    first plans. cycles: time and diagnostics of each control cycle. offset: (N, 2) m, the true
    position minus that by the odometry: the shift by which costmaps and diagnostics, which are in
    the odometry frame, are drawn. decisions: as in Reasons, empty until a user asks for them.
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
    decisions: tuple[Mapping[str, Any], ...] = ()


class Moment(NamedTuple):
    """A moment of a trial: the number of its sample, the latest costmap, cycle and decision.

    drawn: the latest cycle with trajectories; a log has them for one cycle in several.
    """

    sample: int
    costmap: CostmapFrame | None
    cycle: Mapping[str, Any]
    drawn: Mapping[str, Any]
    decision: Mapping[str, Any] | None


def moment_at(watched: Watched, time_s: float) -> Moment:
    """Returns the moment of a time, s."""
    index = max(bisect_right(watched.times_s, time_s + 1e-9) - 1, 0)
    costmap = bisect_right(watched.costmaps, time_s + 1e-9, key=lambda entry: entry.time_s) - 1
    cycle = bisect_right(watched.cycles, time_s + 1e-9, key=lambda entry: entry[0]) - 1
    latest = reversed(watched.cycles[max(cycle - MAX_LOOK_BACK, 0) : cycle + 1])
    decision = bisect_right(watched.decisions, time_s + 1e-9, key=lambda entry: entry["time"]) - 1
    return Moment(
        index,
        watched.costmaps[costmap] if costmap >= 0 else None,
        watched.cycles[cycle][1] if cycle >= 0 else {},
        next((left for _, left in latest if not TRAJECTORIES.isdisjoint(left)), {}),
        # Before the first cycle the first one is shown.
        watched.decisions[max(decision, 0)] if watched.decisions else None,
    )


def rows_of(watched: Watched, moment: Moment) -> list[tuple[str, str]]:
    """Returns the values of a moment by name: the motion, then the diagnostics."""
    rows = [(name, f"{values[moment.sample]:.3g}") for name, values in watched.values.items()]
    for name, value in moment.cycle.items():
        if isinstance(value, bool | int | str):
            rows.append((name, str(value)))
        elif isinstance(value, float):
            rows.append((name, f"{value:.3g}"))
    return rows


def trajectories_of(moment: Moment) -> tuple[list[Array], Array | None]:
    """Returns the samples of a cycle, those with the lowest costs, and its prediction, (N, 2) m."""
    cycle = moment.drawn
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
