"""Whole visits of the doctor: from a public complaint to a patch that is shown to help.

    python studies/doctor_cases.py files FILES     fetches the files of the cases
    python studies/doctor_visits.py drive FILES DIR
                                                   visits the next cases; goes on where it stopped
    python studies/doctor_visits.py table          the answers so far, as a table

Both take `--round NAME`: `first` (the default), `second` or `again`; `table` also `before`. Written
before a case was driven:

- *Cases.* Of the three lists in `doctor_cases/` (development, test, fresh) those with whole files
  of the day before the cure, whose class of symptom a detector knows (not late cycles: these need a
  board), whose controller this program has, and whose files it takes. By their words alone those
  are left out that no probe can contain (`LEFT_OUT` has the reasons), and two that earlier visits
  have driven. The doctor's reading was made with these cases known, or has learnt from them since;
  no probe was driven with any of them, except for the two.
- *Order.* By the seed 2040; of one owner the first two. One after the other, until the time ends.
  Every case begun counts, whatever comes out.
- *Visit.* As a user would do it: class of the symptom, the words of the complaint and of the robot,
  the file, one worker (`--jobs 1`), `--budget 6m` in place of 10m, because each case has one core.
  A visit that takes 12 minutes is stopped as by Ctrl-C and counts as it then stands.
- *Robot.* The one that lends base and lidar: car-like in the words, `ackermann_robot`;
  omnidirectional or mecanum, `omni_robot`; an outline that reaches less than 0.25 m and at most
  0.31 m/s, `turtlebot4`; one that reaches more than 0.6 m, `agv`; else `jackal`. The outline is the
  file's own where it has one.
- *Answers.* Shown: the probes show the class that was complained of. Cause: some cause is shown.
  Patch: a change helps on fresh seeds. Gone: in how many fresh trials of the probes that showed it
  the symptom is before and after. Worse: other symptoms that more trials show (two more; of touches
  one). Public cure: the patch, or any cause that was shown, changes a parameter of the public cure
  in its direction.
- *Without skill* nothing is shown to help: no patch. *A crash* ends a case with the program's
  message, and counts as a case without an answer.
- *Changes of the program* meanwhile are allowed for later cases only; the table says after which
  case the code changed. After the third, P07: of a symptom that was complained of a severity above
  half of the threshold counts as a weak sign and is treated (the first two had ended with `no probe
  shows it`; P26 had 0.84 and 0.95). Then *shown* has a third answer, `weakly`. After P24: who
  complains of a touch that no probe shows is treated for passing too closely, where a probe shows
  that (P39 showed neither). After P37's answer, or the case that was then under way: a change that
  halves the severity has the third look, too (P37's best change fell by 78% in 24 pairs, was not
  shown, and the time was not used up). After P40: two changes are tried together unless one alone
  takes the symptom away; before, a mean severity below 0.5 was held for that, which a seldom one
  has anyway. P37 and P35 were then gone on with by the mended doctor (`again`), which is told apart
  and not counted. The processor time of the first two cases was not measured. The study stopped for
  want of time after P17, the nineteenth case.
- *After P17*, committed before the twentieth case was begun: a task that ends because every command
  is refused is a weak sign of `false_abort` and of `no_recovery`. That was made with the ten cases
  known that the probes had not shown (P01 and F32 end so); these do not count again. The eleven
  cases that are left follow in the same order, with this doctor, which is not changed before the
  last; the end of the time, not an answer, ends the study. Harsher probes were tried on the ten and
  on sound files, and are not part of it: docs/doctor_evidence.md. The time ended after P41, the
  twenty-seventh case; F10, F24 and P42 were not begun.

The rounds `second` and `again`, committed before a case of either was driven: since then the doctor
also makes all likely changes together, and searches the fewest of them that suffice
(`experiment.py`); a costmap without an obstacle layer may get one.

- *Second*: cases for which no change was ever tried (but J16): those of `fresh_two`, `fresh_three`
  and `fresh_four`, without those that `doctor_shown.py` leaves out, in the order of the seed 2041,
  of one owner the first two. All else as in the first round. What their probes show was known of
  most (`doctor_shown.json`), whether a change helps of none.
- *Again*: the cases of the first round and the three that it did not begin, in its order.
- *Two arms*, the same cases and seeds: the doctor with sets, and the one before, which tries pairs
  of the best three. Each case is visited by both, one core each, whatever comes out; a case counts
  if both have visited it. The doctor is not changed before the last case. *Unit*: a case.
  *Expected*: of the second round a patch for 15% with sets, 8% without.
- *Outcome.* Both arms visited all 19 cases of the second round; the doctor without sets is that of
  the commit 2be74666, and `table --round before` prints its answers. Two cases were under way when
  the drives were stopped once, for want of processors; both arms went on from their journals.
- *Again, changed before its first case*: one arm, the doctor of the commit c4e49caf, in two
  processes that share the order's cases in turn; the answers of the first round stand beside it.
  The time ended it after 18 of the 30 cases; P21 was under way and does not count.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import time
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from planted_faults import HERE

from drake_navbench.errors import NavbenchError
from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.alike import Told
from drake_navbench.studies.doctor.detectors import DETECTORS
from drake_navbench.studies.doctor.driving import Driver
from drake_navbench.studies.doctor.facts import Facts, kinds_of
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.known_cases import (
    Case,
    files_of,
    is_hit,
    kind_in,
    read_cases,
)
from drake_navbench.studies.doctor.page import write_outputs
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.visit import visit
from drake_navbench.studies.doctor.visited import Visit
from drake_navbench.studies.doctor.words import verdict

LISTS = [HERE / "doctor_cases" / f"{name}.yaml" for name in ("development", "test", "fresh")]
DRIVEN = HERE / "doctor_visits.json"
ORDER_SEED, MOST_OF_AN_OWNER = 2040, 2
BUDGET_S, LONGEST_S = 360.0, 720
ANSWERS_TWO, ANSWERS_AGAIN = HERE / "doctor_visits_two.json", HERE / "doctor_visits_again.json"
ANSWERS_BEFORE = HERE / "doctor_visits_two_before.json"
LISTS_TWO = [HERE / "doctor_cases" / f"fresh_{name}.yaml" for name in ("two", "three", "four")]
LEFT_OUT = {
    "P09": "the costmap times out: the computer",
    "P10": "late transforms stop the robot: the computer",
    "P13": "the lidar marks the dock behind it",
    "P14": "the costmap times out: the computer",
    "P19": "the planner's way, not the robot's drive",
    "P30": "follows a person",
    "P44": "driven earlier",
    "P45": "driven earlier",
    "F03": "follows a person",
    "F05": "the controller does not come up",
    "F08": "the controller does not come up",
    "F11": "drives into a keepout zone",
    "F17": "a box that is taken away",
    "F21": "the planner does not come up",
    "F22": "late transforms",
    "F33": "the motors' deadband",
    "F40": "a turn commanded by hand",
}


def patient_of(case: Case, files: Path, robot: str) -> Patient:
    """Returns a case's file, with the controller that the case is about; raises InputError."""
    release = next((str(r) for r in Release if r in case.release.lower()), None)
    patient = Patient(tuple(files_of(case, files)), robot, {}, release)
    setup = patient.columns().setup
    own = [p for p in setup.presets if kinds_of(p)[-1] == kind_in(case.controller)]
    plugin = setup.places[own[0].name][1] if own else ""
    return Patient(patient.paths, robot, {}, release, plugin)


