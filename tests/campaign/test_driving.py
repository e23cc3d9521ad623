"""What the machine does to a campaign is never a trial's fault, and nothing is lost by it."""

import dataclasses
import errno
import os
import shutil
import signal
import time

import pandas as pd
import pytest
from worker_here import working_here

from drake_navbench.campaign import driving, trial_tasks
from drake_navbench.campaign.campaign import Campaign, plan_campaign
from drake_navbench.campaign.driving import run_campaign
from drake_navbench.campaign.warm_up import Compiling, WarmUp
from drake_navbench.errors import CannotBeWritten, EndedFromOutside, InputError
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.processes.tasks import Died, Task, TimedOut
from drake_navbench.processes.worker_process import Raised, TaskFailed
from drake_navbench.trial.trial import NotDriven
from drake_navbench.trial.trial_log import failed_log

SCENARIO = "description: nothing in the way\ngoal: [0.6, 0.0, 0.0]\ntimeout_s: 20.0\n"


@pytest.fixture
def campaign(tmp_path) -> Campaign:
    """Two short trials of one column."""
    (tmp_path / "short.yaml").write_text(SCENARIO)
    return plan_campaign([str(tmp_path / "short.yaml")], ["rpp"], trials=2)


@pytest.fixture
def folder(tmp_path, campaign) -> ResultsFolder:
    """The folder of that campaign, begun."""
    results = ResultsFolder(tmp_path / "out")
    results.write_manifest({"identity": campaign.identity})
    return results


def logs_in(folder: ResultsFolder) -> list[str]:
    return sorted(path.name for path in folder.path.rglob("trial_*"))


def test_a_log_that_cannot_be_written_leaves_its_trial_to_be_driven_again(
    campaign, folder, monkeypatch
):
    def full_disk(log, path):
        path.write_bytes(b"half of it")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(TrialLog, "write", full_disk)
    with pytest.raises(CannotBeWritten, match="No space left on device"):
        trial_tasks.drive_and_write(campaign.specs[0], folder, campaign.identity)
    assert logs_in(folder) == []
    assert list(folder.path.rglob(".*")) == []


def test_a_log_that_holds_what_no_file_can_is_the_trials_own_fault(campaign, folder, monkeypatch):
    spec = campaign.specs[0]
    samples = pd.DataFrame({name: [0.0] for name in failed_log(spec, "").samples.columns})
    odd = dataclasses.replace(
        failed_log(spec, ""), samples=samples, diagnostics=((0.0, {"tried": {1, 2}}),)
    )
    monkeypatch.setattr(trial_tasks, "drive", lambda spec: odd)
    row = trial_tasks.drive_and_write(spec, folder, campaign.identity)
    assert row["outcome"] == Outcome.ERROR
    assert row["reason"].startswith("TypeError: ")
    assert "got set" in row["reason"]
    log = TrialLog.read(folder.log_path("short", "rpp", 0))
    assert log.info["reason"] == row["reason"]
    assert "Traceback" in log.info["traceback"]


@pytest.mark.parametrize("fault", [MemoryError("16 GB"), OSError(errno.ENOSPC, "No space left")])
def test_what_the_machine_lacks_in_a_trial_is_not_the_trials_fault(
    fault, campaign, folder, monkeypatch
):
    def lacking(spec, **options):
        raise fault

    monkeypatch.setattr("drake_navbench.trial.trial.simulate", lacking)
    with pytest.raises(type(fault)):
        trial_tasks.drive_and_write(campaign.specs[0], folder, campaign.identity)
    assert logs_in(folder) == []


ENDINGS_OF_THE_MACHINE = {
    "killed from outside": Died("ended by signal 9", is_from_outside=True),
    "out of memory": Raised(TaskFailed("MemoryError")),
}
ENDINGS_OF_THE_TRIAL = {
    "crashed": Died("ended by signal 11", is_from_outside=False),
    "hung": TimedOut(120.0),
}


@pytest.mark.parametrize("case", ENDINGS_OF_THE_MACHINE)
def test_a_trial_that_the_machine_ended_has_no_log(case, campaign, folder):
    ending = ENDINGS_OF_THE_MACHINE[case]
    with pytest.raises(NotDriven):
        driving._row_of(ending, campaign.specs[0], folder)
    assert logs_in(folder) == []


@pytest.mark.parametrize("case", ENDINGS_OF_THE_TRIAL)
def test_a_trial_that_ended_its_worker_has_a_log_of_it(case, campaign, folder):
    row = driving._row_of(ENDINGS_OF_THE_TRIAL[case], campaign.specs[0], folder)
    assert row["outcome"] == Outcome.ERROR
    assert logs_in(folder) == ["trial_000.parquet"]


