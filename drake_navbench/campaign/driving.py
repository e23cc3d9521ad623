"""Drives the trials of a campaign in workers, and reports how each ended."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.metrics.metric_file import asked_metrics
from drake_navbench.campaign.campaign import Campaign
from drake_navbench.campaign.cluster import TrialEnding, drive_on_cluster
from drake_navbench.campaign.cluster_connection import ClusterPlace, connected
from drake_navbench.campaign.trial_tasks import TRIALS_PER_WORKER, Row, table_row, trial_task
from drake_navbench.campaign.warm_up import Compiling, start_worker_server
from drake_navbench.errors import EndedFromOutside, InputError
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.processes.fingerprint import Fingerprint
from drake_navbench.processes.tasks import Died, Ending
from drake_navbench.processes.worker_process import Raised, Returned
from drake_navbench.processes.workers import run_tasks
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import NotDriven, log_of_ending

# The manifest's key for trials with third-party code whose worker or client was killed once.
KILLED_ONCE = "killed_once"


@dataclass
class Progress:
    """Number of a campaign's trials by state; `failed` counts those that ended in an error.

    compiling: the parts of trials whose kernels are still to be compiled.
    """

    total: int
    done: int = 0
    running: int = 0
    failed: int = 0
    compiling: tuple[str, ...] = ()


class Undriven(NamedTuple):
    """A trial that was ended by something outside of it."""

    spec: TrialSpec
    reason: str


class Driven(NamedTuple):
    """The outcome of a campaign: the table of the trials that ended, and the others.

    machines: the machines of a cluster, each with the number of trials that it drove.
    """

    trials: pd.DataFrame
    undriven: list[Undriven]
    machines: Sequence[tuple[Fingerprint, int]] = ()


def run_campaign(
    campaign: Campaign,
    folder: ResultsFolder,
    *,
    jobs: int,
    compiling: Compiling | None = None,
    on_progress: Callable[[Progress], None] = lambda progress: None,
    on_refused_log: Callable[[str], None] = lambda line: None,
    cluster: ClusterPlace | None = None,
    on_refused_worker: Callable[[str], None] = lambda line: None,
) -> Driven:
    """Drives every trial that has no log of its own in the folder yet; writes the table of trials.

    A trial that raises, hangs or ends its worker becomes a row with the outcome `error`. A trial
    whose worker is killed from outside, or for which the machine lacks memory or the like, has no
    row and is driven again by `--resume`. If the trial runs code that is not ours and its worker is
    killed a second time, that code is blamed, and the outcome is `error`. Ctrl-C stops the workers
    and keeps the finished logs; a resumed run drives the other trials. compiling: compiles kernels
    beside trials that do not need them; the first column's come first. on_refused_log: is called
    for every log in a trial's place that is not this trial's; the trial is then driven again.
    cluster: where to drive in place of `jobs` workers here. on_refused_worker: is called for every
    worker of the cluster with other versions of the software. Raises CannotBeWritten where a log
    cannot be kept: driving on would be useless.
    """
    rows = _read_back(campaign, folder, on_refused_log)
    undriven: list[Undriven] = []
    progress = Progress(total=len(campaign.specs), done=len(rows))
    progress.failed = sum(row["outcome"] == Outcome.ERROR for row in rows.values())
    compiling = compiling or Compiling(())
    progress.compiling = compiling.parts
    on_progress(progress)
    missing = [index for index in range(len(campaign.specs)) if index not in rows]
    first_column = _indices_of_first_column(campaign) if compiling.parts else set()
    machines: dict[str, tuple[Fingerprint, int]] = {}

    def tell_compiling(parts: tuple[str, ...]) -> None:
        progress.compiling = parts
        on_progress(progress)

    driving = (
        _drive_here(campaign, missing, folder, jobs, compiling, tell_compiling)
        if cluster is None or not missing
        else _drive_there(campaign, missing, folder, cluster, on_refused_worker)
    )
    left = len(missing)
    with closing(driving) as endings:
        for index, ending, made_by, workers in endings:
            spec = campaign.specs[index]
            try:
                rows[index] = _row_of(_blamed(ending, spec, folder), spec, folder)
                progress.failed += rows[index]["outcome"] == Outcome.ERROR
            except NotDriven as reason:
                undriven.append(Undriven(spec, str(reason)))
                progress.failed += 1
            if made_by is not None:
                _, count = machines.get(repr(made_by), (made_by, 0))
                machines[repr(made_by)] = made_by, count + 1
            left -= 1
            progress.done += 1
            progress.running = min(workers, left)
            on_progress(progress)
            if index in first_column and first_column <= rows.keys():
                compiling.on_first_column(
                    pd.DataFrame([rows[index] for index in sorted(first_column)])
                )
    trials = pd.DataFrame([rows[index] for index in sorted(rows)])
    folder.write_trials(trials)
    return Driven(trials, undriven, tuple(machines.values()))


def _indices_of_first_column(campaign: Campaign) -> set[int]:
    """Returns the indices of the first column's trials; none where it is the only column."""
    first, *others = campaign.columns
    specs = campaign.specs
    return {k for k, spec in enumerate(specs) if spec.preset.name == first} if others else set()


