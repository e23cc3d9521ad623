"""The losses of the doctor's reading: where the cures of the known cases stand among its causes.

    python studies/doctor_reading.py losses FOLDER     the table of losses, list by list
    python studies/doctor_reading.py ranks FOLDER      the rank of the first cure, case by case

For the cases of each list in `doctor_cases/` the program counts where the doctor, given the right
class, has the cure: first, second or third, fourth to twelfth, later; among the causes in the other
direction alone; or not at all. Of those whose cure is not first, it counts those whose first cause
is the right parameter in the wrong direction. Then it takes the class from the user's words and
counts the right classes, and the cures that are first so. `doctor_cases.py files` makes FOLDER.
A list that is not in `doctor_cases/` is left out.

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

What came of it, November 2026. The frozen ranking (commit `59e1f81d`: a sum of four parts, rule,
suspect by its value, name, likeness of words) had on the eighth list, which its collectors made in
two halves, `fresh_eight` and `fresh_nine`, 31 of 53 cures first, as many as the ranking before, and
45 among three, before 42: the first rule holds. Over all 159 unlearnt cases it has 81 first, before
74, and 112 among three, before 106; of 96 owners 12 gain the first place and 5 lose it, p = 0.07:
the second rule does not hold. The ranking was taken out for good.

`fresh_ten` taught faults that words tell apart (`families.py`), before `fresh_eleven` was opened.
With them and without them the doctor has there the same 6 of 12 cures first and 7 among three; of
the 157 cases of `fresh_three` to `fresh_nine` 74 first and 107 among three, before 73 and 105. By
the last of the first rules they stay, though no gain is shown.
"""

from __future__ import annotations

import argparse
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from drake_navbench.errors import InputError
from drake_navbench.studies.doctor.alike import Told
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
from drake_navbench.studies.doctor.reading import Suspicion, suspicions_of
from drake_navbench.studies.doctor.symptoms import Symptom

LISTS = Path(__file__).parent / "doctor_cases"
# The lists from which the doctor has learnt, and those from which it has not.
OLD = ("thirty_eight", "development", "test", "fresh", "fresh_two", "fresh_ten")
NEW = (
    "fresh_three",
    "fresh_four",
    "fresh_five",
    "fresh_six",
    "fresh_seven",
    "fresh_eight",
    "fresh_nine",
    "fresh_eleven",
)
# The most that a user reads: the doctor asks about twelve complaints.
MANY = 12
FIRST, FEW, SOME, LATE, TURNED, NONE = (
    "first", "2 to 3", "4 to 12", "later", "other direction alone", "not there",
)  # fmt: skip
TURNED_FIRST, CLASS, BY_WORDS = "first cause turned", "class right", "first by words"
COLUMNS = ("cases", FIRST, FEW, SOME, LATE, TURNED, NONE, TURNED_FIRST, CLASS, BY_WORDS)


class Read(NamedTuple):
    """A case of a list with the facts of its file and its right class."""

    name: str
    case: Case
    facts: Facts
    symptom: Symptom

    @property
    def found(self) -> list[Suspicion]:
        """The causes that the doctor has for the case, the likeliest first."""
        return suspicions_of(self.facts, self.symptom, Told(self.case.words))

    def rank_in(self, found: Sequence[Suspicion]) -> int | None:
        """Returns the rank of the first cure, from 1; None without one."""
        ranked = enumerate((entry.cause for entry in found), 1)
        return next((rank for rank, c in ranked if is_hit(c, self.case, self.facts)), None)


def cases_of(names: Sequence[str], files: Path) -> Iterator[Read]:
    """Yields the cases of some lists that the doctor can read."""
    for name in names:
        path = LISTS / f"{name}.yaml"
        for case in read_cases(path) if path.exists() else ():
            try:
                facts = facts_of_case(case, files)
            except InputError as error:
                print(f"# {name}, {case.id}: left out, {error}")
                continue
            yield Read(name, case, facts, symptoms_called(case.symptom_class)[0])


def ranks(files: Path) -> None:
    """Prints the rank of the first cure of each case, as YAML; null where no cause is one."""
    for read in cases_of((*OLD, *NEW), files):
        rank = read.rank_in(read.found)
        print(f"{read.name} {read.case.id}: {'null' if rank is None else rank}", flush=True)


def _columns(read: Read) -> Iterator[str]:
    """Yields the columns in which a case counts."""
    case, facts, found = read.case, read.facts, read.found
    rank = read.rank_in(found)
    yield "cases"
    if rank is None:
        yield TURNED if any(has_place(entry.cause, case, facts) for entry in found) else NONE
    else:
        yield FIRST if rank == 1 else FEW if rank <= TOP else SOME if rank <= MANY else LATE
    if rank != 1 and has_place(found[0].cause, case, facts):
        yield TURNED_FIRST
    told = symptoms_told(case.symptom)
    if told[:1] == [read.symptom]:
        yield CLASS
    by_words = read._replace(symptom=told[0]).found if told else []
    if any(is_hit(entry.cause, case, facts) for entry in by_words[:1]):
        yield BY_WORDS


def losses(files: Path) -> None:
    """Prints the table of losses."""
    print(f"| list | {' | '.join(COLUMNS)} |\n|{'---|' * (len(COLUMNS) + 1)}", flush=True)
    for names in (OLD, NEW):
        counts: dict[str, Counter[str]] = defaultdict(Counter)
        for read in cases_of(names, files):
            counts[read.name].update(_columns(read))
        for name, found in counts.items():
            _print_row(name, found)
        _print_row("all", sum(counts.values(), Counter()))


def _print_row(name: str, found: Counter[str]) -> None:
    print(f"| {name} | {' | '.join(str(found[column]) for column in COLUMNS)} |", flush=True)


def main() -> None:
    """Takes a step."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    steps = {"losses": losses, "ranks": ranks}
    parser.add_argument("step", choices=steps)
    parser.add_argument("files", type=Path, help="folder of the cases' files")
    arguments = parser.parse_args()
    if not arguments.files.is_dir():
        # Without their files the cases would be read by their named values, and score otherwise.
        parser.error(f"files {arguments.files}: no such folder")
    steps[arguments.step](arguments.files)


if __name__ == "__main__":
    main()
