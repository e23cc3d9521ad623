"""A call that a worker makes, and the ways in which it ends."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from drake_navbench.errors import NavbenchError
from drake_navbench.processes.worker_process import Raised, Returned


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
