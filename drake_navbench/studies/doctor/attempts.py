"""Parameters in a user's words: those that are named, and those that were tried without success."""

from __future__ import annotations

import re

from drake_navbench.studies.doctor.causes import Cause

# A name of a parameter, critic or layer: PathAlign, vx_max, obstacle_poses_affected.
NAME = re.compile(r"[A-Za-z]+(?:_[A-Za-z0-9]+)+|[A-Z][a-z]+(?:[A-Z][a-z]+)+")
# Words that tell that a change was tried and did not help.
IN_VAIN = re.compile(
    r"chang(e|es|ed|ing) nothing|without (any )?(effect|success|improvement)"
    r"|no (effect|difference|improvement)|(was|were) tried|already tried|(i|we) (have )?tried"
    r"|(did|does|do)(n't| not) (help|work|change|matter)|still the same|made nothing better",
    re.IGNORECASE,
)


def named_in(words: str) -> frozenset[str]:
    """Returns the names in a user's words, except those that were tried in vain."""
    return frozenset(name for c in _clauses(words) if not IN_VAIN.search(c) for name in _names(c))


def tried_in_vain(words: str) -> frozenset[str]:
    """Returns the names of the parameters that a user has changed without success."""
    return frozenset(name for c in _clauses(words) if IN_VAIN.search(c) for name in _names(c))


def is_among(cause: Cause, names: frozenset[str]) -> bool:
    """Tells whether a cause's parameter, or its critic, is among some names."""
    parts = cause.place.lower().split(".")
    return any(part == name or part == f"{name}critic" for part in parts for name in names)


def _clauses(words: str) -> list[str]:
    return re.split(r";|\.\s|\bbut\b", words)


def _names(clause: str) -> list[str]:
    return [name.lower() for name in NAME.findall(clause)]
