"""Drives of the doctor: paired by seed, kept in a journal, so that the same command goes on."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import takewhile
from operator import itemgetter
from pathlib import Path
from typing import Any

from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.rows_of_trials import drive_each
from drake_navbench.errors import InputError, writing
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.studies.doctor.detectors import detectors_digest, doctor_row
from drake_navbench.trial.spec import TrialSpec

JOURNAL = "journal.jsonl"
# A batch that takes longer tells how far it is, each time after so long, s.
TELL_EVERY_S = 30.0
# From so many trials on, and from two of each worker on, those after each worker's first tell how
# long the rest takes. The first one takes longer: workers begin, and kernels may be compiled.
ENOUGH_TO_TELL = 4
# A trial's duration before one was driven: for what a budget keeps, never told.
GUESSED_TRIAL_S = 2.0
Row = dict[str, Any]
# From a visit's seed on: the seeds of the first look, of the search, and of the judgement. The
# first look chooses the probes; its trials in the search would count the same luck twice.
SEARCH_SEED, FRESH_SEED = 5 * 10**5, 10**6
# From the search's seed on: those of a set of changes that the search's own trials have chosen.
TOGETHER_SEED = 10**5
# From the judgement's seed on: those that tell whether one further touch was chance.
AGAIN_SEED = 10**5


class OutOfTime(Exception):
    """The budget is used up; what is known so far counts."""


class Driver:
    """Drives columns through probes; each trial is driven once and kept in the journal.

    budget_s: from now on; the trial that ends after it is the last. tell: is given a line of
    progress. clock: returns the time, s.
    """

    def __init__(
        self,
        folder: Path,
        robot: str,
        *,
        jobs: int,
        budget_s: float,
        tell: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._path, self._robot, self._jobs, self.tell = folder / JOURNAL, robot, jobs, tell
        self._clock, self._began_s, self.budget_s, self._kept_s = clock, clock(), budget_s, 0.0
        self._rows = _read(self._path)
        self.driven, self._driving_s = 0, 0.0
        # By column, probes, trials and seed. The column is held, so that its id stays its own.
        self._plans: dict[tuple[Any, ...], tuple[Preset, list[TrialSpec]]] = {}

    @property
    def left_s(self) -> float:
        """The rest of the budget, without what is kept for later, s."""
        return self._rest_s() - self._kept_s

    @contextmanager
    def keeping(self, time_s: float) -> Iterator[None]:
        """Keeps so much of the budget for what comes after the block, s."""
        kept_s, self._kept_s = self._kept_s, time_s
        try:
            yield
        finally:
            self._kept_s = kept_s

    def _rest_s(self) -> float:
        return self.budget_s - (self._clock() - self._began_s)

    @property
    def trial_s(self) -> float:
        """The mean duration of a trial so far, all workers together, s; at first a guess."""
        return self._driving_s / self.driven if self.driven else GUESSED_TRIAL_S

    def told_time(self, trials: int) -> str:
        """Returns the expected time of trials and the rest of the budget, in words.

        Before a trial was driven no time is told: the first ones will tell it.
        """
        left_s = max(round(self._rest_s()), 0)
        left = f"left {left_s // 60}:{left_s % 60:02d} of the budget"
        return f"about {max(round(trials * self.trial_s), 1)} s; {left}" if self.driven else left

    def check(self, preset: Preset, probes: Sequence[Scenario], *, seed: int) -> None:
        """Raises InputError where a column cannot drive the probes."""
        self._planned(preset, probes, 1, seed)

    def drive(
        self, preset: Preset, probes: Sequence[Scenario], trials: int, *, seed: int
    ) -> list[Row]:
        """Returns one row for each trial: every probe with `trials` seeds, in a fixed order.

        Raises OutOfTime if the budget does not suffice.
        """
        found = self.drive_together([preset], probes, trials, seed=seed)
        if not found:
            raise OutOfTime
        return found[0]

    def drive_together(
        self, presets: Sequence[Preset], probes: Sequence[Scenario], trials: int, *, seed: int
    ) -> list[list[Row]]:
        """Returns the rows of several columns, driven in one batch, so that all workers are busy.

        Where the budget does not suffice for all of them, those of the first columns.
        """
        planned = [self._planned(preset, probes, trials, seed) for preset in presets]
        self._drive_missing([spec for specs in planned for spec in specs])
        whole = takewhile(lambda specs: all(map(self._is_driven, specs)), planned)
        return [[self._rows[spec.identity] for spec in specs] for specs in whole]

    def drive_nearest(
        self, presets: Sequence[Preset], probes: Sequence[Scenario], trials: int, *, seed: int
    ) -> list[list[Row]]:
        """Returns the rows of several columns, of the trials for which the budget suffices.

        The first seed of each probe comes first, the probes in their order; then the second. Each
        column has the rows of the same trials, in the order of `drive`.
        """
        planned = [self._planned(preset, probes, trials, seed) for preset in presets]
        places = {probe.name: place for place, probe in enumerate(probes)}
        # By trial: the specs of all columns, and their place in a row of `drive`.
        cells = sorted(
            enumerate(zip(*planned, strict=True)),
            key=lambda cell: (cell[1][0].trial, places[cell[1][0].scenario.name]),
        )
        self._drive_missing([spec for _, specs in cells for spec in specs])
        whole = takewhile(lambda cell: all(map(self._is_driven, cell[1])), cells)
        driven = [specs for _, specs in sorted(whole, key=itemgetter(0))]
        return [
            [self._rows[specs[column].identity] for specs in driven]
            for column in range(len(presets))
        ]

    def _is_driven(self, spec: TrialSpec) -> bool:
        return spec.identity in self._rows

    def _drive_missing(self, specs: Sequence[TrialSpec]) -> None:
        """Drives trials that are in no journal, in their order, as far as the budget goes."""
        missing = list({s.identity: s for s in specs if not self._is_driven(s)}.values())
        if missing and self.left_s > 0.0:
            self._drive_all(missing)

    def _drive_all(self, specs: Sequence[TrialSpec]) -> None:
        """Drives trials until the budget is used up, and tells how far they are.

        The visit's first trials tell how long the others take, as soon as they are enough.
        """
        began_s = told_s = warm_s = self._clock()
        done, is_first = 0, not self.driven
        cold, enough = self._jobs, max(ENOUGH_TO_TELL, 2 * self._jobs)

        def on_row(spec: TrialSpec, row: Row) -> None:
            nonlocal told_s, warm_s, done
            self._keep(spec, row)
            done += 1
            if self.left_s <= 0.0:
                raise OutOfTime
            now_s = self._clock()
            warm_s = now_s if done == cold else warm_s
            is_due = now_s - told_s >= TELL_EVERY_S or (is_first and done == enough)
            if is_due and done < len(specs):
                told_s = now_s
                more = ""
                if done >= enough:
                    rest_s = (now_s - warm_s) / (done - cold) * (len(specs) - done)
                    more = f": about {max(round(rest_s), 1)} s more"
                self.tell(f"  {done} of {len(specs)} trials driven{more}")

        with suppress(OutOfTime):
            drive_each(specs, doctor_row, jobs=self._jobs, on_row=on_row)
        self._driving_s += self._clock() - began_s
        self.driven += done

    def log(
        self, preset: Preset, probes: Sequence[Scenario], trials: int, *, seed: int, index: int
    ) -> TrialLog:
        """Drives one of the trials of `drive` again, by its row's index, and returns its log."""
        spec = self._planned(preset, probes, trials, seed)[index]
        log: TrialLog = drive_each([spec], _whole, jobs=1)[0]["log"]
        return log

    def _planned(
        self, preset: Preset, probes: Sequence[Scenario], trials: int, seed: int
    ) -> list[TrialSpec]:
        # Planning takes as long as a short trial: what was planned is kept.
        key = (id(preset), tuple(probe.name for probe in probes), trials, seed)
        if key not in self._plans:
            planned = plan_campaign(
                list(probes), [preset], trials=trials, seed=seed, robot=self._robot,
                keeps_costmaps=False,
            ).specs  # fmt: skip
            ordered = sorted(planned, key=lambda spec: (spec.trial, spec.scenario.name))
            self._plans[key] = preset, ordered
        return self._plans[key][1]

    def _keep(self, spec: TrialSpec, row: Row) -> None:
        """Keeps a row at once, so that an interrupted batch is not driven again.

        What failed, perhaps for want of time on a busy computer, the next command tries again.
        """
        self._rows[spec.identity] = row
        if has_failed(row):
            return
        entry = {"identity": spec.identity, "detectors": detectors_digest(), "row": row}
        with writing(self._path), self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(entry) + "\n")


