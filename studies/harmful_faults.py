"""Planted faults that do harm: does the doctor's experiment find them and take the harm away?

    python studies/harmful_faults.py census DIR    which faults do harm, and how strong they must be
    python studies/harmful_faults.py visit DIR     whole visits of the harmful ones
    python studies/harmful_faults.py both DIR 2032 in turn: some of the census, then the visits
    python studies/planted_faults_page.py          docs/doctor_planted_faults.md

All go on where they were stopped. Of 14 faults of `planted_faults.py` that were driven 13 did no
harm in any probe, so here a fault is made stronger until it does. Written before anything was
driven:

- *Draw.* Of the sound files of RPP, DWB and Graceful; seed 2031 also of MPPI and TEB. A seed
  orders all numbers and switches of a file and draws a coin for each number's direction.
  Parameters are taken in this order.
- *Strength.* A number is multiplied by 10 or 1/10, as the coin says; a switch is turned round; what
  the file's reader refuses is passed over. Where one seed of each probe shows no symptom that the
  sound file does not show, the parameter counts as harmless and nothing more of it is driven. Else
  it is multiplied by 3 or 1/3 and, where that does no harm, by 10 or 1/10.
- *Harmful* is a strength at which at least half of the two trials of a probe show a symptom that
  none of the sound file's trials shows (as in `planted_faults_driven.py`). The mildest harmful
  strength is the fault.
- *Stop.* The census of a controller ends with the eight parameters that bring its sixth harmful
  fault (seed 2031: its fourth, since five controllers share the time), or with its last parameter;
  eight of each controller in turn, as many as the time allows. (In turn only after RPP's first 15;
  before, the controllers came one after the other.) With seed 2031 the faults that a turn has
  brought are visited before the next turn, and the end of the time, not an answer, ends the study.
  TEB was taken out when MPPI's first trials had shown what a trial costs, before one of TEB's.
- *Complaint.* The new symptom that most trials show; of several the weightiest. The doctor is given
  it as `--symptom` and no words. It does not know the sound file.
- *Order.* One of each controller in turn, as many as the time allows; none is left out after its
  answer is known. (MPPI's come last: decided when a trial's cost was known, and before the third
  fault of the seed was visited.) No budget in seconds, as there.
- *Scores* are those of `planted_faults_driven.py`: first, among, gone, nothing worse on further
  seeds, the first suspect by reading, and the value farthest from Nav2's default. *Chance* is any
  parameter of the file and a coin for its direction, as an expected value.
- *Rounds.* The doctor as it is at the draw is scored with seed 2030. If it is changed because of
  these answers, the changed doctor is scored with the seed 2031, whose faults are drawn alike, and
  both scores are published; of 2031 a parameter that is harmful in 2030 too is passed over. The
  doctor of 2031 is the one that tries Nav2's own value as a third step; it is not changed while
  it is scored.
- *Seed 2032*, written before any of its faults was read or driven, for the doctor as it is in the
  commit that adds this. All five controllers in turn. A turn takes four parameters of one of them;
  after it one fault is visited, if any waits. A controller's census ends with the turn that brings
  its third harmful fault. One seed of six probes decides, since nearly all harm of seed 2031 shows
  in these: the fault is the mildest strength whose trials show a symptom that none of the sound
  file's two trials of each probe shows. A visit has all probes; it goes on from these trials,
  which are its first look's, too. Aim: twelve visits. The end of the time, not an answer, ends the
  study. A parameter that was harmful in 2030 or 2031 is passed over. If the doctor is changed
  after the first answer, these faults are spent. *Without skill* the answers are those of the
  other seeds: the value farthest from Nav2's default (right in 9 of the 24 harmful faults so far),
  and chance (about 1%). *A crash* would look so: the command ends with the program's message, and
  the fault counts as missed in every row; a single trial that fails is neither a symptom nor a
  cure.
- *Slip*: the census of 2033 ended at MPPI's `model_dt` of 5 ms, which the file's reader takes and
  the controller refuses. Since then such a value counts as refused, too.
- *Seed 2033*, written before any of its faults was read or driven, for the doctor of the commit
  that adds this: it sets the abnormal values of a file back to Nav2's before all, if these are
  three at most, and names such a change before others that take the symptom away as well. Draw,
  strength, harm, order, scores and stop are those of 2032; what was harmful in an earlier draw is
  passed over. Aim: twelve visits, until about 08:00 of the day. The change was made with the 31
  harmful faults of the earlier draws known: in 30 of these the way back is among the values that
  come first, in 29 it is the likeliest of them. A sound file has one abnormal value at most (TEB:
  its weight of forward drive), so such faults are easy to see, and a further answer *without
  skill* is published: the likeliest abnormal value, nothing driven. What the scores say holds for
  files close to Nav2's: of 111 public files with a known cure 5 have three abnormal values or
  fewer, and the others are treated as before.

- *Seed 2034*, and 2035 if time is left, written before any of their faults was read or driven, for
  the doctor of the commit that adds this. What was changed, with the misses of 2030 to 2033 and the
  parameters of all sound files known, but not the draw: (a) a DWB limit of motion has no usual
  value of 0, so one that is too low has a way back; (b) speeds that contradict each other in the
  file have ways out to both sides, not only downwards; (c) a number that differs between the two
  costmaps is set to that of the other one, in each; (d) if fewer than three values are abnormal,
  limits of motion and ranges 2.5 times off follow; (e) of several changes that take the symptom
  away, all are judged on all probes, and one that leaves two symptoms fewer than another goes
  first: what only makes up for a fault leaves the fault's other symptoms; (f) who still nears its
  goal at half of its speed when a probe ends, is not stuck: a cure that lowers the speed was held
  against it; (g) costmap outlines are tried where the robot's body is known from elsewhere (not
  here: the robot is a built-in one). Counted over all numbers and switches of the sound files at
  both strengths and in both directions, the way back is now among the first changes for 192 of 212
  of RPP (151 before), 233 of 244 of DWB (191) and 171 of 183 of Graceful (136); most of the others
  nothing reads.
  *The census* is that of 2033, with one step more, since chance was taken for harm in 2032: a
  probe that shows the new symptom is driven with two further seeds, in the spoilt and in the sound
  file; the fault is harmful if at least two of the three spoilt trials show it and none of the
  sound ones. A controller's census ends with its sixth harmful fault. Aim: twenty visits, until
  about 14:45 of the day. The end of the time ends the study.
  *Expected*: first 80% or more, gone 85% or more, of these nothing worse 90% or more. The method
  without skill that does best should be the likeliest abnormal value, with some 75%; if that has as
  many as the doctor, driving adds nothing here. (e) should decide in few visits. If first is below
  65%, the changes are no good.

- *2031, gone on with*, written before any of these visits was driven, at 14:25 of the day of
  2034: so many others use the computer that the first visit of 2034, one of MPPI, takes most of
  an hour, and few would be left. Twelve harmful faults of 2031 were found but never visited: nine
  of RPP, DWB and Graceful, whose trials take a fifth of MPPI's. The doctor of 2034, unchanged,
  visits these in the order of 2031 until about 14:48. They are not blind as those of 2034 are:
  that they do harm was known when the doctor was changed, and three of them made it try critics'
  switches and limits of motion before 2032. What a visit of them ends in was not known. They are
  told apart in the tables. *Expected*: first in 7 of 9, gone in 7 of 9.

- *2034 and 2035, by the doctor that ends rare symptoms early*, written before this doctor was
  driven, and before anything of 2035 was read or driven. What is changed: (a) before any change is
  tried, the unchanged file is driven alone on the search's own seeds, 12 trials, and 24 if too few
  of these have any of the symptom. 13 pairs must fall for a change to be shown, of 48 at most: if
  fewer than 13 of 48 trials should have it by what was driven, none is tried, and the visit ends
  with the words that the symptom is too rare. (b) Of the probes that show the symptom those that
  show it in every trial of the first look are raced on alone, if there are any; the judgement has
  all of them, as before. (c) The first look at a change lasts until two pairs have the symptom. (d)
  A change that takes it away and leaves at most one trial with any symptom is offered without a
  judgement of others, which could not be offered before it. Known then: all visits of 2030 to 2034,
  by whose journals (a) and (b) were chosen.
  *2034.* Two faults of MPPI wait. Of `cost_power` the first look and 24 trials of the search were
  known (15 have some of the symptom, 5 above its bar), so it is not blind. `time_steps` is blind,
  but one of its trials takes some fifteen times as long as one of RPP: it is visited last, if there
  is time. The census of 2034 is not gone on with.
  *2035.* Draw, strength, harm, order and scores are those of 2034, of RPP, DWB and Graceful alone,
  since a visit of MPPI takes as long as four of theirs: no goal is judged for MPPI and TEB. In turn
  a step of the census and a visit, until 18:15 of the day; the end of the time ends it.
  *A symptom that is called too rare* counts as a miss in every row, and the table says so.
  *Expected*: of 2035 first 70%, gone 75%, of these nothing worse 90%, a fifth called too rare; a
  visit drives 100 trials or fewer (2033: 110). The likeliest abnormal value alone should have 70%.
  If the doctor is not above it, driving adds nothing on these files.

- *Seed 2036, and 2037 if time is left*, written before any of their faults was read or driven, for
  the doctor of the commit that adds this. Draw, strength, harm, order, controllers and scores are
  those of 2035; a step of the census and a visit in turn, until 21:35 of the day; the end of the
  time ends it. What is changed: until 2035 the cause of the change that is offered was called the
  first. Now the *likeliest cause* is told apart from the *change offered*. It is the first of the
  causes that were shown, in this order: what fresh seeds refute comes last; what takes the symptom
  away comes before what leaves some of it; then by reading: first the ways back to Nav2's value of
  at most three abnormal values, then by score, in which the rules that fired, the symptom's
  frequent causes and the value against the range of working robots count. What is driven, judged
  and offered is unchanged. Where a change of another parameter takes the symptom away as well, the
  verdict says that driving cannot tell the two apart.
  *Scores*: "first" is now the likeliest cause, which the doctor states; the cause of the change
  offered, "first" until 2035, has a row of its own; so have faults of which driving cannot tell the
  first cause from another parameter. This bounds what driving alone can find.
  *In journals of earlier visits*, whose answers were known: six can be replayed to their end (2031:
  two of RPP, with 40 further trials; 2033: one; 2035: three). The new rule is right in 6 of 6, the
  old one in 5; driving cannot tell the first from another parameter in 2 of the 6. Of the other
  five misses of 2030 to 2035 in which another change takes the symptom away it would mend those two
  in which the way back was shown (2032, both of Graceful).
  *Expected*: likeliest cause 80%, cause of the change offered 70%, gone 80%, of these nothing worse
  90%; likeliest abnormal value alone 80%; a third that driving cannot tell apart. If the likeliest
  cause is right less often than that of the change offered, the new rule is no good.

- *2035 and 2031, gone on with*, written at 20:50 of the day of 2036, before any of these visits was
  driven, and with one answer of 2036 known, a miss: of the first 28 parameters of 2036 one does
  harm (of earlier draws one in four), so that the census takes the time of the visits. Harmful
  faults of RPP, DWB and Graceful that were found earlier wait for a visit: one of 2035, eight of
  2031. The doctor of 2036, unchanged, visits these, 2035's first, then those of 2031 in their
  order, until 21:35; then 2036 goes on, if there is time. That they do harm was known when the
  doctors before this one were changed; three of them made it try critics' switches and limits of
  motion. What a visit ends in is not known but for the first of 2031, DWB's `PathDist.scale`, which
  journals show to be too rare. It is visited in its turn and counts as a miss. First looks come
  from the journals of then. They are told apart in the tables. *Expected*: likeliest cause 65%,
  gone 65%, of these nothing worse 90%.

- *Seed 2037, and 2031 gone on with*, written before anything of 2037 was read or driven, for the
  doctor of the commit that adds this. Draw, strength, harm, order, controllers and scores are those
  of 2036. What is changed since 2036, none of it for an answer to these faults: cures of rules have
  the value that quiets the rule, or both sides of a window; two rules more (RPP's carrot within the
  goal's tolerance, DWB's RotateToGoal that looks ahead); the verdict names a likelier change that
  could not be driven. After each step of the census a fault of 2037 is visited; while none waits,
  so that the time goes to visits, the next of 2031 (of DWB four wait, then MPPI's). These are not
  blind as those of 2037 are and are told apart, as before. One worker on one core, until 01:10 of
  the day; the end of the time ends it. *Expected*: of both together likeliest cause 65%, gone 65%,
  of these nothing worse 90%; the likeliest abnormal value alone 75%; three to six visits, so that
  no goal is shown or refuted.
- *Seed 2038*, written before anything of it was read or driven, for the doctor of the commit that
  adds this: draw, order, controllers and scores are those of 2037. The census confirms with six
  trials in place of three, of which four must show the symptom: what one trial in eight shows, as
  with 2031's `PathDist.scale`, passes two of three in 4% and four of six in 0.3%.
  *What fails, by mechanism, in the 32 visits so far*: of eleven first causes that were missed five
  had a rival that takes the symptom away as well, three a way back that was no value to try, two a
  way back that the probes could not drive, one was too rare. Rivals are ordered by reading since
  2036 and values mended since 2033. Left are: (1) what a fault hides, held against the way back: in
  two of the three that got worse the way back itself "brings" near misses that the sound file has,
  since the spoilt robot did not get so far. (2) a speed that the file asks for is the limit of the
  probes' base, though the robot's own file gives more.
  *What is changed*, for a reason that holds for any file: (1) a trial that ends early before the
  change (a touch, no start, given up, stuck) may miss what would follow, so symptoms of the way are
  not compared there, only told. Ends are: to be stuck in place of giving up is still worse, and a
  further touch always is. This is what the search has done the other way round since 2031. (2) a
  change may ask for a speed that the robot's own file gives. (3) detectors: corner cutting is
  measured against the robot's half width, stop and start counts slow-downs without a stop, too.
  Values of just 0.4 times Nav2's are far no more.
  *Scores*: "nothing else is worse" stays the strict one, of all trials but those with a touch
  before. A further row compares with the sound file on the same seeds: what the cured file shows in
  two more trials than the sound one (a touch: one more).
  After each step of the census a fault is visited; while none waits, the census goes on. One
  worker, until 04:35 of the day; the end of the time ends it. Faults of earlier draws that wait are
  not visited. *Expected*: first 75%, gone 80%, of these nothing worse 90%, nothing worse than in
  the sound file 95%; the likeliest abnormal value alone 75%; four to eight visits, so that no goal
  is shown or refuted.

- *Seed 2039*, written before anything of it was driven, for the doctor of the commit that adds
  this. Draw, strength, census, order, controllers and scores are those of 2038, but: (a) a fault is
  passed over if an earlier draw found it harmful in the same direction, no longer in either; (b) or
  if an earlier draw's same six trials found its strongest form harmless. 98 faults are left.
  *What is changed in the doctor*: of the values set back first the likeliest by both its
  abnormality and the symptom comes first (before, by the symptom alone), and of two values at odds
  the one that is not Nav2's; changes to try, where none is shown, count abnormal values as well.
  Today's doctor, unchanged, was driven again on four earlier misses (2032, 2035, 2036): the first
  cause is right in all four, so these classes were mended before. By reading alone the way back
  stands first in 43 of the 45 known faults (40 before the change).
  *A further score*, "named": the first cause shown or, where none is, the first change to try.
  One worker on one core of a busy computer, a step of the census and a visit in turn, then what
  waits, until 03:17 of the day; the end of the time ends it, no answer does. A visit that the end
  cuts off does not count. *Expected*: first 85%, gone 90%, of these nothing worse 85%, as in the
  sound file 95%; the likeliest abnormal value alone 85%.

Unit: one fault, which is one file. Intervals are Wilson's, 95%. Faults of one controller share
their sound file, so they are less apart than the intervals suppose.
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
    fault = fault_of(entry)
    entry |= visited_by(fault, Symptom(entry["harmful"][0]), out / fault.controller)
    keep(key, entry)
    print(key, entry, flush=True)
    return True


def main() -> None:
    """Runs the step of the study that the command line names."""
    steps = {"census": census, "visit": visit_all, "both": census_and_visits}
    parser = argparse.ArgumentParser(description="Planted faults that do harm.")
    parser.add_argument("step", choices=steps)
    parser.add_argument("folder", type=Path, help="for files and trials")
    parser.add_argument("seed", type=int, nargs="?", choices=SEEDS, default=SEEDS[0])
    arguments = parser.parse_args()
    steps[arguments.step](arguments.seed, arguments.folder)


if __name__ == "__main__":
    main()
