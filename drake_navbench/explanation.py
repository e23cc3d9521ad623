"""The reasons of one decision, as a controller tells them; docs/why.md shows them.

A controller that can tell them has the method `explain`; see `ExplainingController`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from drake_navbench.controller import Observation
from drake_navbench.kernels.arrays import Array

Cell = float | int | str | None
Row = tuple[Cell, ...]


class Explanation(NamedTuple):
    """The reasons of a controller's command in one cycle.

    command: as in `Decision`; None where the cycle had none.
    sentence: the reason in one sentence, with numbers and units.
    columns, rows: a table; the first column names the subject of the row, such as a critic. Numbers
        are rounded where they are printed; None is an empty cell.
    notes: further sentences.
    """

    command: Array | None
    sentence: str
    columns: tuple[str, ...]
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()

    def gives(self, command: Array | None) -> bool:
        """Returns whether the explained command equals `command` to the last bit."""
        if self.command is None or command is None:
            return self.command is None and command is None
        ours, theirs = (_padded(given) for given in (self.command, command))
        return ours.tobytes() == theirs.tobytes()


class ControlCycle(NamedTuple):
    """One call of the controller, and its outcome.

    observation, memory: the inputs of the call. command: (3,) as published, v m/s, w rad/s, vy m/s;
    None where the controller raised a ControllerError, whose text is `failure`.
    """

    observation: Observation
    memory: Any
    command: Array | None
    failure: str = ""


class SpeedRule(NamedTuple):
    """A rule that bounds the speed of a cycle.

    speed: the bound, m/s. because: the facts behind it, for the table. words: the end of the
    sentence 'drives 0.2 m/s: ...' if this rule sets the speed.
    """

    name: str
    speed: float
    because: str
    words: str


SPEED_COLUMNS = ("rule", "speed [m/s]", "sets it", "because")


def speed_rows(rules: Sequence[SpeedRule], setting: SpeedRule | None) -> tuple[Row, ...]:
    """Returns the rows of SPEED_COLUMNS; setting: the rule that sets the speed."""
    return tuple(
        (rule.name, rule.speed, "*" if rule is setting else "", rule.because) for rule in rules
    )


def collision_stop(
    name: str, command: Array, ahead_s: float, rules: Sequence[SpeedRule]
) -> Explanation:
    """Returns the reasons of a stop because the arc of a command meets an obstacle.

    name: name of the controller. command: (2,) v m/s, w rad/s. ahead_s: time along its arc
    until the outline touches. rules: the rules that made the command.
    """
    told = f"on the arc of {command_text(command)} the outline hits an obstacle in {ahead_s:.2f} s"
    stop = SpeedRule("collision stop", 0.0, told, told)
    return Explanation(
        None, f"{name} stops: {told}.", SPEED_COLUMNS, speed_rows([*rules, stop], stop)
    )


def length_text(metres: float) -> str:
    """Returns a length in words: '0.48 m', or 'infinite'."""
    return "infinite" if math.isinf(metres) else f"{metres:.3g} m"


@runtime_checkable
class ExplainingController(Protocol):
    """A controller that can tell why it decides as it does.

    `drake-navbench why` builds it with `ControllerSetup.wants_diagnostics` and calls `explain` with
    the observation and the memory of one cycle of a trial. `explain` changes neither, as `step`
    does not.
    """

    def explain(self, observation: Observation, memory: Any) -> Explanation:
        """Returns the reasons of the command of `step(observation, memory)`.

        Where `step` raises a ControllerError, the reasons are those of the error, without a
        command.
        """
        ...


def command_text(command: Array) -> str:
    """Returns a command in words: '0.21 m/s, 0.44 rad/s'."""
    v, w, *vy = (float(value) + 0.0 for value in command)
    text = f"{v:.3g} m/s"
    if vy and vy[0] != 0.0:
        text += f", {vy[0]:.3g} m/s to the left"
    return f"{text}, {w:.3g} rad/s"


def _padded(command: Array) -> Array:
    """Returns (3,) v, w, vy without a sign of zero."""
    padded = np.zeros(3)
    padded[: len(command)] = command
    return padded + 0.0
