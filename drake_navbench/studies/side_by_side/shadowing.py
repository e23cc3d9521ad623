"""A trial that a port drives while its original decides on the same observations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import (
    ClosableController,
    Controller,
    ControllerError,
    ControllerParameters,
    ControllerSetup,
    Decision,
    GracefulController,
    Observation,
    PlanCuttingController,
    memory_of_next_task,
)
from drake_navbench.inputs.presets import Preset

# A controller's command, (2,) v m/s, w rad/s; or the error that it raised instead.
Decided = NDArray[np.float64] | ControllerError


class _Memories(NamedTuple):
    """The memories of the port and of the original."""

    port: Any
    original: Any


@dataclass(frozen=True, eq=False)
class ShadowedPreset(Preset):
    """The column of a port, in which the original decides in every cycle beside the port.

    original: its column, for the same robot. tell: called with both decisions of each cycle.
    """

    original: Preset = field(kw_only=True)
    tell: Callable[[Decided, Decided], None] = field(kw_only=True)

    @property
    def controller_class(self) -> type[Controller]:
        """A controller that decides as the port does."""
        port, original, tell = super().controller_class, self.original, self.tell

        class Shadowed(_Shadowed):
            Parameters: ClassVar[type[ControllerParameters]] = port.Parameters
            nav2_plugin: ClassVar[str | None] = port.nav2_plugin

            def __init__(self, parameters: Any, setup: ControllerSetup) -> None:
                theirs = original.controller_class(original.parameters, setup)
                super().__init__(port(parameters, setup), theirs, tell)

        return Shadowed


def shadowed(port: Preset, original: Preset, tell: Callable[[Decided, Decided], None]) -> Preset:
    """Returns the column of a port that its original shadows."""
    values = {name: getattr(port, name) for name in Preset.__dataclass_fields__}
    return ShadowedPreset(**values, original=original, tell=tell)


def decided(controller: Controller, observation: Observation, memory: Any) -> tuple[Decided, Any]:
    """Returns a controller's command (v m/s, w rad/s), or its error, and its new memory."""
    try:
        decision = controller.step(observation, memory)
    except ControllerError as error:
        return error, memory if error.memory is None else error.memory
    return decision.command[:2], decision.memory


class _Shadowed:
    """A controller that calls port and original in every cycle, and returns the port's command."""

    def __init__(
        self, port: Controller, original: Controller, tell: Callable[[Decided, Decided], None]
    ) -> None:
        self._port, self._original, self._tell = port, original, tell

    @property
    def cuts_plan(self) -> bool:
        return isinstance(self._port, PlanCuttingController) and self._port.cuts_plan

    def initial_memory(self) -> _Memories:
        return _Memories(self._port.initial_memory(), self._original.initial_memory())

    def next_memory(self, memory: _Memories) -> _Memories:
        """Returns the memories at the start of a task that follows another."""
        controllers = (self._port, self._original)
        return _Memories(*map(memory_of_next_task, controllers, memory))

    def step(self, observation: Observation, memory: _Memories) -> Decision:
        theirs, their_memory = decided(self._original, observation, memory.original)
        try:
            decision = self._port.step(observation, memory.port)
        except ControllerError as error:
            self._tell(error, theirs)
            mine = memory.port if error.memory is None else error.memory
            error.memory = _Memories(mine, their_memory)
            raise
        self._tell(decision.command[:2], theirs)
        return decision._replace(memory=_Memories(decision.memory, their_memory))

    def is_at_rest(self, memory: _Memories) -> bool:
        port = self._port
        return not isinstance(port, GracefulController) or port.is_at_rest(memory.port)

    def close(self) -> None:
        for controller in (self._port, self._original):
            if isinstance(controller, ClosableController):
                controller.close()
