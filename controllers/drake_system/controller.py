"""`SystemController`: hosts a Drake System that computes the commands of a controller."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
from pydrake.systems.analysis import InitializeParams, Simulator
from pydrake.systems.framework import Context, InputPort, PortDataType, System

from drake_navbench.controller import (
    ControllerParameters,
    ControllerSetup,
    Decision,
    Observation,
)
from drake_navbench.errors import InputError

COMMAND = "command"
COMMAND_SIZES = (2, 3)
# Sizes of the vector ports that a system may declare; the others are abstract.
VECTOR_SIZES = {"pose": 3, "twist": 3, "goal": 3}
ABSTRACT = ("plan", "global_plan", "costmap", "observation")


class SystemController(ABC):
    """Base of a controller whose command a Drake System computes: a LeafSystem or a Diagram.

    A subclass gives `make_system`, and `Parameters` if it has parameters. The system declares those
    of these input ports that it needs:

    - `pose` (3,) estimated x m, y m, yaw rad; `goal` (3,) likewise, the plan's last pose; both in
      the odometry frame.
    - `twist` (3,) measured v m/s, w rad/s, vy m/s in the base frame.
    - abstract ones: `plan` (M, 3), `global_plan` (N, 3), `costmap` and `observation`, each with the
      value that `Observation` has.

    Its output port `command` has v m/s, w rad/s and, for a base that moves sideways, vy m/s.

    In each control cycle the system is simulated to the cycle's time with the inputs of the cycle
    before it. Then it gets the new inputs, its periodic events of that instant and its forced
    events are handled, and its output is the command; so a forced event happens once a cycle. Its
    Context is the controller's memory: everything that evolves must be a state in it. A
    ControllerError that one of its functions raises is that of the cycle.
    """

    Parameters: ClassVar[type[ControllerParameters]] = ControllerParameters
    nav2_plugin: ClassVar[str | None] = None

    def __init__(self, parameters: Any, setup: ControllerSetup) -> None:
        self._system = self.make_system(parameters, setup)
        if not isinstance(self._system, System):
            found = type(self._system).__name__
            raise InputError(f"{self._name}.make_system: got {found}, expected a System of Drake")
        self._inputs = [
            self._checked(self._system.get_input_port(index))
            for index in range(self._system.num_input_ports())
        ]
        if not self._system.HasOutputPort(COMMAND):
            raise InputError(f"{self._name}: expected an output port {COMMAND!r}")
        self._command = self._system.GetOutputPort(COMMAND)
        if self._command.size() not in COMMAND_SIZES:
            raise InputError(
                f"{self._name}: output port {COMMAND!r}: got {self._command.size()} numbers, "
                "expected 2 or 3"
            )

    @abstractmethod
    def make_system(self, parameters: Any, setup: ControllerSetup) -> System:
        """Returns the system that computes the commands of one trial."""

    def initial_memory(self) -> Context | None:
        """Returns None: the Context is made at the first cycle, at that cycle's time."""
        return None

    def step(self, observation: Observation, memory: Context | None) -> Decision:
        """Returns the output of the system, and its Context as the memory."""
        time_s = observation.time_s
        is_first = memory is None
        if memory is None:
            context = self._system.CreateDefaultContext()
            context.SetTime(time_s)
            self._set_inputs(context, observation)
        else:
            context = memory.Clone()
        simulator = Simulator(self._system, context)
        simulator.Initialize(InitializeParams(suppress_initialization_events=not is_first))
        if not is_first:
            simulator.AdvanceTo(time_s)
            self._set_inputs(context, observation)
        simulator.AdvancePendingEvents()
        context = self._after_forced_events(context)
        command = np.array(self._command.Eval(context))
        # The next cycle's Simulator would handle the events of this instant once more.
        context.SetTime(math.nextafter(time_s, math.inf))
        return Decision(command, context)

    def _after_forced_events(self, context: Context) -> Context:
        """Returns the Context after the updates that happen once a cycle."""
        discrete = self._system.AllocateDiscreteVariables()
        self._system.CalcForcedDiscreteVariableUpdate(context, discrete)
        context.get_mutable_discrete_state().SetFrom(discrete)
        updated = context.Clone()
        self._system.CalcForcedUnrestrictedUpdate(context, updated.get_mutable_state())
        return updated

    @property
    def _name(self) -> str:
        return type(self).__name__

    def _checked(self, port: InputPort) -> InputPort:
        """Returns an input port; raises InputError if no observation has a value for it."""
        name = port.get_name()
        is_vector = port.get_data_type() == PortDataType.kVectorValued
        if name not in VECTOR_SIZES and name not in ABSTRACT:
            expected = ", ".join((*VECTOR_SIZES, *ABSTRACT))
            raise InputError(f"{self._name}: input port {name!r}: expected one of {expected}")
        if is_vector != (name in VECTOR_SIZES):
            kind = f"a vector of {VECTOR_SIZES[name]} numbers" if not is_vector else "abstract"
            raise InputError(f"{self._name}: input port {name!r}: expected it to be {kind}")
        if is_vector and port.size() != VECTOR_SIZES[name]:
            raise InputError(
                f"{self._name}: input port {name!r}: got {port.size()} numbers, expected "
                f"{VECTOR_SIZES[name]}"
            )
        return port

    def _set_inputs(self, context: Context, observation: Observation) -> None:
        """Fixes the input ports of the system to the values of an observation."""
        for port in self._inputs:
            name = port.get_name()
            if name in VECTOR_SIZES:
                port.FixValue(context, _vector(name, observation))
                continue
            value = self._system.AllocateInputAbstract(port)
            value.set_value(observation if name == "observation" else getattr(observation, name))
            port.FixValue(context, value)


def _vector(name: str, observation: Observation) -> np.ndarray:
    if name == "twist":
        return np.append(observation.twist, observation.vy_mps)
    return np.array(getattr(observation, name), dtype=np.float64)
