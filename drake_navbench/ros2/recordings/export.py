"""Exports the trials of a results folder, or one log, in the formats asked for."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from drake_navbench.errors import InputError, NavbenchError
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.logs.text_tables import csv_text
from drake_navbench.processes.tasks import Task
from drake_navbench.processes.worker_process import Raised, Returned
from drake_navbench.processes.workers import run_tasks, start_server
from drake_navbench.ros2.recordings.bag_file import write_bag
from drake_navbench.ros2.recordings.messages import MessageMaker
from drake_navbench.ros2.recordings.rosbags_extra import require_rosbags
from drake_navbench.ros2.recordings.trial_messages import TrialMessages
from drake_navbench.typed_files.output_file import write_text

EXPORT_FOLDER = "export"
# Prepared layouts for the topics, which one opens by hand in a viewer.
LAYOUTS = ("foxglove_layout.json", "plotjuggler_layout.xml")
# Trajectory -> columns of a log; evo compares the second with the first.
TRAJECTORIES = {
    "truth": ("x_m", "y_m", "yaw_rad"),
    "estimate": ("estimated_x_m", "estimated_y_m", "estimated_yaw_rad"),
}


@dataclass(frozen=True)
class Formats:
    """The files to write for each trial.

    mcap: a bag of ROS 2. csv: the samples. tum: the trajectories.
    """

    mcap: bool = False
    csv: bool = False
    tum: bool = False


def export(source: Path, formats: Formats, out: Path | None, *, jobs: int) -> list[Path]:
    """Exports a log or all logs of a results folder; returns what was written for each trial.

    out: the folder to write into; `EXPORT_FOLDER` in the results folder, or the log's own, where
    not given. Raises InputError where the source is neither, a log cannot be read or has nothing
    to show, or a file cannot be written; trials before it are exported then.
    """
    if not any((formats.mcap, formats.csv, formats.tum)):
        raise InputError("nothing to export: expected --mcap, --csv or --tum")
    if formats.mcap:
        require_rosbags()
    stems = _stems(source, out)
    tasks = [(path, stem, formats) for path, stem in stems.items()]
    written: list[Path] = []
    for entry in _one_by_one(tasks) if len(tasks) == 1 or jobs == 1 else _apart(tasks, jobs):
        written += entry
    if formats.mcap:
        _write_layouts(out or (source / EXPORT_FOLDER if source.is_dir() else source.parent))
    return sorted(written)


def export_trial(log_path: Path, stem: Path, formats: Formats) -> list[Path]:
    """Writes a log in the chosen formats; returns the paths of the files.

    stem: the path of the files without suffix.
    """
    log = TrialLog.read(log_path)
    if log.samples.empty:
        raise InputError(f"{log_path}: the trial ended before its first sample; nothing to export")
    written = []
    paths = plain_paths(stem)
    if formats.mcap:
        write_bag(stem, TrialMessages(log, MessageMaker()))
        written.append(stem)
    if formats.csv:
        write_text(paths["csv"], csv_text(log.samples))
        written.append(paths["csv"])
    if formats.tum:
        for name in TRAJECTORIES:
            write_text(paths[name], tum_of(log, name))
            written.append(paths[name])
    return written


def _stems(source: Path, out: Path | None) -> dict[Path, Path]:
    """Returns for each log the path of its files without suffix."""
    if not source.is_dir():
        if not source.is_file():
            raise InputError(f"{source}: no such file or folder")
        return {source: (out or source.parent) / source.stem}
    ResultsFolder(source).read_manifest()
    trials = source / "trials"
    logs = sorted(trials.glob("*/*/trial_*.parquet"))
    if not logs:
        raise InputError(f"{source}: no trial logs below {trials}")
    folder = out or source / EXPORT_FOLDER
    return {log: folder / log.relative_to(trials).with_suffix("") for log in logs}


def _one_by_one(tasks: Sequence[tuple[Path, Path, Formats]]) -> Iterator[list[Path]]:
    yield from (export_trial(*task) for task in tasks)


def _apart(tasks: Sequence[tuple[Path, Path, Formats]], jobs: int) -> Iterator[list[Path]]:
    """Exports trials in `jobs` worker processes; yields the paths that each has written.

    Raises the error that a worker raised.
    """
    start_server([__name__])
    with closing(run_tasks([Task(export_trial, task) for task in tasks], jobs=jobs)) as endings:
        for task, ending in endings:
            if isinstance(ending, Raised):
                raise ending.error
            if not isinstance(ending, Returned):
                raise NavbenchError(f"{task.arguments[0]}: {ending.sentence}")
            yield ending.value


def _write_layouts(folder: Path) -> None:
    for name in LAYOUTS:
        text = files("drake_navbench.ros2.recordings").joinpath("layouts", name).read_text("utf-8")
        write_text(folder / name, text)


def tum_of(log: TrialLog, trajectory: str) -> str:
    """Returns a trajectory in the format of the TUM RGB-D benchmark.

    A line a sample: time s, x m, y m, z m, quaternion x, y, z, w. trajectory: see `TRAJECTORIES`.
    Samples without a pose are left out.
    """
    columns = ["time_s", *TRAJECTORIES[trajectory]]
    lines = []
    for time_s, x, y, yaw in log.samples[columns].dropna().to_numpy().tolist():
        z_turn, w_turn = math.sin(0.5 * yaw), math.cos(0.5 * yaw)
        lines.append(f"{time_s!r} {x!r} {y!r} 0 0 0 {z_turn!r} {w_turn!r}\n")
    return "".join(lines)


def plain_paths(stem: Path) -> dict[str, Path]:
    """Returns the paths of a trial's files: 'csv' and each trajectory; stem: without suffix."""
    return {"csv": stem.with_name(f"{stem.name}.csv")} | {
        name: stem.with_name(f"{stem.name}_{name}.tum") for name in TRAJECTORIES
    }