def robot_for(case: Case, facts: Facts) -> str:
    """Returns the robot that lends its base and lidar."""
    words = case.robot.lower()
    if "car-like" in words:
        return "ackermann_robot"
    if "omnidirectional" in words or "mecanum" in words:
        return "omni_robot"
    assert facts.robot is not None
    reach_m = facts.robot.radii[1]
    if reach_m < 0.25 and facts.speed_mps <= 0.31:
        return "turtlebot4"
    return "agv" if reach_m > 0.6 else "jackal"


def drivable_cases(
    lists: Sequence[Path], left_out: Collection[str], files: Path
) -> list[tuple[Case, str]]:
    """Returns the cases of lists that can be driven, with their robots, in the lists' order.

    Their class has a detector (late cycles do not count), and their file is whole. left_out: ids.
    """
    shown = {detector.symptom for detector in DETECTORS} - {Symptom.LATE_CYCLES}
    found: list[tuple[Case, str]] = []
    for case in (case for path in lists for case in read_cases(path)):
        if case.symptom_class not in shown or case.id in left_out or not files_of(case, files):
            continue
        try:
            facts = patient_of(case, files, "jackal").facts()
        except NavbenchError as error:
            print(f"{case.id} cannot be driven: {str(error)[:120]}")
            continue
        if facts.is_whole:
            found.append((case, robot_for(case, facts)))
    return found


