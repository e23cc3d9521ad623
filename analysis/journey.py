"""The legs of a trial and the navigator's actions over time; for trials with a navigator."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from drake_navbench.analysis.metrics.mission import leads_through_poses, leg_ends_s, ride_s
from drake_navbench.analysis.metrics.signals import column, poses_at, times
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.logs.log import TrialLog

# The nodes of Nav2's trees that act; the other nodes only choose among these. A node's name may end
# in its place in the tree, such as ClearLocalCostmap-Context.
ACTIONS = frozenset(
    {
        "BackUp",
        "ClearGlobalCostmap",
        "ClearLocalCostmap",
        "ComputePathThroughPoses",
        "ComputePathToPose",
        "DriveOnHeading",
        "FollowPath",
        "SmoothPath",
        "Spin",
        "Wait",
    }
)
PLANNING = ("ComputePathToPose", "ComputePathThroughPoses")
STATUS_WORDS = {"running": "begins", "success": "succeeds", "failure": "fails"}
NEW_PLAN = "new plan"


class Leg(NamedTuple):
    """The way to one goal.

    goal: x m, y m, yaw rad. driven_m: length of the true path. recoveries: number of started
    recovery actions. floor: its name, where there are several floors. lift: the name of the lift to
    which the leg led, '' for none. lift_s: time from calling the lift until leaving it.
    clearance_m: the least one, inf beyond 5 m.
    """

    goal: tuple[float, ...]
    outcome: str
    reason: str
    start_s: float
    duration_s: float
    driven_m: float
    recoveries: int
    floor: str = ""
    lift: str = ""
    lift_s: float = 0.0
    clearance_m: float = math.inf


class Action(NamedTuple):
    """An action of the navigator, done `count` times in a row between first_s and last_s."""

    first_s: float
    last_s: float
    text: str
    count: int  # type: ignore[assignment]  # nobody counts in it as in a tuple


def legs_of(log: TrialLog) -> list[Leg]:
    """Returns the legs that ended, in order; none where the trial had no navigator.

    A leg of navigate_through_poses ends where the robot is nearest to its pose; see `leg_ends_s`.
    """
    legs, ends = log.info.get("legs", []), leg_ends_s(log)
    goes_through = leads_through_poses(log)
    starts = [legs[0]["start_time_s"], *ends] if goes_through and legs else []
    found = []
    for index, (leg, end_s) in enumerate(zip(legs, ends, strict=True)):
        start_s = starts[index] if goes_through else leg["start_time_s"]
        found.append(
            Leg(
                goal=tuple(leg["goal"]),
                outcome=leg["outcome"],
                reason=_reason(log, leg, end_s) if goes_through else leg["reason"],
                start_s=start_s,
                duration_s=end_s - start_s,
                driven_m=_driven_between(log, start_s, end_s),
                recoveries=leg["recovery_count"],
                floor=leg.get("floor", ""),
                lift=leg.get("lift", ""),
                lift_s=ride_s(log, leg),
                clearance_m=_clearance_between(log, start_s, end_s),
            )
        )
    return found


def _reason(log: TrialLog, leg: Mapping[str, Any], end_s: float) -> str:
    """Returns the reason for the end of a leg; for a pose that was passed with its distance."""
    if leg["outcome"] != "succeeded" or len(log.samples) == 0:
        return str(leg["reason"])
    (at,) = poses_at(log, np.array([end_s]))
    return f"{leg['reason']}, {math.dist(at[:2], leg['goal'][:2]):.2f} m away"


def actions_of(log: TrialLog) -> list[Action]:
    """Returns the navigator's actions in order; equal ones in a row are one entry with a count."""
    told = [(time_s, text) for time_s, event in log.events if (text := _text(event))]
    actions = []
    for text, group in groupby(told, key=lambda pair: pair[1]):
        moments = [time_s for time_s, _ in group]
        actions.append(Action(moments[0], moments[-1], text, len(moments)))
    return actions


def _text(event: Mapping[str, Any]) -> str:
    """Returns an event in words; '' for an event that is left out."""
    if "plan_id" in event:
        return NEW_PLAN
    if "lift" in event:
        return f"lift {event['lift']} {event['event']}"
    name, status = event["node"], event["status"]
    # A computed path is already listed as the new plan.
    is_told_otherwise = name in PLANNING and status == "success"
    if name.partition("-")[0] not in ACTIONS or status not in STATUS_WORDS or is_told_otherwise:
        return ""
    return f"{name} {STATUS_WORDS[status]}"


def _driven_between(log: TrialLog, start_s: float, end_s: float) -> float:
    """Returns the driven length between two moments, linear between samples, m."""
    if len(log.samples) == 0:
        return 0.0
    time_s = times(log)
    inside = time_s[(time_s > start_s) & (time_s < end_s)]
    return path_length(poses_at(log, np.concatenate([[start_s], inside, [end_s]]))[:, :2])


def _clearance_between(log: TrialLog, start_s: float, end_s: float) -> float:
    """Returns the least clearance between two moments, m; inf where nothing was near."""
    if len(log.samples) == 0:
        return math.inf
    time_s = times(log)
    inside = (time_s >= start_s) & (time_s <= end_s)
    return float(np.nanmin(column(log, "clearance_m")[inside], initial=math.inf))
