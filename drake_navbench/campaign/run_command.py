"""Runs a benchmark as a shell asks for it: a results folder, and printed tables."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterable, Sequence
from datetime import datetime
from itertools import chain, count
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from rich.console import Console

from drake_navbench.analysis.numbers import counted
from drake_navbench.analysis.totals import scenarios_in_totals
from drake_navbench.campaign.benchmark import running_stacks, worker_count
from drake_navbench.campaign.campaign import Campaign
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
from drake_navbench.campaign.request_arguments import request_from_arguments
from drake_navbench.campaign.run_console import (
    lines_on_inputs,
    print_error,
    print_tables,
    printed_metrics,
    tell_verdict,
    undriven_line,
)
from drake_navbench.campaign.table_console import print_first_column
from drake_navbench.campaign.warm_up import (
    Compiling,
    cold_parts,
    start_worker_server,
    warm_up,
    warm_ups,
)
from drake_navbench.errors import InputError, printable
from drake_navbench.inputs.presets import resolved_parameters
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.results import ResultsFolder, only_run_in, require_writable
from drake_navbench.nav2.whole_files import FileColumns
from drake_navbench.processes import cache_folder, instruction_set
from drake_navbench.processes.kernel_cache import notice_of_wheel
from drake_navbench.typed_files.typed_yaml import validate

if TYPE_CHECKING:
    import pandas as pd


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
    folder = ResultsFolder((arguments.resume or arguments.out or default_results_path()).absolute())
    request, campaign = _begun(folder) if resumed else _asked(arguments, folder)
    if arguments.live:
        return _watch(arguments, request, campaign, folder, console)
    for line in (*lines_on_inputs(request, campaign), *remarks(campaign.nav2)):
        console.print(printable(line), soft_wrap=True)
    jobs = worker_count(campaign, arguments.jobs)
    cluster = _cluster(arguments, campaign)
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


def _begun(folder: ResultsFolder) -> tuple[Request, Campaign]:
    """Returns an unfinished run's request and campaign; raises InputError for changed inputs."""
    begun = validate(Begun, folder.read_manifest(), str(folder.manifest_path))
    campaign = begun.request.campaign()
    require_same_inputs(folder, campaign, begun)
    return begun.request, campaign


def _asked(arguments: argparse.Namespace, folder: ResultsFolder) -> tuple[Request, Campaign]:
    """Returns the request and the campaign of the command line; raises InputError."""
    request = request_from_arguments(arguments)
    campaign = request.campaign()
    require_writable(folder.path)
    return request, campaign


def _watch(
    arguments: argparse.Namespace,
    request: Request,
    campaign: Campaign,
    folder: ResultsFolder,
    console: Console,
) -> bool:
    """Shows trials while they drive; keeps them in the folder if `--out` is given."""
    from drake_navbench.campaign.live import DEFAULT_WAIT_S, Kept, LiveOptions, show_live

    options = LiveOptions(
        wait_s=arguments.live_wait or DEFAULT_WAIT_S, port=arguments.live_port or 0
    )
    kept = None if arguments.out is None else Kept(folder, request)
    return show_live(campaign, console, options, kept)


def _cluster(arguments: argparse.Namespace, campaign: Campaign) -> ClusterPlace | None:
    """Returns the cluster that is to drive, None without one.

    Raises InputError, before anything is written, where it does not answer or cannot drive this.
    """
    cluster = cluster_place(arguments)
    if cluster is None:
        return None
    stacks = running_stacks(campaign)
    if stacks:
        raise InputError(
            f"--cluster: {stacks[0]} is a stack on this machine; expected no --cluster"
        )
    require_cluster(cluster)
    return cluster


def _resuming(folder: ResultsFolder) -> str:
    """Returns the command that goes on with a run, for a shell."""
    return f"drake-navbench run --resume {quote(str(folder.path))}"


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
    """Drives, writes and prints; returns whether any trial is missing or ended in an error."""
    notices = instruction_set.notice(), cache_folder.notice(), notice_of_wheel()
    for line in filter(None, notices):
        console.print(line, soft_wrap=True)
    trials, undriven, wall_s = _drive(campaign, folder, jobs, console, cluster)
    if trials.empty:
        return True
    from drake_navbench.analysis.early_arrivals import early_arrivals
    from drake_navbench.analysis.figures.choice import FigureChoice
    from drake_navbench.analysis.report import build_report

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
    count = counted(len(trials), "trial")
    console.print(
        f"{count}, {driven_s:.0f} s of driving, in {time.perf_counter() - began_s:.0f} s, "
        f"of which the trials took {wall_s:.0f} s."
    )
    # The path is on a line of its own, which no terminal breaks as long as it fits.
    page = folder.path / ("sweep.html" if campaign.sweep else "report.html")
    console.print(f"Open {page}", soft_wrap=True)
    tell_verdict(console, campaign, folder, trials, report.verdict)
    for line in early_arrivals(trials):
        console.print(printable(line), soft_wrap=True)
    errors = trials[trials["outcome"] == Outcome.ERROR]
    for row in errors.itertuples():
        where = f"{row.scenario}, {row.controller}, trial {row.trial}"
        print_error(f"error: {where}: {row.reason}")
    return undriven or not errors.empty


def _drive(
    campaign: Campaign,
    folder: ResultsFolder,
    jobs: int,
    console: Console,
    cluster: ClusterPlace | None,
) -> tuple[pd.DataFrame, bool, float]:
    """Drives the missing trials; returns the table, whether any is undriven, and the time, s."""
    compiling = _begin_compiling(campaign, console, jobs, is_beside=cluster is None)
    started = time.perf_counter()
    start_worker_server()
    # Report and figures take as long to import as the server of the workers to start.
    import drake_navbench.analysis.report  # noqa: F401

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
        count = counted(len(undriven), "trial")
        print_error(f"{count} not driven; {_resuming(folder)} drives the rest")
    return trials, bool(undriven), wall_s


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
