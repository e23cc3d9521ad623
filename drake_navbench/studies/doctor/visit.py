"""A whole visit: read, drive the probes, try the causes, judge the change."""

from __future__ import annotations

from collections.abc import Sequence

from drake_navbench.studies.doctor.alike import Told
from drake_navbench.studies.doctor.candidates import BEYOND, HALF
from drake_navbench.studies.doctor.change import judge, trials_to_judge
from drake_navbench.studies.doctor.complaints import symptoms_told
from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.differences import ways_back, with_differences
from drake_navbench.studies.doctor.driven_on import driven_on
from drake_navbench.studies.doctor.driving import (
    SEARCH_SEED,
    Driver,
    OutOfTime,
    probe_of,
)
from drake_navbench.studies.doctor.experiment import Experiment
from drake_navbench.studies.doctor.files import Patient, speed_asked
from drake_navbench.studies.doctor.first_look import (
    FIRST_SEEDS,
    KEPT_SHARE,
    first_look,
    seen_in,
)
from drake_navbench.studies.doctor.offers import REPLAY_TRIALS, note_offers
from drake_navbench.studies.doctor.probes import MADE_FOR, probes_for
from drake_navbench.studies.doctor.reading import asked_about, findings_of, suspicions_of
from drake_navbench.studies.doctor.surroundings import Surroundings
from drake_navbench.studies.doctor.symptoms import MILDER, Symptom
from drake_navbench.studies.doctor.told import told_blindness
from drake_navbench.studies.doctor.tried import Tried
from drake_navbench.studies.doctor.visited import Visit

# The search keeps the time of one judgement and of the replays, but at most this share of what is
# left.
MOST_KEPT_SHARE = 0.4
# Who complains of a symptom has seen it, on a robot that may lag and slip more than the one of the
# probes: a severity above this share of the threshold is then a weak sign of it.
WEAK = 0.5
# The classes of a user's words, the likeliest, that are treated first where none was asked for.
MOST_TOLD = 3
# The causes of a symptom are tried on at most this many probes.
MOST_SHOWING = 3
# If several symptoms are seen, these are treated first.
BY_WEIGHT = (
    Symptom.COLLISION,
    Symptom.NO_START,
    Symptom.FALSE_ABORT,
    Symptom.NO_RECOVERY,
    Symptom.GOAL_NOT_REACHED,
    Symptom.SPINS,
    Symptom.NO_TURNING,
    Symptom.DOOR_STOP,
    Symptom.STALL_BEFORE_GOAL,
    Symptom.GOAL_OVERSHOOT,
    Symptom.GOAL_OSCILLATION,
    Symptom.WOBBLE_STRAIGHT,
    Symptom.CORNER_CUTTING,
    Symptom.STOP_START_JERK,
    Symptom.NEAR_MISS,
    Symptom.TOO_SLOW,
    Symptom.REVERSE_FAILURE,
    Symptom.LATE_CYCLES,
    Symptom.GIVES_UP_LATE,
)


def visit(
    patient: Patient,
    asked: Symptom | None,
    told: Told,
    driver: Driver,
    *,
    seed: int,
    around: Surroundings | None = None,
    proposed: Sequence[Trial] = (),
) -> Visit:
    """Returns the findings of a visit; if it ends early, those up to then.

    around: the user's map, base and computer, with which the probes are driven. proposed: the
    user's own changes.
    """
    facts = patient.facts()
    found = Visit(facts, asked=asked, around=around or Surroundings(), proposed=proposed, seed=seed)
    found.findings = findings_of(facts)
    if asked is None:
        found.told = symptoms_told(told.words)[:MOST_TOLD]
    try:
        with driver.keeping(KEPT_SHARE * driver.budget_s):
            _look(found, patient, driver, seed=seed)
        _treat(found, patient, told, driver, seed=seed)
    except OutOfTime:
        found.is_out_of_time = True
    except KeyboardInterrupt:
        found.is_interrupted = True
    note_offers(found, patient, driver, _near(found))
    return found


