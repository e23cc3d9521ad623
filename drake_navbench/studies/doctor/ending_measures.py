"""Measures of a drive at its goal and at its end."""

from __future__ import annotations

import numpy as np

from drake_navbench.logs.outcome import Outcome
from drake_navbench.studies.doctor.drive_signals import NEAR_GOAL_M
from drake_navbench.studies.doctor.drives import STANDS_MPS, STANDS_RADPS, Drive

# A task that ends because every command was refused is a weak sign of a robot that gives up or gets
# stuck: where no recovery was tried, all of it may be a stop before a door.
REFUSAL = 0.4
# Who comes nearer to its goal by this share of the speed that is asked for, in the last seconds of
# a drive, is under way, and only the time was short.
UNDER_WAY, LAST_S = 0.5, 3.0


def beyond_goal(d: Drive) -> float:
    """The distance beyond the tolerance that the robot leaves the goal again, m."""
    inside = np.flatnonzero(d.to_goal_m < d.tolerance_m)
    if not len(inside):
        return 0.0
    return max(0.0, float(d.to_goal_m[inside[0] :].max()) - d.tolerance_m)


def hunting(d: Drive) -> float:
    """Number of reversals near the goal, of driving or of turning."""
    near = d.to_goal_m < max(NEAR_GOAL_M, 2.0 * d.tolerance_m)
    count = 0
    for signal, least in ((d.v_mps, 2 * STANDS_MPS), (d.w_radps, 2 * STANDS_RADPS)):
        signs = np.sign(signal[near & (np.abs(signal) > least)])
        count += int((np.diff(signs) != 0).sum())
    return float(count)


def gave_up(d: Drive) -> float:
    """1 if the robot gives a task up that can be done; less after a command that was refused."""
    if d.outcome is not Outcome.ABORTED or d.is_impossible:
        return 0.0
    return REFUSAL if d.is_refused else 1.0


def goes_on(d: Drive) -> float:
    """1 if the robot still tries at the end of a task that cannot be done."""
    return float(d.outcome is Outcome.TIMED_OUT and d.is_impossible)


def _is_under_way(d: Drive) -> bool:
    count = round(LAST_S / d.step_s)
    if len(d.to_goal_m) <= count:
        return False
    nearer_m = float(d.to_goal_m[-1 - count] - d.to_goal_m[-1])
    return nearer_m >= UNDER_WAY * LAST_S * max(d.asked_mps, 0.1)


def not_there(d: Drive) -> float:
    """1 if the time ends near the goal, and the robot does not count as arrived."""
    if d.is_impossible or d.outcome is not Outcome.TIMED_OUT or _is_under_way(d):
        return 0.0
    return float(d.to_goal_m[-1] < max(1.0, 2.0 * d.tolerance_m))


def stuck(d: Drive) -> float:
    """1 if the time ends far from the goal, and the robot is not under way."""
    if d.is_impossible or d.to_goal_m[-1] < max(1.0, 2.0 * d.tolerance_m):
        return 0.0
    if d.outcome is Outcome.TIMED_OUT:
        return float(not _is_under_way(d))
    return float(d.recovers or REFUSAL) if d.is_refused else 0.0
