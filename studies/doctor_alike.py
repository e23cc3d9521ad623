"""Does the doctor find more cures if a user names the known complaint that is most like the own?

    python studies/doctor_alike.py ask LIST ... --files FOLDER      the questions, without any cure
    python studies/doctor_alike.py score LIST ... --files FOLDER    the score of the answers

`ask` prints, for each case of a list, the user's words and the complaints that the doctor asks
about. A chooser who sees this alone notes up to two names for each case, or none, in
`doctor_alike_answers.yaml`, before seeing any cure. `score` reads the doctor's causes with and
without them. Nothing is driven.

The rules, written before the first answer to a case of the lists that count:

- Lists that count: `fresh_three` and `fresh_four` (72 cases; what the doctor's rules have learnt
  from them helps with and without answers alike), and `fresh_six`, of owners in no list. Number of
  complaints, weights and length of a line were chosen on the 44 cases of `fresh_two`, for which
  the same chooser had answered: 14 first without answers, 19 with.
- The table of known complaints was written from Nav2's own texts. Nothing in it was learnt from a
  case, so nothing is left out of it.
- `fresh_six` is collected blind: a program prints the words of commits, of comments in Nav2 files
  and of notes about symptoms, with names of parameters, numbers and words of change masked. From
  these the collector writes the case's words and class and, where they are about a symptom, answers
  the doctor's question. Only then the change is unmasked, and the case is taken or refused: taken
  if it changes at most 6 parameters of Nav2 that the words explain (the same one in both costmaps
  counts once). Owners of other lists are left out; at most 3 cases per owner. No answer is changed
  after that. Where the masked words have betrayed the cure, the case is marked, and the score is
  told without these, too.
- A case is one unit; intervals by owner, who may have several cases. First and among three, with
  and without the answers. Beside them: the methods without skill of `doctor --score`, one
  complaint of the list at random in place of the answer (the mean over all of the list), and the
  first of the list as the answer to every case.
- The chooser is a language model in the user's place. It sees neither cures nor causes nor file,
  but may guess a cure behind a line; a user sees the robot instead.
- The question stays in the doctor if on `fresh_six` at least 8 points more of the cases have their
  cure first, or if on the 72 the first place is gained more often than lost with p at most 0.05
  (exact sign test over owners, one-sided, each owner by the sum of its cases). Else it is taken
  out again.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterator, Sequence
from math import comb
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

from drake_navbench.errors import InputError
from drake_navbench.studies.doctor.alike import Alike, Told, complaints_named
from drake_navbench.studies.doctor.complaints import Known, symptoms_called
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.known_cases import (
    TOP,
    Case,
    facts_of_case,
    is_hit,
    read_cases,
)
from drake_navbench.studies.doctor.reading import asked_about, suspicions_of
from drake_navbench.studies.doctor.symptoms import Symptom

HERE = Path(__file__).parent
LISTS = HERE / "doctor_cases"
ANSWERS = HERE / "doctor_alike_answers.yaml"
DRAWS, SEED = 10_000, 43


class Asked(NamedTuple):
    """A case with what the doctor reads, and the complaints that it asks about."""

    case: Case
    facts: Facts
    symptom: Symptom
    complaints: list[Alike]

    def rank(self, names: Sequence[str] = ()) -> int | None:
        """Returns the rank of the first hit among the causes, from 1; names: those of --like."""
        told = Told(self.case.words, tuple(self._possible(names)))
        found = suspicions_of(self.facts, self.symptom, told)
        hits = (n for n, s in enumerate(found, 1) if is_hit(s.cause, self.case, self.facts))
        return next(hits, None)

    def _possible(self, names: Sequence[str]) -> Iterator[Known]:
        """Yields the named complaints but those that today's doctor knows to be impossible here."""
        for name in names:
            try:
                yield from complaints_named([name], self.facts)
            except InputError as error:
                print(f"{self.case.id}: an answer is left out: {error}")

    @property
    def owner(self) -> str:
        """The owner of the case's repository or thread."""
        return self.case.link.partition("/")[0]


def asked_of(names: Sequence[str], files: Path) -> Iterator[Asked]:
    """Yields the cases of some lists with the complaints that the doctor asks about."""
    for name in names:
        for case in read_cases(LISTS / f"{name}.yaml"):
            facts = facts_of_case(case, files)
            symptom = symptoms_called(case.symptom_class)[0]
            told = Told(case.words)
            found = suspicions_of(facts, symptom, told)
            yield Asked(case, facts, symptom, asked_about(facts, symptom, told, found))


