"""Runs a benchmark as a shell or Python asks for it: a results folder, and printed tables."""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from datetime import datetime
from itertools import chain, count
from pathlib import Path
from shlex import quote
from typing import Any, TypedDict, Unpack

from rich.console import Console

from drake_navbench.analysis.totals import scenarios_in_totals
from drake_navbench.campaign.campaign import DEFAULT_TRIALS, Campaign, plan_campaign
from drake_navbench.campaign.cluster_connection import (
    ClusterPlace,
    cluster_place,
    require_cluster,
)
from drake_navbench.campaign.console import CampaignProgress, CompileProgress, terminal
from drake_navbench.campaign.driving import run_campaign
from drake_navbench.campaign.manifest import (
    Begun,
    add_cluster,
    add_wall_clock,
    begin,
    complete,
    require_same_inputs,
)
from drake_navbench.campaign.replays import write_replays
from drake_navbench.campaign.request import Request
from drake_navbench.campaign.request_arguments import (
    listed_controllers,
    request_from_arguments,
)
from drake_navbench.campaign.run_console import (
    lines_on_inputs,
    print_error,
    print_tables,
    printed_metrics,
    tell_verdict,
    undriven_line,
)
from drake_navbench.campaign.run_results import Results
from drake_navbench.campaign.sweep import swept_points
from drake_navbench.campaign.table_console import print_first_column
from drake_navbench.campaign.warm_up import (
    Compiling,
    cold_parts,
    start_worker_server,
    warm_up,
    warm_ups,
)
from drake_navbench.errors import InputError, NavbenchError, printable
from drake_navbench.inputs.presets import Preset, resolved_parameters
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.log import Outcome
from drake_navbench.logs.results import ResultsFolder, only_run_in, require_writable
from drake_navbench.nav2.whole_files import FileColumns
from drake_navbench.processes import cache_folder, instruction_set
from drake_navbench.processes.kernel_cache import notice_of_wheel
from drake_navbench.processes.machine import available_cores
from drake_navbench.processes.workers import require_workers
from drake_navbench.trial.trial import DEFAULT_ROBOT
from drake_navbench.typed_files.typed_yaml import validate


class NavigationFiles(TypedDict, total=False):
    """Files of a navigation stack for `run_benchmark`.

    nav2, against: whole Nav2 files, each with columns of its own. map, goals: a map, and the number
    of tasks that are drawn on it.
    """

    nav2: str | Path
    against: str | Path | Sequence[str | Path]
    map: str | Path
    goals: int


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
    scenarios = [scenarios] if isinstance(scenarios, str | Scenario) else list(scenarios)
    sweeps = [sweeps] if isinstance(sweeps, str) else list(sweeps)
    if isinstance(controllers, str):
        controllers = listed_controllers(controllers)
    elif isinstance(controllers, Preset):
        controllers = [controllers]
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
    if any(of_files.values()):
        campaign = request.campaign()
    else:
        campaign = plan_campaign(
            scenarios,
            controllers,
            trials=trials,
            seed=seed,
            robot=robot,
            points=swept_points(sweeps, samples=samples, seed=seed),
        )
    jobs = _jobs(campaign, jobs)
    temporary = tempfile.TemporaryDirectory() if out is None else None
    folder = ResultsFolder(out or Path(temporary.name if temporary else ""))
    with only_run_in(folder.path):
        require_writable(folder.path)
        begin(folder, campaign, request if is_told_by_names else None, jobs)
        table, undriven, _ = run_campaign(campaign, folder, jobs=jobs)
    if undriven:
        raise NavbenchError("\n".join(undriven_line(entry) for entry in undriven))
    return Results(table, folder.path, temporary)


def _asked_of_files(files: NavigationFiles) -> dict[str, Any]:
    """Returns the fields of a request; raises TypeError for an unknown argument."""
    unknown = set(files) - set(NavigationFiles.__annotations__)
    if unknown:
        raise TypeError(f"run_benchmark() got an unexpected keyword argument {min(unknown)!r}")
    against = files.get("against", ())
    against = [against] if isinstance(against, str | Path) else list(against)
    if "goals" in files and "map" not in files:
        raise InputError("run_benchmark: goals: expected a map as well")
    return {
        "nav2_files": [str(files["nav2"])] if "nav2" in files else [],
        "against": list(map(str, against)),
        "map_task": {"map": str(files["map"]), "goals": files.get("goals")}
        if "map" in files
        else None,
    }


