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
from drake_navbench.analysis.movers import movers_of
from drake_navbench.inputs.world import World
from drake_navbench.kernels.least_gap import Surroundings, least_gap
from drake_navbench.kernels.swept_contact import pose_within_step
from drake_navbench.logs.log import TrialLog

# Times that differ by less count as equal: rounding.
ROUNDING_S = 1e-9


def least_clearance_m(log: TrialLog, sampled_m: float) -> float:
    """Returns the least distance between footprint and obstacle over a trial, m.

    sampled_m: the least clearance at the samples; between samples it may be smaller. It is the
    result for a recording that does not contain the obstacles.
    """
    if "obstacles" in log.missing:
        return sampled_m
    time_s, states = _motion_of(log)
    outline = np.ascontiguousarray(outline_of(log))
    is_step = ~is_carried(log)[: len(time_s) - 1]
    around = _surroundings(log, states, reach_m=sampled_m + np.hypot(*outline.T).max())
    return float(least_gap(outline, time_s, states, is_step, around, sampled_m))


def _motion_of(log: TrialLog) -> tuple[Array, Array]:
    """Returns times (T,) s and states (T, 6) up to the end of the trial; the log goes on after it.

    A state is x m, y m, yaw rad, v m/s, w rad/s, vy m/s.
    """
    time_s, end_s = times(log), log.end_time_s
    names = ("x_m", "y_m", "yaw_rad", "v_mps", "w_radps")
    states = np.column_stack([*(column(log, name) for name in names), lateral_velocity(log)])
    count = max(int(np.searchsorted(time_s, end_s + ROUNDING_S, side="right")), 1)
    last, after = count - 1, min(count, len(time_s) - 1)
    if after == last or time_s[last] >= end_s - ROUNDING_S:
        # A copy: for the log's read-only times the kernel would be compiled once more.
        return time_s[:count].copy(), states[:count]
    duration_s = time_s[after] - time_s[last]
    share = (end_s - time_s[last]) / duration_s
    end = (1.0 - share) * states[last] + share * states[after]
    end[:3] = pose_within_step(states[last], states[after], duration_s, share)
    return np.append(time_s[:count], end_s), np.vstack([states[:count], end])


def _surroundings(log: TrialLog, states: Array, *, reach_m: float) -> Surroundings:
    """Returns the obstacles within reach of the trial's positions, and everything that moves."""
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
