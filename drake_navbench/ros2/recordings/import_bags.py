"""Imports recordings into a results folder, where report, compare and replay take them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from drake_navbench.errors import InputError
from drake_navbench.inputs.drive import AckermannDrive
from drake_navbench.inputs.robot import Robot, load_robot
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder, file_name, only_run_in
from drake_navbench.navigation.costmaps.map_file import OccupancyMap, load_map
from drake_navbench.processes.version import __version__
from drake_navbench.ros2.recordings.decoded_messages import Cells, Steered
from drake_navbench.ros2.recordings.drive_data import DriveData, drive_data
from drake_navbench.ros2.recordings.drive_fit import DriveFit, as_yaml, fit_drive
from drake_navbench.ros2.recordings.gap_page import as_plain, write_curves, write_gap_page
from drake_navbench.ros2.recordings.reading import Piece, Recording, read_bag
from drake_navbench.ros2.recordings.recorded_columns import Column
from drake_navbench.ros2.recordings.recorded_motion import RecordedMotion, recorded_motion
from drake_navbench.ros2.recordings.recorded_tasks import (
    RecordedTask,
    task_by_hand,
    tasks_by_status,
)
from drake_navbench.ros2.recordings.recorded_trial import Subject, recorded_trial
from drake_navbench.ros2.recordings.simulation_gap import SimulationGap, simulation_gap
from drake_navbench.typed_files.output_file import write_text
from drake_navbench.typed_files.typed_yaml import validate

NANOSECONDS = 1e9
# The end of a column's name, after the controller that an exported bag names.
RECORDED = "recording"
# A slower robot stands still, m/s and rad/s.
STANDING_MPS, STANDING_RADPS = 0.01, 0.02
NO_ROBOT = "does not contain the robot's outline and limits; name its file with --robot"


class NoTasks(InputError):
    """A recording has no goals, and no times at which to cut it were given."""


@dataclass(frozen=True)
class ImportRequest:
    """The arguments of an import.

    topics: role -> topic. scenario, controller: names of the trials' scenario and column; '' for
    the recording's own. start_s, end_s: seconds from the beginning of the recording, between which
    it is one task; None: tasks are found. robot: name or file; may be None for an exported bag.
    fits_drive: whether to find the parameters of the drive. packages: folders searched for the
    packages that a robot's model names.
    """

    robot: str | None = None
    map_file: Path | None = None
    topics: Mapping[str, str] = field(default_factory=dict)
    namespace: str | None = None
    scenario: str = ""
    controller: str = ""
    start_s: float | None = None
    end_s: float | None = None
    fits_drive: bool = False
    packages: tuple[Path, ...] = ()


@dataclass(frozen=True)
class Imported:
    """The trials made of one recording. losses: the parts that could not be read.

    gaps: the simulation gap of each log; None where it has no commands. fit: the fitted parameters
    of the drive, where the user asked for them. drive: its commands and velocities; None where the
    recording has no commands.
    """

    path: Path
    logs: tuple[TrialLog, ...]
    topics: Mapping[str, str]
    losses: tuple[str, ...]
    gaps: tuple[SimulationGap | None, ...]
    fit: DriveFit | None
    drive: DriveData | None


def read_recording(path: Path, request: ImportRequest) -> Imported:
    """Returns the trials in a recording; raises InputError where it cannot be read as trials."""
    # The user's own files are read first, as a large recording takes minutes.
    given_robot = None
    if request.robot is not None:
        given_robot = load_robot(request.robot, packages=request.packages)
    given_map = None if request.map_file is None else load_map(request.map_file)
    needed = (("trial", NO_ROBOT),) if given_robot is None else ()
    piece = Piece(request.topics, request.namespace, request.start_s, request.end_s, needed)
    recording = read_bag(path, piece)
    told = _exported_trial(recording.columns)
    robot = given_robot or _exported_robot(path, told)
    columns, unsteered = _with_turn_rates(path, recording, robot)
    motion = recorded_motion(path, columns)
    tasks = _tasks(path, request, recording.start_ns, columns, motion)
    known_map = given_map or _recorded_map(columns, motion)
    losses = (*recording.losses, *unsteered)
    notes = {"topics": recording.topics, "losses": list(losses)}
    scenario, controller = path.stem, RECORDED
    if told is not None:
        scenario = told["info"]["scenario"]["name"]
        controller = f"{told['info']['controller']}-{RECORDED}"
    logs = [
        recorded_trial(
            path,
            columns,
            motion,
            task,
            Subject(
                scenario=request.scenario or scenario,
                controller=request.controller or controller,
                robot=robot,
                trial=number,
                description=f"recorded in {path.name}",
                map=known_map,
            ),
            told=told,
            notes=notes,
        )
        for number, task in enumerate(tasks)
    ]
    drive = drive_data(columns, motion)
    gaps = tuple(_gap(robot, drive, task) for task in tasks)
    for log, gap in zip(logs, gaps, strict=True):
        if gap is not None:
            log.info["recording"]["simulation_gap"] = as_plain(gap)
    fit = _fit(path, robot, drive) if request.fits_drive else None
    return Imported(path, tuple(logs), recording.topics, losses, gaps, fit, drive)


def _with_turn_rates(
    path: Path, recording: Recording, robot: Robot
) -> tuple[dict[str, Column], list[str]]:
    """Returns the columns with steering angles as turn rates of the robot, and a line on losses.

    For a robot without a wheelbase the commands are left out.
    """
    columns = recording.columns
    column = columns.get("command")
    if column is None or not any(isinstance(value, Steered) for value in column.values):
        return columns, []
    if not isinstance(robot.drive, AckermannDrive):
        others = {role: other for role, other in columns.items() if role != "command"}
        return others, [
            f"{path}: {recording.topics['command']} (command): steering angles need the wheelbase "
            "of a car; expected drive.type: ackermann in the robot file; left out"
        ]
    turned = [value.twist(robot.drive.wheelbase_m) for value in column.values]
    return {**columns, "command": column._replace(values=turned)}, []


def _fit(path: Path, robot: Robot, drive: DriveData | None) -> DriveFit:
    if robot.drive.turning_radius_m:
        raise InputError(f"{path}: --fit-drive: expected a robot that turns in place, got a car")
    if drive is None:
        raise InputError(f"{path}: --fit-drive: the recording has no commands")
    return fit_drive(drive)


def _gap(robot: Robot, drive: DriveData | None, task: RecordedTask) -> SimulationGap | None:
    if drive is None:
        return None
    piece = drive.within(task.begin_s, task.end_s)
    return simulation_gap(robot, piece) if len(piece.time_s) > 1 else None


def import_recordings(
    paths: Sequence[Path], request: ImportRequest, folder: ResultsFolder
) -> list[Imported]:
    """Adds the trials in recordings to a results folder, which is made if it is missing.

    All recordings are read before anything is written. Raises InputError where a recording is
    invalid, or where the path is not a results folder.
    """
    out = folder.path
    is_new = not out.exists() or (out.is_dir() and not any(out.iterdir()))
    manifest = _new_manifest() if is_new else folder.read_manifest()
    imported: list[Imported] = []
    taken: dict[tuple[str, str], int] = {}
    for path in paths:
        found = read_recording(path, request)
        logs = []
        for log in found.logs:
            column = (log.info["scenario"]["name"], log.info["controller"])
            number = taken.get(column, _first_free(folder, *column))
            taken[column] = number + 1
            logs.append(_numbered(log, number))
        imported.append(replace(found, logs=tuple(logs)))
    with only_run_in(folder.path):
        for entry in imported:
            for log, gap in zip(entry.logs, entry.gaps, strict=True):
                folder.write_log(log)
                if gap is not None:
                    write_curves(gap, folder.path_of(log))
            if entry.fit is not None:
                write_text(fit_path(folder, entry), as_yaml(entry.fit, entry.path.name))
        folder.write_manifest(_with_recordings(manifest, imported))
        write_gap_page(folder)
    return imported


def fit_path(folder: ResultsFolder, imported: Imported) -> Path:
    """Returns the path of the drive's parameters that were fitted to a recording."""
    return folder.path / "fitted_drives" / f"{file_name(imported.path.stem)}.yaml"


