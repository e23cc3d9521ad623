"""The chance that a cause is the cure of a complaint in a user's words.

A conditional logit (McFadden 1974, "Conditional logit analysis of qualitative choice behavior")
over the possible causes of one complaint: the odds of a cause grow by the exponential of a weighted
sum of its evidence. `studies/doctor_reading.py fit` fits the weights to the known cases.

The words count by the cosine of their terms with two texts of each cause: the known complaints that
it cures (their centroid, Rocchio 1971), and the reasons that rules and suspects have for it.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.complaints import (
    known_complaints,
    likeness_to,
    term_weights,
    terms_of,
)
from drake_navbench.studies.doctor.rules.all_rules import RULES
from drake_navbench.studies.doctor.suspects import all_suspects
from drake_navbench.typed_files.typed_yaml import FrozenModel, read_yaml, validate

WEIGHTS = Path(__file__).parent / "ranking.yaml"
# The score of a cause for which nothing speaks. By it a suspect of mean weight scores its weight,
# as it does without words.
UNKNOWN = 0.07


class Evidence(NamedTuple):
    """The evidence for a cause. Each part is 0 where nothing speaks for it.

    rule: weight of the rule that fires. suspect: weight in the table of suspects. value: logarithm
    of `value_factor`. unusual: logarithm by which the value is far from Nav2's. named: 1 if the
    user names the parameter or its value. nearest: likeness of the user's words to the known
    complaint most alike that it cures; complaints: to all that it cures; reasons: to the reasons of
    rules and suspects for it.
    """

    rule: float = 0.0
    suspect: float = 0.0
    value: float = 0.0
    unusual: float = 0.0
    named: float = 0.0
    nearest: float = 0.0
    complaints: float = 0.0
    reasons: float = 0.0


class Weights(FrozenModel):
    """The weight of each part of the evidence."""

    rule: float
    suspect: float
    value: float
    unusual: float
    named: float
    nearest: float
    complaints: float
    reasons: float

    def score(self, evidence: Evidence) -> float:
        """Returns a number proportional to the chance of a cause."""
        parts = zip(evidence._fields, evidence, strict=True)
        return UNKNOWN * math.exp(sum(getattr(self, name) * part for name, part in parts))


@cache
def weights() -> Weights:
    """Returns the weights that were fitted to the known cases."""
    return validate(Weights, read_yaml(WEIGHTS), str(WEIGHTS))


def words_for(words: str, cause: Cause) -> tuple[float, float]:
    """Returns the likeness of words to the complaints that a cause cures, and to its reasons."""
    own = terms_of(words)
    nothing: Mapping[str, float] = {}
    complaints = likeness_to(own, _complaints_cured().get(cause.key, nothing))
    return complaints, likeness_to(own, _reasons().get(cause.key, nothing))


@cache
def _complaints_cured() -> Mapping[tuple[str, Direction], Mapping[str, float]]:
    """Returns the terms of the complaints that each cause cures, by its share in them."""
    shares: dict[tuple[str, Direction], dict[str, float]] = {}
    for known in known_complaints():
        for cause, share in known.causes:
            own = shares.setdefault(cause.key, defaultdict(float))
            for term in known.terms:
                own[term] += share
    return {
        key: {term: math.log1p(share) for term, share in own.items()} for key, own in shares.items()
    }


@cache
def _reasons() -> Mapping[tuple[str, Direction], Mapping[str, float]]:
    """Returns the terms of what suspects and the names of rules say of each cause."""
    texts: dict[tuple[str, Direction], set[str]] = defaultdict(set)
    for suspect in all_suspects():
        texts[suspect.cause.key].add(suspect.cause.why)
    for rule in RULES:
        for cause in rule.cures:
            texts[cause.key].add(rule.name)
    known = term_weights()
    return {
        key: {term: 1.0 for term in terms_of(" ".join(sorted(whys))) if term in known}
        for key, whys in texts.items()
    }
