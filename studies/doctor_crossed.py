"""Leave one owner out: changes of the doctor's method on all public cases, beside no skill.

    python studies/doctor_crossed.py FOLDER

FOLDER holds the files that `doctor_cases.py files FOLDER` wrote. Each owner's cases are answered by
the variant that is best on the other owners' cases: most cures first, then most among three. Causes
and words are common to all variants; they were written with all of these cases known.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from drake_navbench.studies.doctor import reading, value_factors
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.known_cases import (
    TOP,
    Case,
    facts_of_case,
    is_hit,
    plain_culprits,
    read_cases,
)
from drake_navbench.studies.doctor.symptoms import Symptom, symptom_called

HERE = Path(__file__).parent / "doctor_cases"
LISTS = ("development", "test", "thirty_eight", "fresh", "fresh_two")
# Threads of these repositories are by users of their own.
OF_MANY = ("ros-navigation", "rst-tu-dortmund")
# The variants: a constant of the reading, and its other values.
CONSTANTS: Mapping[str, tuple[float, ...]] = {
    "OF_A_RULE": (1.0, 1.15, 1.5),
    "NEXT_CURE": (0.7, 1.0),
    "ON_BRINGUP": (0.3, 0.75),
    "BEYOND": (1.6, 3.0),
    "OPPOSITE": (0.5, 0.9),
    "CHANGED": (1.0, 1.5),
    "NAMED": (1.5, 2.0),
}
# The factors of a further cause of the same server, and of the same parameter in the other costmap.
SERVER, TWIN = (0.8, 0.6), (0.8, 0.6)


class Read(NamedTuple):
    """A case with its facts; owner: whose cases are left out together."""

    case: Case
    facts: Facts
    symptom: Symptom
    owner: str


Ranks = list[int | None]


def read_all(folder: Path) -> list[Read]:
    """Returns the cases of all lists with their facts."""
    found = []
    for name in LISTS:
        for case in read_cases(HERE / f"{name}.yaml"):
            files = None if name == "thirty_eight" else folder
            owner = case.link.partition("/")[0]
            owner = case.link if owner in OF_MANY else owner
            symptom = symptom_called(case.symptom_class)
            found.append(Read(case, facts_of_case(case, files), symptom, owner))
    return found


def ranks(cases: Sequence[Read], words: bool = True, key: str = "", factor: float = 1.0) -> Ranks:
    """Returns the rank of the first cure of each case.

    key, factor: further causes of the same 'server' or of a 'twin' parameter weigh this much.
    """
    found: Ranks = []
    for entry in cases:
        told = entry.case.words if words else ""
        seen: Counter[str] = Counter()
        scored = []
        for cause, score, *_ in reading.suspicions_of(entry.facts, entry.symptom, told):
            first, _, rest = cause.place.partition(".")
            group = f"{rest}{cause.direction}" if key == "twin" else first
            scored.append((score * factor ** min(seen[group], 2), cause))
            seen[group] += 1
        scored.sort(key=lambda pair: -pair[0])
        hits = (n for n, (_, c) in enumerate(scored, 1) if is_hit(c, entry.case, entry.facts))
        found.append(next(hits, None))
    return found


def variants(cases: Sequence[Read]) -> Iterator[tuple[str, Ranks]]:
    """Yields the ranks of each variant, the doctor as it is first."""
    yield "as it is", ranks(cases)
    for name, values in CONSTANTS.items():
        module = value_factors if hasattr(value_factors, name) else reading
        own = getattr(module, name)
        for value in values:
            setattr(module, name, value)
            yield f"{name} {value}", ranks(cases)
        setattr(module, name, own)
    for key, factors in (("server", SERVER), ("twin", TWIN)):
        for factor in factors:
            yield f"a further cause of the same {key}: {factor}", ranks(cases, True, key, factor)


def crossed(found: Mapping[str, Ranks], cases: Sequence[Read]) -> tuple[Ranks, Counter[str]]:
    """Returns the ranks by the variant that is best without each owner, and how often each is."""
    result: Ranks = [None] * len(cases)
    chosen: Counter[str] = Counter()
    for owner in sorted({entry.owner for entry in cases}):
        others = [n for n, entry in enumerate(cases) if entry.owner != owner]
        best = max(found, key=lambda name: _counts([found[name][n] for n in others]))
        chosen[best] += 1
        for number, entry in enumerate(cases):
            if entry.owner == owner:
                result[number] = found[best][number]
    return result, chosen


def frequent(cases: Sequence[Read]) -> Ranks:
    """Returns the ranks among the symptom's commonest culprits in other owners' cases."""
    result: Ranks = []
    for entry in cases:
        counts: Counter[tuple[str, str]] = Counter()
        for other in cases:
            if other.owner != entry.owner and other.symptom is entry.symptom:
                counts.update(sorted(set(plain_culprits(other.case))))
        own = set(plain_culprits(entry.case))
        listed = enumerate((culprit for culprit, _ in counts.most_common()), 1)
        result.append(next((rank for rank, culprit in listed if culprit in own), None))
    return result


def _counts(found: Ranks) -> tuple[int, int]:
    return sum(r == 1 for r in found), sum(r is not None and r <= TOP for r in found)


def main(arguments: list[str]) -> None:
    """Prints a line for each variant, for the crossed choice and for no skill."""
    if len(arguments) != 1:
        sys.exit("usage: doctor_crossed.py FOLDER")
    cases = read_all(Path(arguments[0]))
    found = dict(variants(cases))
    result, chosen = crossed(found, cases)
    choices = ", ".join(f"{name} ({count})" for name, count in chosen.most_common())
    rows = {
        **found,
        f"left out by owner, chosen: {choices}": result,
        "without the user's words": ranks(cases, words=False),
        "no skill: the most frequent culprit of other owners": frequent(cases),
    }
    print(
        f"{len(cases)} cases of {len({entry.owner for entry in cases})} owners: first, among three"
    )
    for name, row in rows.items():
        print(*_counts(row), name)


if __name__ == "__main__":
    main(sys.argv[1:])
