"""The legs of a trial: their goals in order, and the length of the first plan to each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from drake_navbench.analysis.metrics.definition import Undefined
from drake_navbench.analysis.metrics.signals import (
    is_carried,
    poses_at,
    positions,
    stretches,
    times,
)
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.plans import Plan

# A plan comes to a pose where it is nearer than this to its nearest point, m: a map's cell.
AT_POSE_M = 0.05
GAVE_UP = (Outcome.ABORTED, Outcome.ERROR)


def goals(log: TrialLog) -> Array:
    """Returns the waypoints and then the goal, (G, 3): x m, y m, yaw rad.

    For a recording without a goal (see `require`) the goal is the robot's last pose.
    """
    scenario = log.info["scenario"]
    return np.array([*scenario.get("waypoints", ()), scenario["goal"]], dtype=float)


def reached_every_goal(log: TrialLog) -> bool:
    """Returns whether the trial succeeded and missed no waypoint on its way.

    Nav2's waypoint follower may go on after a missed waypoint, and then reports success.
    """
    missed = any(leg["outcome"] != "succeeded" for leg in _legs(log))
    return log.outcome is Outcome.SUCCEEDED and not missed


def present_leg(log: TrialLog) -> int:
    """Returns the number, from 0, of the leg that the robot was on at the end of the trial."""
    ended = len(_legs(log))
    # A mission that gives up does so at the end of a leg whose goal it did not reach.
    under_way = ended - 1 if log.outcome in GAVE_UP else ended
    return min(max(under_way, 0), len(goals(log)) - 1)


def leads_through_poses(log: TrialLog) -> bool:
    """Returns whether one plan led through all goals (mode navigate_through_poses)."""
    return bool(log.info["scenario"].get("navigation_mode") == "navigate_through_poses")


def leg_ends_s(log: TrialLog) -> list[float]:
    """Returns the end of each leg that ended, s.

    A pose of navigate_through_poses is passed where the robot is nearest to it, after the pose
    before and before the navigator ends the leg to the next one: the navigator checks only now and
    then which poses are passed, and near the last one not at all.
    """
    legs = _legs(log)
    ends = [float(leg["end_time_s"]) for leg in legs]
    if not leads_through_poses(log) or len(log.samples) == 0:
        return ends
    time_s, path = times(log), positions(log)
    since_s, untils_s = float(time_s[0]), [*ends[1:], float(time_s[-1])]
    for index, leg in enumerate(legs[: len(goals(log)) - 1]):
        if leg["outcome"] == "succeeded":
            rows = np.flatnonzero((time_s >= since_s) & (time_s <= max(untils_s[index], since_s)))
            distances_m = np.hypot(*(path[rows] - leg["goal"][:2]).T)
            since_s = float(time_s[rows[np.argmin(distances_m)]])
            ends[index] = since_s
        elif index + 1 < len(legs):  # The navigator left the pose out.
            ends[index] = since_s
    return ends


def plans_of_legs(log: TrialLog) -> tuple[Plan, ...]:
    """Returns the plan of each leg: the first plan that was made in it.

    In navigate_through_poses the legs are the parts of the very first plan between the poses. A
    part ends at its first point within 0.05 m of the least distance to its pose.
    """
    if not leads_through_poses(log) or not log.first_plans:
        return log.first_plans
    plan, begin, parts = log.first_plans[0], 0, []
    starts = [plan.time_s, *leg_ends_s(log)]
    for leg, goal in enumerate(goals(log)):
        distances_m = np.hypot(*(plan.poses[begin:, :2] - goal[:2]).T)
        end = begin + int((distances_m <= distances_m.min() + AT_POSE_M).argmax())
        if leg + 1 == len(goals(log)):
            end = len(plan.poses) - 1
        part = plan.poses[begin : end + 1]
        parts.append(Plan(starts[min(leg, len(starts) - 1)], part, leg))
        begin = end
    return tuple(parts)


def straight_way_m(log: TrialLog) -> float:
    """Returns the sum over the legs of the straight distance from a leg's start to its end, m."""
    whole_m, ends = 0.0, leg_ends_s(log)[: present_leg(log)]
    parts = stretches(log)
    changes = times(log)[1:][is_carried(log)]
    for part, since_s, until_s in zip(parts, [-np.inf, *changes], [*changes, np.inf], strict=True):
        between = poses_at(log, [end for end in ends if since_s <= end < until_s])[:, :2]
        whole_m += path_length(np.vstack([part[:1], between, part[-1:]]))
    return whole_m