def _look(found: Visit, patient: Patient, driver: Driver, *, seed: int) -> None:
    robot = patient.columns().setup.robot
    for line in told_blindness(found.facts):
        driver.tell(line)
    found.probes = probes_for(robot, speed_asked(found.facts, robot), found.around, seed=seed)
    found.look = first_look(patient, found.probes, _near(found), driver, seed=seed)
    found.rows, found.is_out_of_time = found.look.rows, not found.look.rows
    found.seen = seen_in(found.rows)


def _near(found: Visit) -> list[Symptom]:
    """Returns the symptoms for which a short first look looks first."""
    if found.asked is not None:
        return [s for s in (found.asked, MILDER.get(found.asked)) if s is not None]
    return [*found.told, *(symptom for finding in found.findings for symptom in finding.likely)]


def _treat(found: Visit, patient: Patient, told: Told, driver: Driver, *, seed: int) -> None:
    if found.asked is not None:
        _suspect(found, found.asked, told)
        # One trial that shows it is enough, and else a weak sign in half of a probe's trials.
        _see(found, found.asked, 1e-9, 1.0)
        if found.asked is Symptom.FALSE_ABORT and found.asked not in found.seen:
            with driver.keeping(KEPT_SHARE * driver.budget_s):
                _drive_on(found, patient, driver, seed=seed)
        _see(found, found.asked, 0.5, WEAK)
        milder = MILDER.get(found.asked)
        if milder is not None and found.asked not in found.seen:
            _see(found, milder, 0.5, WEAK)
    elif found.told and found.seen.keys().isdisjoint(found.told):
        _suspect(found, found.told[0], told)
    found.of_complaint = found.suspicions
    for symptom in _to_treat(found):
        found.treated = symptom
        showing = _most_severe(found, symptom)
        weak = "a weak sign of " if found.bar < 1.0 else ""
        driver.tell(f"{weak}{symptom} is seen in {', '.join(showing)}")
        if symptom is not found.complaint or not found.suspicions:
            _suspect(found, symptom, told)
        judging = trials_to_judge(len(showing), len(found.probes)) + REPLAY_TRIALS
        with driver.keeping(min(judging * driver.trial_s, MOST_KEPT_SHARE * driver.left_s)):
            experiment = _try_causes(found, patient, symptom, showing, driver, seed=seed)
        rarity = experiment.rarity
        if not rarity.is_rare:
            break
        found.rare[symptom] = rarity
        driver.tell(f"{symptom} is too rare: {rarity.shown} of {rarity.trials} trials have any")
    else:
        found.treated = next(iter(found.rare), None)
        return
    _judge(found, found.tried, patient, showing, driver, seed=seed)
    if found.cure is not None and not found.cure.worse:
        return
    priced = next((judged for judged in found.judged if judged.is_gone and judged.worse), None)
    if priced is not None and driver.left_s > 0.0:
        # Whoever touches has gone too far.
        shares = (HALF,) if Symptom.COLLISION in priced.worse else (BEYOND, HALF)
        further = experiment.further(priced.tried, shares)
        found.tried = [*found.tried, *further]
        _judge(found, further, patient, showing, driver, seed=seed)


def _judge(
    found: Visit,
    tried: Sequence[Tried],
    patient: Patient,
    showing: Sequence[str],
    driver: Driver,
    *,
    seed: int,
) -> None:
    """Judges the best of some changes for the treated symptom on fresh seeds."""
    assert found.treated is not None
    for judged in judge(
        patient, tried, found.treated, found.probes, showing, driver, seed=seed, bar=found.bar
    ):
        found.judged.append(judged)


def _suspect(found: Visit, symptom: Symptom, told: Told) -> None:
    """Notes the suspicions of a symptom, and the complaints that the user is asked about.

    If another symptom than the complaint is treated, the question stays about the complaint.
    """
    found.suspicions = suspicions_of(found.facts, symptom, told)
    if not found.of_complaint:
        found.alike = asked_about(found.facts, symptom, told, found.suspicions)


