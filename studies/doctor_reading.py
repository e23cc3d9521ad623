"""Where does the doctor's reading lose, and which other way of ranking its causes gains?

    python studies/doctor_reading.py loss --files FOLDER      the table of losses, list by list
    python studies/doctor_reading.py judge --files FOLDER     the score, fitted on other owners
    python studies/doctor_reading.py fit --files FOLDER       fits the weights that the doctor has

`loss` puts each case of the lists in `doctor_cases/` into one row: the cure is the first cause, the
second or third, the fourth to twelfth, later; it is among the causes in the other direction alone;
or it is not among them. Beside it, whether the class of the user's words is the right one, and the
score if the doctor takes that class. FOLDER is made by `doctor_cases.py files`.

The rules, written before another way of ranking was scored:

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
"""

from __future__ import annotations

import argparse
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from drake_navbench.errors import InputError
from drake_navbench.studies.doctor.alike import Told
from drake_navbench.studies.doctor.complaints import symptoms_called, symptoms_told
from drake_navbench.studies.doctor.known_cases import (
    TOP,
    Case,
    facts_of_case,
    has_place,
    is_hit,
    read_cases,
)
from drake_navbench.studies.doctor.ranking import WEIGHTS, Evidence
from drake_navbench.studies.doctor.reading import evidence_of, suspicions_of
from drake_navbench.typed_files.output_file import write_text

LISTS = Path(__file__).parent / "doctor_cases"
OLD = ("thirty_eight", "development", "test", "fresh", "fresh_two")
NEW = ("fresh_three", "fresh_four", "fresh_five", "fresh_six")
# Hosts of the threads of many users, each of whom is an owner.
HOSTS = ("ros-navigation", "ros-planning")
# The parts of the owners that are left out in turn, and the penalty on the squared weights of the
# evidence, each divided by its standard deviation.
PARTS, SEED, PENALTY = 12, 0, 20.0
LOSSES = ("first", "2 to 3", "4 to 12", "13 and later", "other direction", "none")


class Read(NamedTuple):
    """A case with the evidence for each possible cause, one row each. is_hit: which are cures."""

    name: str
    owner: str
    evidence: np.ndarray
    factors: np.ndarray
    is_hit: np.ndarray
    places: list[str]

    def rank(self, weights: np.ndarray) -> int | None:
        """Returns the rank of the first cure with some weights, from 1; None without one."""
        scores = self.evidence @ weights + np.log(self.factors)
        order = sorted(range(len(scores)), key=lambda n: (-scores[n], self.places[n]))
        return next((rank for rank, n in enumerate(order, 1) if self.is_hit[n]), None)


def owner_of(case: Case, name: str) -> str:
    """Returns the owner of a case: of a repository, else the asker of a thread or a note."""
    if name == "fresh_five":
        return case.link.rpartition(",")[0] or case.link
    first = case.link.partition("/")[0]
    return case.link.partition("@")[0] if first in HOSTS or "#" in case.link else first


def cases_of(names: Sequence[str]) -> Iterator[tuple[str, Case]]:
    """Yields the cases of some lists, each with the name of its list."""
    for name in names:
        for case in read_cases(LISTS / f"{name}.yaml"):
            yield name, case


def read_all(files: Path, names: Sequence[str]) -> list[Read]:
    """Returns the cases that the doctor can read, with their evidence."""
    found = []
    for name, case in cases_of(names):
        try:
            facts = facts_of_case(case, files)
            symptom = symptoms_called(case.symptom_class)[0]
        except InputError as error:
            print(f"{name} {case.id}: left out, {error}")
            continue
        listed = evidence_of(facts, symptom, Told(case.words))
        found.append(
            Read(
                name,
                owner_of(case, name),
                np.array([evidence for _, evidence, _ in listed]),
                np.array([factor for _, _, factor in listed]),
                np.array([is_hit(cause, case, facts) for cause, _, _ in listed]),
                [cause.place for cause, _, _ in listed],
            )
        )
    return found


def fitted(cases: Sequence[Read]) -> np.ndarray:
    """Returns the weights under which the cures of some cases are likeliest."""
    cases = [case for case in cases if case.is_hit.any()]
    evidence = np.concatenate([case.evidence for case in cases])
    scale = evidence.std(axis=0) + 1e-9
    offset = np.log(np.concatenate([case.factors for case in cases]))
    hit = np.concatenate([case.is_hit for case in cases])
    starts = np.cumsum([0, *(len(case.is_hit) for case in cases)])[:-1]
    of_case = np.repeat(np.arange(len(cases)), [len(case.is_hit) for case in cases])

    def loss(weights: np.ndarray) -> tuple[float, np.ndarray]:
        scores = evidence / scale @ weights + offset
        odds = np.exp(scores - np.maximum.reduceat(scores, starts)[of_case])
        total, cures = (np.add.reduceat(part, starts) for part in (odds, odds * hit))
        chance, of_cures = odds / total[of_case], odds * hit / cures[of_case]
        gradient = -(evidence / scale).T @ (of_cures - chance) + PENALTY * weights
        return float(np.log(total / cures).sum() + PENALTY * weights @ weights / 2), gradient

    start = np.zeros(evidence.shape[1])
    return minimize(loss, start, jac=True, method="L-BFGS-B").x / scale


