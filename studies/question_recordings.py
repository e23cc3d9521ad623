"""The study of docs/questions/recordings.md: `python studies/questions.py recordings FOLDER`.

FOLDER/recordings holds the files of docs/questions/recordings_list.csv, each as owner/name/path. A
base is fitted to the first half of each drive and foretells the second.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from question_trials import (
    PAGES,
    Row,
    equal_rows,
    findings_table,
    judged,
    metric,
    read_rows,
    spread,
    table,
    write_page,
)

from drake_navbench.errors import InputError
from drake_navbench.inputs.drive import LEAST_LAG_S
from drake_navbench.inputs.robot import Robot, load_robot, overridden
from drake_navbench.logs.outcome import Outcome
from drake_navbench.ros2.recordings.drive_data import DriveData, drive_data
from drake_navbench.ros2.recordings.drive_fit import DriveFit, fit_drive
from drake_navbench.ros2.recordings.reading import Piece, read_bag
from drake_navbench.ros2.recordings.recorded_motion import recorded_motion
from drake_navbench.ros2.recordings.simulation_gap import simulation_gap
from drake_navbench.typed_files.input_file import file_digest

LIST = PAGES / "recordings_list.csv"
# Slower motion is standing.
STANDING_MPS, STANDING_RADPS = 0.02, 0.05
# A half must move so far or turn so much, and its commands change so often.
LEAST_WAY_M, LEAST_TURN_RAD, LEAST_CHANGES = 0.3, 0.5, 2
SHORTEST_S = 15.0
# A real robot's stamps are later than 2001.
EARLIEST_NS = 10**18
# The robot file that stands for a recorded robot, none of which ships.
SHIPPED = {"Neato": "round_robot", "Husky": "jackal"}
MODELS = ("fitted", "as shipped", "at once")
# Columns of the rows with numbers, and those that the first table shows.
SHOWN = (
    ("position after 5 s [m]", "position_5s_m", "{:.3f}"),
    ("heading after 5 s [deg]", "heading_5s_deg", "{:.1f}"),
    ("position after 10 s [m]", "position_10s_m", "{:.3f}"),
    ("heading after 10 s [deg]", "heading_10s_deg", "{:.1f}"),
    ("speed, r.m.s. [m/s]", "v_rms_mps", "{:.3f}"),
    ("turn rate, r.m.s. [rad/s]", "w_rms_radps", "{:.3f}"),
)
NUMBERS = (*(column for _, column, _ in SHOWN), "starts", "lag_s", "dead_time_s", "explained")
# As the doctor asks before it believes a fit; the split by it was added after the drives were seen.
LEAST_EXPLAINED = 0.5
PAIRS = tuple((other, "fitted") for other in MODELS[1:])
# The lag of a base that does at once as it is told: the shortest that a base may have.
AT_ONCE_S = LEAST_LAG_S
MAX_BYTES = 100_000_000
# A difference that matters to nobody.
POSITION = metric("position_5s_m", "m", relevant=0.01)


class Halves(NamedTuple):
    """The two halves of the part of a drive in which the robot moves."""

    first: DriveData
    second: DriveData


def halves_of(data: DriveData) -> Halves | str:
    """Returns the halves of a drive; a sentence where it cannot be used by the rules."""
    v, w, vy = np.abs(data.twist).T
    moving = np.flatnonzero((v > STANDING_MPS) | (vy > STANDING_MPS) | (w > STANDING_RADPS))
    if not len(moving):
        return "it never moves"
    begin_s, end_s = (float(data.time_s[moving[place]]) for place in (0, -1))
    begin_s = max(begin_s - 1.0, float(data.time_s[0]))
    if end_s - begin_s < SHORTEST_S:
        return f"it moves for {end_s - begin_s:.0f} s"
    middle_s = 0.5 * (begin_s + end_s)
    halves = Halves(data.within(begin_s, middle_s), data.within(middle_s, end_s))
    for name, half in zip(("first", "second"), halves, strict=True):
        if not _shows_enough(half):
            return f"too little happens in the {name} half"
    return halves


def _shows_enough(half: DriveData) -> bool:
    given = half.commands[half.command_time_s >= half.time_s[0]]
    changes = int(np.count_nonzero(np.abs(np.diff(given, axis=0)).max(axis=1) > 1e-3))
    way_m = float(np.hypot(*np.diff(half.pose[:, :2], axis=0).T).sum())
    turned = float(np.abs(np.diff(np.unwrap(half.pose[:, 2]))).sum())
    return changes >= LEAST_CHANGES and (way_m >= LEAST_WAY_M or turned >= LEAST_TURN_RAD)


def errors_of(robot_name: str, halves: Halves) -> Iterator[Row]:
    """Yields the errors of each model over the second half."""
    shipped = load_robot(SHIPPED[robot_name])
    fit = fit_drive(halves.first)
    at_once = _base(shipped, AT_ONCE_S, None, None)
    fitted = _base(
        shipped, fit.response_time_constant_s, fit.linear.acceleration, fit.angular.acceleration
    )
    second = halves.second
    driven = {
        "fitted": (fitted, as_the_base_gets_them(second, fit)),
        "as shipped": (shipped, second),
        "at once": (at_once, second),
    }
    for model, (robot, data) in driven.items():
        gap = simulation_gap(robot, data)
        of = {pose.horizon_s: pose for pose in gap.poses}
        yield {
            "model": model,
            "starts": of[5.0].start_count if 5.0 in of else 0,
            "position_5s_m": of[5.0].position_median_m if 5.0 in of else math.nan,
            "heading_5s_deg": of[5.0].heading_median_deg if 5.0 in of else math.nan,
            "position_10s_m": of[10.0].position_median_m if 10.0 in of else math.nan,
            "heading_10s_deg": of[10.0].heading_median_deg if 10.0 in of else math.nan,
            "v_rms_mps": gap.v_rms_mps,
            "w_rms_radps": gap.w_rms_radps,
            "lag_s": fit.response_time_constant_s,
            "dead_time_s": fit.dead_time_s,
            "explained": explained_by(fit),
        }


def explained_by(fit: DriveFit) -> float:
    """Returns the share of the first half's motion that the fit explains, of its worse axis."""
    return min(axis.explained for axis in (fit.linear, fit.angular) if axis.least_command)