def _see(found: Visit, symptom: Symptom, share: float, bar: float) -> None:
    """Notes the probes of which such a share of trials shows a symptom that was not seen so far."""
    names = seen_in(found.rows, share=share, bar=bar).get(symptom)
    if names and symptom not in found.seen:
        found.seen[symptom], found.bar = names, bar


def _drive_on(found: Visit, patient: Patient, driver: Driver, *, seed: int) -> None:
    """Drives on what ended by time; if some robot gives up then, these are the probes from now."""
    probes = driven_on(found.probes, found.rows, found.facts)
    if not probes:
        return
    count = len(probes) * FIRST_SEEDS
    driver.tell(
        f"driving on {', '.join(probes)}, which ended by time, for the robot to give up: "
        f"{driver.told_time(count)}"
    )
    preset = patient.chosen(patient.columns())
    (rows,) = driver.drive_nearest([preset], list(probes.values()), FIRST_SEEDS, seed=seed)
    probes = {name: probe for name, probe in probes.items() if name in map(probe_of, rows)}
    if Symptom.FALSE_ABORT in seen_in(rows, share=1e-9):
        found.probes = {**found.probes, **probes}
        found.rows = [row for row in found.rows if probe_of(row) not in probes] + rows
        found.seen = seen_in(found.rows)
        _see(found, Symptom.FALSE_ABORT, 1e-9, 1.0)


def _try_causes(
    found: Visit,
    patient: Patient,
    symptom: Symptom,
    showing: Sequence[str],
    driver: Driver,
    *,
    seed: int,
) -> Experiment:
    """Tries the causes of a symptom, and returns the experiment; if it is too rare, none is tried.

    Where some of the probes that show it do so in every trial, on these alone.
    """
    sure = seen_in(found.rows, share=1.0, bar=found.bar).get(symptom, ())
    names = [name for name in showing if name in sure] or showing
    experiment = Experiment(
        patient,
        symptom,
        [found.probes[name] for name in names],
        driver,
        seed=seed + SEARCH_SEED,
    )
    try:
        suspicions = with_differences(found.suspicions, found.facts)
        experiment.run(suspicions, ways_back(suspicions, found.facts), found.proposed)
    except OutOfTime:
        found.is_out_of_time = True
    finally:
        # The changes that were tried until Ctrl-C count, too.
        found.tried = experiment.tried
        found.is_out_of_time |= experiment.is_out_of_time
    return experiment


def _to_treat(found: Visit) -> list[Symptom]:
    """Returns the symptom that was asked for and its milder form, as far as they are seen.

    If neither is, but a touch, that: it outweighs everything. If none was asked for: a touch before
    all, then what the user's words tell, then what a rule that fired leads to, then the weightiest.
    One is treated if all before it are too rare.
    """
    if found.asked is not None:
        own = [s for s in (found.asked, MILDER.get(found.asked)) if s in found.seen]
        return own or [s for s in (Symptom.COLLISION,) if s in found.seen]
    led_to = {symptom for finding in found.findings for symptom in finding.likely}
    seen = [symptom for symptom in BY_WEIGHT if symptom in found.seen]
    ranks = {symptom: number for number, symptom in enumerate(found.told)}
    return sorted(
        seen,
        key=lambda s: (s is not Symptom.COLLISION, ranks.get(s, MOST_TOLD), s not in led_to),
    )


def _most_severe(found: Visit, symptom: Symptom) -> list[str]:
    """Returns the probes that show a symptom most, of those that were made for it, if any."""

    def mean(name: str) -> float:
        own = [r for r in found.rows if r["scenario"] == f"probe_{name}"]
        return sum(float(r["severity"].get(symptom, 0.0)) for r in own) / max(len(own), 1)

    seen = found.seen[symptom]
    fitting = [name for name in seen if name in MADE_FOR.get(symptom, ())]
    return sorted(fitting or seen, key=lambda name: -mean(name))[:MOST_SHOWING]
