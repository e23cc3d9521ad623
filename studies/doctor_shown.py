"""Do the probes show what the user saw? First looks at complaints that no visit has driven.

    python studies/doctor_cases.py files FILES     fetches the files of the cases
    python studies/doctor_shown.py look FILES DIR  looks at the next cases; goes on where it stopped
    python studies/doctor_shown.py harsher FILES DIR
                                                   harsher circumstances for what was not shown
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
- *Harsher.* What was not shown is driven in the probes made for the class (`RELEVANT`), with one
  seed, in five circumstances, one at a time: commands 0.3 s and odometry 0.1 s late; wheels that
  stand below 15% of the file's speed; 20% slip; pose noise of 3 cm and 0.03 rad that changes twice
  a second; a base with 30% of its accelerations and a lag of 0.4 s. Counted is a severity above 1
  that the ideal probe does not have. *Chance*: the same circumstances for the same classes in the
  sound files of RPP, DWB and Graceful. A circumstance is worth something if it shows the complaint
  in more than twice the share in which it makes a sound file look ill.
- *Known then.* Of the 16 complaints of `doctor_visits.py` that no probe shows three were driven so:
  F12, P40 and F27, of which none shows it in any of the five.
- *Expected.* Shown 40%, weakly 10% more; the harsher circumstances show one in ten of the rest.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from doctor_visits import patient_of, robot_for
from planted_faults import HERE, ROBOT, sound_file
from planted_faults import patient_of as patient_of_sound

from drake_navbench.errors import NavbenchError
from drake_navbench.inputs.robot import Robot, merged
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studies.doctor.detectors import DETECTORS
from drake_navbench.studies.doctor.driven_on import driven_on
from drake_navbench.studies.doctor.driving import Driver, Row, severity
from drake_navbench.studies.doctor.files import Patient, speed_asked
from drake_navbench.studies.doctor.known_cases import Case, files_of, kind_in, read_cases
from drake_navbench.studies.doctor.probes import probes_for
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.visit import MILDER, WEAK, seen_in

LISTS = [HERE / "doctor_cases" / f"fresh_{name}.yaml" for name in ("two", "three", "four")]
ANSWERS = HERE / "doctor_shown.json"
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
# The probes in which a class is looked for in harsher circumstances.
AT_GOAL = ("exact_heading", "straight", "goal_beside_wall")
TURNS = ("goal_behind", "exact_heading", "dead_end")
NEAR = ("right_angle", "box_on_path", "closed_way", "beside_obstacle")
RELEVANT = {
    "wobble_straight": ("straight", "corridor", "bends"),
    "corner_cutting": ("bends", "right_angle"),
    "goal_overshoot": AT_GOAL,
    "goal_oscillation": AT_GOAL,
    "goal_not_reached": AT_GOAL,
    "stall_before_goal": AT_GOAL,
    "no_turning": TURNS,
    "spins": TURNS,
    "reverse_failure": ("goal_behind", "straight", "dead_end"),
    "false_abort": ("goal_behind", "dead_end", "exact_heading", "door"),
    "no_recovery": ("beside_obstacle", "dead_end", "box_on_path", "door"),
    "no_start": ("goal_behind", "dead_end", "beside_obstacle"),
    "collision": NEAR,
    "near_miss": NEAR,
    "door_stop": ("door", "corridor", "right_angle"),
    "too_slow": ("straight", "bends"),
    "stop_start_jerk": ("straight", "bends", "door"),
    "gives_up_late": ("closed_way",),
}
SOUND = ("rpp", "dwb", "graceful")


def in_order(files: Path) -> list[tuple[Case, str]]:
    """Returns the cases with their robots, in the order in which they are looked at."""
    known = {detector.symptom for detector in DETECTORS} - {Symptom.LATE_CYCLES}
    found: list[tuple[Case, str]] = []
    for case in (case for path in LISTS for case in read_cases(path)):
        if case.symptom_class not in known or case.id in LEFT_OUT or not files_of(case, files):
            continue
        try:
            facts = patient_of(case, files, "jackal").facts()
        except NavbenchError as error:
            print(f"{case.id} cannot be driven: {str(error)[:120]}")
            continue
        if facts.is_whole:
            found.append((case, robot_for(case, facts)))
    cheap = ("rpp", "dwb", "mppi")
    return sorted(found, key=lambda entry: cheap.index(kind_in(entry[0].controller)))


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


def harsher(files: Path, out: Path) -> None:
    """Drives harsher circumstances for the cases that were not shown, and for the sound files."""
    done = _read()
    missed = [(c, r) for c, r in in_order(files) if done.get(c.id, {}).get("shown") == "no"]
    for case, robot in missed:
        key = f"{case.id} harsher"
        if key not in _read():
            patient = patient_of(case, files, robot)
            _keep(key, _in_circumstances(patient, robot, {case.symptom_class}, out / case.id))
    classes = {case.symptom_class for case, _ in missed}
    for name in SOUND:
        key = f"sound_{name} harsher"
        if key not in _read():
            folder = out / f"sound_{name}"
            folder.mkdir(parents=True, exist_ok=True)
            patient = patient_of_sound(sound_file(name), folder)
            _keep(key, _in_circumstances(patient, ROBOT, classes, folder))


def _in_circumstances(
    patient: Patient, robot: str, classes: set[str], folder: Path
) -> dict[str, dict[str, float]]:
    """Returns the largest severity of each class in its probes, by circumstance."""
    driver = Driver(folder, robot, jobs=1, budget_s=0.0, tell=lambda line: None)
    columns = patient.columns()
    base = columns.setup.robot
    speed_mps = speed_asked(patient.facts(), base)
    probes = probes_for(base, speed_mps, seed=0)
    names = list(dict.fromkeys(name for c in sorted(classes) for name in RELEVANT[c]))
    found = {}
    for circumstance, changed in {"ideal": {}, **_circumstances(base, speed_mps)}.items():
        own = [_with(probes[name], circumstance, changed) for name in names]
        rows = driver.drive(patient.chosen(columns), own, 1, seed=0, must=True)
        by_name = {name: row for name in names for row in rows if f"probe_{name}" in row_name(row)}
        found[circumstance] = {
            c: max(severity(by_name[name], c) for name in RELEVANT[c]) for c in sorted(classes)
        }
    return found


def row_name(row: dict[str, Any]) -> tuple[str, ...]:
    """Returns the name of a row's probe, in a circumstance and without."""
    name = str(row["scenario"])
    return name, name.partition("__")[0]


