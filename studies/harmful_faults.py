"""Planted faults that do harm: does the doctor's experiment find them and take the harm away?

    python studies/harmful_faults.py drive DIR --until 12:30    in turn: some of the census, visits
    python studies/harmful_faults.py again DIR    the misses, by today's doctor
    python studies/harmful_faults.py sound DIR    the good files alone, four seeds of each probe
    python studies/planted_faults_page.py         docs/doctor_planted_faults.md

`drive` goes on where it was stopped. Unit: one fault, which is one file. The rules of each of the
three draws, of seeds 2040, 2041 and 2042, were written and the doctor was frozen before a fault of
it was driven. Between them the doctor learnt from the misses. For all three:

- *Files.* `good_file` for a base (`planted_base.yaml`), tested in all probes: no touch, no near
  miss. TEB is left out: a trial of it takes five times as long.
- *Draw.* The seed orders all numbers and switches of each file and draws a coin for each number's
  direction.
- *Strength.* A number times 3 or 1/3, as the coin says, and where that does no harm times 10 or
  1/10; a switch is turned round; what the file's reader or the controller refuses is passed over.
- *Harmful* is the mildest strength with which a trial of one of six probes shows a symptom that no
  trial of the sound file shows (all probes), confirmed by six further seeds of at most two of the
  probes that show it: with the fault at least four of a probe's trials have it, without none. The
  strongest form is driven first, with one seed; if it does no harm, no other one is.
- *Complaint.* The confirmed symptom that most trials show; of several the weightiest. The doctor is
  given it as `--symptom`, no words and no budget in seconds. It does not know the sound file.
- *Order.* Of the controllers the one with the fewest turns is next, at first in the order of
  `CONTROLLERS`; a turn of DWB or MPPI, whose trials take thrice as long, counts as two. A turn is
  the census of the next four parameters, then a visit of each of them that does harm. None is left
  out after its answer is known, and no answer ends the drive: no turn and no visit begins after a
  time of the day written before; one that was begun is finished.
- *Scores.* *First*: the likeliest cause of those that were shown is the spoilt parameter, in the
  direction back. *Among*: any shown one is. *Named*: the first cause shown or, where none is, the
  first change to try. *Gone*: a change is offered whose fresh trials show the symptom at most half
  as often. *Nothing worse*: of these, on two further seeds of all probes no symptom in two more
  trials, no touch in one more, than before the change, also where the spoilt robot did not come;
  and a row that compares with the sound file. A symptom that is called too rare, and a visit that
  ends with an error, count as misses.
- *No skill*: the likeliest abnormal value, nothing driven; the controller's value farthest from
  Nav2's default; any parameter with a coin for its direction, as an expected value. If the first of
  these is as often right as the doctor, driving finds no more causes: it shows that one is right.
- *Blind* is every visit: the doctor is not changed until the drives end.

Of 2042 alone: seven files for a base of 0.6 x 0.45 m and 0.7 m/s on which nothing was driven
before, of Regulated Pure Pursuit, DWB, Graceful, MPPI, Vector Pursuit, and a rotation shim with
Regulated Pure Pursuit or DWB. In four seeds of all probes, 68 trials, Graceful's file shows
nothing; the others swing in the rough door in one or two, and DWB's turns late in one. No parameter
is passed over; a row counts the faults whose parameter and direction no visit of the two draws
before had. No turn and no visit begins after 12:30 UTC of 30 November 2026. *Expected*, written
before: 35 visits; first 88%, gone 88%, of these nothing worse 93%, as in the sound file 98%; the
likeliest abnormal value alone 78%, the farthest value 35%.

The rules of 2040 and 2041 alone, their five files for a round base of 0.2 m, and the ten draws of
2030 to 2039 in files for the TurtleBot 4 are in the history of this file; all their visits are in
`harmful_faults.json`.

Intervals are Wilson's, 95%. Faults of one controller share their sound file, so they are less apart
than the intervals suppose.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from harmful_visits import patient_and_driver, visited_by
from planted_faults import Fault, spoilt_file, spoilt_value
from sound_files import HERE, candidates, good_file

from drake_navbench.errors import InputError
from drake_navbench.studies.doctor.driving import Row, shows
from drake_navbench.studies.doctor.files import speed_asked
from drake_navbench.studies.doctor.first_look import seen_in
from drake_navbench.studies.doctor.probes import probes_for
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.visit import BY_WEIGHT

DRIVEN = HERE / "harmful_faults.json"
# The seeds of the draws; the last one is driven.
DRAWS = (2040, 2041, 2042)
SEED = DRAWS[-1]
# In the order of the turns; a controller's place in it is part of its draw.
CONTROLLERS = ("rpp", "dwb", "graceful", "mppi", "vector_pursuit", "shim", "shim_dwb")
# How many turns one of a controller counts as, where not one.
TURN = {"dwb": 2, "mppi": 2, "shim_dwb": 2}
# Parameters that are screened in one batch, which is a turn.
TOGETHER = 4
# The probes by which a fault is found harmful.
SIX_PROBES = (
    "door_rough", "right_angle", "box_on_path", "person_crossing", "closed_way", "exact_heading",
)  # fmt: skip
# Harm is confirmed in at most so many probes by so many trials, of which this share show it.
CONFIRMED_IN, CONFIRMING, CONFIRMED_SHARE = 2, 6, 0.6
MILD, STRONG = 3.0, 10.0
# Trials of each probe of a sound file.
SOUND_SEEDS = 4

# The fields of an entry that its visits share.
OF_A_FAULT = ("controller", "place", "sound", "spoilt", "harmful")

Parameter = tuple[str, Any, bool]


def drive(out: Path, until: str) -> None:
    """Takes turns, each a part of the census and its visits, until a time of the day, UTC."""
    while not _is_over(until):
        done = read_entries()
        if (waiting := next(waiting_visits(done), None)) is not None:
            key, entry = waiting
            print("visiting", key, flush=True)
            keep(key, entry | _visited(entry, out))
        elif (controller := next_controller(done)) is not None:
            _screen(controller, parameters_left(done, controller)[:TOGETHER], out)
        else:
            return


def visit_again(out: Path) -> None:
    """Visits the misses by today's doctor, which has learnt from them: no score of the draw."""
    for key, entry in read_entries().items():
        if key.startswith(f"{SEED} ") and "first" in entry and is_missed(entry):
            fault = {name: entry[name] for name in OF_A_FAULT}
            keep(f"again {key}", fault | _visited(entry, out))


