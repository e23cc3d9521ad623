"""The first look: what the probes show of the unchanged file, as far as its share of the budget."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studies.doctor.driving import Driver, Row, probe_of, shows
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.probes import NEAR, nearest_first
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.told import told_failures

# Seeds in which every probe is driven at first.
FIRST_SEEDS = 2
# The seeds, in all, of a probe of whose first trials only some show a symptom.
CONFIRMING_SEEDS = 4
# This share of the budget is kept by the first look for what comes after it.
KEPT_SHARE = 0.5


class Look(NamedTuple):
    """The rows of a first look. lacking: how many of the `planned` trials the budget left out."""

    rows: list[Row]
    planned: int = 0
    lacking: int = 0


def first_look(
    patient: Patient,
    probes: Mapping[str, Scenario],
    near: Sequence[Symptom],
    driver: Driver,
    *,
    seed: int,
) -> Look:
    """Drives the unchanged file through each probe, and once more where the seeds disagree.

    near: symptoms, the most important first; the probes made for them come first. Those made for
    the first one are driven once even if that takes more than the first look's share of the budget.
    """
    preset = patient.chosen(patient.columns())
    planned = len(probes) * FIRST_SEEDS
    driver.tell(
        f"driving {planned} trials of the unchanged file through {len(probes)} probes: "
        f"{driver.told_time(planned)}"
    )
    ordered = [probes[name] for name in nearest_first(probes, near)]
    made = [probe for probe in ordered if near and _is_made_for(near[0], probe)]
    (rows,) = driver.drive_nearest([preset], ordered, FIRST_SEEDS, seed=seed)
    if len(rows) < len(made):
        # The first trial of each of them is driven from the rest of the budget.
        with driver.keeping(0.0):
            driver.drive_nearest([preset], made, 1, seed=seed)
        (rows,) = driver.drive_nearest([preset], ordered, FIRST_SEEDS, seed=seed)
    if len(rows) < len(made):
        least_s = len(made) * driver.trial_s / (1.0 - KEPT_SHARE)
        driver.tell(
            f"  the budget is too small for the {len(made)} probes made for {near[0]}: the same "
            f"command with --budget {math.ceil(least_s / 60.0)}m drives them all"
        )
    lacking = planned - len(rows)
    if lacking:
        driver.tell(f"  {lacking} of {planned} trials are left out: half of the budget is used up")
    unsure = unsure_of(rows)
    if unsure and driver.left_s > 0.0:
        driver.tell(f"driving {', '.join(unsure)} twice more: one of two trials shows a symptom")
        again = [probes[name] for name in unsure]
        (more,) = driver.drive_nearest([preset], again, CONFIRMING_SEEDS, seed=seed)
        rows = [row for row in rows if probe_of(row) not in unsure] + more
    for line in told_failures(rows):
        driver.tell(line)
    return Look(rows, planned, lacking)


def _is_made_for(symptom: Symptom, probe: Scenario) -> bool:
    return probe.name.removeprefix("probe_") in NEAR.get(symptom, ())


def unsure_of(rows: Sequence[Row]) -> list[str]:
    """Returns the probes of which some trials show a symptom and others do not."""
    sure, some = seen_in(rows, share=1.0), seen_in(rows, share=1e-9)
    return sorted({n for s, names in some.items() for n in names if n not in sure.get(s, ())})


def seen_in(
    rows: Sequence[Row], *, share: float = 0.5, bar: float = 1.0
) -> dict[Symptom, list[str]]:
    """Returns the probes that show each symptom in at least this share of their trials.

    bar: the severity above which a trial shows it.
    """
    trials: dict[str, list[Row]] = {}
    for row in rows:
        trials.setdefault(probe_of(row), []).append(row)
    found: dict[Symptom, list[str]] = {}
    for symptom in Symptom:
        own = [
            name
            for name, several in trials.items()
            if sum(shows(row, symptom, bar) for row in several) >= max(share * len(several), 1)
        ]
        if own:
            found[symptom] = own
    return found
