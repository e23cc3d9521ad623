"""Planted faults that do harm: does the doctor's experiment find them and take the harm away?

    python studies/harmful_faults.py census DIR    which faults do harm, and how strong they must be
    python studies/harmful_faults.py visit DIR     whole visits of the harmful ones
    python studies/harmful_faults.py both DIR 2039 in turn: some of the census, then a visit
    python studies/harmful_faults.py again DIR 2035 the misses of a seed, by today's doctor
    python studies/planted_faults_page.py          docs/doctor_planted_faults.md

All go on where they were stopped. Of 14 faults of `planted_faults.py` that were driven 13 did no
harm in any probe, so here a fault is made stronger until it does. Unit: one fault, which is one
file. The rules in force, those of seed 2039:

- *Draw.* A seed orders all numbers and switches of the sound files of RPP, DWB and Graceful, and
  draws a coin for each number's direction. Passed over is a fault that an earlier draw found
  harmful in the same direction, and one whose strongest form an earlier draw's same six trials
  found harmless.
- *Strength.* A number times 3 or 1/3, as the coin says, and where that does no harm times 10 or
  1/10; a switch is turned round; what the file's reader or the controller refuses is passed over.
- *Harmful* is the mildest strength with which a trial of one of six probes shows a symptom that
  none of the sound file's trials shows, confirmed by six further seeds of the probes that show it:
  at least four of a probe's trials have it with the fault, none without. The strongest form is
  driven first; if it does no harm, no other one is.
- *Complaint.* The new symptom that most trials show; of several the weightiest. The doctor is given
  it as `--symptom` and no words, and no budget in seconds. It does not know the sound file.
- *Order.* In turn a step of the census (four parameters of a controller) and a visit, one of each
  controller in turn; then the faults that wait. The end of the time, told beforehand, ends the
  study, and no answer does; none is left out after its answer is known.
- *Scores* are those of `planted_faults_driven.py`. *First*: the likeliest cause of those that were
  shown is the spoilt parameter, in the direction back. *Named*: the first cause shown or, where
  none is, the first change to try. *Nothing worse*, strictly: on two further seeds of all probes no
  symptom in two more trials, no touch in one more, than before the change; and a row that compares
  with the sound file. A symptom that is called too rare counts as a miss in every row, and so does
  a visit that ends with the program's message; a trial that fails is neither a symptom nor a cure.
- *No skill*: the controller's value farthest from Nav2's default; any parameter with a coin for its
  direction, as an expected value; and the likeliest abnormal value, nothing driven. If this is as
  often right as the doctor, driving does not find more causes here: it shows that one is right.
  These files have one abnormal value at most before the fault; half of 111 public ones have 13.
- *Blind* is a visit if the doctor was not changed after the fault was known to do harm. What is
  visited again is not, and no score of the draws counts it.

The doctor of 2039 was changed with all earlier faults known: of the values set back first the
likeliest by both its abnormality and the symptom comes first (before, by the symptom alone), of two
values at odds the one that is not Nav2's, and changes to try count abnormal values. *Expected*,
written before its first drive: first 85%, gone 90%, of these nothing worse 85%, as in the sound
file 95%; the likeliest abnormal value alone 85%. Time: until 03:17 of the day, one worker; it
sufficed for 68 of the 98 faults left, of which seven do harm, and six visits.

Earlier seeds were driven by the doctors and rules of their day. They differ: confirmed by no
further trial until 2033, by three until 2037; all probes twice in the census of 2030 and 2031; MPPI
in 2031 to 2034 and TEB in 2032 to 2034; all parameters that did harm in either direction passed
over. Each seed's rules, the changes of the doctor before it and the expected scores stood here when
its drives began: the history of this file has them.

Intervals are Wilson's, 95%. Faults of one controller share their sound file, so they are less apart
than the intervals suppose.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

from harmful_faults_drawn import (
    CONFIRMED_FROM,
    CONFIRMED_SHARE,
    CONFIRMING,
    CONTROLLERS_OF,
    LOOKS,
    MILD,
    SCREENED_IN,
    SEEDS,
    SIX_PROBES,
    STRONG,
    TOGETHER,
    entries_of,
    fault_of,
    in_turn,
    is_missed,
    keep,
    read_entries,
    spoilt_by,
    waiting_of,
)
from planted_faults import Fault, is_read, sound_file, spoilt_file
from planted_faults_driven import patient_and_driver, visited_by

from drake_navbench.errors import InputError
from drake_navbench.studies.doctor.driving import Row, shows
from drake_navbench.studies.doctor.files import speed_asked
from drake_navbench.studies.doctor.first_look import FIRST_SEEDS, seen_in
from drake_navbench.studies.doctor.probes import probes_for
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.visit import BY_WEIGHT

# The fields of an entry that its visits share.
OF_A_FAULT = ("controller", "place", "sound", "spoilt", "harmful")


def census(seed: int, out: Path) -> None:
    """Drives the probes of the sound files and of the faults, and keeps what they show.

    A few parameters of each controller in turn.
    """
    while _has_screened(seed, out):
        pass


def visit_all(seed: int, out: Path) -> None:
    """Visits, as the doctor, each harmful fault that was not visited, one controller in turn."""
    while _has_visited(seed, out):
        pass


def census_and_visits(seed: int, out: Path) -> None:
    """Visits a fault after each step of the census; at first the one that was interrupted."""
    _has_visited(seed, out)
    while _has_screened(seed, out):
        _has_visited(seed, out)
    visit_all(seed, out)


def visit_again(seed: int, out: Path) -> None:
    """Visits the misses of a seed that no later doctor has visited."""
    done = read_entries()
    missed = [key for key in in_turn(done, seed) if is_missed(done[key])]
    for key in missed:
        if f"again {key}" not in done:
            fault = {name: done[key][name] for name in OF_A_FAULT}
            keep(f"again {key}", fault | _visited(done[key], out) | {"by": SEEDS[-1]})


def _has_screened(seed: int, out: Path) -> bool:
    """Screens the next parameters of a controller; False where none is left.

    Of the first of those that have had the fewest turns.
    """
    waiting = {c: parameters for c in CONTROLLERS_OF[seed] if (parameters := waiting_of(seed, c))}
    if not waiting:
        return False
    done = read_entries()
    turns = {c: len(entries_of(done, seed, c)) // TOGETHER[seed] for c in waiting}
    controller = min(waiting, key=lambda c: turns[c])
    name = f"sound_{controller}"
    if name not in done:
        (rows,) = _rows_of([sound_file(controller)], out / controller, FIRST_SEEDS, ())
        keep(name, sorted(s.value for s in seen_in(rows, share=1e-9)))
    _screen(seed, controller, waiting[controller][: TOGETHER[seed]], out / controller)
    return True


def _screen(
    seed: int, controller: str, parameters: list[tuple[str, Any, bool]], folder: Path
) -> None:
    """Takes some parameters: one seed of the strongest fault of each, then what that leaves."""
    sound = set(read_entries()[f"sound_{controller}"])
    strengths = {place: _strengths(controller, place, *rest) for place, *rest in parameters}
    strongest = [faults[-1] for faults in strengths.values() if faults]
    files, names = [spoilt_file(fault) for fault in strongest], SCREENED_IN.get(seed, ())
    driven = _rows_of(files, folder, 1, names)
    new = {f.place: _new(rows, sound) for f, rows in zip(strongest, driven, strict=True)}
    for place, value, _ in parameters:
        faults, key = strengths[place], f"{seed} {controller} {place}"
        entry = {"controller": controller, "place": place, "sound": value, "harmful": []}
        if not faults:
            entry |= {"spoilt": None, "refused": True}
        elif not new[place]:
            entry |= {"spoilt": faults[-1].spoilt}
        else:
            entry |= _mildest(faults, folder, sound, seed)
        keep(key, entry)
        print(key, entry, flush=True)


def _strengths(controller: str, place: str, value: Any, is_up: bool) -> list[Fault]:
    """Returns the faults of a parameter that the file's reader takes, the mildest first."""
    faults = (spoilt_by(controller, place, value, is_up, factor) for factor in (MILD, STRONG))
    return [f for f in dict.fromkeys(faults) if f.spoilt != value and is_read(f) and _is_taken(f)]


