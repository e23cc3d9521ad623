"""The losses of the doctor's reading: where the cures of the known cases stand among its causes.

    python studies/doctor_reading.py FOLDER      the table of losses, list by list

For the cases of each list in `doctor_cases/` the program counts where the doctor, given the right
class, has the cure: first, second or third, fourth to twelfth, later; among the causes in the other
direction alone; or not at all. Of those whose cure is not first, it counts those whose first cause
is the right parameter in the wrong direction. Then it takes the class from the user's words and
counts the right classes, and the cures that are first so. `doctor_cases.py files` makes FOLDER.

The rules for other ways of ranking, written before one was scored:

- Cases that count: `fresh_three` to `fresh_six` (93), from which no rule of the doctor was learnt.
  A way that has numbers to fit is fitted on cases of other owners alone (leave one owner out, all
  lists; each thread of a host of many users is an owner of its own). Its form, its penalty and the
  numbers of its features are chosen on the folds of other owners, never by the score that
  counts; where that is not done, the number of forms looked at is told.
- The unit of the test is the owner, by the sum of its cases. A way gains if the first place is
  gained by more owners than lose it with p at most 0.05 (exact sign test, one-sided), or if it has
  at least 8 points more of the cases first; in both cases among three it may not be worse.
- A part is deleted if without it the 93 cases have at least as many first and among three, less
  one each, and the 193 cases of the other lists lose at most 2% first.
- Of two ways that gain, the one with fewer parts is taken if its score is at most two cases less.
- A way that gains is read once on a fresh list of owners on no list. It stays if it has there at
  least as many cures first as the old one.

What came of it, November 2026. A conditional logit over eight parts of the evidence (rule, suspect,
value twice, name, and three likenesses of words) has, on cases of other owners, 46 of the 93 cases
first, before 37, and 58 among three, before 56: nine owners gain, one loses, p = 0.01; about 100
forms were looked at, chosen on other owners' folds 44 to 48. On `fresh_seven`, read once, it has 5
of 13 first, before 6, and 10 among three, before 7. So by the last rule it was taken out again.
Three factors of the ranking were deleted, by the third rule: for values that a partial file does
not give, for what is outside of the file, and for the other direction of a named value. Three that
change no score stay, since each keeps an answer from being absurd: `TRIED`, `MISSING`, `AGAINST`.

The second and last time, by these rules, written before that ranking is scored:

- A fitted ranking takes the place of the factors set by hand, with and without words of the user.
- It stays if both hold, else it is taken out for good and `docs/doctor_evidence.md` says so:
  1. On `fresh_eight`, read once, by somebody else, when the ranking is frozen and its weights are
     fitted to the other lists, it has at least as many cures first as the ranking before, and at
     most one case fewer among the first three.
  2. Over all unlearnt cases (`fresh_three` to `fresh_eight`, each fitted on other owners alone) the
     first place is gained by more owners than lose it, with p at most 0.05 (exact sign test,
     one-sided; owners as above, each by the sum of its cases).
- Its form is chosen by the scores of other owners (nested: for each owner the form that is best on
  the owners besides it), and the number of forms looked at is told. General knowledge that is added
  to the form is taken from the misses of the lists from which the doctor has learnt; of the
  unlearnt lists only counts are looked at, not cases.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from drake_navbench.errors import InputError
from drake_navbench.studies.doctor.alike import Told
from drake_navbench.studies.doctor.causes import Cause
from drake_navbench.studies.doctor.complaints import symptoms_called, symptoms_told
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.known_cases import (
    TOP,
    Case,
    facts_of_case,
    has_place,
    is_hit,
    read_cases,
)
from drake_navbench.studies.doctor.reading import suspicions_of
from drake_navbench.studies.doctor.symptoms import Symptom

LISTS = Path(__file__).parent / "doctor_cases"
# The lists from which the doctor has learnt, and those from which it has not.
OLD = ("thirty_eight", "development", "test", "fresh", "fresh_two")
NEW = ("fresh_three", "fresh_four", "fresh_five", "fresh_six", "fresh_seven")
# The most that a user reads: the doctor asks about twelve complaints.
MANY = 12
FIRST, FEW, SOME, LATE, TURNED, NONE = (
    "first", "2 to 3", "4 to 12", "later", "other direction alone", "not there",
)  # fmt: skip
TURNED_FIRST, CLASS, BY_WORDS = "first cause turned", "class right", "first by words"
COLUMNS = ("cases", FIRST, FEW, SOME, LATE, TURNED, NONE, TURNED_FIRST, CLASS, BY_WORDS)


def losses(name: str, files: Path) -> Counter[str]:
    """Returns the number of cases of a list in each column."""
    counts: Counter[str] = Counter()
    for case in read_cases(LISTS / f"{name}.yaml"):
        try:
            facts = facts_of_case(case, files)
        except InputError as error:
            print(f"{name}, {case.id}: left out, {error}")
            continue
        counts.update(_columns(case, facts))
    return counts


def _columns(case: Case, facts: Facts) -> Iterator[str]:
    """Yields the columns in which a case counts."""
    symptom = symptoms_called(case.symptom_class)[0]
    causes = _causes(case, facts, symptom)
    rank = next((n for n, c in enumerate(causes, 1) if is_hit(c, case, facts)), None)
    yield "cases"
    if rank is None:
        yield TURNED if any(has_place(cause, case, facts) for cause in causes) else NONE
    else:
        yield FIRST if rank == 1 else FEW if rank <= TOP else SOME if rank <= MANY else LATE
    if rank != 1 and has_place(causes[0], case, facts):
        yield TURNED_FIRST
    told = symptoms_told(case.symptom)
    if told[:1] == [symptom]:
        yield CLASS
    if told and is_hit(_causes(case, facts, told[0])[0], case, facts):
        yield BY_WORDS


def _causes(case: Case, facts: Facts, symptom: Symptom) -> list[Cause]:
    return [found.cause for found in suspicions_of(facts, symptom, Told(case.words))]


def main() -> None:
    """Prints the table of losses."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", type=Path, help="folder of the cases' files")
    files = parser.parse_args().files
    print(f"| list | {' | '.join(COLUMNS)} |\n|{'---|' * (len(COLUMNS) + 1)}", flush=True)
    for lists in (OLD, NEW):
        total: Counter[str] = Counter()
        for name in lists:
            found = losses(name, files)
            total += found
            _print_row(name, found)
        _print_row("all", total)


def _print_row(name: str, found: Counter[str]) -> None:
    print(f"| {name} | {' | '.join(str(found[column]) for column in COLUMNS)} |", flush=True)


if __name__ == "__main__":
    main()
