"""Runs each task in a worker process, and tells the caller how each ended.

Every worker is forked from multiprocessing's fork server and has one pipe to the caller, which no
other process holds. Results come through the pipe. When the pipe closes, the process at its other
end has died. So a worker that dies in any way takes no other with it, and a worker whose caller has
died ends at once. Pools whose workers share a pipe lose tasks: where two workers of pebble 5.2.3
were killed at random moments, 14 to 134 of 400 tasks ended before the whole pool broke.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Generator, Iterator, Sequence
from multiprocessing import forkserver
from multiprocessing.connection import wait
from typing import Any

from drake_navbench.errors import InputError, one_line
from drake_navbench.processes.tasks import Died, Ending, NoWorkers, Task, TimedOut
from drake_navbench.processes.waiting_tasks import WaitingTasks
from drake_navbench.processes.worker import LONGEST_WAIT_S, START_LIMIT_S, Worker
from drake_navbench.processes.worker_process import BEGUN, Returned

# If this many workers in a row end before their first task, it is no accident.
MAX_FAILED_STARTS = 3
BLAS_THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")


def start_server(preload: Sequence[str]) -> None:
    """Starts the process that workers are forked from, unless it runs; does not wait for it.

    preload: the modules that this process imports, once for all workers.
    """
    for variable in BLAS_THREAD_VARIABLES:
        # Each worker has one core, for which threads of a linear algebra library would only
        # compete.
        os.environ.setdefault(variable, "1")
    forkserver.set_forkserver_preload(list(preload))
    forkserver.ensure_running()


def run_tasks(
    tasks: Sequence[Task], *, jobs: int, tasks_per_worker: float = math.inf
) -> Generator[tuple[Task, Ending], None, None]:
    """Runs tasks in up to `jobs` workers; yields (task, ending) in the order in which tasks end.

    Urgent tasks come first, then one task of each kind, then those of the kind that took longest,
    so that no worker begins a long task when the others have nothing left to do. Tasks of one kind
    keep their order.

    tasks_per_worker: a worker is replaced after so many. When the iterator is closed, also by an
    exception, all workers are gone. Raises InputError for less than one worker, NoWorkers where no
    worker can be started.
    """
    require_workers(jobs)
    crew = _Crew(tasks, jobs, tasks_per_worker)
    try:
        while crew.is_busy:
            crew.hand_out()
            yield from crew.collect()
    finally:
        crew.dismiss()


def require_workers(jobs: int) -> None:
    """Raises InputError unless `jobs` is a number of workers, at least 1."""
    if jobs < 1:
        raise InputError(f"jobs: expected at least 1, got {jobs}")


class _Crew:
    """The workers and the tasks that wait for them."""

    def __init__(self, tasks: Sequence[Task], jobs: int, tasks_per_worker: float) -> None:
        self._waiting = WaitingTasks(tasks)
        self._jobs = jobs
        self._tasks_per_worker = tasks_per_worker
        self._workers: list[Worker] = []
        self._failed_starts = 0

    @property
    def is_busy(self) -> bool:
        return bool(self._waiting or self._workers)

    def hand_out(self) -> None:
        """Gives every idle worker a task, ends those without one, and starts missing workers.

        A worker stays if its owner's tasks wait for another worker's.
        """
        for worker in [worker for worker in self._workers if worker.is_idle]:
            is_due = worker.tasks_done >= self._tasks_per_worker
            task = None if is_due else self._waiting.take(worker.owner)
            if task is not None:
                worker.begin(task)
            elif is_due or not self._stays(worker):
                self._drop(worker)
        while len(self._workers) < self._jobs and (task := self._waiting.take()):
            try:
                self._workers.append(Worker(task))
            except (OSError, EOFError) as error:
                self._waiting.put_back(task)
                self._count_failed_start(one_line(error))

    def collect(self) -> Iterator[tuple[Task, Ending]]:
        """Waits until something happens; yields the tasks that have ended."""
        deadline_s = min((worker.deadline_s for worker in self._workers), default=-math.inf)
        patience_s = min(max(deadline_s - time.monotonic(), 0.0), LONGEST_WAIT_S)
        signs: dict[Any, Worker] = {
            sign: worker for worker in self._workers for sign in worker.signs
        }
        stirring = wait(signs, timeout=patience_s)
        for worker in dict.fromkeys(signs[sign] for sign in stirring):
            task, said = worker.task, worker.listen()
            if said == BEGUN:
                self._failed_starts = 0
                continue
            if isinstance(said, Died):
                self._drop(worker)
                if worker.is_idle:
                    # Its last task has ended before.
                    continue
                if not worker.has_begun:
                    self._waiting.put_back(task)
                    self._count_failed_start(said.sentence)
                    continue
            if isinstance(said, Returned):
                self._waiting.learn(task, worker.last_task_s)
            self._waiting.end(task)
            yield task, said
        now_s = time.monotonic()
        for worker in [worker for worker in self._workers if worker.deadline_s < now_s]:
            self._drop(worker)
            if worker.has_begun:
                self._waiting.end(worker.task)
                yield worker.task, TimedOut(worker.task.time_limit_s)
            else:
                self._waiting.put_back(worker.task)
                self._count_failed_start(f"one did not start within {START_LIMIT_S:g} s")

    def dismiss(self) -> None:
        """Ends all workers at once."""
        for worker in list(self._workers):
            self._drop(worker)

    def _count_failed_start(self, reason: str) -> None:
        self._failed_starts += 1
        if self._failed_starts >= MAX_FAILED_STARTS:
            raise NoWorkers(
                f"workers cannot be started, {self._failed_starts} in a row failed: {reason}"
            )

    def _stays(self, idle: Worker) -> bool:
        is_awaited = any(not worker.is_idle for worker in self._workers)
        return is_awaited and self._waiting.has_some_of(idle.owner)

    def _drop(self, worker: Worker) -> None:
        worker.stop()
        self._workers.remove(worker)