def _is_taken(fault: Fault) -> bool:
    """Tells whether the controller takes a fault's value; MPPI refuses a `model_dt` of 5 ms."""
    with tempfile.TemporaryDirectory() as folder:
        patient, driver = patient_and_driver(spoilt_file(fault), Path(folder))
        columns = patient.columns()
        probes = probes_for(columns.setup.robot, 0.3, seed=0)
        try:
            driver.check(patient.chosen(columns), [probes["door_rough"]], seed=0)
        except InputError:
            return False
    return True


def _mildest(faults: list[Fault], folder: Path, sound: set[str], seed: int) -> dict[str, Any]:
    """Returns the mildest strength that does harm, and the harm."""
    for fault in faults:
        names = SCREENED_IN.get(seed, ())
        (rows,) = _rows_of([spoilt_file(fault)], folder, LOOKS[seed], names)
        new = _new(rows, sound)
        if new and seed >= CONFIRMED_FROM:
            new = _confirmed(fault, new, rows, folder, CONFIRMING[seed])
        if new:
            return {"spoilt": fault.spoilt, "harmful": new}
    return {"spoilt": faults[-1].spoilt}


def _confirmed(
    fault: Fault, new: list[str], rows: list[Row], folder: Path, trials: int
) -> list[str]:
    """Returns the new symptoms that further seeds confirm and the sound file does not show."""
    names = {name for s, several in seen_in(rows).items() if s.value in new for name in several}
    probes = tuple(name for name in SIX_PROBES if name in names)
    files = [spoilt_file(fault), sound_file(fault.controller)]
    spoilt, sound = _rows_of(files, folder, trials, probes)
    sure = seen_in(spoilt, share=CONFIRMED_SHARE)
    sound_ones = {s.value for s in seen_in(sound, share=1e-9)}
    return [name for name in new if name in {s.value for s in sure} - sound_ones]


