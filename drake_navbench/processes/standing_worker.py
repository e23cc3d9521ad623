"""A worker that is kept from task to task."""

from __future__ import annotations

import math
import time
from multiprocessing.connection import wait

from drake_navbench.errors import one_line
from drake_navbench.processes.tasks import Died, Ending, NoWorkers, Task, TimedOut
from drake_navbench.processes.worker import LONGEST_WAIT_S, Worker
from drake_navbench.processes.worker_process import BEGUN


class StandingWorker:
    """A worker that serves task after task, so that modules and kernels are loaded once.

    It starts with its first task. It is replaced when it has died, after `tasks_per_worker` tasks,
    and for tasks of another owner.
    """

    def __init__(self, tasks_per_worker: float = math.inf) -> None:
        self._tasks_per_worker = tasks_per_worker
        self._worker: Worker | None = None

    @property
    def pid(self) -> int | None:
        """The worker's process id, None without a worker."""
        return None if self._worker is None else self._worker.pid

    def call(self, task: Task) -> Ending:
        """Runs a task and waits for its end; raises NoWorkers where no worker can be started."""
        worker = self._worker
        if worker is not None and (
            worker.tasks_done >= self._tasks_per_worker
            or worker.owner != task.owner
            or worker.has_died_idle
        ):
            self.close()
        try:
            if self._worker is None:
                self._worker = Worker(task)
            else:
                self._worker.begin(task)
        except (OSError, EOFError) as error:
            raise NoWorkers(f"no worker can be started: {one_line(error)}") from error
        return self._ending_of(self._worker)

    def _ending_of(self, worker: Worker) -> Ending:
        while True:
            patience_s = min(max(worker.deadline_s - time.monotonic(), 0.0), LONGEST_WAIT_S)
            if not wait(worker.signs, timeout=patience_s):
                if worker.deadline_s < time.monotonic():
                    self.close()
                    return TimedOut(worker.task.time_limit_s)
                continue
            said = worker.listen()
            if said == BEGUN:
                continue
            if isinstance(said, Died):
                self.close()
            return said

    def close(self) -> None:
        """Ends the process at once; a waiting `call` then returns that it died."""
        worker, self._worker = self._worker, None
        if worker is not None:
            worker.stop()
