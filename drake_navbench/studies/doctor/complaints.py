"""Known complaints: kinds of trouble in users' words and Nav2's messages, with their cures.

A user's words are compared with each known complaint by the cosine of their terms. A term is a word
without its ending, or two such words in a row; its weight is its inverse document frequency (Spärck
Jones 1972, "A statistical interpretation of term specificity"), so rare words count most.
"""

from __future__ import annotations

import base64
import hashlib
import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from pydantic import Field

from drake_navbench.errors import InputError
from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.suspects import parsed_cause
from drake_navbench.studies.doctor.symptoms import LOOKS_LIKE, OTHER_WORDS, Symptom
from drake_navbench.typed_files.typed_yaml import FrozenModel, read_yaml, validate

FOLDER = Path(__file__).parent / "words" / "complaints"
# The factor of a complaint that is not known to look like the symptom.
OTHER_SYMPTOM = 0.3
# The least squared length of a user's words, that of about ten rare terms: one word says little.
FEW_WORDS = 250.0
# The number of complaints, the most alike, that count.
MOST_ALIKE = 8
# The number of complaints, the most alike, that tell the class of a user's words.
MOST_ALIKE_FOR_CLASS = 40
# The factor of the line on what a class looks like, which for one or two words tells more.
OF_THE_LINE = 2.0
# The letters of a complaint's name: of 32 kinds each, so that no two complaints share one.
LETTERS = 5
# The reason for the other cures of a complaint.
ALSO = "A complaint like yours may have this cure as well."
WORD = re.compile(r"[a-z]{3,}|\d{3}")
# Words that are in most complaints, or in none but by grammar.
COMMON = re.compile(
    "and|are|but|can|for|from|has|have|into|its|not|off|one|our|out|robots?|that|the|their|then|there|"
    "they|this|too|was|were|when|where|which|while|with|you|your|nav|navigation|ros"
)
# In Nav2's words, "no valid path": of "no path" only "path" counts, as of a robot that leaves it.
NO_PLAN = re.compile(r"\bno (path|plan|route)\b", re.IGNORECASE)
STEM = re.compile(
    r"(\w{3,}?)(?:ations?|ings?|edly|ed|ers?|ors?|ies|es|s|ly|al|ive|ments?|able|ness)?"
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
    """A complaint with its terms and its causes, each with the share in which it is the cure.

    name: five letters or digits, by which a user names it; they change with its words alone.
    """

    complaint: _Complaint
    terms: frozenset[str]
    causes: tuple[tuple[Cause, float], ...]
    name: str

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
                (parsed_cause(text, _why(complaint, share), content.source, path), share)
                for text, share in complaint.cures.items()
            ),
            _name_of(complaint.says),
        )
        for path in sorted(FOLDER.glob("*.yaml"))
        for content in [validate(_ComplaintFile, read_yaml(path), str(path))]
        for complaint in content.complaints
    )


def _name_of(says: str) -> str:
    digest = hashlib.sha256(says.encode()).digest()
    return base64.b32encode(digest).decode()[:LETTERS].lower()


def _why(complaint: _Complaint, share: float) -> str:
    """Returns the reason for a cure: that of the complaint, which is about its likeliest one."""
    return complaint.why if share == max(complaint.cures.values()) else ALSO


def terms_of(text: str) -> frozenset[str]:
    """Returns the terms of a text: its stems, and each two stems in a row."""
    split = re.sub(r"([a-z])([A-Z])", r"\1 \2", text).lower().replace("_", " ")
    stems = [_stem(word) for word in WORD.findall(split) if not COMMON.fullmatch(word)]
    return frozenset([*stems, *(f"{first} {second}" for first, second in pairwise(stems))])


def _stem(word: str) -> str:
    """Returns a word without its ending, of which at least three letters are left."""
    found = STEM.fullmatch(word)
    return word if found is None else found[1]


