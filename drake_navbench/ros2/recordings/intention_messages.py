"""The messages of a controller's intentions: its prediction, its samples and its carrot."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from drake_navbench.kernels.arrays import Array
from drake_navbench.ros2.recordings import topics
from drake_navbench.ros2.recordings.messages import (
    LINE_LIST,
    LINE_STRIP,
    LineStyle,
    MessageMaker,
    Rgba,
)
from drake_navbench.ros2.recordings.topics import Message

LINE_WIDTH_M, THIN_LINE_WIDTH_M = 0.03, 0.01
REFUSED_RGBA: Rgba = (0.9, 0.6, 0.58, 0.6)
# The colours of the cheap, the middling and the costly third of the samples.
SAMPLE_RGBAS: tuple[Rgba, ...] = (
    (0.13, 0.4, 0.67, 1.0),
    (0.45, 0.66, 0.82, 0.8),
    (0.76, 0.82, 0.87, 0.6),
)
PREDICTED = LineStyle("predicted", LINE_STRIP, LINE_WIDTH_M, (0.8, 0.1, 0.1, 1.0))
SAMPLED = LineStyle("sampled", LINE_LIST, THIN_LINE_WIDTH_M, SAMPLE_RGBAS[0])


def intentions(
    make: MessageMaker, now: int, frame: str, left: Mapping[str, Any]
) -> Iterator[Message]:
    """Yields the trajectories and the carrot among a controller's diagnostics.

    now: the stamp, ns. frame: that of the pose that the controller got. left: the diagnostics of a
    cycle.
    """
    if len(left.get("predicted_trajectory", ())):
        points = np.asarray(left["predicted_trajectory"], dtype=float)[:, :2]
        yield topics.PREDICTED, now, make.lines(now, frame, points, PREDICTED)
    if len(left.get("sampled_trajectories", ())):
        points, colors = _sampled_lines(left)
        yield topics.SAMPLED, now, make.lines(now, frame, points, SAMPLED, colors)
    if len(left.get("carrot", ())):
        x, y = np.asarray(left["carrot"], dtype=float)[:2].tolist()
        header, point = make.header(now, frame), make.point(x, y)
        carrot = make.make("geometry_msgs/msg/PointStamped", header=header, point=point)
        yield topics.LOOKAHEAD, now, carrot


def _sampled_lines(left: Mapping[str, Any]) -> tuple[Array, list[Rgba]]:
    """Returns sampled trajectories as (P, 2) pairs of points with a colour a point, by cost."""
    trajectories = np.asarray(left["sampled_trajectories"], dtype=float)[:, :, :2]
    costs = np.asarray(
        [math.nan if cost is None else cost for cost in left.get("sampled_costs", ())], dtype=float
    )
    if len(costs) != len(trajectories):
        costs = np.zeros(len(trajectories))
    order = np.argsort(costs, kind="stable")
    rank = np.empty(len(order), dtype=int)
    rank[order] = np.arange(len(order))
    accepted = max(int(np.isfinite(costs).sum()), 1)
    pieces = np.stack([trajectories[:, :-1], trajectories[:, 1:]], axis=2)
    points_each = 2 * (trajectories.shape[1] - 1)
    colors: list[Rgba] = []
    for index, cost in enumerate(costs):
        third = min(len(SAMPLE_RGBAS) * rank[index] // accepted, len(SAMPLE_RGBAS) - 1)
        rgba = SAMPLE_RGBAS[third] if math.isfinite(cost) else REFUSED_RGBA
        colors += [rgba] * points_each
    return pieces.reshape(-1, 2), colors
