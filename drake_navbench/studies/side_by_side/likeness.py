"""How alike a port and its original are, in three words."""

from __future__ import annotations

from enum import StrEnum

CLOSE = 1e-5


class Likeness(StrEnum):
    """How alike two decisions or plans, or all decisions of two trials, are."""

    EQUAL = "equal to the last bit"
    CLOSE = "to 1e-5"
    DIFFERENT = "different"


def likeness_of(difference: float) -> Likeness:
    """Returns what the largest difference of two results makes them."""
    if difference == 0.0:
        return Likeness.EQUAL
    return Likeness.CLOSE if difference <= CLOSE else Likeness.DIFFERENT
