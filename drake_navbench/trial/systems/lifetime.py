"""Diagrams with systems written in Python are freed when a trial is over.

Without this module they never are, for two reasons, each a ring of references that Python's
collector does not see as one:

- A system in C++ holds the functions that its ports and events were declared with. A bound method
  holds the Python half of the system, that the diagram, and the diagram owns the system. The link
  in C++ is invisible (Drake's issue 22515). `weakly_bound` leaves that link out.
- Drake keeps the peers of a ring in the `__dict__` of each object, where the collector should find
  them. From Python 3.11 on it meets the `__dict__` of an instance of a Python subclass twice, once
  by the subclass and once by pybind11's base, counts one reference too many, and takes the object
  for one that is held from outside. `release` empties it.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterable
from types import MethodType
from typing import Any

from pydrake.systems.framework import Diagram, System


def weakly_bound(method: Callable[..., Any]) -> Callable[..., Any]:
    """Returns a function that calls a method without keeping its object alive.

    Drake calls it only while the diagram stands, and the diagram holds the object. A callable that
    is no bound method is returned unchanged.
    """
    if not isinstance(method, MethodType):
        return method
    function, owner = method.__func__, weakref.ref(method.__self__)

    def call(*arguments: Any) -> Any:
        return function(owner(), *arguments)

    return call


def release(systems: Iterable[System]) -> None:
    """Empties systems whose diagram is not used any more, so that it can be freed."""
    for system in systems:
        if isinstance(system, Diagram):
            release(system.GetSystems())
        vars(system).clear()
