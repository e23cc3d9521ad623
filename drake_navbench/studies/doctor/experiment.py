"""Causes by experiment: each candidate alone against the file as it is, on the same trials.

A cause is shown where the symptom's severity falls in the pairs, by Wilcoxon's test, corrected by
Holm for every change that was tried, also for those that were left early.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import combinations
from typing import Any

import numpy as np

from drake_navbench.analysis.paired_comparison import compare_differences
from drake_navbench.analysis.pairs import holm
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studies.doctor.cures import Trial, trials_of
from drake_navbench.studies.doctor.driving import Driver, Row, severity, shows
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.reading import Suspicion
from drake_navbench.studies.doctor.symptoms import Symptom

ERROR = 0.05
# Pairs of a candidate; so many that 20 candidates can be told apart: 2^-11 is less than 0.05 / 20.
# Of one that helps but not in every pair, as many again.
PAIRS = 12
# Of a candidate whose first pairs show no fall, or one by less than this share, the rest is not
# driven.
FIRST_LOOK, FIRST_FALL = 4, 0.1
# What falls by less is of no use to anybody, as a share.
LEAST_FALL = 0.3
# Causes that are tried at most, and changes that are driven in one batch: two for most causes.
MOST_CANDIDATES, TOGETHER = 24, 12
# Of a batch, those with the largest fall in the first pairs are driven to the end.
MOST_TO_THE_END = 5
# By so much the symptom falls where it counts as taken away.
NEARLY_ALL = 0.9
PAIRED_BEST = 3
NO_TIME = "the time was too short for more pairs"


class Verdict(StrEnum):
    """The experiment's verdict on a cause."""

    SHOWN = "shown"
    NOT_SHOWN = "not shown"
    OUTSIDE = "outside the file"
    NOT_TRIED = "not tried"


@dataclass(frozen=True)
class Tried:
    """A change that was tried. before, after: mean severity in the pairs. p_value: corrected.

    fall: share by which the severity falls, with its interval. reason: why it was not tried, or
    left early.
    """

    suspicion: Suspicion
    trial: Trial | None
    verdict: Verdict
    before: float = 0.0
    after: float = 0.0
    interval: tuple[float, float] = (0.0, 0.0)
    p_value: float = 1.0
    pairs: int = 0
    touches: int = 0
    reason: str = ""

    @property
    def fall(self) -> float:
        """The share by which the severity falls."""
        return (self.before - self.after) / self.before if self.before > 0.0 else 0.0

    @property
    def takes_all(self) -> bool:
        """Whether the symptom is nearly gone, in all pairs, without more touches."""
        return self.pairs >= PAIRS and self.fall >= NEARLY_ALL and not self.touches


@dataclass
class _Candidate:
    """A change that is being tried. rows: of the changed file, in the pairs driven so far."""

    suspicion: Suspicion
    trial: Trial
    after: Preset
    rows: list[Row] = field(default_factory=list)
    left: str = ""

    @property
    def is_alive(self) -> bool:
        return not self.left


