"""Do the probes show what the user saw? First looks at complaints that no visit has driven.

    python studies/doctor_cases.py files FILES     fetches the files of the cases
    python studies/doctor_shown.py look FILES DIR  looks at the next cases; goes on where it stopped
    python studies/doctor_shown.py assume FILES DIR
                                                   drives the conditions of the doctor
    python studies/doctor_shown.py table           the answers so far, as a table

Written before a case was driven:

- *Cases.* Of the lists `fresh_two`, `fresh_three` and `fresh_four` those with whole files of the
  day before the cure, whose class of symptom a detector knows (not late cycles), and whose files
  the program takes. By their words alone those are left out that no probe can contain (`LEFT_OUT`).
  No probe was driven with any of them; the doctor's reading has been scored with all. Those of RPP
  and DWB first, in the order of the lists, then MPPI's, whose trials take longer, as many as the
  time allows.
- *Look.* As `doctor --symptom CLASS` looks before it tries changes: each probe with two seeds, two
  more where they disagree, drives that ended by time driven on for `false_abort`. No change is
  tried. Robot as in `doctor_visits.py`. *Shown*: one trial is above the threshold, *weakly*: half
  of a probe's trials are above half of it (for `collision`: a near miss, too), else *no*.
- *Departures*, after the first answer, G02's, a no, for want of time: each probe with one seed, so
  what is shown is a lower bound; RPP's cases before DWB's, whose trials take longer.
- *Chance.* The same answer for the other files of the study: in what share of the files with
  another complaint the same look shows this class. A class that most files show says little.
- *Expected.* Shown 40%, weakly 10% more.

Conditions, written before any was driven but for one file (F37, with a deadband of 0.04 m/s, which
shows nothing; it is 0.05 m/s since):

- *Question.* A complaint that no probe shows is driven by the doctor under nine conditions, one
  assumption on the robot each (`conditions.py`). Does that show what the user saw, and more often
  than it shows the same in a file of which nobody complained so?
- *Known* complaints (`KNOWN`): of the 27 visits and the 12 looks those that show nothing, not even
  weakly, to the doctor of today. What they lack was known when the conditions were chosen, and of
  nine of them it was known that earlier circumstances (late, sticking, slip, noise, a weak base)
  do not show them; F39 and F37 had been shown by a base with deadband, slip and lag together.
- *Blind* complaints (`BLIND`): cases of all lists that neither study had driven, those of RPP and
  DWB first. Counted if one seed of the probes made for the class does not show it.
- *Shown*: under some condition both seeds of a probe are above the threshold, as in the doctor.
- *Control*, a method without skill: each file of the two groups with the class of the next
  complaint of its group that has another class (`turned` into the same order, cyclic), and the
  sound files of RPP, DWB and Graceful with each class of KNOWN. Counted if the probes without a
  condition do not show the class with one seed.
- *Rule.* A condition stays in the doctor if it shows a complaint and the share of complaints that
  it shows is at least twice that of the controls. The whole stays if the conditions that stay show
  a quarter of the complaints at least, and twice the share of the controls; else it is taken out.
  The known complaints decide, the blind ones are told beside them. An end of the time ends it.
- *Then* whole visits of those that are shown, in the order of KNOWN, as many as the time allows.
- *Expected.* 4 of 16 known, 2 of 8 blind; controls 20%.
- *Departure*, after P40, the seventh complaint, of which none was shown (nor any of seven
  controls), for want of time: no more controls, and no blind complaints before the known ones.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from doctor_visits import LEFT_OUT as VISITS_LEFT_OUT
from doctor_visits import LISTS as VISITED
from doctor_visits import drivable_cases, patient_of
from planted_faults import HERE, ROBOT, sound_file
from planted_faults import patient_of as patient_of_sound

from drake_navbench.errors import NavbenchError
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studies.doctor.conditions import PROBES
from drake_navbench.studies.doctor.driven_on import driven_on, with_patience
from drake_navbench.studies.doctor.driving import Driver, Row, severity
from drake_navbench.studies.doctor.files import Patient, speed_asked
from drake_navbench.studies.doctor.known_cases import Case, kind_in
from drake_navbench.studies.doctor.probes import probes_for
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.visit import MILDER, WEAK, Visit, assume_for, seen_in

LISTS = [HERE / "doctor_cases" / f"fresh_{name}.yaml" for name in ("two", "three", "four")]
ANSWERS = HERE / "doctor_shown.json"
KNOWN = (
    *("F37", "F39", "F16", "F27", "P36", "P39", "P40", "P43"),
    *("J03", "J16", "G02", "H05", "J09", "J19", "P31", "P33"),
)
BLIND = (
    *("P04", "P15", "P42", "F10", "F15", "F34", "H07", "H08"),
    *("J10", "P25", "P06", "P08", "H03", "H10", "J02", "F24"),
)
WITH_CONTROLS = 7
SOUND = ("rpp", "dwb", "graceful")
LEFT_OUT = {
    "G01": "servers that answer late: the computer",
    "G06": "a walking robot drops slow turns",
    "G07": "a camera that is off",
    "G08": "late transforms",
    "G09": "no initial pose",
    "G11": "bt_navigator crashes",
    "G12": "bt_navigator crashes",
    "H01": "the lidar's height in the collision monitor",
    "H02": "the costmap times out: the computer",
    "H09": "the controller does not come up",
    "J04": "people's cells in the map",
    "J05": "bt_navigator does not come up",
    "J06": "bt_navigator crashes",
    "J13": "bt_navigator crashes",
    "J17": "servers that answer late: the computer",
}


def in_order(files: Path) -> list[tuple[Case, str]]:
    """Returns the cases with their robots, in the order in which they are looked at."""
    cheap = ("rpp", "dwb", "mppi")
    cases = drivable_cases(LISTS, LEFT_OUT, files)
    return sorted(cases, key=lambda entry: cheap.index(kind_in(entry[0].controller)))


def look(files: Path, out: Path) -> None:
    """Looks at the cases that were not looked at, and keeps each answer."""
    order = in_order(files)
    print(f"{len(order)} cases: {' '.join(case.id for case, _ in order)}", flush=True)
    for case, robot in order:
        if case.id not in _read():
            try:
                entry = _look_at(case, robot, files, out / case.id)
            except (NavbenchError, ArithmeticError, LookupError, TypeError, ValueError) as error:
                entry = {"crash": f"{type(error).__name__}: {error}"}
            _keep(case.id, {"symptom": case.symptom_class, "robot": robot} | entry)


def _look_at(case: Case, robot: str, files: Path, folder: Path) -> dict[str, Any]:
    patient = patient_of(case, files, robot)
    folder.mkdir(parents=True, exist_ok=True)
    driver = Driver(folder, robot, jobs=1, budget_s=0.0, tell=lambda line: None)
    asked = Symptom(case.symptom_class)
    columns, facts = patient.columns(), patient.facts()
    base = columns.setup.robot
    probes = probes_for(base, speed_asked(facts, base), seed=0)

    def drive(own: dict[str, Scenario]) -> list[Row]:
        return driver.drive(patient.chosen(columns), list(own.values()), 1, seed=0, must=True)

    rows = drive(probes)
    if asked is Symptom.FALSE_ABORT and asked not in seen_in(rows):
        rows += drive(driven_on(probes, rows, facts))
    most = max(severity(row, asked) for row in rows)
    weak, seen = seen_in(rows, bar=WEAK), seen_in(rows, share=1e-9)
    faint = {s.value for s in (asked, MILDER.get(asked)) if s is not None and s in weak}
    return {
        "controller": "+".join(facts.kinds),
        "shown": "yes" if most > 1.0 else "weakly" if faint else "no",
        "most": most,
        "probes": seen.get(asked, []),
        "all": sorted(s.value for s in seen),
        "trials": driver.driven,
    }


def assume(files: Path, out: Path) -> None:
    """Drives the conditions for the complaints and the controls, and keeps each answer."""
    cases = drivable_cases(VISITED, VISITS_LEFT_OUT, files) + drivable_cases(LISTS, LEFT_OUT, files)
    by_id = {case.id: (case, robot) for case, robot in cases}
    groups = [[by_id[key] for key in group if key in by_id] for group in (KNOWN, BLIND)]
    for group in groups:
        for number, (case, robot) in enumerate(group):
            asked = case.symptom_class
            later = [c.symptom_class for c, _ in group[number:] + group[:number]]
            other = next(symptom for symptom in later if symptom != asked)
            patient = patient_of(case, files, robot)
            classes = {asked: "asked"} | ({other: "control"} if number < WITH_CONTROLS else {})
            _assume_each(case.id, patient, robot, classes, out / case.id)
        if group is groups[0] and len(group) < WITH_CONTROLS:
            classes = {c.symptom_class: "control" for c, _ in group}
            for name in SOUND:
                folder = out / f"sound_{name}"
                folder.mkdir(parents=True, exist_ok=True)
                patient = patient_of_sound(sound_file(name), folder)
                _assume_each(f"sound_{name}", patient, ROBOT, classes, folder)


def _assume_each(
    key: str, patient: Patient, robot: str, classes: dict[str, str], folder: Path
) -> None:
    """Keeps the conditions that show each class in a file. classes: what each class is here."""
    folder.mkdir(parents=True, exist_ok=True)
    driver = Driver(folder, robot, jobs=1, budget_s=1e9, tell=lambda line: None)
    columns, facts = patient.columns(), patient.facts()
    base = columns.setup.robot
    probes = probes_for(base, speed_asked(facts, base), seed=0)
    for symptom, what in classes.items():
        name = f"{key} {symptom} assumed"
        if name in _read():
            continue
        asked = Symptom(symptom)
        own = [probes[n] for n in PROBES.get(asked, ()) if n in probes]
        if asked is Symptom.FALSE_ABORT:
            own = [with_patience(probe, facts) for probe in own]
        ideal = driver.drive(patient.chosen(columns), own, 1, seed=0, must=True) if own else []
        entry: dict[str, Any] = {"what": what, "ideal": asked in seen_in(ideal)}
        if not entry["ideal"]:
            found = Visit(facts, asked=asked, probes=probes)
            assume_for(found, patient, driver, seed=0)
            entry |= {"by": [condition.name for condition in found.assumed]}
        _keep(name, entry | {"trials": driver.driven})


def _read() -> dict[str, Any]:
    done: dict[str, Any] = json.loads(ANSWERS.read_text()) if ANSWERS.exists() else {}
    return done


def _keep(key: str, entry: Any) -> None:
    ANSWERS.write_text(json.dumps(_read() | {key: entry}, indent=1) + "\n", encoding="utf-8")
    print(key, entry, flush=True)


def table() -> None:
    """Prints the answers, those that are shown first, and what chance is."""
    done = _read()
    looked = {key: e for key, e in done.items() if "shown" in e}
    for key in done.keys() - looked.keys():
        print(f"{key} is not counted: {done[key]['crash']}")
    rank = ("yes", "weakly", "no")
    print("| case | complaint, robot | shown | share of threshold | other files that show it |")
    print("|---|---|---|---|---|")
    for key, entry in sorted(looked.items(), key=lambda item: rank.index(item[1]["shown"])):
        others = [e for other, e in looked.items() if e["symptom"] != entry["symptom"]]
        count = sum(entry["symptom"] in e["all"] for e in others)
        what = f"{entry['symptom']}, {entry['controller']}, {entry['robot']}"
        share = f"{entry['most']:.0%}"
        print(f"| {key} | {what} | {entry['shown']} | {share} | {count} of {len(others)} |")


def assumed_table() -> None:
    """Prints by condition, and for all, in how many complaints and controls it shows the class."""
    done = [(k, e) for k, e in _read().items() if k.endswith(" assumed") and "by" in e]
    groups = {
        "known complaints": [e for k, e in done if e["what"] == "asked" and k[:3] in KNOWN],
        "controls": [e for k, e in done if e["what"] == "control" and k[:3] not in BLIND],
        "blind complaints": [e for k, e in done if e["what"] == "asked" and k[:3] in BLIND],
        "their controls": [e for k, e in done if e["what"] == "control" and k[:3] in BLIND],
    }
    names = sorted({name for _, entry in done for name in entry["by"]})
    print(f"\n| condition | {' | '.join(groups)} |\n|---|---|---|---|---|")
    for name in ("any", *names):
        counts = [
            f"{sum(name in e['by'] or (name == 'any' and bool(e['by'])) for e in own)} of {len(own)}"
            for own in groups.values()
        ]
        print(f"| {name} | {' | '.join(counts)} |")
    for key, entry in done:
        print(f"{key.removesuffix(' assumed')} ({entry['what']}): {', '.join(entry['by']) or 'no'}")


def main() -> None:
    """Runs a step of the study."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    steps = parser.add_subparsers(dest="step", required=True)
    step = steps.add_parser("look", help="look at the next cases; goes on where it stopped")
    step.add_argument("files", type=Path, help="folder of the cases' files")
    step.add_argument("folder", type=Path, help="folder of the drives")
    step = steps.add_parser("assume", help="drive the conditions of the doctor")
    step.add_argument("files", type=Path, help="folder of the cases' files")
    step.add_argument("folder", type=Path, help="folder of the drives")
    steps.add_parser("table", help="print the answers so far as a table")
    arguments = parser.parse_args()
    if arguments.step == "look":
        look(arguments.files, arguments.folder)
    elif arguments.step == "assume":
        assume(arguments.files, arguments.folder)
    else:
        table()
        assumed_table()


if __name__ == "__main__":
    main()
