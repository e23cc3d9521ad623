"""What a visit concludes from rows: verdicts that follow from numbers one can count."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from doctor_texts import MPPI, MPPI_BLOCK, nav2_text

from drake_navbench.commands.doctor import main
from drake_navbench.inputs.robot import load_robot
from drake_navbench.nav2.patch import Place
from drake_navbench.studies.doctor import visit as visits
from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.change import judge
from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.detectors import detectors_digest
from drake_navbench.studies.doctor.differences import ways_back, with_differences
from drake_navbench.studies.doctor.driving import FRESH_SEED, Driver
from drake_navbench.studies.doctor.experiment import TOGETHER, Experiment
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.page import write_outputs
from drake_navbench.studies.doctor.probes import LONGEST_S, MAKERS, ROUGH, probes_for
from drake_navbench.studies.doctor.proposals import read_proposals
from drake_navbench.studies.doctor.race import MOST_TO_THE_END
from drake_navbench.studies.doctor.reading import Suspicion, findings_of, suspicions_of
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.tried import Tried, Verdict, corrected
from drake_navbench.studies.doctor.words import change_told, verdict

FOOTPRINT = Place("controller_server", "FollowPath.CostCritic.consider_footprint")
CAUSE = Cause("controller.CostCritic.consider_footprint", Direction.SET, True, "why")
TRIAL = Trial(CAUSE, {FOOTPRINT: True})


def tried(before, after, p_value, **changed):
    values = {
        "suspicion": Suspicion(CAUSE, 1.0, ("The reason.",)),
        "trial": TRIAL,
        "verdict": Verdict.NOT_SHOWN,
        "before": before,
        "after": after,
        "p_value": p_value,
        "pairs": 12,
    }
    return Tried(**(values | changed))


def test_a_cause_is_shown_only_where_its_p_value_holds_after_correction():
    # A visit may drive 48 changes, so Holm counts 48: 0.001 becomes 0.048, 0.01 becomes 0.47.
    found = corrected([tried(2.0, 0.0, 0.001), tried(2.0, 0.5, 0.01)])
    assert [e.verdict for e in found] == [Verdict.SHOWN, Verdict.NOT_SHOWN]
    assert [e.p_value for e in found] == [pytest.approx(0.048), pytest.approx(0.47)]


def test_a_change_of_one_costmap_is_told_from_that_of_the_other():
    def told(node):
        return change_told(Trial(CAUSE, {Place(node, "inflation_layer.inflation_radius"): 0.3}))

    assert told("local_costmap/local_costmap") == (
        "local_costmap: inflation_layer.inflation_radius = 0.3"
    )
    assert told("global_costmap/global_costmap").startswith("global_costmap: ")
    assert change_told(TRIAL) == "FollowPath.CostCritic.consider_footprint = true"


def test_a_fall_that_is_small_or_brings_touches_is_not_shown():
    small, touching = tried(2.0, 1.7, 1e-6), tried(2.0, 0.0, 1e-6, touches=1)
    assert {e.verdict for e in corrected([small, touching])} == {Verdict.NOT_SHOWN}


@pytest.fixture
def patient(tmp_path):
    path = tmp_path / "nav2.yaml"
    path.write_text(nav2_text(MPPI_BLOCK, plugin=MPPI))
    return Patient((path,), "wheelchair", {}, "jazzy")


class Fake:
    """A driver of rows that a test makes up."""

    left_s, trial_s = 100.0, 1.0

    def tell(self, line):
        pass

    def told_time(self, trials):
        return "soon"

    def check(self, preset, probes, *, seed):
        pass

    def drive_together(self, presets, probes, trials, *, seed, must=False):
        return [self.drive(preset, probes, trials, seed=seed) for preset in presets]


class Rows(Fake):
    """A driver that knows what every column does: symptoms by column, on every probe.

    A column whose symptoms are None fails. seldom: how many of the seeds show the symptoms.
    """

    def __init__(self, before, after, seldom=None):
        self.symptoms = {"before": before, "after": after}
        self.seldom = seldom

    def drive(self, preset, probes, trials, *, seed, must=False):
        symptoms = self.symptoms[preset.name]
        shown = {s: 2.0 for s in symptoms or ()}
        return [
            {
                "scenario": probe.name,
                "severity": shown if self.seldom is None or trial in self.seldom else {},
                "outcome": "error" if symptoms is None else "succeeded",
                "reason": "a division by zero",
                "end": [9.0 if preset.name == "before" else 9.5],
            }
            for trial in range(trials)
            for probe in probes
        ]


PROBES = {
    name: scenario
    for name, scenario in probes_for(load_robot("wheelchair"), 0.5).items()
    if name in ("straight", "door", "corridor")
}


def judged(patient, before, after, symptom):
    shown = [tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)]
    driver = Rows(before, after)
    return next(judge(patient, shown, symptom, PROBES, ["straight"], driver, seed=0))


class Counted(Fake):
    """A driver that counts the trials of the changed file. severity: of it, by trial."""

    def __init__(self, end, severity):
        self.end, self.severity, self.trials = end, severity, 0

    def drive(self, preset, probes, trials, *, seed, must=False):
        is_after = preset.name == "after"
        self.trials = len(probes) * trials if is_after else self.trials
        return [
            {
                "scenario": probe.name,
                "outcome": "succeeded",
                "end": [self.end if is_after else 9.0],
                "severity": {"wobble_straight": self.severity if is_after else 2.0},
            }
            for _ in range(trials)
            for probe in probes
        ]


@pytest.mark.parametrize(
    ("end", "severity", "trials", "reason"),
    [
        # To the last digit as before: of the first trial alone.
        (9.0, 2.0, 1, "changes nothing in the first trial"),
        # Not to the last digit, but no better: of one seed in three probes.
        (9.5, 2.0, 3, "little or no fall in the first pairs"),
        # 5% less: of the first four pairs, which are two seeds in three probes.
        (9.5, 1.9, 6, "little or no fall in the first pairs"),
        (9.5, 0.5, 12, ""),
    ],
)
def test_only_a_change_that_does_something_is_driven_to_the_end(
    patient, end, severity, trials, reason
):
    driver = Counted(end, severity)
    experiment = Experiment(
        patient, patient.facts(), Symptom.WOBBLE_STRAIGHT, list(PROBES.values()), driver, seed=0
    )
    candidate, _ = experiment._candidate(Suspicion(CAUSE, 1.0, ()), TRIAL)
    (found,) = experiment._race.run([candidate])
    assert (driver.trials, found.reason) == (trials, reason)
    assert (found.p_value < 1.0) == (reason == "")


@pytest.mark.parametrize(("best", "pairs"), [(0.0, 6), (0.4, 12)])
def test_beside_a_change_that_takes_the_symptom_away_half_a_fall_is_left_early(
    patient, best, pairs
):
    class Two(Counted):
        def drive(self, preset, probes, trials, *, seed, must=False):
            self.severity = best if preset is first.after else 1.2
            return super().drive(preset, probes, trials, seed=seed)

    experiment = Experiment(
        patient, patient.facts(), Symptom.WOBBLE_STRAIGHT, list(PROBES.values()),
        Two(9.5, best), seed=0,
    )  # fmt: skip
    other = Cause("controller.batch_size", Direction.UP)
    first, second = (
        experiment._candidate(Suspicion(cause, 1.0, ()), TRIAL)[0] for cause in (CAUSE, other)
    )
    # 40% less, beside all of it or 80%.
    _, left = experiment._race.run([first, second])
    assert left.pairs == pairs


def test_a_change_is_judged_on_the_seeds_of_the_first_look_where_nothing_was_searched(patient):
    driven = set()

    class Noted(Rows):
        def drive(self, preset, probes, trials, *, seed, must=False):
            driven.update((probe.name, seed) for probe in probes)
            return super().drive(preset, probes, trials, seed=seed)

    shown = [tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)]
    driver = Noted(["wobble_straight"], [])
    next(judge(patient, shown, Symptom.WOBBLE_STRAIGHT, PROBES, ["straight"], driver, seed=7))
    assert driven == {
        ("probe_straight", 7 + FRESH_SEED), ("probe_door", 7), ("probe_corridor", 7),
    }  # fmt: skip


def test_after_a_batch_with_a_change_that_takes_the_symptom_away_none_is_driven(patient):
    def places(driver):
        experiment = Experiment(
            patient, patient.facts(), Symptom.WOBBLE_STRAIGHT, list(PROBES.values()), driver, seed=0
        )
        suspicions = suspicions_of(patient.facts(), Symptom.WOBBLE_STRAIGHT)
        experiment.run(suspicions)
        return [entry for entry in experiment.tried if entry.pairs]

    one_batch, several = places(Counted(9.5, 0.0)), places(Counted(9.5, 1.9))
    # A cause has two values at most.
    assert TOGETHER <= len(one_batch) <= TOGETHER + 1
    assert len(several) > TOGETHER + 1
    # Of those that do the same, the likeliest three are driven to the end.
    assert [entry.reason == "" for entry in one_batch].count(True) == MOST_TO_THE_END
    assert one_batch[0].pairs == 12


def test_of_changes_that_do_the_same_the_way_back_from_an_abnormal_value_is_named_first(patient):
    # Nav2's progress checker waits 10 s, the file's 20 s.
    facts = patient.facts()
    compensation = Suspicion(Cause("controller.wz_std", Direction.DOWN), 0.9, ())
    patience = Cause("progress_checker.movement_time_allowance", Direction.DOWN)
    suspicions = [compensation, Suspicion(patience, 0.1, ())]
    experiment = Experiment(
        patient, facts, Symptom.WOBBLE_STRAIGHT, list(PROBES.values()), Counted(9.5, 0.0), seed=0
    )
    experiment.run(suspicions, ways_back(suspicions, facts))
    first, second = (e for e in experiment.tried if e.verdict is Verdict.SHOWN)
    assert (first.trial.told, second.suspicion.cause) == (
        "controller_server.progress_checker.movement_time_allowance: 10.0", compensation.cause,
    )  # fmt: skip
    # Nav2's value is driven once, though it is the third step of the suspect as well.
    changes = [dict(entry.trial.changes) for entry in experiment.tried]
    assert len(changes) == len({str(change) for change in changes})


@pytest.mark.parametrize(
    ("after", "told"),
    [
        (0.0, "shown (severity 2.00 -> 0.00 in 12 pairs, corrected p = 0.047)"),
        # A fifth less is no cure; it is driven to the end though others take all away.
        (1.6, "not shown (severity 2.00 -> 1.60 in 12 pairs, corrected p = 0.047)"),
    ],
)
def test_what_the_user_proposes_is_tried_first_and_gets_a_verdict(patient, after, told):
    trials = read_proposals(["FollowPath.CostCritic.consider_footprint=true"], patient)

    class Mixed(Counted):
        def drive(self, preset, probes, trials, *, seed, must=False):
            critic = preset.parameters.model_dump()["CostCritic"]
            self.severity = after if critic["consider_footprint"] else 0.0
            return super().drive(preset, probes, trials, seed=seed)

    driver = Mixed(9.5, 0.0)
    found = visits.Visit(
        patient.facts(), asked=Symptom.WOBBLE_STRAIGHT, probes=PROBES, proposed=trials
    )
    found.rows = driver.drive(patient.chosen(patient.columns()), PROBES.values(), 2, seed=0)
    found.seen = {Symptom.WOBBLE_STRAIGHT: list(PROBES)}
    visits._treat(found, patient, "", driver, seed=0)
    assert f"Your proposal, FollowPath.CostCritic.consider_footprint = true: {told}." in verdict(
        found
    )


def test_in_a_file_that_departs_from_nav2_in_many_values_none_is_set_back_first(patient):
    def back(**values):
        patient.paths[0].write_text(nav2_text(MPPI_BLOCK | values, plugin=MPPI))
        facts = replace(patient).facts()
        return {
            s.cause.place.partition(".")[2]: (s.cause.to, s.reasons[0])
            for s in ways_back(with_differences([], facts), facts)
        }

    # The file itself has twice Nav2's patience and 0.3 m in place of 0.5 m of progress. A limit of
    # motion counts from five times on, since robots differ: Nav2 has 1.9 rad/s.
    usual = {"movement_time_allowance", "required_movement_radius"}
    assert set(back()) == set(back(wz_max=0.5)) == usual
    assert back(wz_max=0.3)["wz_max"] == (1.9, "Nav2 or nav2_bringup has 1.9.")
    assert back(wz_max=0.3, gamma=0.15) == {}


@pytest.mark.parametrize(("after", "pairs"), [(0.4, 1), (0.0, 0)])
def test_two_changes_are_tried_together_where_neither_takes_the_symptom_away(patient, after, pairs):
    experiment = Experiment(
        patient, patient.facts(), Symptom.WOBBLE_STRAIGHT, list(PROBES.values()),
        Counted(9.5, 0.0), seed=0,
    )  # fmt: skip
    more = Cause("controller.batch_size", Direction.UP)
    second = Trial(more, {Place("controller_server", "FollowPath.batch_size"): 3000})
    # Of a seldom symptom the mean severity is low before the change, too.
    found = experiment._pairs_of(
        [
            tried(0.9, after, 0.01),
            tried(0.9, 0.5, 0.01, trial=second, suspicion=Suspicion(more, 1.0, ())),
        ]
    )
    assert [len(candidate.trial.changes) for candidate in found] == [2] * pairs


def test_the_time_that_is_left_goes_to_the_likeliest_changes(patient):
    class Short(Counted):
        def drive_together(self, presets, probes, trials, *, seed, must=False):
            return super().drive_together(presets[:3], probes, trials, seed=seed)

    experiment = Experiment(
        patient, patient.facts(), Symptom.WOBBLE_STRAIGHT, list(PROBES.values()),
        Short(9.5, 0.0), seed=0,
    )  # fmt: skip
    suspicions = suspicions_of(patient.facts(), Symptom.WOBBLE_STRAIGHT)
    experiment.run(suspicions)
    found = experiment.tried
    # The file as it is and two changes, one trial each: too little to show anything.
    assert experiment.is_out_of_time
    assert [entry.pairs for entry in found if entry.pairs] == [1, 1]
    assert {entry.verdict for entry in found if entry.pairs} == {Verdict.NOT_SHOWN}


def test_without_time_for_a_trial_nothing_is_said_to_be_tried(patient):
    class Late(Counted):
        left_s = 1.5

        def tell(self, line):
            raise AssertionError(line)

    experiment = Experiment(
        patient, patient.facts(), Symptom.WOBBLE_STRAIGHT, list(PROBES.values()),
        Late(9.5, 0.0), seed=0,
    )  # fmt: skip
    experiment.run(suspicions_of(patient.facts(), Symptom.WOBBLE_STRAIGHT))
    # One trial of the file as it is and one of a change take 2 s.
    assert experiment.is_out_of_time
    assert not [entry for entry in experiment.tried if entry.pairs]


def test_flags_without_effect_here_and_nodes_that_the_file_lacks_are_not_driven(patient):
    patient.paths[0].write_text(nav2_text(MPPI_BLOCK | {"visualize": True}, plugin=MPPI))
    experiment = Experiment(
        patient, patient.facts(), Symptom.WOBBLE_STRAIGHT, list(PROBES.values()),
        Counted(9.5, 0.0), seed=0,
    )  # fmt: skip
    flag = Cause("controller.visualize", Direction.SET, False)
    (told,) = experiment._candidates(Suspicion(flag, 1.0, ()))[1]
    assert told.reason == "no trial depends on it"
    # The file has no smoother server.
    weight = Cause("smoother.w_smooth", Direction.UP)
    assert experiment._candidates(Suspicion(weight, 1.0, ())) == ([], [])


def test_a_change_that_no_trial_depends_on_is_not_driven(patient):
    text = nav2_text(MPPI_BLOCK, plugin=MPPI, amcl={"max_particles": 2000})
    patient.paths[0].write_text(text)
    driver = Counted(9.0, 0.0)
    experiment = Experiment(
        patient, patient.facts(), Symptom.WOBBLE_STRAIGHT, list(PROBES.values()), driver, seed=0
    )
    # AMCL is not simulated here.
    unused = Trial(CAUSE, {Place("amcl", "max_particles"): 5000})
    candidate, reason = experiment._candidate(Suspicion(CAUSE, 1.0, ()), unused)
    assert (candidate, driver.trials) == (None, 0)
    assert reason == "no trial depends on it"


def raced(patient, driver, symptom=Symptom.WOBBLE_STRAIGHT):
    experiment = Experiment(
        patient, patient.facts(), symptom, list(PROBES.values()), driver, seed=0
    )
    candidate, _ = experiment._candidate(Suspicion(CAUSE, 1.0, ()), TRIAL)
    (found,) = experiment._race.run([candidate])
    return found


def test_a_change_with_which_the_program_fails_is_no_cure(patient):
    # A trial that came to no end shows no symptom, either.
    found = raced(patient, Rows(["wobble_straight"], None))
    assert (found.p_value, found.reason) == (1.0, "a trial failed: a division by zero")
    failing = judged(patient, ["wobble_straight"], None, Symptom.WOBBLE_STRAIGHT)
    assert failing.after_target == 0
    assert not failing.helps
    visited = visits.Visit(patient.facts(), probes=PROBES, treated=Symptom.WOBBLE_STRAIGHT)
    visited.seen, visited.judged = {Symptom.WOBBLE_STRAIGHT: ["straight"]}, [failing]
    visited.tried = [tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)]
    assert "with the best one the program fails in a trial" in verdict(visited)


@pytest.mark.parametrize(
    ("symptom", "after", "fall"),
    [
        (Symptom.WOBBLE_STRAIGHT, [], 1.0),
        # A robot that stands does not wobble, and one that touches something no longer.
        (Symptom.WOBBLE_STRAIGHT, ["no_start"], 0.0),
        (Symptom.WOBBLE_STRAIGHT, ["collision"], 0.0),
        # A touch outweighs everything: the price of its going is told with the change.
        (Symptom.COLLISION, ["no_start"], 1.0),
    ],
)
def test_a_drive_that_a_change_cuts_short_shows_no_fall(patient, symptom, after, fall):
    assert raced(patient, Rows([symptom.value], after), symptom).fall == fall


@pytest.mark.parametrize(
    ("seldom", "pairs", "falls", "factor"),
    [
        (None, 12, 12, 2.0),
        # Three of the first four seeds show it, in three probes; five of eight.
        ({0, 1, 2, 4, 5}, 24, 15, 4.0),
        # One of four, two of eight, five of sixteen.
        ({0, 4, 8, 12, 13}, 48, 15, 4.0),
    ],
)
def test_what_takes_a_seldom_symptom_away_gets_more_pairs_until_it_is_shown(
    patient, seldom, pairs, falls, factor
):
    found = raced(patient, Rows(["wobble_straight"], [], seldom=seldom))
    assert found.pairs == pairs
    # Every pair that shows the symptom falls; three looks share the error.
    assert found.p_value == pytest.approx(factor * 2 / 2**falls)
    assert corrected([found])[0].verdict is Verdict.SHOWN


def test_a_change_that_takes_the_symptom_away_but_is_not_shown_does_not_end_the_search(patient):
    def batches(seldom):
        experiment = Experiment(
            patient, patient.facts(), Symptom.WOBBLE_STRAIGHT, list(PROBES.values()),
            Rows(["wobble_straight"], [], seldom=seldom), seed=0,
        )  # fmt: skip
        experiment.run(suspicions_of(patient.facts(), Symptom.WOBBLE_STRAIGHT))
        return len([entry for entry in experiment.tried if entry.pairs]) // TOGETHER

    # Every pair shows it, or two pairs of 48.
    assert batches(None) == 1
    assert batches({0}) > 1


def test_a_seldom_symptom_is_judged_on_more_seeds(patient):
    shown = [tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)]
    driver = Rows(["wobble_straight"], [], seldom={3, 4, 5})
    (found,) = judge(patient, shown, Symptom.WOBBLE_STRAIGHT, PROBES, ["straight"], driver, seed=0)
    # None of the first two seeds shows it.
    assert (found.before_target, found.after_target, found.target_trials) == (3, 0, 8)
    assert found.helps


def test_two_of_eight_trials_are_too_few_to_judge_a_change(patient):
    shown = [tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)]
    driver = Rows(["wobble_straight"], [], seldom={3, 4})
    (found,) = judge(patient, shown, Symptom.WOBBLE_STRAIGHT, PROBES, ["straight"], driver, seed=0)
    assert (found.before_target, found.after_target) == (2, 0)
    assert found.is_rare
    assert not found.helps


def test_a_change_that_leaves_the_symptom_is_not_driven_through_the_other_probes(patient):
    stays, goes = (
        judged(patient, ["wobble_straight"], after, Symptom.WOBBLE_STRAIGHT)
        for after in (["wobble_straight"], [])
    )
    assert (stays.trials, goes.trials) == (8, 12)
    assert not stays.helps


def test_a_symptom_that_no_fresh_seed_shows_judges_no_change(patient):
    shown = [tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)] * 2
    driver = Rows(["wobble_straight"], [], seldom=())
    (found,) = judge(patient, shown, Symptom.WOBBLE_STRAIGHT, PROBES, ["straight"], driver, seed=0)
    assert not found.helps
    visited = visits.Visit(patient.facts(), probes=PROBES, treated=Symptom.WOBBLE_STRAIGHT)
    visited.seen = {Symptom.WOBBLE_STRAIGHT: ["straight"]}
    visited.judged, visited.tried = [found], shown
    assert "0 of 8 trials of the unchanged file show it" in verdict(visited)


@pytest.mark.parametrize(("severity", "bar"), [(1.1, 1.0), (0.7, 0.5), (0.4, None)])
def test_a_weak_sign_of_the_complaint_is_treated_and_called_weak(patient, severity, bar):
    class Weak(Counted):
        def drive(self, preset, probes, trials, *, seed, must=False):
            rows = super().drive(preset, probes, trials, seed=seed)
            if preset.name == "before":
                rows = [row | {"severity": {"wobble_straight": severity}} for row in rows]
            return rows

    driver = Weak(9.5, 0.0)
    found = visits.Visit(patient.facts(), asked=Symptom.WOBBLE_STRAIGHT, probes=PROBES)
    before = patient.chosen(patient.columns())
    found.rows = driver.drive(before, PROBES.values(), 2, seed=0)
    found.seen = visits.seen_in(found.rows)
    visits._treat(found, patient, "", driver, seed=0)
    # Above half of the threshold the sign is enough, below it there is none.
    assert (found.treated is None) == (bar is None)
    assert ("a weak sign" in verdict(found)) == (bar == 0.5)
    if bar is not None:
        assert found.bar == bar
        assert found.cure.after_target == 0


def test_what_was_tried_until_ctrl_c_is_kept(patient):
    class Stopped(Counted):
        batches = 0

        def drive_together(self, presets, probes, trials, *, seed, must=False):
            # The third batch of trials is of the second dozen of changes.
            if trials == 1 and len(probes) == 1:
                self.batches += 1
                if self.batches == 2:
                    raise KeyboardInterrupt
            return super().drive_together(presets, probes, trials, seed=seed)

    found = visits.Visit(patient.facts(), asked=Symptom.WOBBLE_STRAIGHT, probes=PROBES)
    found.rows = Counted(9.5, 1.9).drive(
        patient.chosen(patient.columns()), PROBES.values(), 2, seed=0
    )
    found.seen = {Symptom.WOBBLE_STRAIGHT: list(PROBES)}
    with pytest.raises(KeyboardInterrupt):
        visits._treat(found, patient, "", Stopped(9.5, 1.9), seed=0)
    assert len([entry for entry in found.tried if entry.pairs]) >= TOGETHER


def test_a_change_that_takes_the_symptom_and_brings_no_other_helps(patient):
    found = judged(patient, ["wobble_straight"], [], Symptom.WOBBLE_STRAIGHT)
    # Two seeds of one probe are few: six more are driven.
    assert (found.before_target, found.after_target, found.target_trials) == (8, 0, 8)
    assert found.helps


def test_a_change_that_brings_a_touch_does_not_help(patient):
    found = judged(patient, ["wobble_straight"], ["collision"], Symptom.WOBBLE_STRAIGHT)
    assert found.worse[0] == "collision"
    assert not found.helps


def test_where_the_best_change_brings_a_touch_the_next_one_is_judged_and_offered(patient):
    class Mixed(Rows):
        def drive_together(self, presets, probes, trials, *, seed, must=False):
            rows = super().drive_together(presets, probes, trials, seed=seed)
            if next(order):
                rows[1] = [row | {"severity": {"collision": 2.0}} for row in rows[1]]
            return rows

    # Of each change: two seeds of its probe, eight of them, and the other probes.
    order = iter([False, False, True, False, False, False])
    shown = [tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)] * 2
    driver = Mixed(["wobble_straight"], [])
    found = visits.Visit(patient.facts(), probes=PROBES, treated=Symptom.WOBBLE_STRAIGHT)
    found.judged = list(
        judge(patient, shown, Symptom.WOBBLE_STRAIGHT, PROBES, ["straight"], driver, seed=0)
    )
    assert [entry.worse for entry in found.judged] == [["collision"], []]
    assert found.cure is found.judged[1]


def test_a_touch_outweighs_what_comes_instead_and_the_price_is_told(patient):
    found = judged(patient, ["collision"], ["door_stop"], Symptom.COLLISION)
    # Every trial touched before: in none of the others anything can be worse.
    assert found.helps
    counts = {"collision": 0, "door_stop": 3}
    priced = replace(found, before={"collision": 2, "door_stop": 1}, after=counts, compared=4)
    assert priced.worse == ["door_stop"]
    assert priced.helps
    visited = visits.Visit(patient.facts(), probes=PROBES, treated=Symptom.COLLISION)
    visited.seen, visited.judged = {Symptom.COLLISION: ["straight"]}, [priced, found]
    # Of two that help the one without a price is the change.
    assert visited.cure is found
    visited.judged = [priced]
    told = "(door_stop) in 3 trials, before the change in 1, in the 4 trials"
    assert told in verdict(visited)
    # No other symptom has this right.
    assert not replace(priced, symptom=Symptom.SPINS).helps


def test_what_stands_where_there_was_a_touch_is_told_and_not_held_against_the_change(patient):
    found = judged(patient, ["collision"], ["gives_up_late"], Symptom.COLLISION)
    assert found.helps
    assert found.compared == 0
    # Eight seeds of the probe that showed it, two of the other two.
    assert found.instead == {"gives_up_late": 12}


def test_the_page_begins_with_the_verdict_and_the_patch_applies(patient, tmp_path):
    found = visits.Visit(patient.facts(), probes=PROBES, treated=Symptom.COLLISION)
    found.seen = {Symptom.COLLISION: ["straight"]}
    found.judged = [judged(patient, ["collision"], [], Symptom.COLLISION)]
    written = {path.name for path in write_outputs(found, patient, tmp_path)}
    assert written == {"doctor.html", "patched.yaml", "change.patch"}
    page = (tmp_path / "doctor.html").read_text()
    assert page.index('class="verdict"') < page.index("<h2>")
    assert "8 of 8 trials showed it before and 0 after" in page
    assert "consider_footprint: true" in (tmp_path / "patched.yaml").read_text()
    patch = (tmp_path / "change.patch").read_text()
    assert "-        consider_footprint: false\n+        consider_footprint: true\n" in patch


def test_what_a_rule_leads_to_is_treated_before_what_weighs_more_and_after_a_touch(patient):
    # The rule about the outline leads to corners cut, and to no robot that does not start.
    found = visits.Visit(patient.facts(), findings=findings_of(patient.facts()))
    assert [finding.rule.name for finding in found.findings] == ["mppi-centre-alone"]
    found.seen = {Symptom.NO_START: ["door"], Symptom.CORNER_CUTTING: ["bends"]}
    assert visits._to_treat(found) is Symptom.CORNER_CUTTING
    found.seen[Symptom.COLLISION] = ["door"]
    assert visits._to_treat(found) is Symptom.COLLISION
    found.asked = Symptom.NO_START
    assert visits._to_treat(found) is Symptom.NO_START
    # Who complains of touches is helped where the robot passes too closely.
    found.asked, found.seen = Symptom.COLLISION, {Symptom.NEAR_MISS: ["door"]}
    assert visits._to_treat(found) is Symptom.NEAR_MISS
    found.asked = Symptom.NO_START
    assert visits._to_treat(found) is None


def test_causes_are_tried_where_a_probe_was_made_for_the_symptom(patient):
    found = visits.Visit(patient.facts())
    found.seen = {Symptom.DOOR_STOP: ["dead_end", "door"], Symptom.SPINS: ["dead_end"]}
    assert visits._most_severe(found, Symptom.DOOR_STOP) == ["door"]
    assert visits._most_severe(found, Symptom.SPINS) == ["dead_end"]


def test_a_symptom_that_one_of_two_trials_shows_is_looked_at_again():
    def row(probe, *symptoms):
        return {"scenario": f"probe_{probe}", "severity": {s: 2.0 for s in symptoms}}

    rows = [row("door", "spins"), row("door"), row("bends", "spins"), row("bends", "spins")]
    assert visits._unsure(rows) == ["door"]
    # Of four trials one shows it: less than half.
    assert visits.seen_in([*rows, row("door"), row("door")]) == {Symptom.SPINS: ["bends"]}
    # What every trial shows is sure, and what none shows as well.
    assert visits._unsure(rows[2:]) == []


def test_a_value_otherwise_than_nav2s_is_tried_after_the_suspects(patient):
    facts = patient.facts()
    known = suspicions_of(facts, Symptom.GOAL_OVERSHOOT)
    more = [s for s in with_differences(known, facts) if s not in known]
    told = {s.cause.place: (s.cause.direction, s.cause.to) for s in more}
    # The file has 20 s, Nav2 10 s.
    assert told["progress_checker.movement_time_allowance"] == (Direction.DOWN, 10.0)


def test_a_speed_beyond_what_the_file_lets_through_is_a_difference(patient):
    def speeds(**velocity_smoother):
        text = nav2_text(MPPI_BLOCK, plugin=MPPI, velocity_smoother=velocity_smoother)
        patient.paths[0].write_text(text)
        facts = replace(patient).facts()
        found = with_differences([], facts)
        return [s.cause.to for s in found if s.cause.place == "controller.vx_max"]

    # The controller asks for 0.5 m/s.
    assert speeds(max_velocity=[0.25, 0.0, 1.0], min_velocity=[-0.25, 0.0, -1.0]) == [0.25]
    assert speeds(max_velocity=[0.5, 0.0, 1.0], min_velocity=[-0.5, 0.0, -1.0]) == []


def test_a_check_that_nav2_has_off_is_not_turned_off(patient):
    def switches(is_on):
        block = MPPI_BLOCK | {"CostCritic": {"consider_footprint": is_on, "enabled": False}}
        patient.paths[0].write_text(nav2_text(block, plugin=MPPI))
        found = with_differences([], replace(patient).facts())
        return {s.cause.place for s in found if s.cause.direction is Direction.SET}

    # Nav2 has the outline's check off and the critic on.
    assert switches(is_on=True) == switches(is_on=False) == {"controller.CostCritic.enabled"}


def test_a_limit_of_motion_is_tried_before_unusual_values_if_it_is_far_else_when_all_else_was(
    patient,
):
    critic = MPPI_BLOCK | {"CostCritic": {"consider_footprint": True, "enabled": False}}
    patient.paths[0].write_text(nav2_text(critic | {"wz_max": 0.3, "vx_max": 0.35}, plugin=MPPI))
    found = with_differences([], patient.facts())
    by_place = {s.cause.place: s for s in found}
    switch, limit = by_place["controller.CostCritic.enabled"], by_place["controller.wz_max"]
    assert (switch.cause.direction, switch.cause.to) == (Direction.SET, True)
    # Nav2 has 1.9 rad/s.
    assert (limit.cause.direction, limit.cause.to) == (Direction.UP, 1.9)
    assert limit.score == switch.score
    # 0.35 m/s is not far from Nav2's 0.5.
    assert by_place["controller.vx_max"].score == min(s.score for s in found) < limit.score


def test_nothing_seen_is_a_verdict(patient):
    found = visits.Visit(patient.facts(), probes=PROBES)
    assert verdict(found) == "Nothing to improve: no probe shows a symptom."
    asked = visits.Visit(patient.facts(), probes=PROBES, asked=Symptom.SPINS)
    assert verdict(asked).startswith("No cause found: no probe shows spins")


@pytest.mark.parametrize("robot", ["wheelchair", "turtlebot4", "jackal"])
def test_every_probe_can_be_planned_for_a_robots_outline(robot):
    loaded = load_robot(robot)
    probes = probes_for(loaded, loaded.drive.max_linear_velocity_mps)
    assert {f"{name}_rough" for name in ROUGH} <= set(probes)
    assert set(MAKERS) - {"slow_zone"} <= set(probes)
    for probe in probes.values():
        assert probe.timeout_s <= LONGEST_S


def test_the_person_walks_into_no_robot_that_goes_around():
    (person,) = probes_for(load_robot("turtlebot4"), 0.3)["person_crossing"].world.moving_obstacles
    # It comes from the side and stays on the path.
    assert [waypoint.position[1] for waypoint in person.waypoints] == [-2.0, -0.1]


def test_a_journal_with_a_torn_line_goes_on(tmp_path):
    entry = {"identity": "a", "detectors": detectors_digest(), "row": {"severity": {}}}
    # Severities of other detectors would be compared with those of today's.
    older = json.dumps(entry | {"identity": "c", "detectors": "older"})
    (tmp_path / "journal.jsonl").write_text(f'{json.dumps(entry)}\n{older}\n{{"identity": "b", "ro')
    driver = Driver(tmp_path, "wheelchair", jobs=1, budget_s=1.0, tell=print)
    assert set(driver._rows) == {"a"}


@pytest.mark.long
def test_the_wall_is_found_and_cured(tmp_path, capsys):
    """MPPI with the wheelchair drives into walls; to look at its outline cures it.

    The file is read as for Iron, which looks at an outline within the inflation alone: both change.
    """
    path = tmp_path / "nav2.yaml"
    local = {
        "footprint": "[[0.85, 0.30], [0.85, -0.30], [-0.25, -0.30], [-0.25, 0.30]]",
        "width": 6,
        "height": 6,
    }
    critics = {"critics": [*MPPI_BLOCK["critics"], "GoalAngleCritic", "PathAngleCritic"]}
    path.write_text(nav2_text(MPPI_BLOCK | critics, plugin=MPPI, local_costmap=local))
    out = tmp_path / "out"
    arguments = [str(path), "--symptom", "collision", "--out", str(out), "--budget", "2h"]
    assert main(arguments) == 0
    assert "consider_footprint: true" in (out / "patched.yaml").read_text()
    told = " ".join(capsys.readouterr().out.split())
    assert "CostCritic.consider_footprint = true and local_costmap: inflation_layer" in told