def _base(robot: Robot, lag_s: float, linear: float | None, angular: float | None) -> Robot:
    """Returns a robot with another base, whose limits of speed cut no command."""
    drive = {
        "response_time_constant_s": lag_s,
        "max_linear_acceleration_mps2": linear,
        "max_angular_acceleration_radps2": angular,
        "max_linear_velocity_mps": 10.0,
        "min_linear_velocity_mps": -10.0,
        "max_angular_velocity_radps": 20.0,
    }
    return overridden(robot, {"drive": drive}, "study")


def as_the_base_gets_them(data: DriveData, fit: DriveFit) -> DriveData:
    """Returns a drive whose commands come after the dead time, those in the deadband as 0."""
    commands = data.commands.copy()
    for place, axis in enumerate((fit.linear, fit.angular)):
        if axis.deadband is not None:
            commands[np.abs(commands[:, place]) < axis.deadband, place] = 0.0
    return DriveData(
        data.time_s, data.pose, data.twist, data.command_time_s + fit.dead_time_s, commands
    )


def rows_of(entry: Mapping[str, Any], folder: Path) -> list[Row]:
    """Returns the rows of a recording; one row that says why, where it cannot be used."""
    own = {"recording": entry["recording"], "unit": entry["unit"], "robot": entry["robot"]}
    path = folder / entry["repository"] / entry["path"]
    topics = {role: entry[role] for role in ("odom", "command") if isinstance(entry[role], str)}
    try:
        recording = read_bag(path, Piece(topics, None, None, None))
        columns = recording.columns
        data = drive_data(columns, recorded_motion(path, columns))
    except InputError as error:
        return [own | {"model": "", "left_out": str(error).replace(str(path), path.name)}]
    if columns["odom"].stamp_ns[0] < EARLIEST_NS:
        return [own | {"model": "", "left_out": "its stamps begin near zero: a simulation"}]
    halves = "it has no commands" if data is None else halves_of(data)
    if isinstance(halves, str):
        return [own | {"model": "", "left_out": halves}]
    return [own | row for row in errors_of(entry["robot"], halves)]


