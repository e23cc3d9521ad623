"""The doctor asks back: known complaints, of which a user names the one most like theirs.

A name is made of the complaint's words, so it stays the same for other files and later releases of
the program. The complaint that a user names counts like relevance feedback in a search (Rocchio
1971): its cures gain what the likeliest cause has.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from drake_navbench.errors import InputError
from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.complaints import (
    OTHER_SYMPTOM,
    Known,
    class_named,
    cosines,
    known_complaints,
    likeness_of,
)
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.possible import is_there
from drake_navbench.studies.doctor.symptoms import Symptom

# The number of complaints that a user is asked about.
MOST_ASKED = 12
# The likeness of two lines, 0 to 1, from which on they read the same to a user.
READS_THE_SAME = 0.4
# The greatest length of a line, in characters: two lines of 80 columns.
LONGEST = 140
# The weight of a complaint that reads like the user's words, as of its cures in `suspicions_of`.
BY_WORDS = 3.0
# The weight of a complaint that a user names, by the score of the likeliest cause: a little more.
LIKED = 1.1
# The reason for a cure of a complaint that a user names.
YOU_NAMED = "The complaint that you named has this cure."
# The factor of the second complaint that a user names, of the third, and so on.
NEXT_NAMED = 0.5


class Told(NamedTuple):
    """A user's words about symptom and robot, and the known complaints named as most like them."""

    words: str = ""
    liked: tuple[Known, ...] = ()

    @property
    def has_words(self) -> bool:
        """Whether there are words besides the name of a class of symptoms."""
        return bool(self.words) and class_named(self.words) is None


NOTHING_TOLD = Told()


class Alike(NamedTuple):
    """A known complaint of the list. line: what users say of it, without its cure."""

    name: str
    line: str


class _Entry(NamedTuple):
    """A complaint for its likeliest cure. rank: score, likeness, and whether it has the symptom."""

    rank: tuple[float, float, bool]
    known: Known


def complaints_alike(
    facts: Facts, symptom: Symptom, told: Told, scores: Mapping[tuple[str, Direction], float]
) -> list[Alike]:
    """Returns the complaints that a user is asked about, the likeliest first.

    None if the user has no words, or has answered already.

    Each has another likeliest cure and reads differently. They stand in the order of that cure's
    score with the likeness to the user's words. scores: of the suspicions, by their cause's key.
    """
    if told.liked or not told.has_words:
        return []
    alike = {known.name: cosine for known, cosine in cosines(told.words)}
    best: dict[tuple[str, Direction], _Entry] = {}
    for known in known_complaints():
        is_own = symptom in known.complaint.symptoms
        likeness = alike.get(known.name, 0.0) * (1.0 if is_own else OTHER_SYMPTOM)
        cures = possible_cures(facts, known) if is_own or likeness > 0.0 else []
        if not cures:
            continue
        cause = cures[0][1]
        score = scores.get(cause.key, 0.0) + BY_WORDS * likeness
        entry = _Entry((score, likeness, is_own), known)
        # The same parameter of both costmaps looks the same.
        key = cause.place.rpartition(".")[2], cause.direction
        if key not in best or entry.rank > best[key].rank:
            best[key] = entry
    ordered = sorted(best.values(), key=lambda entry: entry.rank, reverse=True)
    return _differing(entry.known for entry in ordered)


def _differing(ordered: Iterable[Known]) -> list[Alike]:
    """Returns the first complaints, without those that read like one before them."""
    kept: list[Alike] = []
    for known in ordered:
        line = line_of(known.complaint.says)
        if all(likeness_of(line, other.line) < READS_THE_SAME for other in kept):
            kept.append(Alike(known.name, line))
            if len(kept) == MOST_ASKED:
                break
    return kept


def line_of(says: str) -> str:
    """Returns the first of a complaint's phrases, as many as fit into two lines."""
    first, *others = (phrase.strip() for phrase in says.split(";"))
    for phrase in others:
        if len(first) + len(phrase) + 2 > LONGEST:
            break
        first = f"{first}; {phrase}"
    return first


def possible_cures(facts: Facts, known: Known) -> list[tuple[float, Cause]]:
    """Returns the cures of a complaint that a file can have, with their shares, likeliest first."""
    if not known.fits(facts):
        return []
    cures = [(share, cause) for cause, share in known.causes if is_there(facts, cause)]
    return sorted(cures, key=lambda cure: -cure[0])


def complaints_named(names: Sequence[str], facts: Facts) -> tuple[Known, ...]:
    """Returns the complaints that `--like` names; raises InputError."""
    by_name = {known.name: known for known in known_complaints()}
    found = []
    for name in names:
        if name not in by_name:
            raise InputError(
                f"--like {name}: no known complaint has this name; expected one of the list that "
                "the doctor prints after its causes"
            )
        if not possible_cures(facts, by_name[name]):
            raise InputError(
                f"--like {name}: none of its cures is possible with this controller, release and "
                "file; expected another one of the list that the doctor prints after its causes"
            )
        found.append(by_name[name])
    return tuple(found)


def causes_liked(facts: Facts, liked: Sequence[Known]) -> list[tuple[float, Cause]]:
    """Returns the cures of the complaints that a user named, each with its weight, 0 to 1.

    The likeliest cure of the first complaint has 1.
    """
    best: dict[tuple[str, Direction], tuple[float, Cause]] = {}
    for number, known in enumerate(liked):
        cures = possible_cures(facts, known)
        for share, cause in cures:
            weight = NEXT_NAMED ** min(number, 1) * share / cures[0][0]
            if weight > best.get(cause.key, (0.0, cause))[0]:
                best[cause.key] = weight, cause
    return list(best.values())
