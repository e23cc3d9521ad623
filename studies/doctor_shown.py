"""Do the probes show what the user saw? First looks at complaints that no visit has driven.

    python studies/doctor_cases.py files FILES     fetches the files of the cases
    python studies/doctor_shown.py look FILES DIR  looks at the next cases; goes on where it stopped
    python studies/doctor_shown.py table           the answers so far, as a table
    python studies/doctor_shown.py again FILES DIR looks once more, by today's detectors

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

Conditions, one assumption on the robot each, are not part of the doctor. Rule and code, committed
before anything was driven with them but F37 with 0.04 m/s, are in the commits 71d5c5ef and
29d072dd: the probes made for the class under each of nine conditions (wheels that stand below
0.05 m/s, slip of 20%, a time
constant of 0.4 s, commands 0.3 s late, cycles of two periods, scans 0.3 s old, pose noise of 3 cm,
a body 5 cm larger, a path that begins at a right angle), shown if both seeds of a probe are above
the threshold. They would have stayed if they had shown a quarter of the complaints and twice the
share of the controls. Of 16 known complaints 14 were driven and two shown: G02 by the wheels, J16
by the cycles, of which today's detector, since then by half widths, sees 80% without any condition
(a whole visit of J16, 15 min on a quarter of a core: seen in two probes, 36 changes, none shown).
None of 5 controls, files with another's complaint, is shown (7 were driven: P36 shows its class
without a condition, and F37 with the class of F39 is a complaint itself). P31, P33 and the blind
complaints were not driven, for want of time.

- *Again*, committed before the first of these looks: all cases of this study and of
  `doctor_visits.py` whose controller is RPP or DWB (a shim before it, too), RPP's first, each once
  and with one seed a probe, by the program of that day. No detector, threshold or probe is changed
  afterwards because of them. The first answers stay (`doctor_shown.json`, `doctor_visits.json`:
  each by the detectors of its day); the page gives both. What is counted: shown, weakly or no,
  then and now, of the same cases. The end of the time ends it; cases that were not
  reached are named. Added, still before the first of these looks: MPPI's, which were to be left out
  because their trials take five to ten times as long, come last, as far as the time goes. *Chance*
  is counted as above: a file shows a class of which it does not complain.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import doctor_visits
from doctor_visits import drivable_cases, patient_of
from planted_faults import HERE

from drake_navbench.errors import NavbenchError
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studies.doctor.driven_on import driven_on
from drake_navbench.studies.doctor.driving import Driver, Row, severity
from drake_navbench.studies.doctor.files import speed_asked
from drake_navbench.studies.doctor.first_look import seen_in
from drake_navbench.studies.doctor.known_cases import Case, kind_in
from drake_navbench.studies.doctor.probes import probes_for
from drake_navbench.studies.doctor.symptoms import MILDER, Symptom
from drake_navbench.studies.doctor.visit import WEAK
from drake_navbench.typed_files.output_file import write_text

LISTS = [HERE / "doctor_cases" / f"fresh_{name}.yaml" for name in ("two", "three", "four")]
ANSWERS, AGAIN = HERE / "doctor_shown.json", HERE / "doctor_again.json"
# A look is not cut short, s.
NO_BUDGET_S = 1e6
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
    return _cheap_first(drivable_cases(LISTS, LEFT_OUT, files))


def _drivable(files: Path) -> list[tuple[Case, str]]:
    """Returns the cases of both studies that can be driven, with their robots, cheap ones first."""
    lists = doctor_visits.LISTS + LISTS
    return _cheap_first(drivable_cases(lists, LEFT_OUT | doctor_visits.LEFT_OUT, files))


def _cheap_first(cases: list[tuple[Case, str]]) -> list[tuple[Case, str]]:
    cheap = ("rpp", "dwb", "mppi")
    return sorted(cases, key=lambda entry: cheap.index(kind_in(entry[0].controller)))


def look(files: Path, out: Path) -> None:
    """Looks at the cases that were not looked at, and keeps each answer."""
    order = in_order(files)
    print(f"{len(order)} cases: {' '.join(case.id for case, _ in order)}", flush=True)
    for case, robot in order:
        if case.id not in _read(ANSWERS):
            _keep(ANSWERS, case.id, _answer(case, robot, files, out))


def again(files: Path, out: Path) -> None:
    """Looks once more at the cases that were looked at or visited."""
    then = _read(doctor_visits.DRIVEN) | _read(ANSWERS)
    cases = [entry for entry in _drivable(files) if entry[0].id in then]
    print(f"{len(cases)} cases: {' '.join(case.id for case, _ in cases)}", flush=True)
    for case, robot in cases:
        if case.id not in _read(AGAIN):
            entry = _answer(case, robot, files, out)
            _keep(AGAIN, case.id, {"then": _shown_then(then[case.id])} | entry)


def _shown_then(entry: dict[str, Any]) -> str:
    """Returns the first answer: that of a look, or of a visit, which keeps what it has seen."""
    if "shown" in entry and isinstance(entry["shown"], str):
        return entry["shown"]
    if entry["symptom"] not in entry["seen"]:
        return "milder" if entry.get("treated") else "no"
    return "yes" if entry.get("bar", 1.0) == 1.0 else "weakly"


def _answer(case: Case, robot: str, files: Path, out: Path) -> dict[str, Any]:
    try:
        entry = _look_at(case, robot, files, out / case.id)
    except (NavbenchError, ArithmeticError, LookupError, TypeError, ValueError) as error:
        entry = {"crash": f"{type(error).__name__}: {error}"}
    return {"symptom": case.symptom_class, "robot": robot} | entry


def _look_at(case: Case, robot: str, files: Path, folder: Path) -> dict[str, Any]:
    patient = patient_of(case, files, robot)
    folder.mkdir(parents=True, exist_ok=True)
    driver = Driver(folder, robot, jobs=1, budget_s=NO_BUDGET_S, tell=lambda line: None)
    asked = Symptom(case.symptom_class)
    columns, facts = patient.columns(), patient.facts()
    base = columns.setup.robot
    probes = probes_for(base, speed_asked(facts, base), seed=0)

    def drive(own: dict[str, Scenario]) -> list[Row]:
        return driver.drive(patient.chosen(columns), list(own.values()), 1, seed=0)

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


def _read(path: Path) -> dict[str, Any]:
    done: dict[str, Any] = json.loads(path.read_text()) if path.exists() else {}
    return done


def _keep(path: Path, key: str, entry: Any) -> None:
    # Hours of drives: a full disk or Ctrl-C must not leave half a file.
    write_text(path, json.dumps(_read(path) | {key: entry}, indent=1) + "\n")
    print(key, entry, flush=True)


def table() -> None:
    """Prints the answers of both looks, those that are shown first, and what chance is."""
    print("First looks, by the detectors of their day\n")
    _print_answers(_read(ANSWERS))
    print("\nAll complaints, by the detectors of the second look\n")
    _print_answers(_read(AGAIN))


def _print_answers(done: dict[str, Any]) -> None:
    looked = {key: e for key, e in done.items() if "shown" in e}
    for key in done.keys() - looked.keys():
        print(f"{key} is not counted: {done[key]['crash']}")
    rank = ("yes", "weakly", "no")
    print("| case | complaint, robot | then | shown | share of threshold | others that show it |")
    print("|---|---|---|---|---|---|")
    pairs = 0
    by_chance = 0
    for key, entry in sorted(looked.items(), key=lambda item: rank.index(item[1]["shown"])):
        others = [e for e in looked.values() if e["symptom"] != entry["symptom"]]
        count = sum(entry["symptom"] in e["all"] for e in others)
        pairs, by_chance = pairs + len(others), by_chance + count
        what = f"{entry['symptom']}, {entry['controller']}, {entry['robot']}"
        cells = [key, what, entry.get("then", ""), entry["shown"], f"{entry['most']:.0%}"]
        print(f"| {' | '.join(cells)} | {count} of {len(others)} |")
    for answer in rank:
        ids = [key for key, e in looked.items() if e["shown"] == answer]
        print(f"\n{answer}: {len(ids)} of {len(looked)}: {' '.join(ids)}")
    print(f"\nAnother complaint's file shows the class: {by_chance} of {pairs}")


def main() -> None:
    """Runs a step of the study."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    steps = parser.add_subparsers(dest="step", required=True)
    driven = {"look": look, "again": again}
    for name, told in (("look", "look at the next cases"), ("again", "look at all once more")):
        step = steps.add_parser(name, help=f"{told}; goes on where it stopped")
        step.add_argument("files", type=Path, help="folder of the cases' files")
        step.add_argument("folder", type=Path, help="folder of the drives")
    steps.add_parser("table", help="print the answers so far as a table")
    arguments = parser.parse_args()
    if arguments.step in driven:
        driven[arguments.step](arguments.files, arguments.folder)
    else:
        table()


if __name__ == "__main__":
    main()
