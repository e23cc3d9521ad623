"""The inside of a worker: takes calls from a pipe, makes them, and sends back their endings."""

from __future__ import annotations

import math
import os
import pickle
import queue
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from typing import Any, Final, NamedTuple

from drake_navbench.errors import (
    EndedFromOutside,
    InputError,
    NavbenchError,
    one_line,
    printable,
)

# An alarm ends a worker this long after its task's time limit, s. A task that holds the
# interpreter's lock keeps the worker from noticing that its caller has died.
ALARM_MARGIN_S = 60.0
# The message that a worker sends when it begins a call.
BEGUN: Final = "begun"


class Returned(NamedTuple):
    """The task's function returned."""

    value: Any


class Raised(NamedTuple):
    """The ending of a task whose function raised.

    error: the exception, if it is of a class that callers distinguish; else a TaskFailed.
    """

    error: NavbenchError

    @property
    def sentence(self) -> str:
        """The reason why there is no result."""
        return str(self.error)


class TaskFailed(NavbenchError):
    """The exception of a task, in a line; `details` has its traceback."""

    def __init__(self, message: str, details: str = "") -> None:
        super().__init__(message, details)
        self.details = details

    def __str__(self) -> str:
        return printable(self.args[0])


def serve(connection: Connection, variables: Mapping[str, str]) -> None:
    """Runs the tasks that come through the pipe, in the worker, until the pipe closes.

    variables: the project's environment variables as they are now in the caller; the server that
    the worker is forked from may have started before they were set.
    """
    os.environ.update(variables)
    # Ctrl-C reaches the whole process group; only the caller decides what it means.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    calls: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=_receive, args=(connection, calls), daemon=True).start()
    while True:
        call = calls.get()
        try:
            connection.send(BEGUN)
            ending = _ending_of(*call)
            _flush_output()
            connection.send_bytes(_pickled(ending))
        except OSError:
            # The caller is gone, or a task has closed this end.
            os._exit(1)


def _receive(connection: Connection, calls: queue.SimpleQueue[Any]) -> None:
    """Puts the calls from the pipe into the queue; ends the process when the caller is gone."""
    while True:
        try:
            calls.put(connection.recv())
        except (EOFError, OSError):
            os._exit(1)
        except Exception as error:
            # The message cannot be unpickled, as where a module cannot be imported.
            calls.put((_raise, (error,), math.inf))


def _ending_of(
    function: Callable[..., Any], arguments: tuple[Any, ...], time_limit_s: float
) -> Returned | Raised:
    if math.isfinite(time_limit_s):
        signal.setitimer(signal.ITIMER_REAL, time_limit_s + ALARM_MARGIN_S)
    try:
        return Returned(function(*arguments))
    except (InputError, EndedFromOutside) as error:
        return Raised(error)
    except BaseException as error:
        return Raised(TaskFailed(one_line(error), traceback.format_exc()))
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def _pickled(ending: Returned | Raised) -> bytes:
    try:
        return pickle.dumps(ending)
    except Exception as error:
        return pickle.dumps(Raised(TaskFailed(one_line(error), traceback.format_exc())))


def _flush_output() -> None:
    """Flushes the output of a task, since the process may end without closing its files."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (AttributeError, OSError, ValueError):
            continue


def _raise(error: BaseException) -> None:
    raise error