def answer(arguments: argparse.Namespace) -> None:
    """Foretells every drive that FOLDER/recordings holds, and prints the tables."""
    folder = arguments.folder / "recordings"
    rows: list[Row] = []
    for entry in pd.read_csv(LIST).to_dict("records"):
        path = folder / entry["repository"] / entry["path"]
        if not path.is_file():
            print(f"missing: {path}")
        elif file_digest(path, max_bytes=MAX_BYTES) != entry["sha256"]:
            print(f"another file than was used: {path}")
        else:
            rows += rows_of(entry, folder)
    found = pd.DataFrame(rows)
    for column in NUMBERS:
        found[column] = found[column].map(lambda value: float(f"{value:.6g}"))
    told = tell(found)
    for name, text in told.items():
        print(f"{name}\n\n{text}\n")
    shipped = PAGES / "recordings.csv"
    if arguments.write:
        write_page("recordings", found, told, draw)
    elif shipped.exists():
        equal = equal_rows(_as_trials(found), _as_trials(read_rows(shipped)))
        print(
            f"{equal} of {len(_as_trials(found))} rows are equal to docs/questions/{shipped.name}"
        )


def _as_trials(rows: pd.DataFrame) -> pd.DataFrame:
    """Returns the drives that count as `judged` takes trials: the model an arm, a drive a seed."""
    used = rows[rows["model"].isin(MODELS)]
    return used.assign(arm=used["model"], seed=used["recording"], outcome=str(Outcome.SUCCEEDED))


def tell(rows: pd.DataFrame) -> Mapping[str, str]:
    """Returns the tables of the page."""
    used = _as_trials(rows)
    left = rows[~rows["model"].isin(MODELS)]
    findings = judged(used, PAIRS, [POSITION]).findings
    return {
        "models": table(*_models(used)),
        "pairs": findings_table(findings, {"position_5s_m": "position after 5 s [m]"}),
        "units": table(*_units(used)),
        "drives": table(*_drives(used)),
        "left out": table(
            ["recording", "of", "left out because"],
            [
                [f"`{own['recording']}`", own["unit"], own["left_out"]]
                for own in left.to_dict("records")
            ],
        ),
    }


def _models(used: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    """Returns titles and cells: the median over the drives, and their range."""
    is_explained = used["explained"] >= LEAST_EXPLAINED
    groups = {"all": used, "explained": used[is_explained], "not": used[~is_explained]}
    cells = [
        [group, model, str(len(own))] + [spread(own, column, form) for _, column, form in SHOWN]
        for group, rows in groups.items()
        for model in MODELS
        for own in [rows[rows["model"] == model]]
    ]
    return ["drives", "model", "number", *(title for title, _, _ in SHOWN)], cells


def _units(used: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    """Returns titles and cells: each team's drives together, position after 5 s."""
    cells = []
    for unit, own in used.groupby("unit"):
        means = own.groupby("model")["position_5s_m"].mean()
        cells.append(
            [f"{unit}", own["robot"].iloc[0], str(own["recording"].nunique())]
            + [f"{means[model]:.3f}" for model in MODELS]
        )
    return ["repository", "robot", "drives", *(f"{m} [m]" for m in MODELS)], cells


def _drives(used: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    """Returns titles and cells: every drive."""
    cells = []
    for name, own in used.groupby("recording", sort=False):
        by = own.set_index("model")
        fitted = by.loc["fitted"]
        cells.append(
            [f"`{name}`", fitted["unit"], f"{fitted['starts']:.0f}"]
            + [f"{by.loc[model, 'position_5s_m']:.3f}" for model in MODELS]
            + [f"{fitted['lag_s']:.2f}", f"{fitted['dead_time_s']:.2f}"]
            + [f"{max(100 * fitted['explained'], 0):.0f}"]
        )
    titles = ["recording", "of", "starts", *(f"{m} [m]" for m in MODELS)]
    return [*titles, "lag [s]", "dead time [s]", "explained [%]"], cells


def draw(rows: pd.DataFrame) -> Figure:
    """Returns the error of the position after 5 s of every drive, fitted against the others."""
    used = _as_trials(rows)
    by_model = used.pivot_table(index="recording", columns="model", values="position_5s_m")
    figure = Figure(figsize=(5.0, 4.4), layout="constrained")
    axes = figure.subplots()
    for place, other in enumerate(MODELS[1:]):
        axes.scatter(by_model[other], by_model["fitted"], s=16, color=f"C{place}", label=other)
    ends = [0.5 * by_model.to_numpy().min(), 2.0 * by_model.to_numpy().max()]
    axes.plot(ends, ends, "k", lw=0.8)
    axes.set(xscale="log", yscale="log", xlim=ends, ylim=ends)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
    axes.set(xlabel="the other model: position after 5 s [m]", ylabel="fitted [m]")
    axes.legend(loc="upper left")
    return figure
