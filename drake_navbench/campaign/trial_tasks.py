"""A trial as a task of a worker: driven, its log written, its row of the table returned."""

from __future__ import annotations

import traceback

from drake_navbench.analysis.trial_rows import trial_row
from drake_navbench.errors import CannotBeWritten, is_machine_fault, one_line
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.processes.tasks import Task
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.task_cost import wall_clock_limit_s
from drake_navbench.trial.trial import drive
from drake_navbench.trial.trial_log import failed_log

# Trials are freed when they are over, but third-party code may leak memory, so workers are replaced
# after so many trials. A new worker has to load the kernels again, and to rehearse its controllers.
TRIALS_PER_WORKER = 500

Row = dict[str, object]


def trial_task(
    spec: TrialSpec,
    folder: ResultsFolder,
    campaign_identity: str | None,
    *,
    after: tuple[Task, ...] = (),
    is_urgent: bool = False,
) -> Task:
    """Returns the task that drives a trial, see `drive_and_write` and `Task`."""
    return Task(
        drive_and_write,
        (spec, folder, campaign_identity),
        time_limit_s=wall_clock_limit_s(spec.scenario),
        owner=spec.code_owner,
        kind=f"{spec.scenario.name}\n{spec.preset.name}",
        after=after,
        is_urgent=is_urgent,
    )


def drive_and_write(spec: TrialSpec, folder: ResultsFolder, campaign_identity: str | None) -> Row:
    """Drives one trial in a worker, writes its log, and returns its row of the table."""
    log = drive(spec)
    try:
        folder.write_log(log, campaign_identity)
        return table_row(log)
    except CannotBeWritten:
        raise
    except Exception as error:
        if is_machine_fault(error):
            raise
        # A plugin may have left any value in a log.
        log = failed_log(spec, one_line(error), traceback.format_exc())
    folder.write_log(log, campaign_identity)
    return table_row(log)


def table_row(log: TrialLog) -> Row:
    """Returns the row of the table of trials for a log."""
    return trial_row(log) | {"simulated_time_s": log.end_time_s}
