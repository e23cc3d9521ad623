"""The call of a controller, ours or a third party's: its time, its errors, its checked result."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import Decision
from drake_navbench.errors import is_machine_fault
from drake_navbench.logs.log import as_json
from drake_navbench.trial.systems.diagnostics import is_array, without_arrays
from drake_navbench.trial.systems.ports import COMMAND_SIZE

# The kinds of arrays that a log can hold: flags, whole numbers, numbers, text.
LOGGABLE_KINDS = "biufU"
# The kinds of numbers of a velocity: no complex numbers, flags or text, though numpy would convert.
REAL_KINDS = "iuf"
# The most characters of one cycle's numbers, text and flags as JSON.
MAX_NOTE_LENGTH = 100_000
# The types of most cycles' values. Their JSON has at most PLAIN_LENGTH characters a value and
# LETTER_LENGTH a letter; where this bound is short enough, no JSON is written to measure it.
PLAIN_TYPES = frozenset({float, bool, type(None), str})
PLAIN_LENGTH, LETTER_LENGTH = 30, 12


class Stopwatch(NamedTuple):
    """The start of a call: by the wall clock, and by the thread's processor time, s."""

    wall_s: float
    cpu_s: float

    @classmethod
    def started(cls) -> Stopwatch:
        """Returns a stopwatch that begins now."""
        return cls(time.perf_counter(), time.thread_time())

    def elapsed_ms(self) -> tuple[float, float]:
        """Returns the wall-clock and the processor time since the start, ms."""
        return 1e3 * (time.perf_counter() - self.wall_s), 1e3 * (time.thread_time() - self.cpu_s)


class PluginBroke(Exception):
    """A plugin broke its contract; error: the exception raised."""

    def __init__(self, error: BaseException) -> None:
        super().__init__()
        self.error = error


class PluginCode:
    """Guards calls of a plugin, which may break in any way: its own trial ends, never the campaign.

    Raises PluginBroke, but not for Ctrl-C of the user nor for a fault of the machine.
    """

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        # Drake reports a failed C++ check as SystemExit; plugins may raise anything.
        if error is None or isinstance(error, KeyboardInterrupt) or is_machine_fault(error):
            return
        raise PluginBroke(error) from error


def checked_command(decision: Decision, *, moves_sideways: bool) -> NDArray[np.float64]:
    """Returns (3,) the command; raises ValueError for a command that the base cannot follow."""
    given = np.asarray(decision.command)
    is_real = given.dtype.kind in REAL_KINDS and given.shape in ((2,), (3,))
    command = np.zeros(COMMAND_SIZE)
    if is_real:
        command[: given.size] = given
    if not is_real or not all(map(math.isfinite, command.tolist())):
        raise ValueError(
            f"the controller returned the command {decision.command!r}; "
            "expected two finite numbers, v m/s and w rad/s, or a third one, vy m/s"
        )
    if command[2] != 0.0 and not moves_sideways:
        raise ValueError(
            f"the controller commanded vy = {command[2]:g} m/s; expected 0, because the base of "
            "this robot does not move sideways"
        )
    return command


def require_loggable(name: str, values: Mapping[str, Any]) -> None:
    """Raises TypeError or ValueError where a log could not hold a controller's values."""
    if type(values) is dict and _is_short(values):
        return
    if not isinstance(values, Mapping):
        raise TypeError(f"{name}: expected a mapping, got {type(values).__name__}")
    for key, value in values.items():
        if not isinstance(key, str):
            raise TypeError(f"{name}: expected text as keys, got {key!r}")
        if is_array(value) and value.dtype.kind not in LOGGABLE_KINDS:
            raise TypeError(
                f"{name}: {key}: expected numbers or text, got an array of {value.dtype}"
            )
    length = len(as_json(without_arrays(values)))
    if length > MAX_NOTE_LENGTH:
        raise ValueError(f"{name}: {length} characters of JSON, expected at most {MAX_NOTE_LENGTH}")


def _is_short(values: dict[Any, Any]) -> bool:
    """Returns whether values are of PLAIN_TYPES under text keys, and short enough as JSON."""
    length = 0
    for key, value in values.items():
        kind = type(value)
        if type(key) is not str or kind not in PLAIN_TYPES:
            return False
        length += PLAIN_LENGTH + LETTER_LENGTH * (len(key) + (len(value) if kind is str else 0))
    return length <= MAX_NOTE_LENGTH