def run_from_command_line(
    arguments: argparse.Namespace,
    *,
    began_s: float,
    remarks: Callable[[Sequence[FileColumns]], Iterable[str]],
) -> bool:
    """Does what the command line asks; returns whether any trial ended in an error.

    began_s: `time.perf_counter()` at the command's beginning, for the total time. remarks: returns
    further lines about the Nav2 files that drive. Raises InputError, before anything is written,
    where the input is wrong.
    """
    console = terminal(quiet=arguments.quiet)
    resumed = arguments.resume is not None
    # A plugin may change the working directory; paths are relative to the directory at the start.
    path = (arguments.resume or arguments.out or default_results_path()).absolute()
    folder = ResultsFolder(path)
    if resumed:
        begun = validate(Begun, folder.read_manifest(), str(folder.manifest_path))
        request = begun.request
        campaign = request.campaign()
        require_same_inputs(folder, campaign, begun)
    else:
        request = request_from_arguments(arguments)
        campaign = request.campaign()
        require_writable(folder.path)
    if arguments.live:
        from drake_navbench.campaign.live import DEFAULT_WAIT_S, Kept, LiveOptions, show_live

        options = LiveOptions(
            wait_s=arguments.live_wait or DEFAULT_WAIT_S, port=arguments.live_port or 0
        )
        kept = None if arguments.out is None else Kept(folder, request)
        return show_live(campaign, console, options, kept)
    for name in ("live_port", "live_wait"):
        if getattr(arguments, name) is not None:
            raise InputError(f"--{name.replace('_', '-')}: expected --live as well")
    for line in (*lines_on_inputs(request, campaign), *remarks(campaign.nav2)):
        console.print(printable(line), soft_wrap=True)
    jobs = _jobs(campaign, arguments.jobs)
    cluster = cluster_place(arguments)
    if cluster is not None and _running_stacks(campaign):
        raise InputError(
            f"--cluster: {_running_stacks(campaign)[0]} is a stack on this machine; expected "
            "no --cluster"
        )
    if cluster is not None:
        # A cluster that does not answer is noticed before anything is written.
        require_cluster(cluster)
    try:
        with only_run_in(folder.path):
            if resumed:
                complete(folder, campaign, jobs)
            else:
                require_writable(folder.path)
                begin(folder, campaign, request, jobs)
            return _run(
                request,
                campaign,
                folder,
                jobs=jobs,
                console=console,
                began_s=began_s,
                cluster=cluster,
            )
    except KeyboardInterrupt:
        console.print(f"Continue with: {_resuming(folder)}", soft_wrap=True)
        raise


def _resuming(folder: ResultsFolder) -> str:
    """Returns the command that goes on with a run, for a shell."""
    return f"drake-navbench run --resume {quote(str(folder.path))}"


def _running_stacks(campaign: Campaign) -> list[str]:
    """Returns the columns that are running stacks."""
    return [preset.name for preset in campaign.presets if preset.is_running_stack]


def _jobs(campaign: Campaign, given: int | None) -> int:
    """Returns the number of workers: one where a running stack drives, one trial at a time.

    Raises InputError where more were asked for, or none.
    """
    if given is not None:
        require_workers(given)
    stacks = _running_stacks(campaign)
    if not stacks:
        return given or available_cores()
    if given not in (None, 1):
        raise InputError(
            f"--jobs: the running stack {stacks[0]} drives one trial at a time; expected 1, "
            f"got {given}"
        )
    return 1


def default_results_path() -> Path:
    """Returns results/<time>, with a number behind it where that exists already."""
    stem = datetime.now().strftime("%Y-%m-%d_%H-%M-%S")
    paths = (
        Path("results") / f"{stem}{suffix}" for suffix in chain([""], map("_{}".format, count(2)))
    )
    return next(path for path in paths if not path.exists())