def _drive_here(
    campaign: Campaign,
    indices: Sequence[int],
    folder: ResultsFolder,
    jobs: int,
    compiling: Compiling,
    on_compiling: Callable[[tuple[str, ...]], None],
) -> Generator[TrialEnding, None, None]:
    """Drives trials in workers of this machine; yields each with how it ended.

    on_compiling: is called with the parts of trials whose kernels are still to be compiled.
    """
    identity = campaign.identity
    tasks = {}
    for index in indices:
        spec = campaign.specs[index]
        after = compiling.before(spec)
        is_urgent = spec.preset.name == campaign.specs[0].preset.name
        tasks[trial_task(spec, folder, identity, after=after, is_urgent=is_urgent)] = index
    start_worker_server()
    everything = [*compiling.tasks, *tasks]
    running = run_tasks(everything, jobs=jobs, tasks_per_worker=TRIALS_PER_WORKER)
    with closing(running) as endings:
        for task, ending in endings:
            if task in tasks:
                yield TrialEnding(tasks.pop(task), ending, None, jobs)
            else:
                on_compiling(compiling.end(task))


def _drive_there(
    campaign: Campaign,
    indices: Sequence[int],
    folder: ResultsFolder,
    place: ClusterPlace,
    on_refused_worker: Callable[[str], None],
) -> Generator[TrialEnding, None, None]:
    with connected(place) as client:
        for ended in drive_on_cluster(
            client,
            campaign.specs,
            indices,
            folder,
            campaign.identity,
            on_refused_worker=on_refused_worker,
        ):
            yield _with_own_metrics(ended, campaign.specs[ended.place], folder)


def _with_own_metrics(ended: TrialEnding, spec: TrialSpec, folder: ResultsFolder) -> TrialEnding:
    """Returns the ending of a cluster's trial with the metrics of `--metric`, measured here.

    Their files are on this machine alone, as is every log once its trial has ended.
    """
    if not asked_metrics() or not isinstance(ended.ending, Returned):
        return ended
    log = TrialLog.read(folder.log_path(spec.scenario.name, spec.preset.name, spec.trial))
    return ended._replace(ending=Returned(table_row(log)))


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
            rows[index] = table_row(log)
    return rows


def _blamed(ending: Ending, spec: TrialSpec, folder: ResultsFolder) -> Ending:
    """Returns a trial's ending; a repeated kill is blamed on third-party code.

    Nobody can know who killed a process. A controller that kills its own process would be driven
    again by every `--resume`. So the first kill of such a trial is noted in the manifest, and a
    second one counts as the fault of its controller.
    """
    is_kill = (
        ending.is_killed
        if isinstance(ending, Died)
        else isinstance(ending, Raised) and isinstance(ending.error, EndedFromOutside)
    )
    runs_others_code = bool(spec.code_owner) or spec.preset.controller == "external"
    if not (is_kill and runs_others_code and isinstance(ending, Died | Raised)):
        return ending
    name = folder.log_path(spec.scenario.name, spec.preset.name, spec.trial).stem
    trial = "/".join((spec.scenario.name, spec.preset.name, name))
    manifest = folder.read_manifest()
    killed = manifest.get(KILLED_ONCE, [])
    if trial in killed:
        reason = f"{ending.sentence}, for the second time: so its controller is blamed"
        return Died(reason, is_from_outside=False)
    folder.write_manifest(manifest | {KILLED_ONCE: [*killed, trial]})
    return ending


def _row_of(ending: Ending, spec: TrialSpec, folder: ResultsFolder) -> Row:
    """Returns the row of a trial; raises NotDriven, or CannotBeWritten."""
    if isinstance(ending, Returned):
        return ending.value
    if isinstance(ending, Raised) and isinstance(ending.error, InputError):
        raise ending.error
    log = log_of_ending(spec, ending)
    folder.write_log(log)
    return table_row(log)