def is_missed(entry: Mapping[str, Any]) -> bool:
    """Tells whether a visit misses a goal."""
    return not entry["first"] or not entry["gone"] or bool(entry.get("worse"))


def _time_of_day(text: str) -> str:
    """Returns a time of the day, 'HH:MM'; raises ArgumentTypeError where a text is none."""
    try:
        return f"{datetime.strptime(text, '%H:%M'):%H:%M}"
    except ValueError:
        raise argparse.ArgumentTypeError(f"got {text!r}, expected a time such as 09:30") from None


def _is_over(until: str) -> bool:
    return datetime.now(UTC).strftime("%H:%M") >= until


def in_draw_order(controller: str) -> list[Parameter]:
    """Returns place, value and direction (up or not) of a file's parameters, in drawn order."""
    generator = np.random.default_rng([SEED, CONTROLLERS.index(controller)])
    choices = candidates(good_file(controller))
    order = generator.permutation(len(choices))
    coins = generator.integers(0, 2, len(choices))
    return [(*choices[int(i)], bool(coin)) for i, coin in zip(order, coins, strict=True)]


def parameters_left(done: Mapping[str, Any], controller: str) -> list[Parameter]:
    """Returns the parameters that the census of a controller has still to take."""
    order = in_draw_order(controller)
    return [p for p in order if f"{SEED} {controller} {p[0]}" not in done]