def fit(files: Path) -> None:
    """Writes the weights that fit all cases."""
    weights = fitted(read_all(files, (*OLD, *NEW)))
    named = zip(Evidence._fields, weights, strict=True)
    lines = [f"{name}: {weight:.2f}" for name, weight in named]
    made = f"# Made by `python studies/{Path(__file__).name} fit --files FOLDER`."
    write_text(WEIGHTS, "\n".join([made, *lines]) + "\n")
    print("\n".join(lines))


def judge(files: Path) -> None:
    """Prints the score of the ranking, each case by weights fitted on other owners alone."""
    cases = read_all(files, (*OLD, *NEW))
    owners = sorted({case.owner for case in cases})
    drawn = np.random.default_rng(SEED).permutation(len(owners)) % PARTS
    part_of = {owner: int(part) for owner, part in zip(owners, drawn, strict=True)}
    by_part = [fitted([c for c in cases if part_of[c.owner] != part]) for part in range(PARTS)]
    ranks = [case.rank(by_part[part_of[case.owner]]) for case in cases]
    for name in (*OLD, *NEW):
        own = [rank for rank, case in zip(ranks, cases, strict=True) if case.name == name]
        print(f"{name:12} {len(own):3} cases: first {_upto(own, 1)}, among three {_upto(own, TOP)}")
    new = [(r, c) for r, c in zip(ranks, cases, strict=True) if c.name in NEW]
    low, high = _interval([r == 1 for r, _ in new], [c.owner for _, c in new])
    first, three = (_upto([r for r, _ in new], most) for most in (1, TOP))
    interval = f"{low:.0%} to {high:.0%} by owner"
    print(f"{len(new)} that count: first {first} ({interval}), among three {three}")
    print(dict(zip(Evidence._fields, np.round(np.mean(by_part, axis=0), 2).tolist(), strict=True)))


def _upto(ranks: Sequence[int | None], most: int) -> int:
    return sum(rank is not None and rank <= most for rank in ranks)


def _interval(hits: Sequence[bool], owners: Sequence[str]) -> tuple[float, float]:
    by_owner: dict[str, list[bool]] = defaultdict(list)
    for owner, hit in zip(owners, hits, strict=True):
        by_owner[owner].append(hit)
    sums = np.array([(sum(own), len(own)) for own in by_owner.values()])
    drawn = np.random.default_rng(SEED).integers(len(sums), size=(10_000, len(sums)))
    shares = sums[drawn].sum(axis=1)
    low, high = np.percentile(shares[:, 0] / shares[:, 1], [2.5, 97.5])
    return float(low), float(high)


def loss(files: Path) -> None:
    """Prints the table of losses."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for name, case in cases_of((*OLD, *NEW)):
        try:
            facts = facts_of_case(case, files)
            symptom = symptoms_called(case.symptom_class)[0]
        except InputError:
            continue
        told = Told(case.words)
        causes = [s.cause for s in suspicions_of(facts, symptom, told)]
        hits = (rank for rank, cause in enumerate(causes, 1) if is_hit(cause, case, facts))
        rank = next(hits, None)
        has = any(has_place(cause, case, facts) for cause in causes)
        counts[name]["cases"] += 1
        counts[name][_loss(rank, has)] += 1
        counts[name]["turned"] += rank != 1 and has_place(causes[0], case, facts)
        classes = symptoms_told(case.symptom)
        counts[name]["class"] += classes[:1] == [symptom]
        by_words = [s.cause for s in suspicions_of(facts, classes[0], told)] if classes else []
        counts[name]["by words"] += any(is_hit(cause, case, facts) for cause in by_words[:1])
    columns = ("cases", *LOSSES, "turned", "class", "by words")
    print(f"| list | {' | '.join(columns)} |\n|{'---|' * (len(columns) + 1)}")
    for name in (*OLD, *NEW):
        print(f"| {name} | {' | '.join(str(counts[name][column]) for column in columns)} |")


def _loss(rank: int | None, has_place: bool) -> str:
    if rank is None:
        return LOSSES[4] if has_place else LOSSES[5]
    return LOSSES[0] if rank == 1 else LOSSES[1] if rank <= TOP else LOSSES[2 + (rank > 12)]


def main() -> None:
    """Prints the losses or the score, or fits the weights."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("step", choices=("loss", "judge", "fit"))
    parser.add_argument("--files", type=Path, required=True, help="folder of the cases' files")
    arguments = parser.parse_args()
    {"loss": loss, "judge": judge, "fit": fit}[arguments.step](arguments.files)


if __name__ == "__main__":
    main()
