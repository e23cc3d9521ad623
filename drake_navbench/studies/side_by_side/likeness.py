"""Three grades of likeness between a port and its original."""

from __future__ import annotations

from enum import StrEnum

CLOSE = 1e-5


class Likeness(StrEnum):
    """The likeness of two decisions, of two plans, or of all decisions of two trials."""

    EQUAL = "equal to the last bit"
    CLOSE = "to 1e-5"
    DIFFERENT = "different"


def likeness_of(difference: float) -> Likeness:
    """Returns the likeness of two results from their largest difference."""
    if difference == 0.0:
        return Likeness.EQUAL
    return Likeness.CLOSE if difference <= CLOSE else Likeness.DIFFERENT