class Round(NamedTuple):
    """Cases that are visited in an order: their lists, the file of the answers, the order's seed.

    left_out: ids of cases that no probe can contain.
    """

    lists: Sequence[Path]
    answers: Path
    order_seed: int
    left_out: Collection[str]


def round_of(name: str) -> Round:
    """Returns a round by its name."""
    if name in ("second", "before"):
        # Imported here, as that study imports this one.
        import doctor_shown

        answers = ANSWERS_TWO if name == "second" else ANSWERS_BEFORE
        return Round(LISTS_TWO, answers, ORDER_SEED + 1, doctor_shown.LEFT_OUT)
    return Round(LISTS, DRIVEN if name == "first" else ANSWERS_AGAIN, ORDER_SEED, LEFT_OUT)


def in_order(files: Path, which: Round) -> list[tuple[Case, str]]:
    """Returns the cases with their robots, in the order in which they are visited."""
    found = drivable_cases(which.lists, which.left_out, files)
    order = np.random.default_rng(which.order_seed).permutation(len(found))
    taken: dict[str, int] = {}
    chosen = []
    for case, robot in (found[int(index)] for index in order):
        owner = case.link.partition("/")[0]
        taken[owner] = taken.get(owner, 0) + 1
        if taken[owner] <= MOST_OF_AN_OWNER:
            chosen.append((case, robot))
    return chosen


def drive(files: Path, out: Path, which: Round) -> None:
    """Visits the cases that were not visited, and keeps each answer."""
    order = in_order(files, which)
    print(f"{len(order)} cases: {' '.join(case.id for case, _ in order)}", flush=True)
    for case, robot in order:
        done = _read(which)
        if case.id in done:
            continue
        print(f"\n{case.id} {case.symptom_class} {robot}: {case.symptom}", flush=True)
        try:
            entry = _visited(case, robot, files, out / case.id)
        except (NavbenchError, ArithmeticError, LookupError, TypeError, ValueError) as error:
            entry = {"crash": f"{type(error).__name__}: {error}"}
        done = _read(which) | {case.id: {"symptom": case.symptom_class, "robot": robot} | entry}
        which.answers.write_text(json.dumps(done, indent=1) + "\n", encoding="utf-8")
        print(case.id, entry, flush=True)


def _visited(case: Case, robot: str, files: Path, folder: Path) -> dict[str, Any]:
    patient = patient_of(case, files, robot)
    folder.mkdir(parents=True, exist_ok=True)
    driver = Driver(
        folder, robot, jobs=1, budget_s=BUDGET_S, tell=lambda line: print(line, flush=True)
    )
    began_s, began_cpu_s = time.monotonic(), _processor_s()
    signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.alarm(LONGEST_S)
    words = f"{case.symptom_class} {case.words}"
    found = visit(patient, Symptom(case.symptom_class), Told(words), driver, seed=0)
    signal.alarm(0)
    print(verdict(found))
    entry = _answer(case, found) | {
        "trials": driver.driven,
        "wall_s": round(time.monotonic() - began_s),
        "processor_s": round(_processor_s() - began_cpu_s),
    }
    write_outputs(found, patient, folder, driver)
    return entry | {"with_replays_s": round(_processor_s() - began_cpu_s)}


