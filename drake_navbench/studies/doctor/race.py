"""A race of changes: each alone against the file as it is, on the same trials.

The file as it is drives first: if it shows the symptom too seldom, no change can be shown to help.
One trial of each change tells whether it has any effect, a few more whether the symptom falls; the
best are driven to the end. If one takes the symptom away, changes that do half as much are left.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_navbench.analysis.paired_comparison import compare_differences
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studies.doctor.candidates import Candidate
from drake_navbench.studies.doctor.causes import with_short_outlines
from drake_navbench.studies.doctor.driving import (
    Driver,
    Row,
    has_failed,
    has_not_begun,
    is_same,
    severity,
    shows,
)
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.tried import (
    FIRST_FACTOR,
    LATER_FACTOR,
    LEAST_FALL,
    MORE_PAIRS,
    MOST_PAIRS,
    NEARLY_ALL,
    NO_TIME,
    PAIRS,
    SAME,
    Rarity,
    Tried,
    Verdict,
    corrected,
)

# A candidate is dropped if the severity does not fall in its first GLANCE pairs, if these show the
# symptom at all, or falls by less than FIRST_FALL, a share, in its first FIRST_LOOK pairs. These
# are more, up to PAIRS, until ENOUGH of them have any of the symptom before the change.
GLANCE, FIRST_LOOK, FIRST_FALL, ENOUGH = 3, 4, 0.1, 2
# This many candidates of a batch, those with the largest fall so far, are driven to the end.
MOST_TO_THE_END = 3
# A change that lowers the severity by this share may help, and has a third look.
HALF = 0.5
# This many more trials with another symptom may be chance.
CHANCE = 1
# Symptoms that end a drive early. If a change brings one of them, the drive may not reach the place
# where the treated symptom showed, and says nothing about it.
CUTS_SHORT = (
    Symptom.COLLISION,
    Symptom.NO_START,
    Symptom.FALSE_ABORT,
    Symptom.NO_RECOVERY,
)


class Race:
    """Drives batches of changes for a symptom on the probes that show it.

    before: the column of the file as it is.
    """

    def __init__(
        self,
        before: Preset,
        symptom: Symptom,
        probes: Sequence[Scenario],
        driver: Driver,
        *,
        seed: int,
    ) -> None:
        self._before, self._symptom = before, symptom
        self._probes, self._driver, self._seed = list(probes), driver, seed
        self.is_out_of_time = False

    def rarity(self) -> Rarity:
        """Returns the share of the race's own trials in which the file as it is has the symptom.

        Any severity above 0 counts. Of PAIRS trials; where these are too few for a change to be
        shown, of MORE_PAIRS.
        """
        found = Rarity(0, 0)
        self.is_out_of_time |= self._driver.left_s < 2.0 * self._driver.trial_s
        if self.is_out_of_time:
            return found
        for pairs in (PAIRS, MORE_PAIRS):
            seeds = self._seeds_of(pairs)
            count = seeds * len(self._probes) - found.trials
            self._driver.tell(
                f"driving {count} trials of the unchanged file on the search's seeds: "
                f"{self._driver.told_time(count)}"
            )
            rows = self._old(seeds, self._probes)
            having = sum(severity(row, self._symptom) > 0.0 for row in rows)
            found = Rarity(having, len(rows))
            if not found.is_rare:
                break
        return found

    def run(self, batch: Sequence[Candidate]) -> list[Tried]:
        """Returns the effects of the changes of a batch, as far as the budget goes."""
        # A trial of the file as it is and one of a change are the least.
        self.is_out_of_time |= self._driver.left_s < 2.0 * self._driver.trial_s
        if not batch or self.is_out_of_time:
            return []
        self._tell_of(batch)
        seeds = self._seeds_of(PAIRS)
        self._drive(batch, 1, self._probes[:1])
        old = self._old(1, self._probes[:1])
        for candidate in batch:
            if candidate.rows and all(map(is_same, candidate.rows, old)):
                candidate.left = SAME
        glance = self._seeds_of(GLANCE)
        self._drive(batch, glance)
        driven = [c for c in batch if c.is_alive and c.rows]
        if driven and any(shows(row, self._symptom) for row in self._before_of(driven[0])):
            self._leave(batch, glance, 0.0)
        first = min(max(self._seeds_of(FIRST_LOOK), self._seeds_that_tell()), seeds)
        self._drive(batch, first)
        self._leave(batch, first, FIRST_FALL)
        self._leave_all_but_the_best(batch)
        self._drive(batch, seeds)
        self._go_on(batch, MORE_PAIRS, LEAST_FALL)
        self._go_on(batch, MOST_PAIRS, HALF)
        return self._entries(batch)

    def takes_away(self, candidate: Candidate) -> bool:
        """Tells whether a change nearly takes the symptom away in PAIRS pairs, and adds no other.

        One that does not in the first pairs gets no more. Of a touch that goes it does not matter
        what comes instead.
        """
        first = max(self._seeds_of(FIRST_LOOK), self._seeds_that_tell())
        for seeds in (first, self._seeds_of(PAIRS)):
            self._drive([candidate], seeds)
            entry = self._entry(candidate) if candidate.rows else None
            if entry is None or candidate.left or not entry.leaves_nothing or entry.touches:
                return False
            if self._symptom is not Symptom.COLLISION and self._adds_another(candidate):
                return False
        return len(candidate.rows) >= PAIRS

    def _adds_another(self, candidate: Candidate) -> bool:
        """Tells whether another symptom is shown in at least two more trials than before."""
        before = self._before_of(candidate)
        more = {
            symptom: sum(shows(row, symptom) for row in candidate.rows)
            - sum(shows(row, symptom) for row in before)
            for symptom in Symptom
            if symptom is not self._symptom
        }
        return max(more.values()) > CHANCE

    def _seeds_of(self, pairs: int) -> int:
        """Returns the seeds of each probe that make at least so many pairs."""
        return -(-pairs // len(self._probes))

    def _seeds_that_tell(self) -> int:
        """Returns the seeds of each probe until ENOUGH trials before the change have any of it."""
        rows = self._old(self._seeds_of(PAIRS), self._probes)
        having = [n for n, row in enumerate(rows, 1) if severity(row, self._symptom) > 0.0]
        count = having[ENOUGH - 1] if len(having) >= ENOUGH else len(rows)
        return -(-count // len(self._probes))

    def _leave(self, batch: Sequence[Candidate], seeds: int, least: float) -> None:
        """Drops changes that lower the severity by at most the share `least`, or had no time."""
        for candidate in batch:
            if not candidate.is_alive:
                continue
            if len(candidate.rows) < seeds * len(self._probes):
                candidate.left = NO_TIME
            elif self._fall(candidate) <= least:
                candidate.left = "little or no fall in the first pairs"

    def _drive(
        self, batch: Sequence[Candidate], seeds: int, probes: Sequence[Scenario] | None = None
    ) -> None:
        """Drives the candidates that are alive, as far as the budget goes."""
        alive = [candidate for candidate in batch if candidate.is_alive]
        if not alive or self.is_out_of_time:
            return
        columns = [self._before, *(candidate.after for candidate in alive)]
        found = self._driver.drive_together(columns, probes or self._probes, seeds, seed=self._seed)
        for candidate, rows in zip(alive, found[1:], strict=False):
            candidate.rows = rows
            failed = next((row for row in rows if has_failed(row)), None)
            if failed is not None:
                candidate.left = f"a trial failed: {failed['reason']}"
        self.is_out_of_time = len(found) < len(columns)

    def _old(self, seeds: int, probes: Sequence[Scenario]) -> list[Row]:
        """Returns the rows of the file as it is, which were driven with the first of a batch."""
        return self._driver.drive(self._before, probes, seeds, seed=self._seed)

    def _before_of(self, candidate: Candidate) -> list[Row]:
        """Returns the rows of the file as it is in a candidate's pairs."""
        count = len(candidate.rows)
        if count < len(self._probes):
            return self._old(1, self._probes[:count])
        return self._old(count // len(self._probes), self._probes)

    def _fall(self, candidate: Candidate) -> float:
        """Returns the share by which the severity falls in the pairs so far."""
        if not candidate.rows:
            return 0.0
        before, after = _pairs(self._before_of(candidate), candidate.rows, self._symptom).mean(0)
        return float((before - after) / before) if before > 0.0 else 0.0

    def _leave_all_but_the_best(self, batch: Sequence[Candidate]) -> None:
        """Drops the changes that others outdo, and strong steps where a mild step does as much.

        A few pairs do not tell a way back from half of it: both go on, unless the whole takes all.
        """
        falls = {id(c): round(self._fall(c), 1) for c in batch if c.is_alive}
        alive = sorted((c for c in batch if c.is_alive), key=lambda c: -falls[id(c)])
        most = falls[id(alive[0])] if alive else 0.0
        least = HALF * most if most >= NEARLY_ALL else 0.0
        whole = {
            c.suspicion.cause.key for c in alive if falls[id(c)] >= NEARLY_ALL and not c.is_half
        }
        done: set[tuple[str, Any]] = set()
        kept: set[tuple[tuple[str, Any], bool]] = set()
        for candidate in alive:
            key = candidate.suspicion.cause.key
            if candidate.is_proposed:
                continue
            if (key, candidate.is_half) in kept or (candidate.is_half and key in whole):
                candidate.left = "another value does as much in the first pairs"
            elif (key not in done and len(done) >= MOST_TO_THE_END) or (
                falls[id(candidate)] <= least
            ):
                candidate.left = "others do more in the first pairs"
            else:
                done.add(key)
                kept.add((key, candidate.is_half))

    def _go_on(self, batch: Sequence[Candidate], pairs: int, least: float) -> None:
        """Drives changes that help, but not surely enough for one of many, up to so many pairs.

        least: the share by which they lower the severity. One that adds touches cannot be shown,
        and does not go on. If a change surely takes the symptom away, only others that take it away
        go on, and none if all its pairs are driven.
        """
        entries = [(c, self._entry(c)) for c in batch if c.is_alive]
        shown = [e for _, e in entries if corrected([e])[0].verdict is Verdict.SHOWN]
        if any(entry.takes_all for entry in shown):
            least = NEARLY_ALL if pairs < MOST_PAIRS else math.inf
        able = [(c, e) for c, e in entries if e not in shown and not e.touches]
        unsure = [
            c
            for c, entry in able
            if entry.fall >= least or (least <= NEARLY_ALL and entry.leaves_nothing)
        ]
        if unsure and not self.is_out_of_time:
            names = ", ".join(c.trial.told for c in unsure)
            self._driver.tell(f"  not sure yet: {names}: up to {pairs} pairs")
            self._drive(unsure, self._seeds_of(pairs))

    def _entries(self, batch: Sequence[Candidate]) -> list[Tried]:
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

    def _tell_of(self, batch: Sequence[Candidate]) -> None:
        told = (
            c.trial.told if c.trial.parts else with_short_outlines(c.suspicion.cause.told)
            for c in batch
        )
        names = list(dict.fromkeys(told))
        more = f" and {len(names) - 3} more" if len(names) > 3 else ""
        trials = len(batch) * FIRST_LOOK + MOST_TO_THE_END * (PAIRS - FIRST_LOOK)
        count = f"{len(batch)} change{'s' * (len(batch) > 1)}"
        self._driver.tell(
            f"trying {count} ({', '.join(names[:3])}{more}): up to {trials} trials, "
            f"{self._driver.told_time(trials)}"
        )

    def _entry(self, candidate: Candidate) -> Tried:
        before_rows = self._before_of(candidate)
        before, after = _pairs(before_rows, candidate.rows, self._symptom).T
        found = compare_differences(after - before)
        touches = sum(shows(row, Symptom.COLLISION) for row in candidate.rows) - sum(
            shows(row, Symptom.COLLISION) for row in before_rows
        )
        # A candidate that was dropped early, or had no time, is no test.
        is_whole = not candidate.left and len(candidate.rows) >= PAIRS
        factor = LATER_FACTOR if len(candidate.rows) >= MORE_PAIRS else FIRST_FACTOR
        reason = candidate.left or ("" if is_whole else NO_TIME)
        return Tried(
            candidate.suspicion,
            candidate.trial,
            Verdict.NOT_SHOWN,
            float(before.mean()),
            float(after.mean()),
            (found.interval.low, found.interval.high),
            min(factor * found.p_value, 1.0) if is_whole and found.difference < 0.0 else 1.0,
            len(candidate.rows),
            max(touches, 0),
            reason,
            int((after > 1.0).sum()),
        )


def _pairs(before: Sequence[Row], after: Sequence[Row], symptom: Symptom) -> NDArray[np.float64]:
    """Returns the severities of the symptom, [pair, before or after the change].

    A pair in which the change cuts the drive short, or lets none begin, counts as no fall; a touch
    outweighs everything, so what comes instead of it does not matter here.
    """
    ends = () if symptom is Symptom.COLLISION else CUTS_SHORT
    found = []
    for old, new in zip(before, after, strict=True):
        pair = [severity(old, symptom), severity(new, symptom)]
        is_cut = any(shows(new, s) and not shows(old, s) for s in ends if s is not symptom)
        is_cut |= bool(ends) and has_not_begun(new)
        found.append([pair[0], max(pair)] if is_cut or has_failed(old) else pair)
    return np.array(found)
