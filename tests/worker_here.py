"""A worker that is this process: `run_tasks` without a fork, kernels and modules loaded once.

A real worker is needed where a test kills it, limits it, or looks at how it ends.
"""

from __future__ import annotations

import math
import os
import pickle
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from multiprocessing import Pipe, forkserver
from multiprocessing.connection import Connection

import pytest

from drake_navbench.processes import standing_worker, workers
from drake_navbench.processes.tasks import Task
from drake_navbench.processes.worker_process import Raised, Returned, _ending_of, _pickled


class WorkerHere:
    """What `run_tasks` sees of a worker. Calls and endings are pickled as to and from a process."""

    def __init__(self, task: Task) -> None:
        self._ours, self._theirs = Pipe()
        self.owner = task.owner
        self.tasks_done = 0
        self.begin(task)

    @property
    def signs(self) -> tuple[Connection]:
        """The handle that is ready when a task has ended."""
        return (self._ours,)

    @property
    def pid(self) -> int:
        """The number of this process."""
        return os.getpid()

    @property
    def has_died_idle(self) -> bool:
        """No: it is this process."""
        return False

    def begin(self, task: Task) -> None:
        """Makes the call, and keeps its ending until `listen`."""
        self.task, self.is_idle, self.has_begun = task, False, True
        # It has ended when this returns, however long it takes.
        self.deadline_s = math.inf
        function, arguments = pickle.loads(pickle.dumps((task.function, task.arguments)))
        begun_s = time.monotonic()
        self._ending = _pickled(_ending_of(function, arguments, math.inf))
        self.last_task_s = time.monotonic() - begun_s
        self._theirs.send_bytes(b"ended")

    def listen(self) -> Returned | Raised:
        """Returns how the task ended."""
        self._ours.recv_bytes()
        self.is_idle = True
        self.tasks_done += 1
        return pickle.loads(self._ending)

    def stop(self) -> None:
        """Closes both ends."""
        self._ours.close()
        self._theirs.close()


_PROCESS, _START_SERVER = workers.Worker, forkserver.ensure_running


def working_here() -> AbstractContextManager[None]:
    """Lets `run_tasks` work in this process, and starts no server."""
    return _working_in(WorkerHere, lambda: None)


def working_apart() -> AbstractContextManager[None]:
    """Lets `run_tasks` work in processes of its own, as it does for users."""
    return _working_in(_PROCESS, _START_SERVER)


@contextmanager
def _working_in(worker: type, start_server: Callable[[], None]) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for module in (workers, standing_worker):
            patch.setattr(module, "Worker", worker)
        patch.setattr(forkserver, "ensure_running", start_server)
        yield
