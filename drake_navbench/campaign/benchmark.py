"""Runs a benchmark as Python asks for it: a results folder, and a table of its trials."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypedDict, Unpack

from drake_navbench.campaign.campaign import DEFAULT_TRIALS, Campaign, plan_campaign
from drake_navbench.campaign.driving import run_campaign
from drake_navbench.campaign.manifest import begin
from drake_navbench.campaign.request import Request
from drake_navbench.campaign.request_arguments import asked_goals, listed_controllers
from drake_navbench.campaign.run_console import undriven_line
from drake_navbench.campaign.run_results import Results
from drake_navbench.campaign.sweep import swept_points
from drake_navbench.errors import InputError, NavbenchError
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.results import ResultsFolder, only_run_in, require_writable
from drake_navbench.processes.machine import available_cores
from drake_navbench.processes.workers import require_workers
from drake_navbench.trial.trial import DEFAULT_ROBOT
from drake_navbench.typed_files.typed_yaml import validate


class NavigationFiles(TypedDict, total=False):
    """Files of a navigation stack for `run_benchmark`.

    nav2, against: whole Nav2 files, each with columns of its own. map, goals: a map, and the number
    of tasks that are drawn on it, or a file of places.
    """

    nav2: str | Path
    against: str | Path | Sequence[str | Path]
    map: str | Path
    goals: int | str | Path


def run_benchmark(
    scenarios: str | Scenario | Sequence[str | Scenario] = (),
    controllers: str | Preset | Sequence[str | Preset] = (),
    *,
    trials: int = DEFAULT_TRIALS,
    seed: int = 0,
    jobs: int | None = None,
    robot: str = DEFAULT_ROBOT,
    out: str | Path | None = None,
    sweeps: str | Sequence[str] = (),
    samples: int | None = None,
    **files: Unpack[NavigationFiles],
) -> Results:
    """Runs a benchmark and returns its trials: a table with the metrics, and their logs.

    The arguments are those of the command line; several controllers may be one string with commas,
    as there. files: see `NavigationFiles`. out: a new folder that keeps the logs. `drake-navbench
    report` makes its report, and `run --resume` continues it; the latter only if every controller
    and scenario was given by its name, not as an object. Raises InputError where an argument is
    wrong, NavbenchError where trials were ended by something outside of them.
    """
    out = None if out is None else Path(out).absolute()
    if isinstance(controllers, str):
        controllers = listed_controllers(controllers)
    controllers, scenarios, sweeps = map(_as_list, (controllers, scenarios, sweeps))
    names = [c if isinstance(c, str) else c.name for c in controllers]
    scenario_names = [s if isinstance(s, str) else s.name for s in scenarios]
    is_told_by_names = [*names, *scenario_names] == [*controllers, *scenarios]
    given = {
        "scenarios": scenario_names,
        "controllers": names,
        "parameter_files": [],
        "trials": trials,
        "seed": seed,
        "robot": robot,
        "replay": "none",
        "sweeps": sweeps,
        "samples": samples,
    }
    of_files = _asked_of_files(files)
    if any(of_files.values()) and not is_told_by_names:
        raise InputError(
            "run_benchmark: nav2, against and map: expected controllers and scenarios by name"
        )
    request = validate(Request, given | of_files, "run_benchmark")
    if is_told_by_names:
        campaign = request.campaign()
    else:
        points = swept_points(sweeps, samples=samples, seed=seed)
        campaign = plan_campaign(
            scenarios, controllers, trials=trials, seed=seed, robot=robot, points=points
        )
    jobs = worker_count(campaign, jobs)
    temporary = tempfile.TemporaryDirectory() if out is None else None
    folder = ResultsFolder(out or Path(temporary.name if temporary else ""))
    with only_run_in(folder.path):
        require_writable(folder.path)
        begin(folder, campaign, request if is_told_by_names else None, jobs)
        table, undriven, _ = run_campaign(campaign, folder, jobs=jobs)
    if undriven:
        raise NavbenchError("\n".join(undriven_line(entry) for entry in undriven))
    return Results(table, folder.path, temporary)


def _as_list(given: Any) -> list[Any]:
    """Returns an argument that is one thing or a sequence of things as a list."""
    is_one = isinstance(given, str | Path | Scenario | Preset)
    return [given] if is_one else list(given)


def _asked_of_files(files: NavigationFiles) -> dict[str, Any]:
    """Returns the fields of a request; raises TypeError for an unknown argument."""
    unknown = set(files) - set(NavigationFiles.__annotations__)
    if unknown:
        raise TypeError(f"run_benchmark() got an unexpected keyword argument {min(unknown)!r}")
    if "goals" in files and "map" not in files:
        raise InputError("run_benchmark: goals: expected a map as well")
    return {
        "nav2_files": [str(files["nav2"])] if "nav2" in files else [],
        "against": list(map(str, _as_list(files.get("against", ())))),
        "map_task": {"map": str(files["map"]), **asked_goals(files.get("goals"))}
        if "map" in files
        else None,
    }


def running_stacks(campaign: Campaign) -> list[str]:
    """Returns the columns that are running stacks."""
    return [preset.name for preset in campaign.presets if preset.is_running_stack]


def worker_count(campaign: Campaign, given: int | None) -> int:
    """Returns the number of workers: one where a running stack drives, one trial at a time.

    Raises InputError for less than one worker, and for more than one with a running stack.
    """
    if given is not None:
        require_workers(given)
    stacks = running_stacks(campaign)
    if not stacks:
        return given or available_cores()
    if given not in (None, 1):
        raise InputError(
            f"--jobs: the running stack {stacks[0]} drives one trial at a time; expected 1, "
            f"got {given}"
        )
    return 1