def next_controller(done: Mapping[str, Any]) -> str | None:
    """Returns the controller that has had the fewest turns; None if all faults are screened."""
    left = [c for c in CONTROLLERS if parameters_left(done, c)]
    screened = {c: sum(key.startswith(f"{SEED} {c} ") for key in done) for c in left}
    return min(left, key=lambda c: screened[c] // TOGETHER * TURN.get(c, 1), default=None)


def waiting_visits(done: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yields the harmful faults that were not visited, in the order in which they were found."""
    for key, entry in done.items():
        if key.startswith(f"{SEED} ") and entry["harmful"] and "first" not in entry:
            yield key, entry


def _visited(entry: dict[str, Any], out: Path) -> dict[str, Any]:
    """Returns the scores of a visit; one that ends with an error is a miss."""
    fault = Fault(entry["controller"], entry["place"], entry["sound"], entry["spoilt"])
    try:
        return visited_by(fault, Symptom(entry["harmful"][0]), out / fault.controller)
    except Exception as error:
        return {"first": False, "among": False, "gone": False, "error": repr(error)}


def _screen(controller: str, parameters: list[Parameter], out: Path) -> None:
    """Takes some parameters: one seed of the strongest fault of each, then what that leaves."""
    folder, name = out / controller, f"sound {SEED} {controller}"
    if name not in read_entries():
        (rows,) = _rows_of([good_file(controller)], folder, SOUND_SEEDS, ())
        keep(name, {"harmful": [], "shows": sorted(s.value for s in seen_in(rows, share=1e-9))})
    sound = set(read_entries()[name]["shows"])
    strengths = {place: _strengths(controller, place, *rest) for place, *rest in parameters}
    strongest = [faults[-1] for faults in strengths.values() if faults]
    driven = _rows_of([_file_of(fault) for fault in strongest], folder, 1, SIX_PROBES)
    new = {f.place: _new(rows, sound) for f, rows in zip(strongest, driven, strict=True)}
    for place, value, _ in parameters:
        faults, key = strengths[place], f"{SEED} {controller} {place}"
        entry = {"controller": controller, "place": place, "sound": value, "harmful": []}
        if not faults:
            entry |= {"spoilt": None, "refused": True}
        elif not new[place]:
            entry |= {"spoilt": faults[-1].spoilt}
        else:
            entry |= _mildest(faults, folder, sound)
        keep(key, entry)
        print(key, entry, flush=True)


def _file_of(fault: Fault) -> dict[str, dict[str, Any]]:
    return spoilt_file(fault, good_file(fault.controller))


def _strengths(controller: str, place: str, value: Any, is_up: bool) -> list[Fault]:
    """Returns the faults of a parameter that reader and controller take, the mildest first."""
    factors = [factor if is_up else 1.0 / factor for factor in (MILD, STRONG)]
    faults = (Fault(controller, place, value, spoilt_value(value, f)) for f in factors)
    return [f for f in dict.fromkeys(faults) if f.spoilt != value and _is_taken(f)]


def _is_taken(fault: Fault) -> bool:
    """Tells whether reader and controller take a fault's value; MPPI refuses some `model_dt`."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            patient, driver = patient_and_driver(_file_of(fault), Path(folder))
            patient.facts()
            columns = patient.columns()
            probes = probes_for(columns.setup.robot, 0.3, seed=0)
            driver.check(patient.chosen(columns), [probes["door_rough"]], seed=0)
        except InputError:
            return False
    return True


def _mildest(faults: list[Fault], folder: Path, sound: set[str]) -> dict[str, Any]:
    """Returns the mildest strength that does harm, and the harm."""
    for fault in faults:
        (rows,) = _rows_of([_file_of(fault)], folder, 1, SIX_PROBES)
        new = _new(rows, sound)
        if new and (confirmed := _confirmed(fault, new, rows, folder)):
            return {"spoilt": fault.spoilt, "harmful": confirmed}
    return {"spoilt": faults[-1].spoilt}


def _confirmed(fault: Fault, new: list[str], rows: list[Row], folder: Path) -> list[str]:
    """Returns the new symptoms that further seeds confirm and the sound file does not show.

    In the probes that show most of the new symptoms.
    """
    shown = [name for s, several in seen_in(rows).items() if s.value in new for name in several]
    names = sorted(set(shown), key=lambda name: (-shown.count(name), SIX_PROBES.index(name)))
    files = [_file_of(fault), good_file(fault.controller)]
    # The first seed was driven before: it has chosen the fault.
    both = _rows_of(files, folder, CONFIRMING, tuple(names[:CONFIRMED_IN]), seed=1)
    sure = {s.value for s in seen_in(both[0], share=CONFIRMED_SHARE)}
    sure -= {s.value for s in seen_in(both[1], share=1e-9)}
    return [name for name in _new(both[0], set()) if name in new and name in sure]


def _new(rows: list[Row], sound: set[str]) -> list[str]:
    """Returns the symptoms that the sound file has not, that of most trials first."""
    seen = seen_in(rows, share=1e-9)
    new = [s for s in BY_WEIGHT if s in seen and s.value not in sound]
    return [s.value for s in sorted(new, key=lambda s: -sum(shows(row, s) for row in rows))]


def _rows_of(
    files: list[dict[str, Any]], folder: Path, seeds: int, names: tuple[str, ...], *, seed: int = 0
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
        rows = driver.drive_together(own_columns, probes[indices[0]], seeds, seed=seed)
        found |= dict(zip(indices, rows, strict=True))
    return [found[index] for index in range(len(files))]


def print_sound(out: Path) -> None:
    """Prints the symptoms that each good file shows, and in how many trials."""
    for controller in CONTROLLERS:
        (rows,) = _rows_of([good_file(controller)], out / controller, SOUND_SEEDS, ())
        seen = [f"{s} {sum(shows(r, s) for r in rows)}" for s in seen_in(rows, share=1e-9)]
        print(f"{controller}: {len(rows)} trials; {', '.join(seen) or 'no symptom'}", flush=True)


def read_entries() -> dict[str, Any]:
    done: dict[str, Any] = json.loads(DRIVEN.read_text()) if DRIVEN.exists() else {}
    return done


def keep(key: str, entry: Any) -> None:
    """Adds an entry to the file."""
    done = read_entries() | {key: entry}
    DRIVEN.write_text(json.dumps(done, indent=1) + "\n", encoding="utf-8")


def main() -> None:
    """Runs the step of the study that the command line names."""
    parser = argparse.ArgumentParser(description="Planted faults that do harm.")
    parser.add_argument("step", choices=("drive", "again", "sound"))
    parser.add_argument("folder", type=Path, help="for files and trials")
    parser.add_argument(
        "--until", type=_time_of_day, default="23:59", help="no turn begins after it, UTC"
    )
    arguments = parser.parse_args()
    if arguments.step == "drive":
        drive(arguments.folder, arguments.until)
    elif arguments.step == "again":
        visit_again(arguments.folder)
    else:
        print_sound(arguments.folder)


if __name__ == "__main__":
    main()
