"""A worker that stays from task to task, and is replaced when it has died."""

from __future__ import annotations

import os
import signal

import pytest

from drake_navbench.processes.standing_worker import StandingWorker
from drake_navbench.processes.tasks import Died, Task, TimedOut
from drake_navbench.processes.worker_process import Raised, Returned

pytestmark = pytest.mark.usefixtures("real_workers")


def ends_itself() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_standing_worker_keeps_its_process_and_gets_another_after_a_death():
    worker = StandingWorker(tasks_per_worker=2)
    try:
        first = worker.call(Task(os.getpid, ()))
        assert isinstance(first, Returned)
        assert worker.call(Task(os.getpid, ())) == first
        third = worker.call(Task(os.getpid, ()))
        assert third != first
        assert isinstance(worker.call(Task(int, ("x",))), Raised)
        assert isinstance(worker.call(Task(ends_itself, ())), Died)
        assert isinstance(worker.call(Task(os.getpid, (), owner="other")), Returned)
        assert isinstance(worker.call(Task(signal.pause, (), time_limit_s=0.2)), TimedOut)
        assert worker.pid is None
    finally:
        worker.close()


def test_a_worker_that_is_killed_between_two_tasks_does_not_cost_the_next_one():
    """As when a trial is stopped in the moment in which it ends."""
    worker = StandingWorker()
    try:
        first = worker.call(Task(os.getpid, ()))
        os.kill(first.value, signal.SIGKILL)
        while not worker._worker.has_died_idle:
            pass
        assert isinstance(worker.call(Task(os.getpid, ())), Returned)
    finally:
        worker.close()