def _run(
    request: Request,
    campaign: Campaign,
    folder: ResultsFolder,
    *,
    jobs: int,
    console: Console,
    began_s: float,
    cluster: ClusterPlace | None = None,
) -> bool:
    notices = instruction_set.notice(), cache_folder.notice(), notice_of_wheel()
    for line in filter(None, notices):
        console.print(line, soft_wrap=True)
    compiling = _begin_compiling(campaign, console, jobs, is_beside=cluster is None)
    started = time.perf_counter()
    start_worker_server()
    # The report and its figures take as long to import as the server of the workers to start.
    from drake_navbench.analysis.figures.choice import FigureChoice
    from drake_navbench.analysis.report import build_report

    with CampaignProgress(console) as progress:
        trials, undriven, machines = run_campaign(
            campaign,
            folder,
            jobs=jobs,
            compiling=compiling,
            on_progress=progress.update,
            on_refused_log=print_error,
            cluster=cluster,
            on_refused_worker=print_error,
        )
    wall_s = time.perf_counter() - started
    add_wall_clock(folder, wall_s)
    if machines and (warning := add_cluster(folder, machines)):
        print_error(warning)
    for entry in undriven:
        print_error(undriven_line(entry))
    if undriven:
        print_error(f"{len(undriven)} trials were not driven; {_resuming(folder)} drives them")
    if trials.empty:
        return True
    told = scenarios_in_totals(campaign.suites)
    print_tables(console, campaign, trials, told, printed_metrics(request))
    _write_wanted_replays(console, request, campaign, folder, told, jobs)
    console.print("Writing the report ...")
    report = build_report(
        folder.path,
        figures=FigureChoice(request.figures),
        jobs=jobs,
        measured=trials,
        parameters_of=resolved_parameters,
    )
    driven_s = float(trials["simulated_time_s"].sum())
    count = f"{len(trials)} trial{'s' if len(trials) > 1 else ''}"
    console.print(
        f"{count}, {driven_s:.0f} s of driving, in {time.perf_counter() - began_s:.0f} s, "
        f"of which the trials took {wall_s:.0f} s."
    )
    # The path is on a line of its own, which no terminal breaks as long as it fits.
    page = folder.path / ("sweep.html" if campaign.sweep else "report.html")
    console.print(f"Open {page}", soft_wrap=True)
    tell_verdict(console, campaign, folder, trials, report.verdict)
    errors = trials[trials["outcome"] == Outcome.ERROR]
    for row in errors.itertuples():
        where = f"{row.scenario}, {row.controller}, trial {row.trial}"
        print_error(f"error: {where}: {row.reason}")
    return bool(undriven) or not errors.empty


def _begin_compiling(
    campaign: Campaign, console: Console, jobs: int, *, is_beside: bool
) -> Compiling | None:
    """Returns the tasks for the kernels that are not compiled yet, None where there are none.

    is_beside: kernels are compiled beside the driving; otherwise now, as a cluster's workers drive
    at once.
    """
    cold = cold_parts(campaign.specs)
    if not cold.names:
        return None
    parts = ", ".join(cold.names)
    console.print(
        printable(f"Compiling kernels that are used for the first time: {parts}"), soft_wrap=False
    )
    compiling = Compiling(warm_ups(cold), lambda rows: print_first_column(console, rows))
    if is_beside:
        return compiling
    with CompileProgress(console, cache_folder.kernel_folder()) as progress:
        warm_up(compiling, jobs=jobs, on_progress=progress.update)
    return None


def _write_wanted_replays(
    console: Console,
    request: Request,
    campaign: Campaign,
    folder: ResultsFolder,
    told: frozenset[str],
    jobs: int,
) -> None:
    """Writes the requested replays; no races of scenarios that are only in the totals."""
    is_each, is_race = request.replay == "each", request.replay == "race"
    if not is_each and not (is_race and set(campaign.scenarios) - told):
        return
    console.print("Writing the replays ...")
    left_out = told if is_race else frozenset()
    failures = write_replays(folder, campaign, each=is_each, jobs=jobs, left_out=left_out)
    for scenario, reason in failures.items():
        print_error(f"no replay: {scenario}: {reason}")
