"""The workers of a studio: one checks and reads, one drives; both stay warm."""

from __future__ import annotations

import os
import signal
import tempfile
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import Any

from drake_navbench.errors import NavbenchError
from drake_navbench.processes.standing_worker import StandingWorker
from drake_navbench.processes.tasks import Task
from drake_navbench.processes.worker_process import Returned
from drake_navbench.processes.workers import start_server

# The workers share these modules, which are loaded once, before they begin.
PRELOAD_MODULES = ["drake_navbench.campaign.worker_preload", "drake_navbench.studio.tasks"]
# Columns that the first click is likely to ask for; they are driven once beforehand, in this order.
WARM_COLUMNS = ("rpp", "dwb")
# The limit is long because a trial in a world with many people may take that long; the user can
# stop it.
DRIVE_LIMIT_S = 1800.0
LOOK_LIMIT_S = 120.0
# A worker that drives holds 0.1 MB more after each trial, so it is replaced now and then; a new one
# has to load the kernels again.
TASKS_PER_WORKER = 500
# Logs of the studio's trials that are kept for the page Live, the newest; older ones are deleted.
KEPT_LOGS = 6


class NoResult(NavbenchError):
    """A worker's task came to no result: it was stopped, took too long or the worker died."""


class _WaitedFor:
    """A standing worker with a thread that waits for it, so that the pages never do."""

    def __init__(self, limit_s: float) -> None:
        self._worker = StandingWorker(TASKS_PER_WORKER)
        self._waiter = ThreadPoolExecutor(1)
        self._limit_s = limit_s

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        return self._waiter.submit(self._called, Task(function, arguments, self._limit_s))

    def _called(self, task: Task) -> Any:
        ending = self._worker.call(task)
        if isinstance(ending, Returned):
            return ending.value
        error = getattr(ending, "error", None)
        raise error if error is not None else NoResult(ending.sentence)

    def stop(self) -> None:
        """Ends the task that runs, with its worker; the next task gets a new one."""
        pid = self._worker.pid
        if pid is not None:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)

    def close(self) -> None:
        self._waiter.shutdown(wait=False, cancel_futures=True)
        self.stop()


class Engine:
    """Two worker processes, one task each at a time: one checks and reads, the other drives.

    Every method returns at once; the Future has the result, or the error in a line.
    """

    def __init__(self) -> None:
        load_workers()
        self._looks, self._drives = _WaitedFor(LOOK_LIMIT_S), _WaitedFor(DRIVE_LIMIT_S)
        self._folder = tempfile.TemporaryDirectory(prefix="drake-navbench-studio-")
        self._numbers = count()
        self.metrics, *_ = [self.drive("warm", name) for name in WARM_COLUMNS]

    @property
    def is_warm(self) -> bool:
        """Whether the worker that drives has driven its first column."""
        return self.metrics.done()

    def look(self, name: str, *arguments: Any) -> Future[Any]:
        """Calls a function of the module `tasks` in the worker that looks."""
        return self._looks.submit(_call, name, arguments)

    def drive(self, name: str, *arguments: Any) -> Future[Any]:
        """Calls a function of the module `tasks` in the worker that drives."""
        return self._drives.submit(_call, name, arguments)

    def new_log(self) -> str:
        """Returns the path of a log that does not exist yet; deletes old ones."""
        folder = Path(self._folder.name)
        for old in sorted(folder.glob("*.parquet"))[: -KEPT_LOGS + 1]:
            old.unlink(missing_ok=True)
        return str(folder / f"{next(self._numbers):06d}.parquet")

    def stop_driving(self) -> None:
        """Ends the trial that runs."""
        self._drives.stop()

    def close(self) -> None:
        """Ends the workers and deletes the logs."""
        self._looks.close()
        self._drives.close()
        self._folder.cleanup()


def load_workers() -> None:
    """Starts to load the workers' modules, unless that has begun already; returns at once."""
    start_server(PRELOAD_MODULES)


def _call(name: str, arguments: tuple[Any, ...]) -> Any:
    """Calls a function of the module `tasks`, which this process loads and its caller need not."""
    from drake_navbench.studio import tasks

    return getattr(tasks, name)(*arguments)
