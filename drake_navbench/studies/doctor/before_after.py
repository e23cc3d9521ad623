"""The replays of a visit: each symptom as it was seen, and the change before and after."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from drake_navbench.analysis.replay.pages import write_race_replay
from drake_navbench.logs.log import TrialLog
from drake_navbench.studies.doctor.driving import FRESH_SEED, Driver, probe_of, severity
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.judged import Judged
from drake_navbench.studies.doctor.offer import Kind
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.visit import BY_WEIGHT
from drake_navbench.studies.doctor.visited import Visit
from drake_navbench.typed_files.output_file import write_whole

REPLAY = "before_after.html"
# Symptoms that have a replay, the weightiest first.
MOST_SHOWN = 5


def write_replays(patient: Patient, visit: Visit, driver: Driver, folder: Path) -> list[Path]:
    """Writes a replay of the change, and of each symptom that the probes show; returns the paths.

    Without a change that helps, the first trade has the replay. The trials are driven again, since
    a visit keeps no logs. The treated symptom comes first, and none is written after the end of the
    budget.
    """
    driver.tell("driving the clearest trials again, for the replays")
    seen = [s for s in BY_WEIGHT if s in visit.seen][:MOST_SHOWN]
    seen.sort(key=lambda symptom: symptom is not visit.treated)
    todo: dict[str, Callable[[], list[TrialLog]]] = {}
    trades = [o.judged for o in visit.offers if o.kind is Kind.TRADE and o.judged is not None]
    for change in [visit.cure] if visit.cure is not None else trades[:1]:
        todo[REPLAY] = partial(_before_and_after, patient, visit, change, driver)
    for symptom in seen:
        todo[name_of(symptom)] = partial(_clearest, patient, visit, symptom, driver)
    written: list[Path] = []
    for name, logs_of in todo.items():
        if driver.left_s <= 0.0:
            driver.tell(f"  no time for {len(todo) - len(written)}: the same command goes on")
            break
        path = folder / name
        _write(path, logs_of())
        written.append(path)
    return written


def name_of(symptom: Symptom) -> str:
    """Returns the file's name of a symptom's replay."""
    return f"seen_{symptom}.html"


def _clearest(patient: Patient, visit: Visit, symptom: Symptom, driver: Driver) -> list[TrialLog]:
    """Returns one log: of the unchanged file's trial in which a symptom is most severe."""
    own = [row for row in visit.rows if probe_of(row) in visit.seen[symptom]]
    best = max(own, key=lambda row: severity(row, symptom))
    index = [row for row in visit.rows if probe_of(row) == probe_of(best)].index(best)
    preset = patient.chosen(patient.columns())
    probes = [visit.probes[probe_of(best)]]
    return [driver.log(preset, probes, index + 1, seed=visit.seed, index=index)]


def _before_and_after(
    patient: Patient, visit: Visit, cure: Judged, driver: Driver
) -> list[TrialLog]:
    """Returns the logs of the judged trial in which the symptom falls most."""
    probes = [visit.probes[name] for name in cure.showing]
    seeds = cure.target_trials // len(probes)
    return [
        driver.log(preset, probes, seeds, seed=visit.seed + FRESH_SEED, index=cure.best)
        for preset in patient.before_and_after(cure.trial.changes)
    ]


def _write(path: Path, logs: Sequence[TrialLog]) -> None:
    write_whole(path, lambda unfinished: write_race_replay(logs, unfinished, model=None))
