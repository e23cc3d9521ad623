"""A worker as its caller sees it: a process, and the one pipe to it."""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection, wait
from types import ModuleType
from typing import Literal

from drake_navbench.errors import OUTSIDE_SIGNALS
from drake_navbench.processes.tasks import Died, Task
from drake_navbench.processes.worker_process import BEGUN, Raised, Returned, serve

# The patience with a first start, which compiles the kernels and takes a minute, s.
START_LIMIT_S = 600.0
# multiprocessing's exit code if the fork server died, so that the real one is unknown.
UNKNOWN_EXIT_CODE = 255
EXIT_PATIENCE_S = 1.0
LONGEST_WAIT_S = 3600.0
# The prefix of environment variables whose present values every worker gets when it starts.
OWN_VARIABLES = "DRAKE_NAVBENCH_"


def _own_variables() -> dict[str, str]:
    """Returns the environment variables of this project, by name."""
    return {name: value for name, value in os.environ.items() if name.startswith(OWN_VARIABLES)}


class Worker:
    """A process and the pipe to it, as the caller sees them.

    task: its latest task. is_idle: whether that task has ended. has_begun: whether the worker has
    begun the task; a task that was not begun may go to another worker. last_task_s: the duration of
    the last task that ended. owner: owner of all its tasks.
    """

    def __init__(self, task: Task) -> None:
        context = multiprocessing.get_context("forkserver")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=serve, args=(theirs, _own_variables()), daemon=True)
        try:
            with _without_main_module():
                self._process.start()
        except BaseException:
            self._connection.close()
            raise
        finally:
            theirs.close()
        self._sentinel = self._process.sentinel
        self.owner = task.owner
        self.tasks_done = 0
        self.last_task_s = self._begun_s = 0.0
        self.begin(task)

    @property
    def pid(self) -> int | None:
        """The number of the process."""
        return self._process.pid

    @property
    def has_died_idle(self) -> bool:
        """Whether the process has died since its last task: an idle one sends nothing."""
        return self.is_idle and bool(wait(self.signs, timeout=0.0))

    @property
    def signs(self) -> tuple[Connection, int]:
        """The handles that become ready when the process has something to say."""
        return self._connection, self._sentinel

    def begin(self, task: Task) -> None:
        """Hands a task to the process; if the process has died, `listen` returns its death."""
        self.task, self.is_idle, self.has_begun = task, False, False
        self.deadline_s = time.monotonic() + START_LIMIT_S
        with suppress(OSError):
            self._connection.send((task.function, task.arguments, task.time_limit_s))

    def listen(self) -> Returned | Raised | Died | Literal["begun"]:
        """Returns the process's message: BEGUN, the end of its task, or its death."""
        try:
            said = self._connection.recv() if self._connection.poll() else None
        except Exception:
            # The pipe is closed, or holds what a broken process wrote.
            said = None
        if said == BEGUN:
            self.has_begun, self._begun_s = True, time.monotonic()
            self.deadline_s = self._begun_s + self.task.time_limit_s
            return BEGUN
        if not isinstance(said, Returned | Raised):
            return self._death()
        self.tasks_done += 1
        self.last_task_s = time.monotonic() - self._begun_s
        self.is_idle, self.deadline_s = True, math.inf
        return said

    def _death(self) -> Died:
        self._process.join(EXIT_PATIENCE_S)
        code = self._process.exitcode
        if code is None:
            return Died("the worker process closed its pipe", is_from_outside=False)
        pid = self._process.pid
        if code == UNKNOWN_EXIT_CODE and pid is not None and _is_alive(pid):
            return Died("the server of the workers died", is_from_outside=True)
        if code >= 0:
            return Died(f"the worker process died with exit code {code}", is_from_outside=False)
        name = signal.strsignal(-code) or "unknown"
        is_from_outside = -code in OUTSIDE_SIGNALS
        return Died(
            f"the worker process was ended by signal {-code} ({name})",
            is_from_outside,
            is_killed=is_from_outside,
        )

    def stop(self) -> None:
        """Ends the process; closing its pipe ends it even where its server has died."""
        self._connection.close()
        self._process.kill()
        self._process.join()
        self._process.close()


@contextmanager
def _without_main_module() -> Iterator[None]:
    """Keeps multiprocessing from running the user's script anew in every worker.

    A task's function is ours and never the script's, so that a script needs no main guard, may come
    from standard input, and does what it does once.
    """
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def _is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except OSError:
        return False
    return True
