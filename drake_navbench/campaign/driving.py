"""Drives the trials of a campaign in workers, and says what became of each."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.tables import trial_row
from drake_navbench.campaign.campaign import Campaign
from drake_navbench.campaign.warm_up import start_worker_server
from drake_navbench.errors import CannotBeWritten, InputError, is_machine_fault, one_line
from drake_navbench.log import Outcome, TrialLog
from drake_navbench.processes.worker_process import Raised, Returned
from drake_navbench.processes.workers import Ending, Task, run_tasks
from drake_navbench.results import ResultsFolder
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.task_cost import wall_clock_limit_s
from drake_navbench.trial.trial import NotDriven, drive, failed_log, log_of_ending

# Trials are freed when they are over, but what others' code leaves behind is not. A new worker has
# to load the kernels again, and to rehearse what it drives.
TRIALS_PER_WORKER = 500

Row = dict[str, object]


@dataclass
class Progress:
    """How far a campaign is; `failed` counts the trials that ended in an error."""

    total: int
    done: int = 0
    running: int = 0
    failed: int = 0


class Undriven(NamedTuple):
    """A trial that came to no end, by something that it did not do."""

    spec: TrialSpec
    reason: str


class Driven(NamedTuple):
    """What became of a campaign: the table of the trials that ended, and the others."""

    trials: pd.DataFrame
    undriven: list[Undriven]


def run_campaign(
    campaign: Campaign,
    folder: ResultsFolder,
    *,
    jobs: int,
    on_progress: Callable[[Progress], None] = lambda progress: None,
    on_refused_log: Callable[[str], None] = lambda line: None,
) -> Driven:
    """Drives every trial that has no log of its own in the folder yet; writes the table of trials.

    A trial that breaks, hangs or ends its worker becomes a row with the outcome `error`. One that
    is ended from outside, or for which the machine has too little, is left to be driven again.
    Ctrl-C stops the workers and leaves the finished logs behind, from which a resumed run goes on.
    on_refused_log: is told of every log that is not the one of its trial, which is driven again.
    Raises CannotBeWritten where a log cannot be kept: there is no use in driving on.
    """
    rows = _read_back(campaign, folder, on_refused_log)
    undriven: list[Undriven] = []
    progress = Progress(total=len(campaign.specs), done=len(rows))
    progress.failed = sum(row["outcome"] == Outcome.ERROR for row in rows.values())
    on_progress(progress)
    identity = campaign.identity
    tasks = {
        Task(
            _drive_and_write,
            (spec, folder, identity),
            time_limit_s=wall_clock_limit_s(spec.scenario),
            owner=spec.code_owner,
            kind=f"{spec.scenario.name}\n{spec.preset.name}",
        ): index
        for index, spec in enumerate(campaign.specs)
        if index not in rows
    }
    start_worker_server()
    running = run_tasks(list(tasks), jobs=jobs, tasks_per_worker=TRIALS_PER_WORKER)
    with closing(running) as endings:
        for task, ending in endings:
            index = tasks.pop(task)
            spec = campaign.specs[index]
            try:
                rows[index] = _row_of(ending, spec, folder)
                progress.failed += rows[index]["outcome"] == Outcome.ERROR
            except NotDriven as reason:
                undriven.append(Undriven(spec, str(reason)))
                progress.failed += 1
            progress.done += 1
            progress.running = min(jobs, len(tasks))
            on_progress(progress)
    trials = pd.DataFrame([rows[index] for index in sorted(rows)])
    folder.write_trials(trials)
    return Driven(trials, undriven)


def _read_back(
    campaign: Campaign, folder: ResultsFolder, on_refused_log: Callable[[str], None]
) -> dict[int, Row]:
    """Returns the rows of the trials whose own logs are in the folder, by their index."""
    rows = {}
    for index, spec in enumerate(campaign.specs):
        path = folder.log_path(spec.scenario.name, spec.preset.name, spec.trial)
        if not path.exists():
            continue
        try:
            log = TrialLog.read(path)
            if log.info.get("identity") != spec.identity:
                raise InputError(f"{path}: the log of another trial")
        except InputError as error:
            on_refused_log(f"{error}; driven again")
        else:
            rows[index] = _table_row(log)
    return rows


def _drive_and_write(spec: TrialSpec, folder: ResultsFolder, campaign_identity: str) -> Row:
    """Drives one trial in a worker, writes its log, returns its row of the table."""
    log = drive(spec)
    try:
        folder.write_log(log, campaign_identity)
        return _table_row(log)
    except CannotBeWritten:
        raise
    except Exception as error:
        if is_machine_fault(error):
            raise
        # A log may hold what a plugin left in it.
        log = failed_log(spec, one_line(error), traceback.format_exc())
    folder.write_log(log, campaign_identity)
    return _table_row(log)


def _table_row(log: TrialLog) -> Row:
    return trial_row(log) | {"simulated_time_s": log.end_time_s}


def _row_of(ending: Ending, spec: TrialSpec, folder: ResultsFolder) -> Row:
    """Returns the row of a trial; raises NotDriven, or CannotBeWritten."""
    if isinstance(ending, Returned):
        return ending.value
    if isinstance(ending, Raised) and isinstance(ending.error, InputError):
        raise ending.error
    log = log_of_ending(spec, ending)
    folder.write_log(log)
    return _table_row(log)