def _numbered(log: TrialLog, number: int) -> TrialLog:
    """Returns a log with a trial's number; a seed equal to the old number changes, too."""
    info = dict(log.info)
    if info["seed"] == info["trial"]:
        info["seed"] = number
    info["trial"] = number
    return replace(log, info=info)


def _first_free(folder: ResultsFolder, scenario: str, controller: str) -> int:
    number = 0
    while folder.log_path(scenario, controller, number).exists():
        number += 1
    return number


def _new_manifest() -> dict[str, Any]:
    return {
        "request": {},
        "scenarios": [],
        "controllers": [],
        "inputs": {},
        "drake_navbench": __version__,
    }


def _with_recordings(manifest: Mapping[str, Any], imported: Sequence[Imported]) -> dict[str, Any]:
    """Returns a manifest with the recordings added."""
    entries = [
        {
            "bag": str(entry.path),
            "topics": dict(entry.topics),
            "losses": list(entry.losses),
            "trials": [
                [log.info["scenario"]["name"], log.info["controller"], log.info["trial"]]
                for log in entry.logs
            ],
        }
        for entry in imported
    ]
    return dict(manifest) | {"recordings": [*manifest.get("recordings", ()), *entries]}


def _tasks(
    path: Path,
    request: ImportRequest,
    start_ns: int,
    columns: Mapping[str, Column],
    motion: RecordedMotion,
) -> list[RecordedTask]:
    last_s = float(motion.time_s[-1])
    if request.start_s is not None or request.end_s is not None:

        def moment(since_s: float) -> float:
            ns = np.array([start_ns + round(since_s * NANOSECONDS)], dtype=np.int64)
            return float(motion.clock.received(ns)[0])

        begin_s = motion.time_s[0] if request.start_s is None else moment(request.start_s)
        end_s = last_s if request.end_s is None else moment(request.end_s)
        begin_s = max(float(begin_s), float(motion.time_s[0]))
        return [task_by_hand(path, begin_s, min(end_s, last_s))]
    status = columns.get("status")
    if status is None or not status.values:
        raise NoTasks(
            f"{path}: no states of a goal, such as /navigate_to_pose/_action/status, to cut tasks "
            f"by; cut by hand with --start and --end{_motion_hint(motion, start_ns)}"
        )
    times = motion.clock.received(status.receive_ns)
    return tasks_by_status(path, status, times, last_s)


