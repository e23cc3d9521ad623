"""Causes by experiment: which changes are tried, in which order, and when it is enough.

A race drives the changes; a verdict follows from its pairs.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studies.doctor.candidates import Candidate, Candidates
from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.driving import Driver
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.race import Race
from drake_navbench.studies.doctor.reading import Suspicion
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.tried import (
    LEAST_FALL,
    MOST_CHANGES,
    Rarity,
    Tried,
    Verdict,
    corrected,
)

# Changes that are driven in one batch: two for most causes.
TOGETHER = 6
PAIRED_BEST = 3


class Experiment:
    """Tries changes for a symptom on the probes that show it, a batch at a time."""

    def __init__(
        self,
        patient: Patient,
        symptom: Symptom,
        probes: Sequence[Scenario],
        driver: Driver,
        *,
        seed: int,
    ) -> None:
        self.candidates = Candidates(patient, symptom, probes[0], driver, seed=seed)
        before = patient.chosen(patient.columns())
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
        batch += [c for suspicion in first for c in self.candidates.of(suspicion)[0][:1]]
        known = [c.trial.changes for c in batch]
        room = MOST_CHANGES - PAIRED_BEST
        for number, suspicion in enumerate(suspicions, 1):
            candidates, told = self.candidates.of(suspicion)
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
        candidate, reason = self.candidates.of_trial(suspicion, trial)
        if candidate is None:
            self._raw.append(Tried(suspicion, trial, Verdict.NOT_TRIED, reason=reason))
            return []
        candidate.is_proposed = True
        return [candidate]

    def _pairs_of(self, raw: Sequence[Tried]) -> list[Candidate]:
        """Returns pairs of the best changes of different causes where none is enough alone."""
        helpful = sorted(
            (e for e in raw if e.trial is not None and e.fall >= LEAST_FALL and not e.touches),
            key=lambda e: -e.fall,
        )
        # The largest fall may be of a change that was left after few pairs, for another's sake.
        if any(entry.takes_all for entry in helpful):
            return []
        best = list({e.suspicion.cause.key: e for e in reversed(helpful)}.values())[::-1]
        found = []
        for first, second in combinations(best[:PAIRED_BEST], 2):
            assert first.trial is not None
            assert second.trial is not None
            both = Trial(first.trial.cause, {**first.trial.changes, **second.trial.changes})
            candidate, _ = self.candidates.of_trial(first.suspicion, both)
            if candidate is not None:
                found.append(candidate)
        return found
