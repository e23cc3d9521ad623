"""The replay of a change: one trial of the file as it is and of the patched one, in one scene."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from drake_navbench.analysis.replay.pages import write_race_replay
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.results import write_whole
from drake_navbench.studies.doctor.change import FRESH_SEEDS, Judged
from drake_navbench.studies.doctor.driving import FRESH_SEED, Driver
from drake_navbench.studies.doctor.files import Patient

REPLAY = "before_after.html"


def write_replay(
    patient: Patient, cure: Judged, probes: Mapping[str, Scenario], driver: Driver, folder: Path
) -> Path:
    """Writes the replay of the judged trial in which the symptom falls most; returns its path.

    It is driven again, before and after, since a visit keeps no logs.
    """
    driver.tell("  driving the clearest trial again, for the replay")
    everything = list(probes.values())
    logs = [
        driver.log(preset, everything, FRESH_SEEDS, seed=FRESH_SEED, index=cure.best)
        for preset in patient.before_and_after(cure.trial.changes)
    ]
    path = folder / REPLAY
    write_whole(path, lambda unfinished: write_race_replay(logs, unfinished, model=None))
    return path
