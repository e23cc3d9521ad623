"""Causes by experiment: each candidate alone against the file as it is, on the same trials.

A cause is shown where the symptom's severity falls in the pairs, by Wilcoxon's test, corrected by
Holm for every change that was tried, also for those that were left early.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import combinations
from typing import Any

import numpy as np

from drake_navbench.analysis.statistics import compare_differences, holm
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studies.doctor.cures import Trial, trials_of
from drake_navbench.studies.doctor.driving import Driver, OutOfTime, Row, severity, shows
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.reading import Suspicion
from drake_navbench.studies.doctor.symptoms import Symptom

ERROR = 0.05
# Pairs of a candidate; so many that 20 candidates can be told apart: 2^-11 is less than 0.05 / 20.
PAIRS = 12
# Of a candidate whose first pairs show no fall, or one by less than this share, the rest is not
# driven.
FIRST_LOOK, FIRST_FALL = 4, 0.1
# What falls by less is of no use to anybody, as a share.
LEAST_FALL = 0.3
MOST_CANDIDATES = 16
# Candidates that are still tried after one that takes the symptom away.
FURTHER_CANDIDATES = 3
# By so much the symptom falls where it counts as taken away.
NEARLY_ALL = 0.9
PAIRED_BEST = 3


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


class Experiment:
    """Tries changes for a symptom on the probes that show it.

    baseline: what the file as it is does in every probe. probes: by name.
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
        """Tries the suspicions in their order, then pairs of the best; the best first."""
        raw: list[Tried] = []
        tried, most = 0, MOST_CANDIDATES
        for suspicion in suspicions:
            if tried >= most or self.is_out_of_time:
                break
            found = self._of(suspicion)
            raw += found
            tried += any(entry.trial is not None and entry.pairs for entry in found)
            if any(entry.takes_all for entry in found):
                most = min(most, tried + FURTHER_CANDIDATES)
        if not self.is_out_of_time:
            raw += self._pairs_of(raw)
        return _corrected(raw)

    def _of(self, suspicion: Suspicion) -> list[Tried]:
        if suspicion.cause.is_outside:
            return [Tried(suspicion, None, Verdict.OUTSIDE)]
        trials = trials_of(suspicion.cause, self._facts, self._columns.setup)
        if not trials:
            reason = "the doctor knows no value to try"
            return [Tried(suspicion, None, Verdict.NOT_TRIED, reason=reason)]
        found: list[Tried] = []
        for trial in trials:
            if found and found[-1].takes_all:
                break
            entry = self._try(suspicion, trial)
            if entry is None:
                break
            found.append(entry)
        return found

    def _pairs_of(self, raw: Sequence[Tried]) -> list[Tried]:
        """Tries pairs of the best changes of different causes where none is enough alone."""
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
            changes = {**first.trial.changes, **second.trial.changes}
            entry = self._try(first.suspicion, Trial(first.trial.cause, changes))
            if entry is None:
                break
            found.append(entry)
        return found

    def _try(self, suspicion: Suspicion, trial: Trial) -> Tried | None:
        """Returns the effect of a change on the symptom; None where the budget does not suffice."""
        try:
            before, after = self._patient.before_and_after(trial.changes)
        except InputError as error:
            return Tried(suspicion, trial, Verdict.NOT_TRIED, reason=str(error))
        if _is_same(before, after):
            return Tried(suspicion, trial, Verdict.NOT_TRIED, reason="no trial depends on it")
        try:
            old, new, left = self._race(before, after)
        except InputError as error:
            return Tried(suspicion, trial, Verdict.NOT_TRIED, reason=str(error))
        except OutOfTime:
            self.is_out_of_time = True
            return None
        entry = self._entry(suspicion, trial, old, new, left=left)
        self._driver.tell(
            f"  {trial.told}: {entry.before:.2f} -> {entry.after:.2f} in {entry.pairs} pair"
            f"{'s' * (entry.pairs != 1)}"
        )
        return entry

    def _race(self, before: Preset, after: Preset) -> tuple[list[Row], list[Row], str]:
        """Returns pairs of rows, and why the rest was not driven; raises OutOfTime.

        One trial tells whether the change has any effect, a few more whether the symptom falls.
        """
        old, new = self._pairs(before, after, self._probes[:1], 1)
        if _told(old) == _told(new):
            return old, new, "changes nothing in the first trial"
        seeds = -(-PAIRS // len(self._probes))
        first = min(max(1, -(-FIRST_LOOK // len(self._probes))), seeds)
        old, new = self._pairs(before, after, self._probes, first)
        falls = np.mean(_severities(old, self._symptom)) - np.mean(_severities(new, self._symptom))
        if falls <= FIRST_FALL * np.mean(_severities(old, self._symptom)):
            return old, new, "little or no fall in the first pairs"
        return *self._pairs(before, after, self._probes, seeds), ""

    def _pairs(
        self, before: Preset, after: Preset, probes: Sequence[Scenario], seeds: int
    ) -> tuple[list[Row], list[Row]]:
        drive = self._driver.drive
        return (
            drive(before, probes, seeds, seed=self._seed),
            drive(after, probes, seeds, seed=self._seed),
        )

    def _entry(
        self,
        suspicion: Suspicion,
        trial: Trial,
        old: Sequence[Row],
        new: Sequence[Row],
        *,
        left: str,
    ) -> Tried:
        before, after = (np.array(_severities(rows, self._symptom)) for rows in (old, new))
        found = compare_differences(after - before)
        touches = sum(shows(row, Symptom.COLLISION) for row in new) - sum(
            shows(row, Symptom.COLLISION) for row in old
        )
        return Tried(
            suspicion,
            trial,
            Verdict.NOT_SHOWN,
            float(before.mean()),
            float(after.mean()),
            (found.interval.low, found.interval.high),
            1.0 if left or found.difference >= 0.0 else found.p_value,
            len(old),
            max(touches, 0),
            left,
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
    found.sort(key=lambda e: (e.verdict is not Verdict.SHOWN, -e.fall))
    return found + [entry for entry in raw if not entry.pairs]
