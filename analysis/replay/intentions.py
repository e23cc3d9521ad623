"""Draws the trajectories in a controller's diagnostics, such as its prediction and samples.

`Decision.diagnostics` holds them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Rgba, Sphere
from pydrake.math import RigidTransform

from drake_navbench.analysis.replay.flat_meshes import ribbon
from drake_navbench.analysis.replay.stage import Stage, frame_of, spaced_in_time
from drake_navbench.kernels.arrays import Array

Cycles = Sequence[tuple[float, Mapping[str, Any]]]

PREDICTED_COLOR = Rgba(0.80, 0.10, 0.10, 1.0)
CARROT_COLOR = Rgba(0.95, 0.60, 0.05, 1.0)
# The colours of the cheapest, the middle and the costliest third of the samples.
SAMPLE_COLORS = (
    Rgba(0.13, 0.40, 0.67, 1.0),
    Rgba(0.45, 0.66, 0.82, 1.0),
    Rgba(0.76, 0.82, 0.87, 1.0),
)
REFUSED_COLOR = Rgba(0.90, 0.60, 0.58, 1.0)
STOP_COLOR = Rgba(0.45, 0.10, 0.55, 1.0)
GROUP_COLOR = Rgba(0.10, 0.55, 0.45, 1.0)
# Height of the samples, just above everything that lies on the floor; see _Ribbon for the others.
SAMPLES_HEIGHT_M = 0.03
SINGLE_TRAJECTORY_AXES = 2
CARROT_RADIUS_M = 0.06
# The samples of one moment take about 15 kB of the page.
MAX_SAMPLES = 30
MAX_POINTS = 12
MAX_SAMPLE_TURNS = 60


class _Ribbon(NamedTuple):
    """The style of the trajectories under `key` in a controller's diagnostics."""

    key: str
    rgba: Rgba
    width_m: float
    height_m: float


PREDICTED = _Ribbon("predicted_trajectory", PREDICTED_COLOR, 0.05, 0.040)
STOP = _Ribbon("stop_trajectory", STOP_COLOR, 0.03, 0.045)
GROUP = _Ribbon("group_trajectories", GROUP_COLOR, 0.03, 0.035)


def add_prediction(stage: Stage, path: str, cycles: Cycles, period_s: float) -> bool:
    """Shows `predicted_trajectory` (N, 3); returns whether any cycle has one."""
    return _add_ribbons(stage, path, _events(cycles, "predicted_trajectory", period_s), PREDICTED)


def add_stop(stage: Stage, path: str, cycles: Cycles, period_s: float) -> bool:
    """Shows `stop_trajectory` (N, 3), a verified way to rest; returns whether any cycle has one."""
    return _add_ribbons(stage, path, _fewer_events(cycles, "stop_trajectory", period_s), STOP)


def add_groups(stage: Stage, path: str, cycles: Cycles, period_s: float) -> bool:
    """Shows `group_trajectories` (K, N, 3), ways past different sides of obstacles.

    Returns whether any cycle has some.
    """
    return _add_ribbons(stage, path, _fewer_events(cycles, "group_trajectories", period_s), GROUP)


def draw_prediction(stage: Stage, path: str, trajectory: Any) -> bool:
    """Draws a trajectory (N, 3) as a prediction; returns whether it has any length."""
    return _draw_ribbon(stage, path, np.asarray(trajectory, dtype=float), PREDICTED)


def _add_ribbons(
    stage: Stage, path: str, events: list[tuple[float, Mapping[str, Any]]], look: _Ribbon
) -> bool:
    shown: list[tuple[float, str | None]] = []
    for time_s, cycle in events:
        trajectories = np.asarray(cycle[look.key], dtype=float)
        if trajectories.ndim == SINGLE_TRAJECTORY_AXES:
            trajectories = trajectories[None]
        name = f"{path}/{frame_of(time_s)}"
        drawn = [
            _draw_ribbon(stage, f"{name}/{k}", trajectory, look)
            for k, trajectory in enumerate(trajectories)
        ]
        shown.append((time_s, name if any(drawn) else None))
    stage.take_turns(shown)
    return bool(shown)


