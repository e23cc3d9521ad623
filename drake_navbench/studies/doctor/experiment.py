"""Causes by experiment: which changes are tried, in which order, and when it is enough.

A race drives the changes; a verdict follows from its pairs.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.cures import Trial, trials_of
from drake_navbench.studies.doctor.driving import Driver
from drake_navbench.studies.doctor.facts import CONTROLLER, Facts
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.race import Candidate, Race
from drake_navbench.studies.doctor.reading import Suspicion
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.tried import (
    IDLE,
    LEAST_FALL,
    MOST_CHANGES,
    Rarity,
    Tried,
    Verdict,
    corrected,
)
from drake_navbench.typed_files.dotted_names import flattened

# Changes that are driven in one batch: two for most causes.
TOGETHER = 6
PAIRED_BEST = 3
ASKS_FOR_LESS = "asks for less speed, and makes no robot faster"


class Experiment:
    """Tries changes for a symptom on the probes that show it, a batch at a time."""

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
        before = patient.chosen(self._columns)
        self._race = Race(before, symptom, probes, driver, seed=seed)
        self._raw: list[Tried] = []
        self.rarity = Rarity(0, 0)

    @property
    def tried(self) -> list[Tried]:
        """The changes that were tried so far, p-values corrected for all of them; best first."""
        return corrected(self._raw)

    @property
    def is_out_of_time(self) -> bool:
        """Whether the budget was too short for all trials."""
        return self._race.is_out_of_time

    def run(
        self,
        suspicions: Sequence[Suspicion],
        first: Sequence[Suspicion] = (),
        proposed: Sequence[Trial] = (),
    ) -> None:
        """Tries the suspicions in their order, then pairs of the best; none for a rare symptom.

        After a batch with a change that is shown to take the symptom away none is driven. proposed:
        the user's changes, which are in the first batch before all. first: of each of these, one
        change follows, so that it is named before others that do as much.
        """
        self.rarity = self._race.rarity()
        if self.rarity.is_rare:
            return
        raw = self._raw
        batch = [c for trial in proposed for c in self._proposed(trial)]
        batch += [c for suspicion in first for c in self._candidates(suspicion)[0][:1]]
        known = [c.trial.changes for c in batch]
        room = MOST_CHANGES - PAIRED_BEST
        for number, suspicion in enumerate(suspicions, 1):
            candidates, told = self._candidates(suspicion)
            raw += told
            batch += [c for c in candidates if c.trial.changes not in known]
            is_last = number == len(suspicions) or len(batch) >= room
            if len(batch) >= TOGETHER or (is_last and batch):
                raw += self._race.run(batch[:room])
                room -= len(batch)
                batch = []
            is_found = any(e.takes_all and e.verdict is Verdict.SHOWN for e in self.tried)
            if is_last or self.is_out_of_time or is_found:
                break
        if not self.is_out_of_time:
            raw += self._race.run(self._pairs_of(raw))

    def _proposed(self, trial: Trial) -> list[Candidate]:
        """Returns a change of the user to drive; none, but an entry, if no trial depends on it."""
        suspicion = Suspicion(trial.cause, 1.0, (trial.cause.why,))
        candidate, reason = self._candidate(suspicion, trial)
        if candidate is None:
            self._raw.append(Tried(suspicion, trial, Verdict.NOT_TRIED, reason=reason))
            return []
        candidate.is_proposed = True
        return [candidate]

    def _candidates(self, suspicion: Suspicion) -> tuple[list[Candidate], list[Tried]]:
        """Returns the changes to drive for a cause, and entries for those that are not driven."""
        if suspicion.cause.is_outside:
            return [], [Tried(suspicion, None, Verdict.OUTSIDE)]
        if self._symptom is Symptom.TOO_SLOW and _asks_for_less(suspicion.cause, self._facts):
            return [], [Tried(suspicion, None, Verdict.NOT_TRIED, reason=ASKS_FOR_LESS)]
        trials = trials_of(suspicion.cause, self._facts, self._columns.setup)
        if any(
            not self._facts.has_node(p.node.rpartition("/")[2]) for t in trials for p in t.changes
        ):
            # A node that the file does not have cannot be patched.
            return [], []
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

    def _candidate(self, suspicion: Suspicion, trial: Trial) -> tuple[Candidate | None, str]:
        try:
            before, after = self._patient.before_and_after(trial.changes)
            self._driver.check(after, self._probes[:1], seed=self._seed)
        except InputError as error:
            return None, str(error)
        if _is_same(before, after):
            return None, IDLE
        return Candidate(suspicion, trial, after), ""

    def _pairs_of(self, raw: Sequence[Tried]) -> list[Candidate]:
        """Returns pairs of the best changes of different causes where none is enough alone."""
        helpful = sorted(
            (e for e in raw if e.trial is not None and e.fall >= LEAST_FALL and not e.touches),
            key=lambda e: -e.fall,
        )
        if not helpful or helpful[0].takes_all:
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


def _asks_for_less(cause: Cause, facts: Facts) -> bool:
    """Tells whether a cure only lowers the speed that the file asks for."""
    places = (facts.speed_place, f"{CONTROLLER}.max_speed_xy")
    return cause.direction is Direction.DOWN and cause.place in places


def _is_same(before: Preset, after: Preset) -> bool:
    """Tells whether a change alters nothing on which a trial depends."""
    return (
        before.controller == after.controller
        and _with_effect(before) == _with_effect(after)
        and before.path_handler == after.path_handler
        and before.stack == after.stack
    )


def _with_effect(preset: Preset) -> dict[str, Any]:
    """Returns a column's parameters without those that change nothing here, such as `visualize`."""
    values = preset.parameters.model_dump(mode="json")
    is_idle = preset.parameters.is_without_effect
    return {name: value for name, value in flattened(values) if not is_idle(name, values)}