def test_a_client_that_is_killed_is_an_error_the_second_time(campaign, folder):
    killed = Raised(EndedFromOutside("client: was ended by signal 9 (Killed)"))
    own = campaign.specs[0]
    client = dataclasses.replace(
        own, preset=dataclasses.replace(own.preset, controller="external", name="client")
    )
    assert driving._blamed(killed, client, folder) is killed
    again = driving._blamed(killed, client, folder)
    assert again == Died(
        "client: was ended by signal 9 (Killed), for the second time: so its controller is blamed",
        is_from_outside=False,
    )
    # One of ours kills nobody.
    for _ in range(3):
        assert driving._blamed(killed, own, folder) is killed


def test_a_campaign_stops_where_a_log_cannot_be_kept(campaign, folder):
    with pytest.raises(CannotBeWritten):
        driving._row_of(Raised(CannotBeWritten("full")), campaign.specs[0], folder)


def test_logs_of_other_trials_and_spoilt_ones_are_driven_again(campaign, folder):
    first, second = (folder.log_path("short", "rpp", trial) for trial in (0, 1))
    trials, *_ = run_campaign(campaign, folder, jobs=1)
    before = TrialLog.read(first)
    shutil.copy(second, first)
    second.write_bytes(second.read_bytes()[:1000])
    told = []
    again, *_ = run_campaign(campaign, folder, jobs=1, on_refused_log=told.append)
    assert f"{first}: the log of another trial; driven again" in told
    assert any(line.startswith(f"{second}: not a readable trial log") for line in told)
    assert TrialLog.read(first).info == before.info
    assert list(again["path_length"]) == list(trials["path_length"])


def test_a_worker_that_outlives_its_run_writes_nothing_into_another(campaign, folder):
    folder.write_manifest({"identity": "of another campaign"})
    with pytest.raises(InputError, match="is no longer the folder of this run"):
        trial_tasks.drive_and_write(campaign.specs[0], folder, campaign.identity)
    assert logs_in(folder) == []


def test_equal_specifications_and_no_others_have_one_identity(campaign, tmp_path):
    first, second = campaign.specs
    assert first.identity != second.identity
    again = plan_campaign([str(tmp_path / "short.yaml")], ["rpp"], trials=2)
    assert [spec.identity for spec in again.specs] == [first.identity, second.identity]
    (tmp_path / "short.yaml").write_text(SCENARIO.replace("0.6", "0.7"))
    other = plan_campaign([str(tmp_path / "short.yaml")], ["rpp"], trials=2)
    assert other.specs[0].identity != first.identity
    assert other.identity != campaign.identity


def _killed_by_somebody() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.usefixtures("real_workers")
def test_a_worker_killed_by_somebody_costs_one_trial_until_it_is_resumed(
    campaign, folder, monkeypatch
):
    run_tasks = driving.run_tasks

    def with_first_killed(tasks, **options):
        killed = dataclasses.replace(tasks[0], function=_killed_by_somebody, arguments=())
        for task, ending in run_tasks([killed, *tasks[1:]], **options):
            yield (tasks[0] if task is killed else task), ending

    with monkeypatch.context() as patch:
        patch.setattr(driving, "run_tasks", with_first_killed)
        trials, undriven, _ = run_campaign(campaign, folder, jobs=1)
    assert list(trials["trial"]) == [1]
    ((spec, reason),) = undriven
    assert spec.trial == 0
    assert reason == "the worker process was ended by signal 9 (Killed)"
    with working_here():
        trials, undriven, _ = run_campaign(campaign, folder, jobs=1)
    assert list(trials["trial"]) == [0, 1]
    assert set(trials["outcome"]) == {"succeeded"}
    assert undriven == []


@pytest.mark.usefixtures("real_workers")
def test_the_first_column_is_told_while_others_compile(tmp_path, monkeypatch):
    (tmp_path / "short.yaml").write_text(SCENARIO)
    campaign = plan_campaign([str(tmp_path / "short.yaml")], ["rpp", "dwb"], trials=2)
    folder = ResultsFolder(tmp_path / "out")
    folder.write_manifest({"identity": campaign.identity})
    slow = Task(time.sleep, (1.0,), kind="compile dwb")
    columns: list[list[str]] = []
    compiling = Compiling(
        [WarmUp(slow, "dwb", frozenset())], lambda rows: columns.append(list(rows["controller"]))
    )
    told: list[tuple[int, tuple[str, ...]]] = []
    driven = run_campaign(
        campaign,
        folder,
        jobs=2,
        compiling=compiling,
        on_progress=lambda progress: told.append((progress.done, progress.compiling)),
    )
    assert len(driven.trials) == 4
    assert told[0] == (0, ("dwb",))
    assert told[-1] == (4, ())
    assert columns == [["rpp", "rpp"]]
    # No trial of dwb ends before what it waits for.
    assert all(done <= 2 for done, parts in told if parts == ("dwb",))