class Experiment:
    """Tries changes for a symptom on the probes that show it, a batch at a time.

    In a batch one trial of each change tells whether it has any effect, a few more whether the
    symptom falls; the best are driven to the end.
    """

    def __init__(
        self,
        patient: Patient,
        facts: Facts,
        symptom: Symptom,
        probes: Sequence[Scenario],
        driver: Driver,
        *,
        seed: int,
    ) -> None:
        self._patient, self._facts, self._symptom = patient, facts, symptom
        self._probes, self._driver, self._seed = list(probes), driver, seed
        self._columns = patient.columns()
        self._before = patient.chosen(self._columns)
        self.is_out_of_time = False

    def run(self, suspicions: Sequence[Suspicion]) -> list[Tried]:
        """Tries the suspicions in their order, then pairs of the best; the best first.

        After a batch with a change that takes the symptom away no further one is driven.
        """
        raw: list[Tried] = []
        batch: list[_Candidate] = []
        causes = 0
        for number, suspicion in enumerate(suspicions, 1):
            candidates, told = self._candidates(suspicion)
            raw += told
            batch += candidates
            causes += bool(candidates)
            is_last = number == len(suspicions) or causes == MOST_CANDIDATES
            if len(batch) >= TOGETHER or (is_last and batch):
                raw += self._race(batch)
                batch = []
            if is_last or self.is_out_of_time or any(entry.takes_all for entry in raw):
                break
        if not self.is_out_of_time:
            raw += self._race(self._pairs_of(raw))
        return _corrected(raw)

    def _candidates(self, suspicion: Suspicion) -> tuple[list[_Candidate], list[Tried]]:
        """Returns the changes to drive for a cause, and entries for those that are not driven."""
        if suspicion.cause.is_outside:
            return [], [Tried(suspicion, None, Verdict.OUTSIDE)]
        trials = trials_of(suspicion.cause, self._facts, self._columns.setup)
        if not trials:
            reason = "the doctor knows no value to try"
            return [], [Tried(suspicion, None, Verdict.NOT_TRIED, reason=reason)]
        found, told = [], []
        for trial in trials:
            candidate, reason = self._candidate(suspicion, trial)
            if candidate is None:
                told.append(Tried(suspicion, trial, Verdict.NOT_TRIED, reason=reason))
            else:
                found.append(candidate)
        return found, told

    def _candidate(self, suspicion: Suspicion, trial: Trial) -> tuple[_Candidate | None, str]:
        try:
            before, after = self._patient.before_and_after(trial.changes)
            self._driver.check(after, self._probes[:1], seed=self._seed)
        except InputError as error:
            return None, str(error)
        if _is_same(before, after):
            return None, "no trial depends on it"
        return _Candidate(suspicion, trial, after), ""

    def _pairs_of(self, raw: Sequence[Tried]) -> list[_Candidate]:
        """Returns pairs of the best changes of different causes where none is enough alone."""
        helpful = sorted(
            (e for e in raw if e.trial is not None and e.fall >= LEAST_FALL and not e.touches),
            key=lambda e: -e.fall,
        )
        if not helpful or helpful[0].after < 0.5:
            return []
        best = list({e.suspicion.cause.key: e for e in reversed(helpful)}.values())[::-1]
        found = []
        for first, second in combinations(best[:PAIRED_BEST], 2):
            assert first.trial is not None
            assert second.trial is not None
            both = Trial(first.trial.cause, {**first.trial.changes, **second.trial.changes})
            candidate, _ = self._candidate(first.suspicion, both)
            if candidate is not None:
                found.append(candidate)
        return found

    def _race(self, batch: Sequence[_Candidate]) -> list[Tried]:
        """Returns the effects of the changes of a batch, as far as the budget goes."""
        if not batch:
            return []
        self._tell_of(batch)
        seeds = -(-PAIRS // len(self._probes))
        first = min(max(1, -(-FIRST_LOOK // len(self._probes))), seeds)
        self._drive(batch, 1, self._probes[:1])
        old = self._old(1, self._probes[:1])
        for candidate in batch:
            if candidate.rows and _told(candidate.rows) == _told(old):
                candidate.left = "changes nothing in the first trial"
        self._drive(batch, first)
        for candidate in batch:
            is_driven = len(candidate.rows) >= first * len(self._probes)
            if candidate.is_alive and not is_driven:
                candidate.left = NO_TIME
            elif candidate.is_alive and self._fall(candidate) <= FIRST_FALL:
                candidate.left = "little or no fall in the first pairs"
        self._leave_all_but_the_best(batch)
        self._drive(batch, seeds)
        unsure = [c for c in batch if c.is_alive and self._is_unsure(c)]
        self._drive(unsure, 2 * seeds)
        return self._entries(batch)

    def _drive(
        self, batch: Sequence[_Candidate], seeds: int, probes: Sequence[Scenario] | None = None
    ) -> None:
        """Drives the changes that are alive; those for which the time is too short stay as is."""
        alive = [candidate for candidate in batch if candidate.is_alive]
        if not alive or self.is_out_of_time:
            return
        columns = [self._before, *(candidate.after for candidate in alive)]
        found = self._driver.drive_together(columns, probes or self._probes, seeds, seed=self._seed)
        for candidate, rows in zip(alive, found[1:], strict=False):
            candidate.rows = rows
        self.is_out_of_time = len(found) < len(columns)

    def _old(self, seeds: int, probes: Sequence[Scenario]) -> list[Row]:
        """Returns the rows of the file as it is, which were driven with the first of a batch."""
        return self._driver.drive(self._before, probes, seeds, seed=self._seed)

    def _before_of(self, candidate: _Candidate) -> list[Row]:
        """Returns the rows of the file as it is in a candidate's pairs."""
        count = len(candidate.rows)
        if count < len(self._probes):
            return self._old(1, self._probes[:count])
        return self._old(count // len(self._probes), self._probes)

    def _fall(self, candidate: _Candidate) -> float:
        """Returns the share by which the severity falls in the pairs so far."""
        if not candidate.rows:
            return 0.0
        before = np.mean(_severities(self._before_of(candidate), self._symptom))
        after = np.mean(_severities(candidate.rows, self._symptom))
        return float((before - after) / before) if before > 0.0 else 0.0

    def _leave_all_but_the_best(self, batch: Sequence[_Candidate]) -> None:
        """Leaves the changes that others outdo, and strong ones where a mild one does as much."""
        falls = {id(c): round(self._fall(c), 1) for c in batch if c.is_alive}
        alive = [c for c in batch if c.is_alive]
        done: set[tuple[str, Any]] = set()
        for candidate in sorted(alive, key=lambda c: -falls[id(c)]):
            key = candidate.suspicion.cause.key
            if key in done:
                candidate.left = "another value does as much in the first pairs"
            elif len(done) >= MOST_TO_THE_END:
                candidate.left = "others do more in the first pairs"
            else:
                done.add(key)

    def _is_unsure(self, candidate: _Candidate) -> bool:
        """Tells whether a change helps, but not surely enough for one of many that were tried."""
        entry = self._entry(candidate)
        return entry.fall >= LEAST_FALL and entry.p_value > ERROR / MOST_CANDIDATES

    def _entries(self, batch: Sequence[_Candidate]) -> list[Tried]:
        found = [self._entry(candidate) for candidate in batch if candidate.rows]
        for entry in sorted(found, key=lambda e: (bool(e.reason), -e.fall)):
            assert entry.trial is not None
            if not entry.reason:
                self._driver.tell(
                    f"  {entry.trial.told}: {entry.before:.2f} -> {entry.after:.2f} in "
                    f"{entry.pairs} pair{'s' * (entry.pairs != 1)}"
                )
        left = sum(bool(entry.reason) for entry in found)
        if left:
            self._driver.tell(f"  {left} other change{'s' * (left != 1)}: no or a smaller effect")
        return found

    def _tell_of(self, batch: Sequence[_Candidate]) -> None:
        names = list(dict.fromkeys(c.suspicion.cause.told for c in batch))
        more = f" and {len(names) - 3} more" if len(names) > 3 else ""
        trials = len(batch) * FIRST_LOOK + MOST_TO_THE_END * (PAIRS - FIRST_LOOK)
        self._driver.tell(
            f"trying {len(batch)} changes ({', '.join(names[:3])}{more}): up to {trials} trials, "
            f"{self._driver.told_time(trials)}"
        )

    def _entry(self, candidate: _Candidate) -> Tried:
        before_rows = self._before_of(candidate)
        before, after = (
            np.array(_severities(rows, self._symptom)) for rows in (before_rows, candidate.rows)
        )
        found = compare_differences(after - before)
        touches = sum(shows(row, Symptom.COLLISION) for row in candidate.rows) - sum(
            shows(row, Symptom.COLLISION) for row in before_rows
        )
        # What was left early, also for want of time, is no test.
        is_whole = not candidate.left and len(candidate.rows) >= PAIRS
        reason = candidate.left or ("" if is_whole else NO_TIME)
        return Tried(
            candidate.suspicion,
            candidate.trial,
            Verdict.NOT_SHOWN,
            float(before.mean()),
            float(after.mean()),
            (found.interval.low, found.interval.high),
            found.p_value if is_whole and found.difference < 0.0 else 1.0,
            len(candidate.rows),
            max(touches, 0),
            reason,
        )


def _is_same(before: Preset, after: Preset) -> bool:
    """Tells whether a change leaves everything as it is that a trial is a function of."""
    return (
        before.controller == after.controller
        and before.parameters == after.parameters
        and before.path_handler == after.path_handler
        and before.stack == after.stack
    )


def _told(rows: Sequence[Row]) -> list[tuple[Any, ...]]:
    """Returns the outcomes of the drives in the rows, without the column's name."""
    return [(row["outcome"], row["end"], row["severity"]) for row in rows]


def _severities(rows: Sequence[dict[str, Any]], symptom: str) -> list[float]:
    return [severity(row, symptom) for row in rows]


def _corrected(raw: Sequence[Tried]) -> list[Tried]:
    """Returns the changes with p-values corrected for all that were driven, the best first."""
    driven = [entry for entry in raw if entry.pairs]
    adjusted = holm([entry.p_value for entry in driven])
    found: list[Tried] = []
    for entry, p_value in zip(driven, adjusted, strict=True):
        is_shown = p_value <= ERROR and entry.fall >= LEAST_FALL and not entry.touches
        verdict = Verdict.SHOWN if is_shown else Verdict.NOT_SHOWN
        values = entry.__dict__ | {"verdict": verdict, "p_value": float(p_value)}
        found.append(Tried(**values))
    # Of changes that all take the symptom away, the likeliest cause stays before the others.
    found.sort(
        key=lambda e: (e.verdict is not Verdict.SHOWN, not e.takes_all, -e.fall * (not e.takes_all))
    )
    return found + [entry for entry in raw if not entry.pairs]
