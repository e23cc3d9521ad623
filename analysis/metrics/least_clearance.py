"""The least clearance of a trial, at and between the samples of its log."""

from __future__ import annotations

import numpy as np

from drake_navbench.analysis.metrics.body import outline_of
from drake_navbench.analysis.metrics.signals import (
    Array,
    column,
    is_carried,
    lateral_velocity,
    times,
)
from drake_navbench.analysis.metrics.standing import edges_within, shapes_of
from drake_navbench.analysis.moving import movers_of
from drake_navbench.inputs.world import World
from drake_navbench.kernels.least_gap import Surroundings, least_gap
from drake_navbench.log import TrialLog


def least_clearance_m(log: TrialLog, sampled_m: float) -> float:
    """Returns the least distance between footprint and obstacle over a trial, m.

    sampled_m: the least of the samples, which the motion in between may go below; where a recording
    does not tell the obstacles, that is all there is.
    """
    if "obstacles" in log.missing:
        return sampled_m
    states = np.column_stack(
        [
            *(column(log, name) for name in ("x_m", "y_m", "yaw_rad", "v_mps", "w_radps")),
            lateral_velocity(log),
        ]
    )
    outline = np.ascontiguousarray(outline_of(log))
    is_step = ~is_carried(log)
    around = _surroundings(log, states, reach_m=sampled_m + np.hypot(*outline.T).max())
    return float(least_gap(outline, times(log), states, is_step, around, sampled_m))


def _surroundings(log: TrialLog, states: Array, *, reach_m: float) -> Surroundings:
    """Returns what stands within a reach of the trial's positions, and all that moves."""
    world, movers = World(tuple(shapes_of(log))), movers_of(log)
    low, high = states[:, :2].min(axis=0), states[:, :2].max(axis=0)
    return Surroundings(
        edges_within(world.segments, low - reach_m, high + reach_m),
        world.circles,
        movers.bodies.edges,
        movers.bodies.discs,
        movers.tracks.knots,
        movers.tracks.firsts,
        movers.tracks.periods_s,
        movers.top_speed_mps,
    )
