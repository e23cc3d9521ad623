"""Changes that were tried, and the verdict on each: by Wilcoxon's test, corrected by Holm.

The correction counts as many changes as a visit may drive, so that a further batch errs no more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from drake_navbench.analysis.pairs import holm
from drake_navbench.studies.doctor.causes import Cause
from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.reading import Suspicion

ERROR = 0.05
# The changes that a visit drives at most.
MOST_CHANGES = 48
# The pairs of a candidate, and those after which one that helps is looked at again. At the first
# look its p is doubled, later multiplied by 4: the three together err as often as one, because
# 1/2 + 1/4 + 1/4 = 1. Twelve pairs that all fall suffice: 2 * 2^-11 * 48 is less than 0.05.
PAIRS, MORE_PAIRS, MOST_PAIRS = 12, 24, 48
FIRST_FACTOR, LATER_FACTOR = 2.0, 4.0
# The least pairs that must fall, if none rises: 4 * 2 * 2^-13 * 48 is less than 0.05.
LEAST_FALLS = 13
# A change by which the severity falls by a smaller share is of no use.
LEAST_FALL = 0.3
# Why a change is dropped that may help.
NO_TIME = "the time was too short for more pairs"
# Why a change is not driven that would change nothing.
IDLE = "no trial depends on it"
# Why a change is dropped after a trial that it leaves the same to the last digit.
SAME = "changes nothing in the first trial"
# A symptom counts as taken away if its severity falls by this share.
NEARLY_ALL = 0.9


class Verdict(StrEnum):
    """The experiment's verdict on a cause."""

    SHOWN = "shown"
    NOT_SHOWN = "not shown"
    OUTSIDE = "outside the file"
    NOT_TRIED = "not tried"


class Rarity(NamedTuple):
    """The trials of a race, and those, `shown`, in which the file as it is has any of a symptom."""

    shown: int
    trials: int

    @property
    def is_rare(self) -> bool:
        """Whether too few of MOST_PAIRS trials should have it for a change to be shown."""
        return self.shown * MOST_PAIRS < LEAST_FALLS * self.trials

    @property
    def needed(self) -> int | None:
        """The pairs of which enough should have it; None if no trial has."""
        return math.ceil(LEAST_FALLS * self.trials / self.shown) if self.shown else None


@dataclass(frozen=True)
class Tried:
    """A change that was tried. before, after: mean severity in the pairs. p_value: corrected.

    showing: the pairs that show the symptom with the change. fall: share by which the severity
    falls, with its interval. reason: why it was not tried, or left early.
    """

    suspicion: Suspicion
    trial: Trial | None
    verdict: Verdict
    before: float = 0.0
    after: float = 0.0
    interval: tuple[float, float] = (0.0, 0.0)
    p_value: float = 1.0
    pairs: int = 0
    touches: int = 0
    reason: str = ""
    showing: int = 1

    @property
    def fall(self) -> float:
        """The share by which the severity falls."""
        return (self.before - self.after) / self.before if self.before > 0.0 else 0.0

    @property
    def causes(self) -> tuple[Cause, ...]:
        """The causes that the change removes: of each of its parts."""
        parts = self.trial.parts if self.trial is not None else ()
        return tuple(part.cause for part in parts) or (self.suspicion.cause,)

    @property
    def is_refused(self) -> bool:
        """Whether there is a change, but it cannot be driven, as with this robot."""
        return self.verdict is Verdict.NOT_TRIED and bool(self.trial) and self.reason != IDLE

    @property
    def takes_all(self) -> bool:
        """Whether the symptom is nearly gone, in all pairs, without more touches."""
        return self.pairs >= PAIRS and self.leaves_nothing and not self.touches

    @property
    def leaves_nothing(self) -> bool:
        """Whether hardly any of the severity is left, or too little of it to show in any pair.

        A sound file leaves some of what is measured, as a distance from the plan.
        """
        return self.fall >= NEARLY_ALL or (self.before > 1.0 and not self.showing)


def corrected(raw: Sequence[Tried]) -> list[Tried]:
    """Returns the changes with p-values corrected for all that may be driven, the best first."""
    driven = [entry for entry in raw if entry.pairs]
    adjusted = holm([*(entry.p_value for entry in driven), *[1.0] * (MOST_CHANGES - len(driven))])
    found: list[Tried] = []
    for entry, p_value in zip(driven, adjusted, strict=False):
        is_less = entry.fall >= LEAST_FALL or entry.leaves_nothing
        is_shown = p_value <= ERROR and is_less and not entry.touches
        verdict = Verdict.SHOWN if is_shown else Verdict.NOT_SHOWN
        values = entry.__dict__ | {"verdict": verdict, "p_value": float(p_value)}
        found.append(Tried(**values))
    # Of several changes that take the symptom away the likeliest cause by reading stays first; the
    # others follow by what they take away times how likely they are.
    found.sort(
        key=lambda e: (
            e.verdict is not Verdict.SHOWN,
            not e.takes_all,
            -e.fall * e.suspicion.score * (not e.takes_all),
        )
    )
    return found + [entry for entry in raw if not entry.pairs]
