"""Writes a campaign's replays from its logs, scenario by scenario, in parallel."""

from __future__ import annotations

from collections.abc import Collection
from contextlib import closing
from functools import partial
from pathlib import Path

from drake_navbench.analysis.replay import write_race_replay, write_trial_replay
from drake_navbench.campaign.campaign import Campaign
from drake_navbench.campaign.warm_up import start_worker_server
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.processes.tasks import Task
from drake_navbench.processes.worker_process import Returned
from drake_navbench.processes.workers import run_tasks
from drake_navbench.typed_files.output_file import write_whole

REPLAY_LIMIT_S = 600.0


def write_replays(
    folder: ResultsFolder,
    campaign: Campaign,
    *,
    each: bool,
    jobs: int,
    left_out: Collection[str] = (),
) -> dict[str, str]:
    """Writes one race a scenario, of each controller's first trial; with `each` one replay a trial.

    left_out: scenarios that get none. Returns the scenarios whose replays could not be written,
    with the reason.
    """
    models = {spec.scenario.name: spec.robot.model_path for spec in campaign.specs}
    tasks = {
        Task(
            _write_scenario,
            (folder, scenario, campaign.columns, models[scenario], each),
            time_limit_s=REPLAY_LIMIT_S,
        ): scenario
        for scenario in campaign.scenarios
        if scenario not in left_out
    }
    start_worker_server()
    failures = {}
    with closing(run_tasks(list(tasks), jobs=jobs)) as endings:
        for task, ending in endings:
            # An example is a model that cannot be parsed.
            if not isinstance(ending, Returned):
                failures[tasks[task]] = ending.sentence
    return {scenario: failures[scenario] for scenario in campaign.scenarios if scenario in failures}


def _write_scenario(
    folder: ResultsFolder, scenario: str, columns: list[str], model: Path | None, each: bool
) -> None:
    logs = [TrialLog.read(folder.log_path(scenario, column, 0)) for column in columns]
    driven = [log for log in logs if len(log.samples)]
    if not driven:
        return
    write_whole(
        folder.replay_path(scenario),
        lambda path: write_race_replay(driven, path, model=model, columns=columns),
    )
    if each:
        for log in driven:
            write_whole(
                folder.replay_path(scenario, log.info["controller"]),
                partial(write_trial_replay, log, model=model, columns=columns),
            )