def straight_ways_to_goals(log: TrialLog) -> list[Array]:
    """Returns the corners of the straight way through all goals, (K, 2) m for each floor."""
    corners, parts = [positions(log)[0]], []
    for goal, leg in zip(goals(log), _mission_of(log), strict=True):
        corners.append(goal[:2])
        if "arrival" in leg:
            parts.append(np.array(corners))
            corners = [np.array(leg["arrival"][:2])]
    return [*parts, np.array(corners)]


def straight_way_left_m(log: TrialLog) -> float:
    """Returns the straight distance from the trial's last position through all open goals, m."""
    present, legs = present_leg(log), _mission_of(log)
    corners, left_m = [positions(log)[-1]], 0.0
    if "floor" in legs[present] and legs[present]["floor"] != floor_at_end(log):
        # The robot waits for the lift to the floor of this leg, or rides in it.
        corners = [np.array(legs[present - 1]["arrival"][:2])]
    for goal, leg in zip(goals(log)[present:], legs[present:], strict=True):
        corners.append(goal[:2])
        if "arrival" in leg:
            left_m += path_length(np.array(corners))
            corners = [np.array(leg["arrival"][:2])]
    return left_m + path_length(np.array(corners))


def floor_at_end(log: TrialLog) -> str:
    """Returns the name of the floor on which a mission ended; '' for a task on one map."""
    if "floor" not in log.samples.columns:
        return ""
    return str(log.info["floors"][int(log.samples["floor"].iloc[-1])]["name"])


def floor_of_leg(log: TrialLog, leg: int) -> int:
    """Returns the index of the floor on which a leg of a mission begins."""
    names = [floor["name"] for floor in log.info["floors"]]
    return names.index(_mission_of(log)[leg]["floor"])


def ended_on_other_floor(log: TrialLog) -> bool:
    """Returns whether a mission ended on another floor than its last leg's destination."""
    last = _mission_of(log)[-1]
    return last.get("to", last.get("floor", "")) != floor_at_end(log)


def first_plans_length_m(log: TrialLog) -> float:
    """Returns the length of the first plans of all legs; raises Undefined where there is none."""
    plans = plans_of_legs(log)
    if not any(len(plan.poses) > 1 for plan in plans):
        raise Undefined("there is no plan")
    return sum(path_length(plan.poses) for plan in plans)


def leg_lengths_m(log: TrialLog) -> Array:
    """Returns the length of each leg's first plan, (G,) m.

    For a leg without a plan it is the straight distance from the previous goal (for the first leg,
    from the start) to the leg's goal.
    """
    parts = straight_ways_to_goals(log)
    lengths = np.concatenate([np.hypot(*np.diff(part, axis=0).T) for part in parts])
    for plan in plans_of_legs(log):
        lengths[plan.leg] = path_length(plan.poses)
    return lengths


def ride_s(log: TrialLog, leg: Mapping[str, Any]) -> float:
    """Returns the time of waiting and riding after a finished leg, s; 0 without a ride."""
    end_s = leg.get("ride_end_s")
    return 0.0 if end_s is None else min(end_s, log.end_time_s) - leg["end_time_s"]


def _mission_of(log: TrialLog) -> list[dict[str, Any]]:
    """Returns the log header's entry of each leg of a mission; {} for each goal of other tasks."""
    nothing: list[dict[str, Any]] = [{} for _ in goals(log)]
    return log.info.get("mission", nothing)


def _legs(log: TrialLog) -> list[dict[str, Any]]:
    """Returns the legs that ended; [] in the mode follow_path."""
    return log.info.get("legs", [])
