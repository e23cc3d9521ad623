"""Payloads of abstract ports and state that cost nothing to copy."""

from __future__ import annotations

from typing import Any, Self


class Immutable:
    """Base of frozen payloads.

    Drake deep-copies a system's abstract state at every unrestricted update and whenever a Context
    is cloned. A payload that cannot change is its own copy.
    """

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self
