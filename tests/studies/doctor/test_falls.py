"""How long the search drives a change, and which falls show it: numbers one can count."""

from __future__ import annotations

import pytest
from fake_drives import CAUSE, PROBES, TRIAL, Counted, Rows, judged, raced, tried

from drake_navbench.studies.doctor import visit as visits
from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.experiment import TOGETHER, Experiment
from drake_navbench.studies.doctor.race import MOST_TO_THE_END
from drake_navbench.studies.doctor.reading import Suspicion, suspicions_of
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.tried import LATER_FACTOR, LEAST_FALLS, Verdict, corrected
from drake_navbench.studies.doctor.words import verdict


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
    experiment = Experiment(patient, Symptom.WOBBLE_STRAIGHT, list(PROBES.values()), driver, seed=0)
    candidate, _ = experiment.candidates.of_trial(Suspicion(CAUSE, 1.0, ()), TRIAL)
    (found,) = experiment._race.run([candidate])
    assert (driver.trials, found.reason) == (trials, reason)
    assert (found.p_value < 1.0) == (reason == "")


@pytest.mark.parametrize(("best", "pairs"), [(0.0, 6), (0.4, 12)])
def test_beside_a_change_that_takes_the_symptom_away_half_a_fall_is_left_early(
    patient, best, pairs
):
    class Two(Counted):
        def drive(self, preset, probes, trials, *, seed):
            self.severity = best if preset is first.after else 1.2
            return super().drive(preset, probes, trials, seed=seed)

    experiment = Experiment(
        patient, Symptom.WOBBLE_STRAIGHT, list(PROBES.values()),
        Two(9.5, best), seed=0,
    )  # fmt: skip
    other = Cause("controller.batch_size", Direction.UP)
    first, second = (
        experiment.candidates.of_trial(Suspicion(cause, 1.0, ()), TRIAL)[0]
        for cause in (CAUSE, other)
    )
    # 40% less, beside all of it or 80%.
    _, left = experiment._race.run([first, second])
    assert left.pairs == pairs


def test_after_a_batch_with_a_change_that_takes_the_symptom_away_none_is_driven(patient):
    def places(driver):
        experiment = Experiment(
            patient, Symptom.WOBBLE_STRAIGHT, list(PROBES.values()), driver, seed=0
        )
        suspicions = suspicions_of(patient.facts(), Symptom.WOBBLE_STRAIGHT)
        experiment.run(suspicions[: 2 * TOGETHER])
        return [entry for entry in experiment.tried if entry.pairs]

    one_batch, several = places(Counted(9.5, 0.0)), places(Counted(9.5, 1.9))
    # A cause has two values at most.
    assert TOGETHER <= len(one_batch) <= TOGETHER + 1
    assert len(several) > TOGETHER + 1
    # Of those that do the same, the likeliest three are driven to the end.
    assert [entry.reason == "" for entry in one_batch].count(True) == MOST_TO_THE_END
    assert one_batch[0].pairs == 12


def test_a_change_that_adds_a_touch_in_twelve_pairs_gets_no_further_pairs(patient):
    class Touching(Counted):
        def drive(self, preset, probes, trials, *, seed):
            rows = super().drive(preset, probes, trials, seed=seed)
            if preset.name == "after":
                rows[-1] = rows[-1] | {"severity": {"collision": 2.0}}
            return rows

    # In eleven pairs the symptom is gone: without the touch 24 pairs would be driven.
    driver = Touching(9.5, 0.0)
    found = raced(patient, driver)
    assert (driver.trials, found.pairs, found.touches) == (12, 12, 1)


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
            patient, Symptom.WOBBLE_STRAIGHT, list(PROBES.values()),
            Rows(["wobble_straight"], [], seldom=seldom), seed=0,
        )  # fmt: skip
        suspicions = suspicions_of(patient.facts(), Symptom.WOBBLE_STRAIGHT)
        experiment.run(suspicions[: 2 * TOGETHER])
        return len([entry for entry in experiment.tried if entry.pairs]) // TOGETHER

    # Every pair shows it; six of the first 12 and of 48.
    assert batches(None) == 1
    assert batches({0, 1}) > 1


@pytest.mark.parametrize(
    ("seldom", "rarity", "is_rare", "needed"),
    [
        # Three probes: three trials of each seed. 6 of 12 are on the way to 24 of 48.
        ({0, 3}, (6, 12), False, 26),
        # 3 of 12 are not, so 12 more are driven: 6 of 24 are on the way to 12 of 48.
        ({0, 4}, (6, 24), True, 52),
        # 9 of 24 are on the way to 18.
        ({0, 4, 5}, (9, 24), False, 35),
        ((), (0, 24), True, None),
    ],
)
def test_a_symptom_is_rare_if_fewer_than_13_of_48_pairs_should_have_it(
    patient, seldom, rarity, is_rare, needed
):
    experiment = Experiment(
        patient, Symptom.WOBBLE_STRAIGHT, list(PROBES.values()),
        Rows(["wobble_straight"], [], seldom=seldom), seed=0,
    )  # fmt: skip
    experiment.run(suspicions_of(patient.facts(), Symptom.WOBBLE_STRAIGHT)[:2])
    assert experiment.rarity == rarity
    assert (experiment.rarity.is_rare, experiment.rarity.needed) == (is_rare, needed)
    assert bool(experiment.tried) == (not is_rare)


def test_thirteen_falls_are_the_fewest_that_show_a_change():
    # Wilcoxon's p of n falls alone is 2 * 2^-n; the later looks count it four times, Holm 48 times.
    def is_shown(falls):
        p_value = LATER_FACTOR * 2.0 * 2.0**-falls
        return corrected([tried(2.0, 0.0, p_value)])[0].verdict is Verdict.SHOWN

    assert (is_shown(LEAST_FALLS - 1), is_shown(LEAST_FALLS)) == (False, True)


@pytest.mark.parametrize(("seldom", "pairs"), [({0, 1}, 3), ({2, 3}, 9)])
def test_the_first_look_at_a_change_lasts_until_two_pairs_have_the_symptom(patient, seldom, pairs):
    """A seed has three pairs; with the symptom from the third seed on, the eighth pair suffices."""
    found = raced(patient, Rows(["wobble_straight"], ["wobble_straight"], seldom=seldom))
    assert (found.pairs, found.reason) == (pairs, "little or no fall in the first pairs")


def test_what_no_pair_shows_is_taken_away_though_a_sound_file_leaves_some_of_it():
    """A distance from the plan: 2.0 half widths before, 0.35 after, 1.0 is the threshold."""
    assert tried(2.0, 0.35, 0.001, showing=0).takes_all
    # One pair still shows it; or it was only a weak sign before.
    assert not tried(2.0, 0.35, 0.001, showing=1).takes_all
    assert not tried(0.8, 0.35, 0.001, showing=0).takes_all


def test_a_change_with_which_no_drive_begins_is_no_cure(patient):
    """As a radius with which the start itself is blocked: the log is too short for a symptom."""

    class NotBegun(Counted):
        def drive(self, preset, probes, trials, *, seed):
            rows = super().drive(preset, probes, trials, seed=seed)
            is_after = preset.name == "after"
            return [r | {"outcome": "aborted", "severity": {}} if is_after else r for r in rows]

    found = raced(patient, NotBegun(9.5, 0.0))
    assert found.fall == 0.0
    assert not found.takes_all