def _new(rows: list[Row], sound: set[str]) -> list[str]:
    """Returns the symptoms that the sound file has not, that of most trials first."""
    seen = seen_in(rows)
    new = [s for s in BY_WEIGHT if s in seen and s.value not in sound]
    return [s.value for s in sorted(new, key=lambda s: -sum(shows(row, s) for row in rows))]


def _rows_of(
    files: list[dict[str, Any]], folder: Path, seeds: int, names: tuple[str, ...]
) -> list[list[Row]]:
    """Returns the rows of several files, each driven through the named probes, else through all.

    Files of one size and speed have the same probes and are driven in one batch.
    """
    found: dict[int, list[Row]] = {}
    batches: dict[Any, list[int]] = {}
    columns, probes = [], []
    for index, file in enumerate(files):
        patient, driver = patient_and_driver(file, folder)
        own = patient.columns()
        robot = own.setup.robot
        speed_mps = speed_asked(patient.facts(), robot)
        columns.append(patient.chosen(own))
        own_probes = probes_for(robot, speed_mps, seed=0)
        probes.append([own_probes[name] for name in names or own_probes])
        batches.setdefault((speed_mps, robot.radii), []).append(index)
    for indices in batches.values():
        own_columns = [columns[index] for index in indices]
        rows = driver.drive_together(own_columns, probes[indices[0]], seeds, seed=0)
        found |= dict(zip(indices, rows, strict=True))
    return [found[index] for index in range(len(files))]


def _has_visited(seed: int, out: Path) -> bool:
    """Visits the next harmful fault; False where none is left.

    A visit has the journal of the census, whose trials of this file are those of the first look.
    """
    key = next(
        (key for key in in_turn(read_entries(), seed) if "first" not in read_entries()[key]), None
    )
    if key is None:
        return False
    entry = read_entries()[key]
    entry |= _visited(entry, out)
    keep(key, entry)
    print(key, entry, flush=True)
    return True


def _visited(entry: dict[str, Any], out: Path) -> dict[str, Any]:
    """Returns the scores of a visit of a harmful fault."""
    fault = fault_of(entry)
    return visited_by(fault, Symptom(entry["harmful"][0]), out / fault.controller)


def main() -> None:
    """Runs the step of the study that the command line names."""
    steps = {
        "census": census, "visit": visit_all, "both": census_and_visits, "again": visit_again,
    }  # fmt: skip
    parser = argparse.ArgumentParser(description="Planted faults that do harm.")
    parser.add_argument("step", choices=steps)
    parser.add_argument("folder", type=Path, help="for files and trials")
    parser.add_argument("seed", type=int, nargs="?", choices=SEEDS, default=SEEDS[0])
    arguments = parser.parse_args()
    steps[arguments.step](arguments.seed, arguments.folder)


if __name__ == "__main__":
    main()
