"""Writes a campaign's replays from its logs, scenario by scenario, in parallel."""

from __future__ import annotations

from pathlib import Path

from drake_navbench.analysis.replay import write_race_replay, write_trial_replay
from drake_navbench.campaign.campaign import Campaign, worker_pool
from drake_navbench.errors import one_line
from drake_navbench.log import TrialLog
from drake_navbench.results import ResultsFolder, write_whole


def write_replays(
    folder: ResultsFolder, campaign: Campaign, *, each: bool, jobs: int
) -> dict[str, str]:
    """Writes one race a scenario, of each controller's first trial; with `each` every one alone.

    Returns the scenarios whose replays could not be written, with the reason.
    """
    models = {spec.scenario.name: spec.robot.model_path for spec in campaign.specs}
    with worker_pool(jobs) as pool:
        futures = {
            scenario: pool.schedule(
                _write_scenario, args=[folder, scenario, campaign.columns, models[scenario], each]
            )
            for scenario in campaign.scenarios
        }
        failures = {}
        for scenario, future in futures.items():
            try:
                future.result()
            except (Exception, SystemExit) as error:
                # Such as a model that cannot be parsed; Drake reports a failed check as SystemExit.
                failures[scenario] = one_line(error)
    return failures


def _write_scenario(
    folder: ResultsFolder, scenario: str, columns: list[str], model: Path | None, each: bool
) -> None:
    logs = [TrialLog.read(folder.log_path(scenario, column, 0)) for column in columns]
    driven = [log for log in logs if len(log.samples)]
    if not driven:
        return
    write_whole(
        folder.replay_path(scenario), lambda path: write_race_replay(driven, path, model=model)
    )
    if each:
        for log in driven:
            write_whole(
                folder.replay_path(scenario, log.info["controller"]),
                lambda path, log=log: write_trial_replay(log, path, model=model),
            )
