"""The standing obstacles in the world of a trial, read from its log."""

from __future__ import annotations

import numpy as np
from pydantic import TypeAdapter

from drake_navbench.analysis.metrics.signals import Array
from drake_navbench.inputs.world import Obstacle
from drake_navbench.logs.log import TrialLog


def shapes_of(log: TrialLog) -> list[Obstacle]:
    """Returns the obstacles of a log, the walls of a map among them."""
    return TypeAdapter(list[Obstacle]).validate_python(log.obstacles)


def edges_within(edges: Array, low: Array, high: Array) -> Array:
    """Returns the edges (N, 4) whose bounding box overlaps a rectangle."""
    x, y = edges[:, [0, 2]], edges[:, [1, 3]]
    reaches = (x.max(axis=1) >= low[0]) & (x.min(axis=1) <= high[0])
    reaches &= (y.max(axis=1) >= low[1]) & (y.min(axis=1) <= high[1])
    return np.ascontiguousarray(edges[reaches])
