"""Small results folders made of synthetic logs."""

from __future__ import annotations

import atexit
import os
import shutil
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
from scenes import straight_plan
from synthetic_logs import log_times, make_log

from drake_navbench.analysis.folder_analysis import analyse_folder
from drake_navbench.analysis.report import page_of, render
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder

CONTROLLERS = ("rpp", "rpp:v=0.4")
SPEEDS_MPS = {"rpp": 0.5, "rpp:v=0.4": 0.4}
SEEDS = (11, 22, 33)
SCENARIOS = ("empty", "own_corridor")
LENGTH_M = 3.0


def trial_log(
    scenario: str,
    controller: str,
    trial: int,
    *,
    slower: float = 1.0,
    outcome: str = "succeeded",
    is_random: bool = True,
) -> TrialLog:
    """Returns a straight drive whose speed wanders a little with the seed, if it is random."""
    number, trial = trial, trial if is_random else 0
    speed_mps = SPEEDS_MPS[controller] / slower * (1.0 + 0.002 * trial)
    end_time_s = round(LENGTH_M / speed_mps, 2)
    time_s = log_times(end_time_s)
    ramp = np.minimum(time_s / 0.5, 1.0)
    x_m = speed_mps * np.cumsum(ramp) * 0.02
    has_wall = scenario != "empty"
    log = make_log(
        time_s,
        plan=straight_plan(LENGTH_M),
        outcome=outcome,
        x_m=x_m,
        y_m=0.01 * trial * np.sin(time_s),
        v_mps=speed_mps * ramp,
        command_v_mps=speed_mps,
        clearance_m=0.9 - 0.01 * trial if has_wall else np.inf,
        obstacle_cell_distance_m=1.225 if has_wall else np.inf,
        obstacle_corner_distance_m=1.2 if has_wall else np.inf,
        cycle_count=np.floor(time_s * 20.0 + 1e-9) + 1,
        compute_time_ms=1.0 + np.mod(np.floor(time_s * 20.0 + 1e-9), 7),
        compute_cpu_time_ms=0.5 + np.mod(np.floor(time_s * 20.0 + 1e-9), 7),
        info={
            "controller": controller,
            "trial": number,
            "seed": SEEDS[number],
            "reason": "goal reached" if outcome == "succeeded" else "no valid control <0.2 s>",
            "end_time_s": float(time_s[-1]),
        },
    )
    log.info["scenario"]["name"] = scenario
    if has_wall:
        log.info["scenario"]["world"]["obstacles"] = [
            {"type": "box", "min": [-1.0, 1.2], "max": [5.0, 1.4]}
        ]
    return log


def write_manifest(path: Path, **request: object) -> ResultsFolder:
    """Writes the manifest of a folder; request: what else was asked for."""
    folder = ResultsFolder(path)
    folder.write_manifest(
        {
            "scenarios": list(SCENARIOS),
            "controllers": list(CONTROLLERS),
            "created": "2024-04-01T12:00:00+00:00",
            "drake_navbench": "0.1.0",
            "packages": {"drake": "1.51.1"},
            "request": {"seed": 0, "robot": "wheelchair"} | request,
        }
    )
    return folder


def write_folder(
    path: Path,
    *,
    slower: float = 1.0,
    failing: tuple[str, ...] = (),
    ending: str = "aborted",
    is_random: bool = True,
    **request: object,
) -> Path:
    """Writes a results folder; the last trial of `failing` controllers has the outcome `ending`."""
    folder = write_manifest(path, **request)
    for scenario in SCENARIOS:
        for controller in CONTROLLERS:
            for trial in range(len(SEEDS)):
                fails = controller in failing and trial == len(SEEDS) - 1
                folder.write_log(
                    trial_log(
                        scenario,
                        controller,
                        trial,
                        slower=slower,
                        outcome=ending if fails else "succeeded",
                        is_random=is_random,
                    )
                )
    return path


def measured_folder(
    path: Path,
    *,
    slower: float = 1.0,
    failing: tuple[str, ...] = (),
    ending: str = "aborted",
    is_random: bool = True,
    request: dict[str, object] | None = None,
) -> Path:
    """Writes such a folder as a report leaves it: with what it has measured of each log.

    Each content is measured once for all tests of this process.
    """
    shutil.copytree(_measured(slower, failing, ending, is_random), path)
    write_manifest(path, **(request or {}))
    return path


@cache
def _measured(slower: float, failing: tuple[str, ...], ending: str, is_random: bool) -> Path:
    folder = Path(mkdtemp(prefix="measured-"))
    atexit.register(_remove, folder, os.getpid())
    path = folder / "results"
    write_folder(path, slower=slower, failing=failing, ending=ending, is_random=is_random)
    analyse_folder(path, jobs=1, keeps=True)
    return path


def _remove(folder: Path, owner: int) -> None:
    # A forked process that ends has its parent's exit handlers as well.
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)


def report_html(path: Path) -> str:
    """Returns the report of a results folder."""
    analysis = analyse_folder(path, jobs=1)
    return render(analysis, page_of(analysis))