def _whole(log: TrialLog) -> Row:
    return {"log": log}


def _read(path: Path) -> dict[str, Row]:
    """Returns the rows of a journal by the identity of their trials.

    Torn lines are left out, and rows of other detectors, since their severities mean other things.
    """
    rows: dict[str, Row] = {}
    try:
        text = path.read_text(encoding="utf-8") if path.exists() else ""
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    for line in text.splitlines():
        try:
            entry = json.loads(line)
            if entry["detectors"] == detectors_digest():
                rows[entry["identity"]] = entry["row"]
        except (ValueError, KeyError, TypeError):
            continue
    return rows


def probe_of(row: Mapping[str, Any]) -> str:
    """Returns the name of a row's probe."""
    return str(row["scenario"]).removeprefix("probe_")


def severity(row: Mapping[str, Any], symptom: str) -> float:
    """Returns the severity of a symptom in a row; 0 where the log was too short for any."""
    return float(row["severity"].get(symptom, 0.0))


def shows(row: Mapping[str, Any], symptom: str, bar: float = 1.0) -> bool:
    """Tells whether a row shows a symptom: whether its severity is above the bar."""
    return severity(row, symptom) > bar


def has_failed(row: Mapping[str, Any]) -> bool:
    """Tells whether the program came to no end of a trial: it shows no symptom and no cure."""
    return bool(row["outcome"] == Outcome.ERROR)


def has_not_begun(row: Mapping[str, Any]) -> bool:
    """Tells whether a task was given up before the robot drove: no symptom can be told."""
    return bool(row["outcome"] == Outcome.ABORTED and not row["severity"])


def is_same(one: Row, other: Row) -> bool:
    """Tells whether two trials are the same to the last digit, their columns' names apart."""
    return all(one[name] == other[name] for name in ("outcome", "end", "severity"))
