"""Drives the trials by which configurations are compared; keeps their metrics, not their logs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from typing import Any

from drake_navbench.analysis.trial_rows import trial_row
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.trial_tasks import TRIALS_PER_WORKER
from drake_navbench.campaign.warm_up import start_worker_server
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.processes.tasks import Ending, Task
from drake_navbench.processes.worker_process import Raised, Returned
from drake_navbench.processes.workers import run_tasks
from drake_navbench.trial.column_controller import check_controller
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.task_cost import wall_clock_limit_s
from drake_navbench.trial.trial import drive, log_of_ending

Row = dict[str, Any]


def planned_pairs(
    baseline: Preset, scenarios: Sequence[str | Scenario], robot: str, count: int, seed: int
) -> list[TrialSpec]:
    """Returns `count` trials of the baseline that go through the scenarios in turn.

    So a configuration meets every scenario early. Raises InputError.
    """
    trials = -(-count // len({str(entry) for entry in scenarios}))
    campaign = plan_campaign(
        scenarios, [baseline], trials=trials, seed=seed, robot=robot, keeps_costmaps=False
    )
    return sorted(campaign.specs, key=lambda spec: spec.trial)[:count]


def with_column(specs: Sequence[TrialSpec], preset: Preset) -> list[TrialSpec]:
    """Returns the same trials with another column; raises InputError where it cannot drive them."""
    columns: dict[int, tuple[Preset, Robot]] = {}
    for spec in specs:
        if id(spec.robot) not in columns:
            robot = spec.robot
            if preset.stack is not None:
                robot = spec.scenario.load_robot(preset.stack)
            fitted = preset.for_robot(robot)
            if robot not in [checked for _, checked in columns.values()]:
                check_controller(fitted, robot)
            columns[id(spec.robot)] = fitted, robot
    return [
        replace(spec, preset=columns[id(spec.robot)][0], robot=columns[id(spec.robot)][1])
        for spec in specs
    ]


def measure(specs: Sequence[TrialSpec], *, jobs: int) -> list[Row]:
    """Drives trials in workers and returns their rows, in order; no log is kept.

    Raises NotDriven where a trial was ended by something outside of it.
    """
    return drive_each(specs, trial_row, jobs=jobs)


def drive_each(
    specs: Sequence[TrialSpec],
    kept_of: Callable[[TrialLog], Row],
    *,
    jobs: int,
    on_row: Callable[[TrialSpec, Row], None] = lambda spec, row: None,
) -> list[Row]:
    """Drives trials in workers and returns what is kept of each log, in order.

    kept_of: function from a log to its row, which can be sent to a worker. on_row: is called in
    this process with each row as it comes. Raises the errors of `measure`.
    """
    start_worker_server()
    tasks = {
        Task(
            _kept,
            (spec, kept_of),
            time_limit_s=wall_clock_limit_s(spec.scenario),
            owner=spec.code_owner,
        ): index
        for index, spec in enumerate(specs)
    }
    rows: dict[int, Row] = {}
    with closing(run_tasks(list(tasks), jobs=jobs, tasks_per_worker=TRIALS_PER_WORKER)) as endings:
        for task, ending in endings:
            index = tasks[task]
            rows[index] = _row_of(ending, specs[index], kept_of)
            on_row(specs[index], rows[index])
    return [rows[index] for index in range(len(specs))]


def _kept(spec: TrialSpec, kept_of: Callable[[TrialLog], Row]) -> Row:
    return kept_of(drive(spec))


def _row_of(ending: Ending, spec: TrialSpec, kept_of: Callable[[TrialLog], Row]) -> Row:
    if isinstance(ending, Returned):
        row: Row = ending.value
        return row
    if isinstance(ending, Raised):
        raise ending.error
    return kept_of(log_of_ending(spec, ending))
