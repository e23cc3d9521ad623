"""What a trial was to do: its goals one after another, and how far the first plan to each was."""

from __future__ import annotations

from typing import Any

import numpy as np

from drake_navbench.analysis.metrics.definition import Undefined
from drake_navbench.analysis.metrics.signals import Array, positions, require, times
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.log import Outcome, TrialLog

GAVE_UP = (Outcome.ABORTED, Outcome.ERROR)


def goals(log: TrialLog) -> Array:
    """Returns (G, 3) the waypoints and then the goal, x m, y m, yaw rad.

    Raises Undefined where a recording tells of no goal.
    """
    require(log, "goal")
    scenario = log.info["scenario"]
    return np.array([*scenario.get("waypoints", ()), scenario["goal"]], dtype=float)


def reached_every_goal(log: TrialLog) -> bool:
    """Returns whether the trial succeeded and missed no waypoint on its way.

    Nav2's waypoint follower reports success in spite of missed waypoints where it may go on.
    """
    missed = any(leg["outcome"] != "succeeded" for leg in _legs(log))
    return log.outcome is Outcome.SUCCEEDED and not missed


def present_leg(log: TrialLog) -> int:
    """Returns the number, from 0, of the leg that the robot was on at the end of the trial."""
    ended = len(_legs(log))
    # A mission that gives up does so at the end of a leg, whose goal it did not reach.
    under_way = ended - 1 if log.outcome in GAVE_UP else ended
    return min(max(under_way, 0), len(goals(log)) - 1)


def positions_between_legs(log: TrialLog) -> Array:
    """Returns (L, 2) where the robot was at the start, between two legs, and at the end, m."""
    path = positions(log)
    ends = [leg["end_time_s"] for leg in _legs(log)[: present_leg(log)]]
    between = [np.interp(ends, times(log), path[:, axis]) for axis in range(2)]
    return np.vstack([path[:1], np.column_stack(between), path[-1:]])


def first_plans_length_m(log: TrialLog) -> float:
    """Returns the length of the first plans of all legs; raises Undefined where there is none."""
    if not any(len(plan.poses) > 1 for plan in log.first_plans):
        raise Undefined("there is no plan")
    return sum(path_length(plan.poses) for plan in log.first_plans)


def leg_lengths_m(log: TrialLog) -> Array:
    """Returns (G,) the length of each leg's first plan, or where it has none the straight way.

    The straight way begins at the goal before, that of the first leg where the robot started.
    """
    corners = np.vstack([positions(log)[:1], goals(log)[:, :2]])
    lengths = np.hypot(*np.diff(corners, axis=0).T)
    for plan in log.first_plans:
        lengths[plan.leg] = path_length(plan.poses)
    return lengths


def _legs(log: TrialLog) -> list[dict[str, Any]]:
    """Returns the legs that ended, none in the mode follow_path."""
    return log.info.get("legs", [])
