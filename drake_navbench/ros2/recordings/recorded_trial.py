"""Makes the log of a trial from a piece of a recording.

A signal that the recording does not have leaves its columns empty, and the log says why under
`missing`; metrics then have no value, with that reason.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from drake_navbench.errors import InputError
from drake_navbench.inputs.map_world import occupied_boxes
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.inputs.world import Obstacle
from drake_navbench.kernels.arrays import Array
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.plans import Plan, as_logged
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.ros2.recordings.recorded_columns import Column
from drake_navbench.ros2.recordings.recorded_motion import RecordedMotion
from drake_navbench.ros2.recordings.recorded_piece import POSE_COLUMNS, RecordedPiece
from drake_navbench.ros2.recordings.recorded_tasks import RecordedTask
from drake_navbench.typed_files.quantities import MAX_LENGTH_M

# Walls farther from the robot's way than this are left out of the log, m.
MAP_REACH_M = 6.0


@dataclass(frozen=True)
class Subject:
    """The names, the robot and the map that a recording's user gives beside the recording.

    controller: the name of the column. map: the map of the place, None where none is given.
    """

    scenario: str
    controller: str
    robot: Robot
    trial: int
    description: str
    map: OccupancyMap | None = None


def recorded_trial(
    path: Path,
    columns: Mapping[str, Column],
    motion: RecordedMotion,
    task: RecordedTask,
    subject: Subject,
    *,
    told: Mapping[str, Any] | None = None,
    notes: Mapping[str, Any] | None = None,
) -> TrialLog:
    """Returns the log of one task; raises InputError where it has no pose.

    told: the header of the original trial, if the bag is an export of ours. notes: further entries
    of the log's header.
    """
    piece = RecordedPiece(columns, motion, task)
    if len(piece.time_s) < 2:
        raise InputError(
            f"{path}: the task from {task.begin_s:.3f} to {task.end_s:.3f} s has "
            f"{len(piece.time_s)} poses, expected at least 2"
        )
    missing: dict[str, str] = {}
    costmaps, distances = piece.costmaps(missing)
    moves_sideways = subject.robot.drive.lateral_speed_mps > 0.0
    samples = piece.samples(distances, missing, moves_sideways=moves_sideways)
    plans = piece.plans(missing)
    scans = piece.scans(missing)
    info = (
        _told_info(told, subject, missing)
        if told
        else _info(piece, subject, plans, missing, samples)
    )
    info |= {
        "controller": subject.controller,
        "trial": subject.trial,
        "start_time_s": task.start_s - task.begin_s,
        "end_time_s": task.end_s - task.begin_s,
        "missing": missing,
        "recording": {
            "bag": path.name,
            "begin_s": task.begin_s,
            "end_s": task.end_s,
            "pose": motion.source,
            "scanner": piece.scanner_place,
        }
        | dict(notes or {}),
    }
    info["identity"] = _identity(info, samples)
    if told and len(told["plan_legs"]) == len(plans):
        plans = [
            Plan(plan.time_s, plan.poses, leg)
            for plan, leg in zip(plans, told["plan_legs"], strict=True)
        ]
    events = [dict(event) for event in told["events"]] if told else []
    return TrialLog(
        samples=samples,
        plans=as_logged(plans),
        info=info,
        scans=scans,
        costmaps=costmaps,
        events=tuple((event.pop("time_s"), event) for event in events),
    )


def _info(
    piece: RecordedPiece,
    subject: Subject,
    plans: Sequence[Plan],
    missing: dict[str, str],
    samples: pd.DataFrame,
) -> dict[str, Any]:
    """Returns the header of a log, made of the messages alone."""
    path = samples[list(POSE_COLUMNS)].to_numpy()
    goal = piece.goal(plans, missing)
    end_s = float(samples["time_s"].iloc[-1])
    reach_m = float(np.abs(np.vstack([path, goal])[:, :2]).max())
    if reach_m > MAX_LENGTH_M:
        raise InputError(
            f"{subject.description}: poses reach {reach_m:.6g} m from the origin of their frame, "
            f"expected at most {MAX_LENGTH_M:g} m"
        )
    scenario = Scenario(
        name=subject.scenario,
        description=subject.description,
        start=tuple(path[0].tolist()),
        goal=tuple(np.asarray(goal, dtype=float).tolist()),
        timeout_s=max(end_s, 1.0),
    )
    walls = _walls_near(subject.map, path) if subject.map is not None else []
    if subject.map is None:
        missing["map"] = "no map was given, and the recording has none"
    missing["obstacles"] = "a recording does not contain the true positions of all obstacles"
    outcome, reason = _outcome(piece, subject.robot, path[-1], goal, missing)
    return {
        "scenario": scenario.model_dump(mode="json"),
        "obstacles": [wall.model_dump(mode="json") for wall in walls],
        "robot": subject.robot.model_dump(mode="json"),
        "controller_plugin": "",
        "parameters": {},
        "seed": subject.trial,
        "outcome": str(outcome),
        "reason": reason,
        "error_code": 0,
        "details": {},
        "traceback": "",
    }


def _told_info(
    told: Mapping[str, Any], subject: Subject, missing: dict[str, str]
) -> dict[str, Any]:
    """Returns the header of the exported trial, for its recording."""
    info = dict(told["info"])
    info["scenario"] = dict(info["scenario"]) | {"name": subject.scenario}
    missing.pop("costmap", None)
    return info


def _outcome(
    piece: RecordedPiece, robot: Robot, end: Array, goal: Array, missing: Mapping[str, str]
) -> tuple[Outcome, str]:
    task = piece.task
    if task.outcome is not None:
        return task.outcome, task.reason
    if "goal" in missing:
        return Outcome.TIMED_OUT, "cut by hand; the recording has no goal"
    left_m = float(np.hypot(*(end - goal)[:2]))
    tolerance_m = robot.navigation.goal_checker.xy_goal_tolerance
    said = f"cut by hand; {left_m:.3f} m from the goal at the end, tolerance {tolerance_m:g} m"
    return (Outcome.SUCCEEDED if left_m <= tolerance_m else Outcome.TIMED_OUT), said


def _walls_near(grid: OccupancyMap, path: Array) -> list[Obstacle]:
    """Returns the occupied cells of a map near a path, as boxes."""
    low = path[:, :2].min(axis=0) - MAP_REACH_M
    high = path[:, :2].max(axis=0) + MAP_REACH_M
    rows, columns = grid.occupancy.shape
    corner = np.array([grid.origin_x, grid.origin_y])
    first = np.clip(((low - corner) // grid.resolution).astype(int), 0, [columns, rows])
    past = np.clip(((high - corner) // grid.resolution).astype(int) + 1, 0, [columns, rows])
    part = OccupancyMap(
        np.ascontiguousarray(grid.occupancy[first[1] : past[1], first[0] : past[0]]),
        grid.resolution,
        grid.origin_x + first[0] * grid.resolution,
        grid.origin_y + first[1] * grid.resolution,
        files=grid.files,
    )
    return list(occupied_boxes(part)) if part.is_occupied.any() else []


def _identity(info: Mapping[str, Any], samples: pd.DataFrame) -> str:
    """Returns a digest of the recorded header and samples."""
    digest = sha256(json.dumps(info, sort_keys=True).encode())
    digest.update(np.ascontiguousarray(samples.to_numpy(dtype=float)).tobytes())
    return digest.hexdigest()