def _draw_ribbon(stage: Stage, path: str, trajectory: Array, look: _Ribbon) -> bool:
    points = _coarse(trajectory[None])[0]
    mesh = ribbon(points, width_m=look.width_m, height_m=look.height_m)
    return stage.flat_mesh(path, mesh, look.rgba)


def add_samples(stage: Stage, path: str, cycles: Cycles, period_s: float) -> bool:
    """Shows `sampled_trajectories` (K, N, 3), coloured by `sampled_costs` (K,), NaN where refused.

    Of many samples only every n-th, in the order of cost, is drawn. Returns whether any cycle has
    some.
    """
    shown: list[tuple[float, str | None]] = []
    for time_s, cycle in _fewer_events(cycles, "sampled_trajectories", period_s):
        trajectories = np.asarray(cycle["sampled_trajectories"], dtype=float)
        costs = np.asarray(cycle.get("sampled_costs", np.zeros(len(trajectories))), dtype=float)
        name = f"{path}/{frame_of(time_s)}"
        for band, (rgba, indices) in enumerate(_bands_of_cost(costs)):
            _draw_lines(stage, f"{name}/{band}", trajectories[indices], rgba)
        shown.append((time_s, name))
    stage.take_turns(shown)
    return bool(shown)


def add_carrot(stage: Stage, path: str, cycles: Cycles, period_s: float) -> bool:
    """Shows `carrot` (2,), the point steered at; returns whether any cycle has one."""
    events = _events(cycles, "carrot", period_s)
    if events:
        stage.meshcat.SetObject(path, Sphere(CARROT_RADIUS_M), CARROT_COLOR)
    for time_s, cycle in events:
        pose = RigidTransform([*np.asarray(cycle["carrot"], dtype=float)[:2], CARROT_RADIUS_M])
        stage.pose(path, pose, frame_of(time_s))
    return bool(events)


def _events(cycles: Cycles, key: str, period_s: float) -> list[tuple[float, Mapping[str, Any]]]:
    having = [(time_s, cycle) for time_s, cycle in cycles if len(cycle.get(key, ()))]
    return spaced_in_time(having, period_s)


def _fewer_events(
    cycles: Cycles, key: str, period_s: float
) -> list[tuple[float, Mapping[str, Any]]]:
    """Returns at most MAX_SAMPLE_TURNS events with `key`, because their arrays are large."""
    span_s = cycles[-1][0] - cycles[0][0] if cycles else 0.0
    return _events(cycles, key, max(period_s, span_s / MAX_SAMPLE_TURNS))


def _bands_of_cost(costs: Array) -> list[tuple[Rgba, NDArray[np.int64]]]:
    """Returns colours with the indices of the samples to draw; samples of cost NaN come last."""
    by_cost = np.argsort(costs, kind="stable")
    chosen = by_cost[np.unique(np.linspace(0, len(costs) - 1, MAX_SAMPLES).astype(int))]
    accepted = chosen[np.isfinite(costs[chosen])]
    thirds = np.array_split(accepted, len(SAMPLE_COLORS))
    refused = chosen[len(accepted) :]
    return [*zip(SAMPLE_COLORS, thirds, strict=True), (REFUSED_COLOR, refused)]


def _coarse(trajectories: Array) -> Array:
    """Returns (K, M, 2) of (K, N, 3) with M at most MAX_POINTS, first and last point kept."""
    count = trajectories.shape[1]
    chosen = np.unique(np.linspace(0, count - 1, min(count, MAX_POINTS)).round().astype(int))
    return trajectories[:, chosen, :2]


def _draw_lines(stage: Stage, path: str, trajectories: Array, rgba: Rgba) -> None:
    if not len(trajectories):
        return
    points = _coarse(trajectories)
    heights = np.full((*points.shape[:2], 1), SAMPLES_HEIGHT_M)
    points = np.concatenate([points, heights], axis=2)
    stage.meshcat.SetLineSegments(
        path, points[:, :-1].reshape(-1, 3).T, points[:, 1:].reshape(-1, 3).T, rgba=rgba
    )
