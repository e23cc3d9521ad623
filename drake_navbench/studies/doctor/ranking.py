"""The score of a cause of a complaint: a weighted sum of the evidence for it.

The weights are those of a conditional logit (McFadden 1974, "Conditional logit analysis of
qualitative choice behavior") over the possible causes of one complaint, by the weight of a suspect:
`studies/doctor_reading.py fit` fits them to the known cases.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.complaints import known_complaints, likeness_to, terms_of
from drake_navbench.studies.doctor.suspects import all_suspects
from drake_navbench.typed_files.typed_yaml import read_yaml

WEIGHTS = Path(__file__).parent / "ranking.yaml"
Text = Mapping[tuple[str, Direction], Mapping[str, float]]


class Evidence(NamedTuple):
    """The evidence for a cause; a part is 0 where nothing speaks for the cause.

    rule: weight of the strongest rule that fires. suspect: weight in the table of suspects, by the
    factor of the parameter's value. named: 1 if the user names the parameter or its value. words:
    likeness of the user's words to the most alike complaint that it cures, to all of these, and to
    what the suspects say of it; each 0 to 1.
    """

    rule: float = 0.0
    suspect: float = 0.0
    named: float = 0.0
    words: float = 0.0

    @property
    def score(self) -> float:
        """The weighted sum of the parts."""
        return sum(weight * part for weight, part in zip(_weights(), self, strict=True))


@cache
def _weights() -> Evidence:
    return Evidence(**read_yaml(WEIGHTS))


def likeness_to_texts(terms: frozenset[str], cause: Cause) -> float:
    """Returns the likeness of the terms of a user's words to the two texts of a cause, 0 to 2."""
    return sum(likeness_to(terms, text.get(cause.key, {})) for text in _texts())


@cache
def _texts() -> tuple[Text, Text]:
    """Returns each cause's terms in the complaints that it cures, and in the suspects' reasons."""
    cured: defaultdict[tuple[str, Direction], dict[str, float]] = defaultdict(dict)
    reasons: defaultdict[tuple[str, Direction], dict[str, float]] = defaultdict(dict)
    for known in known_complaints():
        for cause, share in known.causes:
            own = cured[cause.key]
            own |= {term: own.get(term, 0.0) + share for term in known.terms}
    for suspect in all_suspects():
        reasons[suspect.cause.key] |= dict.fromkeys(terms_of(suspect.cause.why), 1.0)
    logs = {key: {t: math.log1p(share) for t, share in own.items()} for key, own in cured.items()}
    return logs, reasons
