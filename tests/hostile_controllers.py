"""Controllers that break every promise: what one of them does must not reach any other trial.

Each class is a plugin as somebody might install it. `EXPECTED` says what the log of its trial must
tell, `LEFT_OUT` which of them leave no log because what they meet counts as the machine's.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
import time

import numpy as np

from drake_navbench.controller import ControllerError, ControllerParameters, Decision

MANY = 3_000_000


class Honest:
    """Stands still; the others derive from it."""

    Parameters = ControllerParameters
    nav2_plugin = None

    def __init__(self, parameters, setup):
        pass

    def initial_memory(self):
        return 0

    def step(self, observation, memory):
        return Decision(np.array([0.2, 0.0]), memory + 1)


class KillsItself(Honest):
    """Looks as if the system had ended its worker."""

    def step(self, observation, memory):
        os.kill(os.getpid(), signal.SIGKILL)


class RaisesInterrupt(Honest):
    def step(self, observation, memory):
        raise KeyboardInterrupt


class RaisesExit(Honest):
    def step(self, observation, memory):
        sys.exit("no licence")


class RaisesGeneratorExit(Honest):
    def initial_memory(self):
        raise GeneratorExit("done")


class Unheard(BaseException):
    """An exception of no known kind, whose text cannot be had."""

    def __str__(self):
        raise RuntimeError("no text")


class RaisesUnheard(Honest):
    def step(self, observation, memory):
        raise Unheard


class RaisesMuch(Honest):
    def step(self, observation, memory):
        raise ValueError("x" * MANY)


class FailsWithMuch(Honest):
    def step(self, observation, memory):
        raise ControllerError("a\n" * MANY)


class FailsInColour(Honest):
    def step(self, observation, memory):
        raise ControllerError("\x1b[31mred\x00 and [bold]loud[/]")


class LeavesQuietly(Honest):
    def step(self, observation, memory):
        os._exit(0)


class ReadsNowhere(Honest):
    def step(self, observation, memory):
        ctypes.string_at(0)


class SleepsWithTheLock(Honest):
    """Holds the interpreter's lock, so that no other thread of the process runs."""

    def step(self, observation, memory):
        ctypes.PyDLL(None).sleep(1000)


class IgnoresSignals(Honest):
    def step(self, observation, memory):
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        time.sleep(1000.0)


class ClosesFiles(Honest):
    def step(self, observation, memory):
        os.closerange(0, 1000)
        return super().step(observation, memory)


class ReturnsNothing(Honest):
    def step(self, observation, memory):
        return None


class ReturnsNaN(Honest):
    def step(self, observation, memory):
        return Decision(np.array([np.nan, 0.0]))


class ReturnsComplex(Honest):
    def step(self, observation, memory):
        return Decision(np.array([0.2 + 1.0j, 0.0]))


class ReturnsText(Honest):
    def step(self, observation, memory):
        return Decision(("0.2", "0.0"))


class ReturnsFour(Honest):
    def step(self, observation, memory):
        return Decision(np.zeros(4))


class NotesMuch(Honest):
    def step(self, observation, memory):
        return Decision(np.zeros(2), memory, {"note": "x" * MANY})


class NotesASet(Honest):
    def step(self, observation, memory):
        return Decision(np.zeros(2), memory, {"note": {1, 2}})


class ChangesWhatItSees(Honest):
    def step(self, observation, memory):
        observation.plan[:] = 0.0
        return super().step(observation, memory)


class Recurses(Honest):
    def step(self, observation, memory):
        return self.step(observation, memory)


class Spoils(Honest):
    """Changes everything within reach, also of our code in its process, and drives on."""

    def step(self, observation, memory):
        os.chdir("/")
        os.environ.clear()
        np.hypot = np.cos = lambda *values: np.float64(1.0)
        time.perf_counter = time.time = lambda: 0.0
        sys.path.clear()
        sys.setrecursionlimit(100)
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        return super().step(observation, memory)


class EndsLater(Honest):
    """Ends its process when nobody thinks of it any more."""

    def step(self, observation, memory):
        if memory == 0:
            threading.Timer(1.0, os._exit, [3]).start()
        return super().step(observation, memory)


class RunsOutOfMemory(Honest):
    def step(self, observation, memory):
        np.ones(10**15)


EXPECTED = {
    RaisesInterrupt: "KeyboardInterrupt",
    RaisesMuch: "ValueError: xxx",
    LeavesQuietly: "the worker process died with exit code 0",
    ReadsNowhere: "the worker process was ended by signal 11 (Segmentation fault)",
    ClosesFiles: "",
}
# Who never answers; each costs its trial the whole time limit.
HANGING = (SleepsWithTheLock, IgnoresSignals)
# What their trial notices itself, in whatever process it is driven.
NOTICED = {
    RaisesExit: "SystemExit: no licence",
    RaisesGeneratorExit: "GeneratorExit: done",
    RaisesUnheard: "Unheard",
    NotesMuch: "ValueError: diagnostics: 3000012 characters of JSON, expected at most 100000",
    ReturnsNothing: "AttributeError: ",
    ReturnsNaN: "ValueError: the controller returned the command array([nan,  0.])",
    ReturnsComplex: "ValueError: the controller returned the command array([0.2+1.j",
    ReturnsText: "ValueError: the controller returned the command ('0.2', '0.0')",
    ReturnsFour: "ValueError: the controller returned the command array([0., 0., 0., 0.])",
    NotesASet: "TypeError: a log may hold numbers, text, flags and arrays, got set",
    ChangesWhatItSees: "ValueError: assignment destination is read-only",
    Recurses: "RecursionError: maximum recursion depth exceeded",
}
# Failures that a controller may have, noticed there, too: the trial is aborted.
ABORTED = {
    FailsWithMuch: "a a a a",
    FailsInColour: r"\x1b[31mred\x00 and [bold]loud[/]",
}
SPOILING = (Spoils, EndsLater)
LEFT_OUT = {RunsOutOfMemory: "MemoryError: Unable to allocate"}
ALL = (*EXPECTED, *SPOILING, *LEFT_OUT)
