"""Runs tasks in processes of their own: whatever a task does, the caller learns how it ended.

Every worker is forked from multiprocessing's fork server and has one pipe to the caller, which no
other process holds. Results come through the pipe. When the pipe closes, the process at its other
end has died. So a worker that dies in any way takes no other with it, and a worker whose caller has
died ends at once. Pools whose workers share a pipe lose tasks: where two workers of pebble 5.2.3
were killed at random moments, 14 to 134 of 400 tasks ended before the whole pool broke.
"""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import forkserver
from multiprocessing.connection import Connection, wait
from types import ModuleType
from typing import Any, Literal, NamedTuple

from drake_navbench.errors import OUTSIDE_SIGNALS, InputError, NavbenchError, one_line
from drake_navbench.processes.worker_process import BEGUN, Raised, Returned, serve

# If this many workers in a row end before their first task, it is no accident.
MAX_FAILED_STARTS = 3
# The patience with a first start, which compiles the kernels and takes a minute, s.
START_LIMIT_S = 600.0
# multiprocessing's exit code if the fork server died, so that the real one is unknown.
UNKNOWN_EXIT_CODE = 255
EXIT_PATIENCE_S = 1.0
LONGEST_WAIT_S = 3600.0
BLAS_THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")
# The prefix of environment variables whose present values every worker gets when it starts.
OWN_VARIABLES = "DRAKE_NAVBENCH_"


@dataclass(frozen=True, eq=False)
class Task:
    """A call to be made in a worker.

    function: importable by name. arguments: picklable, as its result is. time_limit_s: wall-clock
    time after which its worker is killed. owner: the package whose code it runs besides ours, ''
    for none; a worker never serves two owners, so that no package can spoil another's tasks. kind:
    tasks of one kind take about equally long; '' where their duration is unknown. after: tasks that
    have to end before this one begins, the same for all of a kind. is_urgent: whether it comes
    before tasks that are not urgent.
    """

    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    time_limit_s: float = math.inf
    owner: str = ""
    kind: str = ""
    after: tuple[Task, ...] = ()
    is_urgent: bool = False


class TimedOut(NamedTuple):
    """The worker was killed because the task took too long."""

    limit_s: float

    @property
    def sentence(self) -> str:
        """The reason why there is no result."""
        return f"no result after {self.limit_s:g} s of wall clock; ended"


class Died(NamedTuple):
    """The worker died.

    sentence: how it died. is_from_outside: the cause was something else than the task, as far as
    one can tell. is_killed: a signal ended this worker; the task itself may have sent it.
    """

    sentence: str
    is_from_outside: bool
    is_killed: bool = False


Failure = Raised | TimedOut | Died
Ending = Returned | Failure


class NoWorkers(NavbenchError):
    """No worker can be started, such as where the system allows no more processes."""


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


class StandingWorker:
    """A worker that serves task after task, so that modules and kernels are loaded once.

    It starts with its first task. It is replaced when it has died, after `tasks_per_worker` tasks,
    and for tasks of another owner.
    """

    def __init__(self, tasks_per_worker: float = math.inf) -> None:
        self._tasks_per_worker = tasks_per_worker
        self._worker: _Worker | None = None

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
                self._worker = _Worker(task)
            else:
                self._worker.begin(task)
        except (OSError, EOFError) as error:
            raise NoWorkers(f"no worker can be started: {one_line(error)}") from error
        return self._ending_of(self._worker)

    def _ending_of(self, worker: _Worker) -> Ending:
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


class _Waiting:
    """The tasks that no worker has begun.

    Finding the next one takes equally long however many wait: only the first of an owner and kind
    can be it.
    """

    def __init__(self, tasks: Sequence[Task]) -> None:
        self._awaited = {before for task in tasks for before in task.after} & set(tasks)
        self._places = {task: place for place, task in enumerate(tasks)}
        self._queues: dict[tuple[str, str], deque[Task]] = {}
        self._times_s: dict[str, float] = {}
        for task in tasks:
            self._queue_of(task).append(task)

    def __bool__(self) -> bool:
        return any(self._queues.values())

    def take(self, owner: str | None = None) -> Task | None:
        """Removes and returns the task to begin first; None where none may begin.

        A task of a kind that was never timed comes first, as it may be the longest. owner: only
        tasks of this owner; None: of any.
        """
        queues = [
            queue
            for (own, _), queue in self._queues.items()
            if queue and owner in (None, own) and self._awaited.isdisjoint(queue[0].after)
        ]
        first = min(queues, key=lambda queue: self._urgency(queue[0]), default=None)
        return None if first is None else first.popleft()

    def has_some_of(self, owner: str) -> bool:
        """Returns whether tasks of an owner wait, even if they may not begin yet."""
        return any(queue for (own, _), queue in self._queues.items() if own == owner)

    def end(self, task: Task) -> None:
        """Notes that a task has ended, so that tasks waiting for it may begin."""
        self._awaited.discard(task)

    def put_back(self, task: Task) -> None:
        """Puts a task back that was not begun after all."""
        self._queue_of(task).appendleft(task)

    def learn(self, task: Task, time_s: float) -> None:
        """Records the duration of a task, as an estimate for tasks of its kind."""
        self._times_s[task.kind] = time_s

    def _queue_of(self, task: Task) -> deque[Task]:
        return self._queues.setdefault((task.owner, task.kind), deque())

    def _urgency(self, task: Task) -> tuple[bool, float, int]:
        time_s = self._times_s.get(task.kind, math.inf)
        return not task.is_urgent, -time_s, self._places[task]


class _Crew:
    """The workers and the tasks that wait for them."""

    def __init__(self, tasks: Sequence[Task], jobs: int, tasks_per_worker: float) -> None:
        self._waiting = _Waiting(tasks)
        self._jobs = jobs
        self._tasks_per_worker = tasks_per_worker
        self._workers: list[_Worker] = []
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
                self._workers.append(_Worker(task))
            except (OSError, EOFError) as error:
                self._waiting.put_back(task)
                self._count_failed_start(one_line(error))

    def collect(self) -> Iterator[tuple[Task, Ending]]:
        """Waits until something happens; yields the tasks that have ended."""
        deadline_s = min((worker.deadline_s for worker in self._workers), default=-math.inf)
        patience_s = min(max(deadline_s - time.monotonic(), 0.0), LONGEST_WAIT_S)
        signs: dict[Any, _Worker] = {
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

    def _stays(self, idle: _Worker) -> bool:
        is_awaited = any(not worker.is_idle for worker in self._workers)
        return is_awaited and self._waiting.has_some_of(idle.owner)

    def _drop(self, worker: _Worker) -> None:
        worker.stop()
        self._workers.remove(worker)


def _own_variables() -> dict[str, str]:
    """Returns the environment variables of this project, by name."""
    return {name: value for name, value in os.environ.items() if name.startswith(OWN_VARIABLES)}


class _Worker:
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
        """Hands a task to the process; if the process has died, `listen` will tell."""
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
