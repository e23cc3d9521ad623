"""The sizes of vector ports, and ports that carry Python objects, None where there is none yet.

The objects, payloads such as a Costmap, all travel as `Value[object]`, so Drake does not tell a
Costmap from a plan: systems are wired by the names of their ports. No Value of a newer Drake holds
None: a port and an abstract state hold NOTHING in its place, which `read_object` returns as None.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import (
    AbstractStateIndex,
    Context,
    DependencyTicket,
    InputPort,
    LeafSystem,
    OutputPort,
)

from drake_navbench.trial.systems.lifetime import weakly_bound

# A state: x m, y m, yaw rad, then the velocity: v m/s forward, w rad/s, vy m/s to the left. vy is 0
# for all but an omnidirectional base.
STATE_SIZE = 6
# A pose: x m, y m, yaw rad.
POSE_SIZE = 3
# A command: v m/s, w rad/s, vy m/s.
COMMAND_SIZE = 3


class _Nothing:
    """The value of a port or an abstract state that holds no object; there is only one."""

    __slots__ = ()

    def __copy__(self) -> _Nothing:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> _Nothing:
        return self

    def __reduce__(self) -> str:
        return "NOTHING"

    def __repr__(self) -> str:
        return "NOTHING"


NOTHING = _Nothing()


def declare_object_input(system: LeafSystem, name: str) -> InputPort:
    """Declares an input port for a Python object."""
    return system.DeclareAbstractInputPort(name, AbstractValue.Make(object()))


def declare_object_output(
    system: LeafSystem,
    name: str,
    value_of: Callable[[Context], Any],
    prerequisites: Collection[DependencyTicket],
) -> OutputPort:
    """Declares an output port for a Python object.

    value_of: returns the port's value in a context, or None; it may read only the `prerequisites`.
    """

    value = weakly_bound(value_of)

    def calc(context: Context, output: AbstractValue) -> None:
        output.set_value(value_to_store(value(context)))

    return system.DeclareAbstractOutputPort(
        name,
        lambda: AbstractValue.Make(object()),
        calc,
        prerequisites_of_calc=set(prerequisites),
    )


def declare_state_part_output(
    system: LeafSystem, name: str, state: AbstractStateIndex, select: Callable[[Any], Any]
) -> OutputPort:
    """Declares an output port for a part of an abstract state, which `select` takes out of it."""
    return declare_object_output(
        system,
        name,
        lambda context: select(context.get_abstract_state(state).get_value()),
        {system.abstract_state_ticket(state)},
    )


def value_to_store(value: Any) -> Any:
    """Returns the content of an abstract value for an object: NOTHING for None."""
    return NOTHING if value is None else value


def read_object(port: InputPort | OutputPort, context: Context) -> Any:
    """Returns the object of a port; None where it holds NOTHING.

    Raises:
        RuntimeError: it is an input port to which nothing is connected.
    """
    value = port.Eval(context)
    return None if value is NOTHING else value


def value_or_none(port: InputPort, context: Context) -> Any:
    """Returns the value of an input port; None where nothing is connected or it holds NOTHING."""
    return read_object(port, context) if port.HasValue(context) else None