@cache
def _weights() -> Mapping[str, float]:
    """Returns the squared inverse document frequency of each term of the known complaints."""
    known = known_complaints()
    counts = Counter(term for entry in known for term in entry.terms)
    return {term: math.log(1.0 + len(known) / count) ** 2 for term, count in counts.items()}


def causes_by_words(facts: Facts, symptom: Symptom, words: str) -> list[tuple[float, Cause]]:
    """Returns the cures of the complaints that a user's words are most like.

    Each has its weight, 0 to 1. Of complaints with the same cure the one most alike counts.
    """
    if not words:
        return []
    alike = [
        (cosine * (1.0 if symptom in entry.complaint.symptoms else OTHER_SYMPTOM), number, entry)
        for number, (entry, cosine) in enumerate(cosines(words))
        if entry.fits(facts)
    ]
    best: dict[tuple[str, Direction], tuple[float, Cause]] = {}
    for likeness, _, entry in sorted(alike, key=lambda item: (-item[0], item[1]))[:MOST_ALIKE]:
        for cause, share in entry.causes:
            if likeness * share > best.get(cause.key, (0.0, cause))[0]:
                best[cause.key] = likeness * share, cause
    return list(best.values())


def symptoms_called(text: str) -> list[Symptom]:
    """Returns `symptoms_told`, at least one class; raises InputError with all classes."""
    classes = symptoms_told(text)
    if not classes:
        raise InputError(
            f"--symptom {text!r}: unknown class of symptoms; expected one of {', '.join(Symptom)}"
        )
    return classes


def class_named(text: str) -> Symptom | None:
    """Returns the class whose name a text is, with spaces or hyphens for underlines."""
    name = re.sub(r"[\s-]+", "_", text.strip().lower())
    return Symptom(name) if name in list(Symptom) else None


def symptoms_told(text: str) -> list[Symptom]:
    """Returns the class that is named, else the classes that a user's words may tell.

    The likeliest is first. Every known complaint that is like the words counts for its symptoms, by
    the cosine, and for its second one half as much; so does the line on what each class looks like.
    """
    named = class_named(text)
    if named is not None:
        return [named]
    text = NO_PLAN.sub("no valid path", text)
    alike = sorted(cosines(text), key=lambda item: -item[1])[:MOST_ALIKE_FOR_CLASS]
    likeness, own = dict.fromkeys(Symptom, 0.0), terms_of(text)
    for entry, cosine in alike:
        for number, symptom in enumerate(entry.complaint.symptoms, 1):
            likeness[symptom] += cosine / number
    for symptom in Symptom:
        line = f"{symptom} {LOOKS_LIKE[symptom]}; {OTHER_WORDS[symptom]}"
        likeness[symptom] += OF_THE_LINE * _cosine(own, terms_of(line))
    found = [symptom for symptom, like in likeness.items() if like > 0.0]
    return sorted(found, key=lambda symptom: -likeness[symptom])


def likeness_of(one: str, other: str) -> float:
    """Returns the cosine of the terms of two texts, 0 to 1."""
    weights = _weights()
    own, theirs = terms_of(one), terms_of(other)
    lengths = [sum(weights.get(term, 0.0) for term in terms) for terms in (own, theirs)]
    shared = sum(weights.get(term, 0.0) for term in own & theirs)
    return shared / math.sqrt(math.prod(lengths)) if shared else 0.0


def _cosine(own: frozenset[str], terms: frozenset[str]) -> float:
    """Returns the likeness of the terms of a user's words to others, 0 to 1."""
    weights = _weights()
    shared = sum(weights[term] for term in own & terms if term in weights)
    if shared == 0.0:
        return 0.0
    length = max(sum(weights.get(term, 0.0) for term in own), FEW_WORDS)
    return shared / math.sqrt(length * sum(weights.get(term, 0.0) for term in terms))


def cosines(words: str) -> Iterator[tuple[Known, float]]:
    """Yields the known complaints that share a term with a user's words, and the cosine, 0 to 1."""
    own = terms_of(words)
    for entry in known_complaints():
        cosine = _cosine(own, entry.terms)
        if cosine > 0.0:
            yield entry, cosine