def ask(asked: Sequence[Asked]) -> None:
    """Prints the questions."""
    for entry in asked:
        case = entry.case
        named = ", ".join(f"{name} {value}" for name, value in case.parameters.items())
        print(f"\n{case.id}, {case.controller}, {case.release}, {entry.symptom}: {case.words}")
        if named:
            print(f"  values: {named}")
        for complaint in entry.complaints:
            print(f"  {complaint.name}  {complaint.line}")


def score(asked: Sequence[Asked], answers: dict[str, list[str]]) -> None:
    """Prints the score of the answers."""
    plain = [entry.rank() for entry in asked]
    told = [entry.rank(answers[entry.case.id]) for entry in asked]
    first = [entry.rank([c.name for c in entry.complaints[:1]]) for entry in asked]
    each = [[entry.rank([c.name]) for c in entry.complaints] for entry in asked]
    owners = [entry.owner for entry in asked]
    answered = sum(bool(answers[entry.case.id]) for entry in asked)
    print(f"{len(asked)} cases of {len(set(owners))} owners, {answered} with an answer")
    for name, ranks in (("without", plain), ("with answers", told), ("always the first", first)):
        print(f"{name:18} first {_told(ranks, owners, 1)}, among three {_told(ranks, owners, TOP)}")
    # A case without a complaint to ask about is answered by none.
    drawn = [row or [rank] for row, rank in zip(each, plain, strict=True)]
    shares = [sum(map(np.mean, [[_is_in(r, n) for r in row] for row in drawn])) for n in (1, TOP)]
    best = [min((rank for rank in row if rank), default=None) for row in drawn]
    print(f"{'the best of all':18} first {_told(best, owners, 1)}, among three "
          f"{_told(best, owners, TOP)}")  # fmt: skip
    print(f"{'one at random':18} first {shares[0]:.1f}, among three {shares[1]:.1f}")
    gains = [_is_in(b, 1) - _is_in(a, 1) for a, b in zip(plain, told, strict=True)]
    by_owner: dict[str, int] = defaultdict(int)
    for owner, gain in zip(owners, gains, strict=True):
        by_owner[owner] += gain
    up, down = (sum(np.sign(g) == s for g in by_owner.values()) for s in (1, -1))
    chance = sum(comb(up + down, k) for k in range(up, up + down + 1)) / 2 ** (up + down)
    print(f"first place: {gains.count(1)} cases gain it, {gains.count(-1)} lose it; owners: "
          f"{up} and {down}, p = {chance:.3f}")  # fmt: skip


def _is_in(rank: int | None, most: int) -> int:
    return int(rank is not None and rank <= most)


def _told(ranks: Sequence[int | None], owners: Sequence[str], most: int) -> str:
    """Returns the number of cases up to a rank, with its share and the interval by owner."""
    hits: dict[str, list[int]] = defaultdict(list)
    for owner, rank in zip(owners, ranks, strict=True):
        hits[owner].append(_is_in(rank, most))
    sums = np.array([(sum(own), len(own)) for own in hits.values()])
    drawn = np.random.default_rng(SEED).integers(len(sums), size=(DRAWS, len(sums)))
    shares = sums[drawn].sum(axis=1)
    low, high = np.percentile(shares[:, 0] / shares[:, 1], [2.5, 97.5])
    found = sum(_is_in(rank, most) for rank in ranks)
    return f"{found} ({found / len(ranks):.0%}; {low:.0%} to {high:.0%})"


def main() -> None:
    """Prints questions or score."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("step", choices=("ask", "score"))
    parser.add_argument("lists", nargs="+", help="names of lists in doctor_cases/")
    parser.add_argument("--files", type=Path, required=True, help="folder of the cases' files")
    parser.add_argument("--without", nargs="*", default=[], help="cases that are left out")
    arguments = parser.parse_args()
    found = asked_of(arguments.lists, arguments.files)
    asked = [entry for entry in found if entry.case.id not in arguments.without]
    if arguments.step == "ask":
        ask(asked)
    else:
        score(asked, yaml.safe_load(ANSWERS.read_text(encoding="utf-8")))


if __name__ == "__main__":
    main()
