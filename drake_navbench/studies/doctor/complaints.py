"""Known complaints: kinds of trouble in users' words and Nav2's messages, with their cures.

A user's words are compared with each known complaint by the cosine of their terms. A term is a word
without its ending, or two such words in a row; its weight is its inverse document frequency (Spärck
Jones 1972, "A statistical interpretation of term specificity"), so rare words count most.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from pydantic import Field

from drake_navbench.releases import Release
from drake_navbench.studies.doctor.causes import Cause
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.suspects import parsed_cause
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.typed_files.typed_yaml import FrozenModel, read_yaml, validate

FOLDER = Path(__file__).parent / "words" / "complaints"
# The factor of a complaint that is not known to look like the symptom.
OTHER_SYMPTOM = 0.5
# Complaints less alike than this say nothing; the few most alike count.
LEAST, MOST_ALIKE = 0.06, 8
WORD = re.compile(r"[a-z]{3,}|\d{3}")
# Words that are in most complaints, or in none but by grammar.
COMMON = frozenset(
    "and are but can for from has have into its not off one our out robot that the their then there "
    "they this too was were when where which while with you your nav2 navigation2 ros ros2".split()
)
ENDINGS = (
    "ations ation ings ing edly ed ers er ors or ies es s ly al ive ment ments able ness".split()
)


class _Complaint(FrozenModel):
    """A kind of trouble as users and log files tell it, and what cures it."""

    says: str = Field(min_length=20, description="Words of users, messages of Nav2.")
    symptoms: tuple[Symptom, ...] = Field(min_length=1)
    controllers: tuple[str, ...] = Field((), description="Kinds of controllers; none: any.")
    since: Release | None = Field(None, description="The first release that has the trouble.")
    until: Release | None = Field(None, description="The last release that has it.")
    cures: dict[str, float] = Field(min_length=1, description="`place direction`, and its share.")
    why: str = Field(min_length=1)


class _ComplaintFile(FrozenModel):
    source: str = Field(min_length=1, description="Where the entries come from.")
    complaints: tuple[_Complaint, ...]


class Known(NamedTuple):
    """A complaint with its terms and its causes, each with the share in which it is the cure."""

    complaint: _Complaint
    terms: frozenset[str]
    causes: tuple[tuple[Cause, float], ...]

    def fits(self, facts: Facts) -> bool:
        """Tells whether controller and release of a file can have this trouble."""
        told = self.complaint
        is_kind = not told.controllers or any(facts.is_kind(kind) for kind in told.controllers)
        is_old_enough = told.since is None or facts.release >= told.since
        return is_kind and is_old_enough and (told.until is None or facts.release <= told.until)


@cache
def known_complaints() -> tuple[Known, ...]:
    """Returns the complaints of all files; raises InputError where one is wrong."""
    return tuple(
        Known(
            complaint,
            terms_of(complaint.says),
            tuple(
                (parsed_cause(text, complaint.why, content.source, path), share)
                for text, share in complaint.cures.items()
            ),
        )
        for path in sorted(FOLDER.glob("*.yaml"))
        for content in [validate(_ComplaintFile, read_yaml(path), str(path))]
        for complaint in content.complaints
    )


def terms_of(text: str) -> frozenset[str]:
    """Returns the terms of a text: its stems, and each two stems in a row."""
    split = re.sub(r"([a-z])([A-Z])", r"\1 \2", text).lower().replace("_", " ")
    stems = [_stem(word) for word in WORD.findall(split) if word not in COMMON]
    return frozenset([*stems, *(f"{first} {second}" for first, second in pairwise(stems))])


def _stem(word: str) -> str:
    for ending in ENDINGS:
        if word.endswith(ending) and len(word) - len(ending) >= 3:
            return word.removesuffix(ending)
    return word


@cache
def _weights() -> Mapping[str, float]:
    """Returns the squared inverse document frequency of each term of the known complaints."""
    known = known_complaints()
    counts = Counter(term for entry in known for term in entry.terms)
    return {term: math.log(1.0 + len(known) / count) ** 2 for term, count in counts.items()}


def likenesses(words: str) -> Iterator[tuple[Known, float]]:
    """Yields the known complaints with their cosine, 0 to 1, to a user's words."""
    own, weights = terms_of(words) & _weights().keys(), _weights()
    length = sum(weights[term] for term in own)
    for entry in known_complaints():
        shared = sum(weights[term] for term in own & entry.terms)
        if shared > 0.0:
            yield entry, shared / math.sqrt(length * sum(weights[term] for term in entry.terms))


def causes_by_words(
    facts: Facts, symptom: Symptom, words: str
) -> Iterator[tuple[float, Cause, str]]:
    """Yields the cures of the complaints that a user's words are most like.

    Each has its weight, 0 to 1, and the reason.
    """
    found = [
        (alike * (1.0 if symptom in entry.complaint.symptoms else OTHER_SYMPTOM), number, entry)
        for number, (entry, alike) in enumerate(likenesses(words))
        if entry.fits(facts)
    ]
    for alike, _, entry in sorted(found, key=lambda item: (-item[0], item[1]))[:MOST_ALIKE]:
        if alike >= LEAST:
            for cause, share in entry.causes:
                yield alike * share, cause, cause.why
