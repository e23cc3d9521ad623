"""The outcomes of a trial, and their order."""

from __future__ import annotations

from enum import StrEnum

# The least distance to the goal of a success that is worth a remark, m: twice Nav2's default of
# xy_goal_tolerance.
EARLY_M = 0.5


class Outcome(StrEnum):
    """The outcome of a trial."""

    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    COLLIDED = "collided"
    TIMED_OUT = "timed_out"
    ERROR = "error"


# The outcomes from the worst to the best.
FROM_WORST = (
    Outcome.ERROR,
    Outcome.COLLIDED,
    Outcome.TIMED_OUT,
    Outcome.ABORTED,
    Outcome.SUCCEEDED,
)
