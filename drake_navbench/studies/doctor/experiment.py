"""Causes by experiment: which changes are tried, in which order, and when it is enough.

A race drives the changes, each alone; a verdict follows from its pairs. A file may have several
faults, each of which alone keeps the symptom: no change alone then shows anything. So all likely
changes are also made together, and if that helps, the fewest of them that do are searched.
"""

from __future__ import annotations

from collections.abc import Sequence

from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studies.doctor.candidates import Candidate, Candidates
from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.driving import TOGETHER_SEED, Driver
from drake_navbench.studies.doctor.fewest import fewest, without_harmful
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.race import FIRST_FALL, Race
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
# Sets of changes that are driven to the end: one after the first batch, one in the end.
SETS = 2
# Changes that are made together at most, the likeliest.
MOST_PARTS = 32
# Changes of which each is left out in turn, in case one spoils what the others do: at least four
# trials each.
MOST_LEFT_OUT = 8


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
        self._driver = driver
        self._race = Race(before, symptom, probes, driver, seed=seed)
        # The race's trials choose a set of changes; trials of other seeds tell whether it helps.
        self._other_race = Race(before, symptom, probes, driver, seed=seed + TOGETHER_SEED)
        self._raw: list[Tried] = []
        self.rarity = Rarity(0, 0)

    @property
    def tried(self) -> list[Tried]:
        """The changes that were tried so far, p-values corrected for all of them; best first."""
        return corrected(self._raw)

    @property
    def is_out_of_time(self) -> bool:
        """Whether the budget was too short for all trials."""
        return self._race.is_out_of_time or self._other_race.is_out_of_time

    @property
    def is_found(self) -> bool:
        """Whether a change is shown to take the symptom away."""
        return any(e.takes_all and e.verdict is Verdict.SHOWN for e in self.tried)

    def run(
        self,
        suspicions: Sequence[Suspicion],
        first: Sequence[Suspicion] = (),
        proposed: Sequence[Trial] = (),
    ) -> None:
        """Tries the suspicions in their order; none for a rare symptom.

        After the first batch all of them are tried together, in the end those that helped. After a
        change that is shown to take the symptom away nothing more is driven. proposed: the user's
        changes, which are in the first batch before all. first: the abnormal values follow, so that
        their ways back are named before others that do as much.
        """
        self.rarity = self._race.rarity()
        if self.rarity.is_rare:
            return
        raw = self._raw
        batch = [c for trial in proposed for c in self._proposed(trial)]
        batch += [c for suspicion in first for c in self.candidates.way_back(suspicion)]
        known = [c.trial.changes for c in batch]
        room = MOST_CHANGES - SETS
        is_first = True
        for number, suspicion in enumerate(suspicions, 1):
            candidates, told = self.candidates.of(suspicion)
            raw += told
            batch += [c for c in candidates if c.trial.changes not in known]
            is_last = number == len(suspicions) or len(batch) >= room
            if len(batch) >= TOGETHER or (is_last and batch):
                raw += self._race.run(batch[:room])
                room -= len(batch)
                batch = []
                if is_first and not self._is_over:
                    self._together([*self._helpful(), *self._likely([*first, *suspicions])])
                is_first = False
            if is_last or self._is_over:
                break
        helpful = self._helpful()
        if len(helpful) > 1 and not self._is_over:
            self._together(helpful)

    def further(self, entry: Tried, shares: Sequence[float]) -> list[Tried]:
        """Drives a change with each share of its step (`cures.scaled`); returns each effect."""
        if entry.trial is None:
            return []
        batch = self.candidates.scaled(entry.suspicion, entry.trial, shares)
        known = [e.trial.changes for e in self._raw if e.trial is not None and not e.reason]
        raw = self._race.run([c for c in batch if c.trial.changes not in known])
        self._raw += raw
        return [e for e in self.tried if any(e.trial is new.trial for new in raw)]

    @property
    def _is_over(self) -> bool:
        return self.is_out_of_time or self.is_found

    def _proposed(self, trial: Trial) -> list[Candidate]:
        """Returns a change of the user to drive; none, but an entry, if no trial depends on it."""
        suspicion = Suspicion(trial.cause, 1.0, (trial.cause.why,))
        candidate, reason = self.candidates.of_trial(suspicion, trial)
        if candidate is None:
            self._raw.append(Tried(suspicion, trial, Verdict.NOT_TRIED, reason=reason))
            return []
        candidate.is_proposed = True
        return [candidate]

    def _helpful(self) -> list[Candidate]:
        """Returns the changes that helped alone, the most helpful first, one for each cause."""
        entries = [e for e in self._raw if e.fall >= LEAST_FALL and not e.touches]
        best: dict[object, Candidate] = {}
        for entry in sorted(entries, key=lambda e: -e.fall):
            key = entry.suspicion.cause.key
            if entry.trial is None or entry.trial.parts or key in best:
                continue
            candidate, _ = self.candidates.of_trial(entry.suspicion, entry.trial)
            if candidate is not None:
                best[key] = candidate
        return list(best.values())

    def _likely(self, suspicions: Sequence[Suspicion]) -> list[Candidate]:
        """Returns a change for each suspicion that a rule names or whose value is known."""
        found: list[Candidate] = []
        for suspicion in suspicions:
            if suspicion.findings or suspicion.cause.to is not None:
                found += self.candidates.of(suspicion, most=1)[0]
        return found

    def _together(self, parts: Sequence[Candidate]) -> None:
        """Tries changes together, and if that takes the symptom away, the fewest that do.

        If it does not, some of them may do harm: they are looked for first (`without_harmful`).
        """
        places: set[object] = set()
        alone: list[Candidate] = []
        for part in parts:
            if places.isdisjoint(part.trial.changes) and len(alone) < MOST_PARTS:
                places.update(part.trial.changes)
                alone.append(part)
        chosen: list[Candidate] = []
        for some in without_harmful(alone, [*map(self._effect, alone)], MOST_LEFT_OUT):
            if len(some) < 2 or chosen or self.is_out_of_time:
                break
            self._driver.tell(f"trying {len(some)} likely changes together")
            chosen = fewest(some, self._suffices)
        if chosen and not self.is_out_of_time and (whole := self._set_of(chosen)) is not None:
            self._driver.tell(f"  {len(chosen)} of them suffice: {whole.trial.told}")
            self._raw += self._other_race.run([whole])

    def _effect(self, part: Candidate) -> float:
        """Returns the share by which a change alone lowers the severity; 0 if it was not driven.

        A share below FIRST_FALL may be chance, and counts as 0; a touch counts as harm.
        """
        for entry in self._raw:
            if (
                entry.pairs
                and entry.trial is not None
                and entry.trial.changes == part.trial.changes
            ):
                return -1.0 if entry.touches else entry.fall * (abs(entry.fall) >= FIRST_FALL)
        return 0.0

    def _suffices(self, parts: Sequence[Candidate]) -> bool:
        whole = self._set_of(parts)
        return whole is not None and self._race.takes_away(whole)

    def _set_of(self, parts: Sequence[Candidate]) -> Candidate | None:
        """Returns several changes as one; None if the file or the robot does not allow it."""
        trial = Trial.of_parts([part.trial for part in parts])
        own = [part.suspicion for part in parts]
        reasons = tuple(dict.fromkeys(reason for each in own for reason in each.reasons[:1]))
        findings = tuple(finding for each in own for finding in each.findings)
        suspicion = own[0]._replace(reasons=reasons, findings=findings)
        return self.candidates.of_trial(suspicion, trial)[0]
