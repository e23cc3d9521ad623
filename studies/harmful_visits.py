"""Visits of planted faults that do harm, and their scores; the rules are `harmful_faults.py`'s."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any

from planted_faults import Fault, is_back, is_farthest, spoilt_file
from sound_files import BASE, good_file, patient_of

from drake_navbench.analysis.statistics import share_interval
from drake_navbench.processes.machine import available_cores
from drake_navbench.studies.doctor.alike import NOTHING_TOLD
from drake_navbench.studies.doctor.change import CHANCE
from drake_navbench.studies.doctor.differences import ways_back, with_differences
from drake_navbench.studies.doctor.driving import FRESH_SEED, Driver, Row, shows
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.visit import visit
from drake_navbench.studies.doctor.visited import Visit

FURTHER_SEED, FURTHER_SEEDS = 2 * FRESH_SEED, 2
NO_BUDGET_S = 1e9
# Of a visit's row, what counts where that is no entry of it.
COUNTED: Mapping[str, Callable[[Mapping[str, Any]], bool]] = {
    "fine": lambda row: not row["worse"],
    "as_sound": lambda row: not row["worse_than_sound"],
    "rivals": lambda row: bool(row["rivals"]),
    "rare": lambda row: "rare" in row,
}

# The visits of which a score is known, where it is not of all.
KNOWN: Mapping[str, Callable[[Mapping[str, Any]], bool]] = {
    "fine": lambda row: row["gone"],
    "as_sound": lambda row: "worse_than_sound" in row,
    "rivals": lambda row: "rivals" in row,
    "rare": lambda row: "rivals" in row,
    "abnormal": lambda row: "abnormal" in row,
    "named": lambda row: "named" in row,
}


def patient_and_driver(file: Mapping[str, Any], folder: Path) -> tuple[Patient, Driver]:
    folder.mkdir(parents=True, exist_ok=True)
    driver = Driver(
        folder, BASE, jobs=available_cores(), budget_s=NO_BUDGET_S, tell=lambda line: None
    )
    return patient_of(file, folder, BASE), driver


def visited_by(fault: Fault, complaint: Symptom, folder: Path) -> dict[str, Any]:
    sound = good_file(fault.controller)
    patient, driver = patient_and_driver(spoilt_file(fault, sound), folder)
    found = visit(patient, complaint, NOTHING_TOLD, driver, seed=0)
    if found.is_interrupted:
        raise KeyboardInterrupt
    facts = found.facts
    causes = [entry.suspicion.cause for entry in found.shown]
    back = [is_back(cause.place, cause.direction, fault, facts) for cause in causes]
    by_change = sorted(
        zip(found.shown, back, strict=True),
        key=lambda pair: found.cure is None or pair[0] is not found.cure.tried,
    )
    offered = [is_back for _, is_back in by_change]
    read = found.suspicions[0].cause if found.suspicions else None
    suspicions = with_differences(found.suspicions, facts)
    first_back = [suspicion.cause for suspicion in ways_back(suspicions, facts)]
    is_rare = complaint in found.rare
    named = [*causes, *(offer.tried.suspicion.cause for offer in found.offers)][:1]
    row: dict[str, Any] = {
        # What is called too rare counts as a miss, even if another symptom is treated.
        "first": back[:1] == [True] and not is_rare,
        "among": any(back) and not is_rare,
        "named": any(is_back(cause.place, cause.direction, fault, facts) for cause in named),
        "shown": found.shown[0].trial.told if found.shown and found.shown[0].trial else "",
        "gone": found.cure is not None and not is_rare,
        "change": found.cure.trial.told if found.cure is not None else "",
        # As the score of 2030 to 2035 has it: if a change is offered, its cause is the first.
        "offered": offered[:1] == [True] and not is_rare,
        "rivals": [entry.trial.told for entry in found.rivals if entry.trial],
        "farthest": is_farthest(facts, fault),
        "abnormal": any(is_back(c.place, c.direction, fault, facts) for c in first_back[:1]),
        "read": read is not None and is_back(read.place, read.direction, fault, facts),
        "candidates": sum(entry.pairs > 0 for entry in found.tried),
        "trials": driver.driven,
    }
    if is_rare:
        row["rare"] = list(found.rare[complaint])
    elif found.cure is not None:
        cure = found.cure
        row["fresh"] = [cure.before_target, cure.after_target, cure.target_trials]
        row |= _worse(found, patient, driver, sound, folder)
    return row


def _worse(
    found: Visit, patient: Patient, driver: Driver, sound: Mapping[str, Any], folder: Path
) -> dict[str, list[str]]:
    """Returns the symptoms that more trials show after the change, on further seeds.

    worse: than before it; worse_than_sound: than of the sound file.
    """
    assert found.cure is not None
    probes = list(found.probes.values())
    own_folder = folder / "sound"
    own_folder.mkdir(exist_ok=True)
    healthy = patient_of(sound, own_folder, BASE)
    presets = [
        *patient.before_and_after(found.cure.trial.changes),
        healthy.chosen(healthy.columns()),
    ]
    old, new, good = (
        driver.drive(preset, probes, FURTHER_SEEDS, seed=FURTHER_SEED) for preset in presets
    )
    return {
        name: [
            s.value
            for s in Symptom
            if _more(rows, new, s) > (0 if s is Symptom.COLLISION else CHANCE)
        ]
        for name, rows in (("worse", old), ("worse_than_sound", good))
    }


def _more(old: list[Row], new: list[Row], symptom: Symptom) -> int:
    """Returns the further trials that show a symptom, without those that ended by a touch."""
    is_touch = symptom is Symptom.COLLISION
    pairs = [
        (a, b) for a, b in zip(old, new, strict=True) if is_touch or not shows(a, Symptom.COLLISION)
    ]
    return sum(shows(b, symptom) for _, b in pairs) - sum(shows(a, symptom) for a, _ in pairs)


def share_text(count: int, of: int) -> str:
    """Returns the 95% interval of a share: '42% to 98%'."""
    interval = share_interval(count / of, of)
    return f"{interval.low:.0%} to {interval.high:.0%}"


def score_of(rows: Sequence[Mapping[str, Any]], key: str) -> tuple[int, int]:
    """Returns the number of visits that have a score, and of those of which it is known."""
    known = [row for row in rows if KNOWN.get(key, lambda row: True)(row)]
    return sum(bool(COUNTED.get(key, itemgetter(key))(row)) for row in known), len(known)