def _with(probe: Scenario, circumstance: str, changed: dict[str, Any]) -> Scenario:
    if not changed:
        return probe
    overrides = merged(probe.robot_overrides, changed)
    name = f"{probe.name}__{circumstance}"
    return probe.model_copy(update={"name": name, "robot_overrides": overrides})


def _circumstances(base: Robot, speed_mps: float) -> dict[str, dict[str, Any]]:
    """Returns fields of the robot file by circumstance, as far as its drive has them."""
    drive = base.drive
    weak: dict[str, Any] = {"response_time_constant_s": 0.4}
    for name in ("max_linear_acceleration_mps2", "max_angular_acceleration_radps2"):
        limit = getattr(drive, name, None)
        weak |= {name: round(0.3 * limit, 4)} if limit else {}
    found: dict[str, dict[str, Any]] = {
        "late": {"timing": {"command_latency_s": 0.3, "odometry_latency_s": 0.1}},
        "noise": {"localization": {"period_s": 0.5, "xy_std_m": 0.03, "yaw_std_rad": 0.03}},
        "weak": {"drive": weak},
    }
    if drive.type == "differential":
        found["sticks"] = {"actuators": {"deadband_mps": round(0.15 * speed_mps, 4)}}
        found["slips"] = {"actuators": {"slip": 0.2, "slip_std": 0.1}}
    return found


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
    rank = ("yes", "weakly", "no")
    print("| case | complaint, robot | shown | share of threshold | other files that show it |")
    print("|---|---|---|---|---|")
    for key, entry in sorted(looked.items(), key=lambda item: rank.index(item[1]["shown"])):
        others = [e for other, e in looked.items() if e["symptom"] != entry["symptom"]]
        count = sum(entry["symptom"] in e["all"] for e in others)
        what = f"{entry['symptom']}, {entry['controller']}, {entry['robot']}"
        share = f"{entry['most']:.0%}"
        print(f"| {key} | {what} | {entry['shown']} | {share} | {count} of {len(others)} |")
    print("\n| harsher | class | ideal | circumstances that show it |\n|---|---|---|---|")
    for key, entry in done.items():
        if key.endswith(" harsher"):
            for name, ideal in entry["ideal"].items():
                showing = [c for c, e in entry.items() if e[name] > 1.0 >= ideal]
                print(f"| {key} | {name} | {ideal:.0%} | {', '.join(showing) or 'none'} |")


def main(arguments: list[str]) -> None:
    """Runs `look FILES DIR`, `harsher FILES DIR` or `table`."""
    steps = {"look": look, "harsher": harsher}
    if len(arguments) == 3 and arguments[0] in steps:
        steps[arguments[0]](Path(arguments[1]), Path(arguments[2]))
    elif arguments == ["table"]:
        table()
    else:
        sys.exit("usage: doctor_shown.py look FILES DIR | harsher FILES DIR | table")


if __name__ == "__main__":
    main(sys.argv[1:])
