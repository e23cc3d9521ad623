"""A rule: a condition over the parameters, what it leads to, and the cure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from drake_navbench.studies.doctor.causes import OUTSIDE, RELEASE, Cause, Direction
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.in_effect import is_in_effect
from drake_navbench.studies.doctor.suspects import ELSEWHERE
from drake_navbench.studies.doctor.symptoms import Symptom

# A rule names the symptoms to which it leads with at least this likelihood.
LIKELY = 0.5
# The likelihood of a fault that the file proves: it comes before all that is merely frequent.
SURE = 4.0
# The digits of a cure's value that a rule computes.
DIGITS = 4


@dataclass(frozen=True)
class Rule:
    """One rule.

    name: its identity. when: whether it fires. seen: a sentence on the finding, with numbers of the
    file. symptoms: those to which it leads, with their likelihood, about 0 to 1, or SURE. cures:
    the best first. source: Nav2's code or page, or a thread. kinds: the kinds of controllers that
    the rule is for; empty for all. is_certain: whether the finding is a fault whatever the symptom;
    others count only beside a symptom. advice: printed instead of the cures if no parameter's value
    is one.
    """

    name: str
    when: Callable[[Facts], bool]
    seen: Callable[[Facts], str]
    symptoms: Mapping[Symptom, float]
    cures: tuple[Cause, ...]
    source: str
    kinds: tuple[str, ...] = ()
    is_certain: bool = True
    advice: str = ""

    def fires(self, facts: Facts) -> bool:
        """Tells whether the rule holds for these facts."""
        return (not self.kinds or facts.is_kind(*self.kinds)) and self.when(facts)

    def finding(self, facts: Facts) -> Finding:
        """Returns the rule's finding.

        A cure that a switch of the file turns off is none, and no value is lowered below 0.
        """
        cures = [c for c in self.cures if is_in_effect(facts, c.place) and not _is_zero(c, facts)]
        fitting = [(c, _fitting(c, facts)) for c in cures or self.cures]
        # A value that the file has already, or is beyond, is no cure beside others.
        known = [fit for c, fit in fitting if c.to is None or fit.to is not None]
        return Finding(self, self.seen(facts), tuple(known or (fit for _, fit in fitting)))


@dataclass(frozen=True)
class Finding:
    """A rule that fired. seen: in words, with names and numbers of the file. cures: without values
    that the file has already, or is beyond."""

    rule: Rule
    seen: str
    cures: tuple[Cause, ...]

    @property
    def likely(self) -> list[Symptom]:
        """The symptoms that it probably leads to, the likeliest first."""
        symptoms = self.rule.symptoms
        return sorted((s for s in symptoms if symptoms[s] >= LIKELY), key=lambda s: -symptoms[s])


def _is_zero(cause: Cause, facts: Facts) -> bool:
    """Tells whether a cure would lower to 0 what is 0 already."""
    is_lowered = cause.direction is Direction.DOWN and cause.to == 0.0
    return is_lowered and bool(facts[cause.place] == 0.0)


def _fitting(cause: Cause, facts: Facts) -> Cause:
    value = facts[cause.place]
    if callable(cause.to):
        to = cause.to(facts)
        cause = cause._replace(to=float(f"{to:.{DIGITS}g}") if isinstance(to, float) else to)
    if not cause.is_number or not isinstance(value, int | float) or cause.to is None:
        return cause
    is_beyond = cause.to > value if cause.direction is Direction.UP else cause.to < value
    return cause if is_beyond else cause._replace(to=None)


def up(place: str, to: Any = None) -> Cause:
    """Returns the cure that raises a parameter; to: a value, or a function of the facts."""
    return Cause(_whole(place), Direction.UP, to)


def down(place: str, to: Any = None) -> Cause:
    """Returns the cure that lowers a parameter; to: a value, or a function of the facts."""
    return Cause(_whole(place), Direction.DOWN, to)


def put(place: str, to: Any = None) -> Cause:
    """Returns the cure that sets a parameter; to: a value, or a function of the facts."""
    return Cause(_whole(place), Direction.SET, to)


def add(place: str) -> Cause:
    """Returns the cure that adds a node or a plugin."""
    return Cause(_whole(place), Direction.ADD)


def upgrade(to: Any) -> Cause:
    """Returns the cure that is a newer release; to: its name, or a function of the facts."""
    return Cause(RELEASE, Direction.UPGRADE, to)


def outside(thing: str) -> Cause:
    """Returns the cure outside of the file."""
    return Cause(f"{OUTSIDE}.{thing}", Direction.SET)


def _whole(place: str) -> str:
    return place if place.partition(".")[0] in ELSEWHERE else f"controller.{place}"
