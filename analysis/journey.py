"""The legs of a trial and the navigator's actions over time; for trials with a navigator."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from drake_navbench.analysis.metrics.mission import ride_s
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
        "ComputePathToPose",
        "DriveOnHeading",
        "FollowPath",
        "SmoothPath",
        "Spin",
        "Wait",
    }
)
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


class Deed(NamedTuple):
    """An action of the navigator, done `count` times in a row from first_s to last_s, s."""

    first_s: float
    last_s: float
    text: str
    count: int  # type: ignore[assignment]  # nobody counts in it as in a tuple


def legs_of(log: TrialLog) -> list[Leg]:
    """Returns the legs that ended, in order; none where the trial had no navigator."""
    return [
        Leg(
            goal=tuple(leg["goal"]),
            outcome=leg["outcome"],
            reason=leg["reason"],
            start_s=leg["start_time_s"],
            duration_s=leg["end_time_s"] - leg["start_time_s"],
            driven_m=_driven_between(log, leg["start_time_s"], leg["end_time_s"]),
            recoveries=leg["recovery_count"],
            floor=leg.get("floor", ""),
            lift=leg.get("lift", ""),
            lift_s=ride_s(log, leg),
            clearance_m=_clearance_between(log, leg["start_time_s"], leg["end_time_s"]),
        )
        for leg in log.info.get("legs", [])
    ]


def deeds_of(log: TrialLog) -> list[Deed]:
    """Returns the navigator's actions in order; equal ones in a row are one entry with a count."""
    told = [(time_s, text) for time_s, event in log.events if (text := _text(event))]
    deeds = []
    for text, group in groupby(told, key=lambda pair: pair[1]):
        moments = [time_s for time_s, _ in group]
        deeds.append(Deed(moments[0], moments[-1], text, len(moments)))
    return deeds


def _text(event: Mapping[str, Any]) -> str:
    """Returns an event in words; '' for an event that is left out."""
    if "plan_id" in event:
        return NEW_PLAN
    if "lift" in event:
        return f"lift {event['lift']} {event['event']}"
    name, status = event["node"], event["status"]
    # A computed path is already listed as the new plan.
    is_told_otherwise = name == "ComputePathToPose" and status == "success"
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