def _motion_hint(motion: RecordedMotion, start_ns: int) -> str:
    """Returns '; it moves from 1.0 to 11.0 s: --start 1.0 --end 11.0', seconds since start_ns.

    Returns '' where the robot never moves.
    """
    v, w, vy = np.abs(motion.twist).T
    moving = np.flatnonzero((v > STANDING_MPS) | (vy > STANDING_MPS) | (w > STANDING_RADPS))
    if not len(moving):
        return ""
    begin_s = float(motion.clock.received(np.array([start_ns], dtype=np.int64))[0])
    first, last = motion.time_s[moving[0]] - begin_s, motion.time_s[moving[-1]] - begin_s
    start, end = f"{max(first, 0.0):.1f}", f"{last:.1f}"
    return f"; it moves from {start} to {end} s: --start {start} --end {end}"


def _exported_trial(columns: Mapping[str, Column]) -> dict[str, Any] | None:
    """Returns the header of the exported trial in a bag of ours; None for any other bag."""
    column = columns.get("trial")
    if column is None or not column.values:
        return None
    with suppress(ValueError, RecursionError):
        told = json.loads(column.values[0])
        if isinstance(told, dict) and {"info", "events", "plan_legs"} <= set(told):
            return told
    return None


def _exported_robot(path: Path, told: Mapping[str, Any] | None) -> Robot:
    if told is None:
        raise InputError(f"{path}: {NO_ROBOT}")
    return validate(Robot, told["info"]["robot"], f"{path}: the trial's robot")


def _recorded_map(columns: Mapping[str, Column], motion: RecordedMotion) -> OccupancyMap | None:
    """Returns the recording's last map; None without a map, or where it is turned."""
    column = columns.get("map")
    if column is None or not column.values:
        return None
    cells: Cells = column.values[-1]
    place = motion.in_world(cells.frame, motion.time_s[:1])
    if place is None or abs(cells.origin[2]) > 0.0 or place[0].any():
        return None
    return OccupancyMap(cells.occupancy, cells.resolution, cells.origin[0], cells.origin[1])