def _processor_s(process: str = "self") -> float:
    """Returns the processor time of a process and of all that descend from it, s."""
    stat = Path(f"/proc/{process}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    # User and system time, its own and those of the children that it has waited for.
    own_s = sum(map(int, stat[11:15])) / os.sysconf("SC_CLK_TCK")
    children = Path(f"/proc/{process}/task").glob("*/children")
    alive = [pid for path in children for pid in path.read_text(encoding="utf-8").split()]
    return own_s + sum(_processor_s(pid) for pid in alive)


def _answer(case: Case, found: Visit) -> dict[str, Any]:
    """Returns the record of a visit: symptoms, causes, changes and verdict."""
    causes = [cause for entry in found.shown for cause in entry.causes]
    judged = [
        {
            "change": j.trial.told,
            "fresh": [j.before_target, j.after_target, j.target_trials],
            "trials": j.trials,
            "worse": {name: [j.before[name], j.after[name]] for name in j.worse},
            "instead": dict(j.instead),
            "helps": j.helps,
        }
        for j in found.judged
    ]
    cure = found.cure
    return {
        "controller": "+".join(found.facts.kinds),
        "bar": found.bar,
        "treated": str(found.treated or ""),
        "seen": {str(symptom): names for symptom, names in found.seen.items()},
        "shown": [entry.trial.told for entry in found.shown if entry.trial],
        "tried": sum(entry.pairs > 0 for entry in found.tried),
        "judged": judged,
        "patch": cure.trial.told if cure is not None else "",
        "hits": [is_hit(cause, case, found.facts) for cause in causes],
        "patch_hits": cure is not None
        and any(is_hit(cause, case, found.facts) for cause in cure.tried.causes),
        "stopped": found.is_interrupted,
        "out_of_time": found.is_out_of_time,
        "verdict": verdict(found),
    }


def _read(which: Round) -> dict[str, Any]:
    path = which.answers
    done: dict[str, Any] = json.loads(path.read_text()) if path.exists() else {}
    return done


def table(which: Round) -> None:
    """Prints the answers, those without a patch first."""
    done = _read(which)
    print("| case | complaint, robot | shown | causes shown | patch | fresh | worse | public | s |")
    print("|---|---|---|---|---|---|---|---|---|")
    rank = {
        key: (bool(e.get("patch")), e.get("symptom") in e.get("seen", ()))
        for key, e in done.items()
    }
    for key in sorted(done, key=lambda key: rank[key]):
        entry = done[key]
        if "crash" in entry:
            print(f"| {key} | {entry['symptom']}, {entry['robot']} | {entry['crash']} |")
            continue
        best = next((j for j in entry["judged"] if j["change"] == entry["patch"]), None)
        fresh = "{} -> {} of {}".format(*best["fresh"]) if best else ""
        weakly = "weakly: " if entry.get("bar", 1.0) < 1.0 else ""
        worse = ", ".join(f"{n} {a} -> {b}" for n, (a, b) in best["worse"].items()) if best else ""
        cells = [
            key, f"{entry['symptom']}, {entry['controller']}, {entry['robot']}",
            weakly + ", ".join(entry["seen"].get(entry["symptom"], ["no"])),
            str(len(entry["shown"])),
            entry["patch"] or "none", fresh, worse or ("none" if best else ""),
            "yes" if entry["patch_hits"] else "shown" if any(entry["hits"]) else "no",
            f"{entry['trials']} trials, {entry['wall_s']}, {entry['processor_s']}",
        ]  # fmt: skip
        print(f"| {' | '.join(cells)} |")


def main() -> None:
    """Runs a step of the study."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    steps = parser.add_subparsers(dest="step", required=True)
    step = steps.add_parser("drive", help="visit the next cases; goes on where it stopped")
    step.add_argument("files", type=Path, help="folder of the cases' files")
    step.add_argument("folder", type=Path, help="folder of the drives")
    steps.add_parser("table", help="print the answers so far as a table")
    for name, step in steps.choices.items():
        more = ("before",) if name == "table" else ()
        rounds = ("first", "second", "again", *more)
        step.add_argument("--round", choices=rounds, default="first", help="round of visits")
    arguments = parser.parse_args()
    which = round_of(arguments.round)
    if arguments.step == "drive":
        drive(arguments.files, arguments.folder, which)
    else:
        table(which)


if __name__ == "__main__":
    main()
