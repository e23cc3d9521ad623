"""What makes a cause shown and a change helpful: verdicts by numbers that one can count."""

from __future__ import annotations

from dataclasses import replace

import pytest
from fake_drives import CAUSE, PROBES, Rows, judged, tried

from drake_navbench.nav2.patch import Place
from drake_navbench.studies.doctor import visit as visits
from drake_navbench.studies.doctor.change import judge
from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.driving import AGAIN_SEED, FRESH_SEED
from drake_navbench.studies.doctor.reading import Suspicion
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.tried import Verdict, corrected
from drake_navbench.studies.doctor.words import verdict


def test_a_cause_is_shown_only_where_its_p_value_holds_after_correction():
    # A visit may drive 48 changes, so Holm counts 48: 0.001 becomes 0.048, 0.01 becomes 0.47.
    found = corrected([tried(2.0, 0.0, 0.001), tried(2.0, 0.5, 0.01)])
    assert [e.verdict for e in found] == [Verdict.SHOWN, Verdict.NOT_SHOWN]
    assert [e.p_value for e in found] == [pytest.approx(0.048), pytest.approx(0.47)]


def test_a_fall_that_is_small_or_brings_touches_is_not_shown():
    small, touching = tried(2.0, 1.7, 1e-6), tried(2.0, 0.0, 1e-6, touches=1)
    assert {e.verdict for e in corrected([small, touching])} == {Verdict.NOT_SHOWN}


def test_a_symptom_hardly_above_its_threshold_is_gone_if_no_pair_shows_it():
    """Too slow by 6%, and at 89% of the threshold with the sound value: a fall of 16%."""
    gone, left = (tried(1.06, 0.89, 1e-4, showing=count) for count in (0, 1))
    assert [e.verdict for e in corrected([gone, left])] == [Verdict.SHOWN, Verdict.NOT_SHOWN]


def test_what_takes_a_part_away_is_ordered_by_that_part_times_how_likely_it_is():
    # 0.5 times 0.6 is more than 0.8 times 0.2.
    likely, unlikely = (
        tried(2.0, after, 1e-4, suspicion=Suspicion(CAUSE, score, ("Why.",)))
        for after, score in ((1.0, 0.6), (0.4, 0.2))
    )
    assert [e.after for e in corrected([unlikely, likely])] == [1.0, 0.4]
    # What takes all of it away comes first, however unlikely.
    whole = tried(2.0, 0.0, 1e-4, suspicion=Suspicion(CAUSE, 0.1, ("Why.",)))
    assert corrected([likely, whole])[0].after == 0.0


def test_a_change_is_judged_on_the_seeds_of_the_first_look_where_nothing_was_searched(patient):
    driven = set()

    class Noted(Rows):
        def drive(self, preset, probes, trials, *, seed):
            driven.update((probe.name, seed) for probe in probes)
            return super().drive(preset, probes, trials, seed=seed)

    shown = [tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)]
    driver = Noted(["wobble_straight"], [])
    next(judge(patient, shown, Symptom.WOBBLE_STRAIGHT, PROBES, ["straight"], driver, seed=7))
    assert driven == {
        ("probe_straight", 7 + FRESH_SEED), ("probe_door", 7), ("probe_corridor", 7),
    }  # fmt: skip


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


def test_a_change_that_takes_the_symptom_and_brings_no_other_helps(patient):
    found = judged(patient, ["wobble_straight"], [], Symptom.WOBBLE_STRAIGHT)
    # Two seeds of one probe are few: six more are driven.
    assert (found.before_target, found.after_target, found.target_trials) == (8, 0, 8)
    assert found.helps


def test_a_change_that_brings_a_touch_does_not_help(patient):
    found = judged(patient, ["wobble_straight"], ["collision"], Symptom.WOBBLE_STRAIGHT)
    assert found.worse[0] == "collision"
    assert not found.helps


@pytest.mark.parametrize(
    ("again_before", "again_after", "helps"), [(0, 0, True), (1, 1, True), (0, 1, False)]
)
def test_one_further_touch_is_looked_for_again_before_it_counts_against_a_change(
    patient, again_before, again_after, helps
):
    """The change adds a touch in one trial of the door; 16 further seeds tell if it was chance."""
    again = {"before": again_before, "after": again_after}
    further = []

    class Touching(Rows):
        def drive(self, preset, probes, trials, *, seed):
            rows = super().drive(preset, probes, trials, seed=seed)
            is_again = seed == FRESH_SEED + AGAIN_SEED
            if is_again:
                further.append([probe.name for probe in probes] * trials)
            count = again[preset.name] if is_again else int(preset.name == "after" and seed == 0)
            touching = [row for row in rows if row["scenario"] == "probe_door"][:count]
            for row in touching:
                row["severity"] = {**row["severity"], "collision": 2.0}
            return rows

    shown = [tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)]
    driver = Touching(["wobble_straight"], [])
    (found,) = judge(patient, shown, Symptom.WOBBLE_STRAIGHT, PROBES, ["straight"], driver, seed=0)
    assert (found.before["collision"], found.after["collision"]) == (0, 1)
    assert further == [["probe_door"] * 16] * 2
    assert (found.again, found.helps) == ((16, again_before, again_after), helps)
    visited = visits.Visit(patient.facts(), probes=PROBES, treated=Symptom.WOBBLE_STRAIGHT)
    visited.seen, visited.tried = {Symptom.WOBBLE_STRAIGHT: ["straight"]}, shown
    visited.judged = [found]
    told = (
        "Touches in all 12 trials: 0 before, 1 after; in 16 further trials of the probes with the "
        f"further touch {again_before} before, {again_after} after."
    )
    assert (told in verdict(visited)) == helps


def test_where_the_best_change_brings_a_touch_the_next_one_is_judged_and_offered(patient):
    class Mixed(Rows):
        def drive_together(self, presets, probes, trials, *, seed):
            rows = super().drive_together(presets, probes, trials, seed=seed)
            if next(order):
                rows[1] = [row | {"severity": {"collision": 2.0}} for row in rows[1]]
            return rows

    # Of each change: two seeds of its probe, eight of them, and the other probes.
    order = iter([False, False, True, False, False, False])
    shown = [tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)] * 2
    driver = Mixed(["wobble_straight"], [])
    found = visits.Visit(patient.facts(), probes=PROBES, treated=Symptom.WOBBLE_STRAIGHT)
    found.tried = shown
    found.judged = list(
        judge(patient, shown, Symptom.WOBBLE_STRAIGHT, PROBES, ["straight"], driver, seed=0)
    )
    assert [entry.worse for entry in found.judged] == [["collision"], []]
    assert found.cure is found.judged[1]
    found.seen = {Symptom.WOBBLE_STRAIGHT: ["straight"]}
    assert "which was judged first: with that more trials show collision." in verdict(found)


@pytest.mark.parametrize(("left", "best"), [(["spins"], 1), ([], 0)])
def test_of_changes_that_take_the_symptom_away_the_one_that_leaves_the_fewest_others_is_offered(
    patient, left, best
):
    """The file spins as well; the first change leaves that, the second does not."""

    class Mixed(Rows):
        def drive_together(self, presets, probes, trials, *, seed):
            self.symptoms["after"] = left if not found.judged else []
            return super().drive_together(presets, probes, trials, seed=seed)

    shown = [tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)] * 2
    driver = Mixed(["wobble_straight", "spins"], [])
    found = visits.Visit(patient.facts(), probes=PROBES, treated=Symptom.WOBBLE_STRAIGHT)
    found.seen, found.tried = {Symptom.WOBBLE_STRAIGHT: ["straight"]}, shown
    for entry in judge(
        patient, shown, Symptom.WOBBLE_STRAIGHT, PROBES, ["straight"], driver, seed=0
    ):
        found.judged.append(entry)
    # What leaves no symptom is offered without a judgement of the next.
    assert [entry.left for entry in found.judged] == [12 * len(left), 0][: best + 1]
    assert found.cure is found.judged[best]
    told = (
        " It is offered in place of FollowPath.CostCritic.consider_footprint = true, which was"
        " judged first: with that the trials show 12 symptoms in all, with the change offered 0."
    )
    assert (told in verdict(found)) == bool(left)


OTHER_TRIAL = Trial(CAUSE, {Place("controller_server", "FollowPath.vx_max"): 0.3})


def visited(patient, entries, judgements):
    found = visits.Visit(patient.facts(), probes=PROBES, treated=Symptom.WOBBLE_STRAIGHT)
    found.seen = {Symptom.WOBBLE_STRAIGHT: ["straight"]}
    found.tried, found.judged = entries, judgements
    return found


def test_the_likeliest_cause_is_named_although_the_change_of_another_parameter_is_offered(patient):
    first = tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)
    other = tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN, trial=OTHER_TRIAL)
    good = judged(patient, ["wobble_straight"], [], Symptom.WOBBLE_STRAIGHT)
    # With the likeliest one a touch comes up, so it is not offered.
    touching = replace(good, tried=first, after=good.after | {"collision": 1})
    good = replace(good, tried=other, trial=OTHER_TRIAL)
    found = visited(patient, [first, other], [touching, good])
    assert found.cure is good
    assert found.shown == [first, other]
    assert found.rivals == [other]
    assert verdict(found).endswith(
        " The likeliest cause is FollowPath.CostCritic.consider_footprint, by reading: The reason."
        " By driving it cannot be told from others: with FollowPath.CostCritic.consider_footprint"
        " = true the symptom goes, and with FollowPath.vx_max = 0.3 as well."
    )


def test_a_cause_that_fresh_seeds_refute_is_not_the_likeliest(patient):
    first = tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)
    other = tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN, trial=OTHER_TRIAL)
    good = judged(patient, ["wobble_straight"], [], Symptom.WOBBLE_STRAIGHT)
    # All eight fresh trials still show the symptom with the first one.
    found = visited(patient, [first, other], [replace(good, tried=first, after_target=8)])
    assert found.shown == [other, first]
    assert found.rivals == []


def test_a_change_that_leaves_some_of_the_symptom_is_no_rival_of_one_that_takes_it_away(patient):
    first = tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)
    half = tried(2.0, 1.0, 0.001, verdict=Verdict.SHOWN, trial=OTHER_TRIAL)
    assert visited(patient, [first, half], []).rivals == []


@pytest.mark.parametrize(("score", "is_told"), [(2.0, True), (0.5, False)])
def test_what_could_not_be_driven_is_told_if_reading_finds_it_likelier_than_what_is_shown(
    patient, score, is_told
):
    first = tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)
    faster = Suspicion(CAUSE._replace(place="controller.vx_max"), score, ("The reason.",))
    refused = tried(
        0.0, 0.0, 1.0, verdict=Verdict.NOT_TRIED, suspicion=faster, trial=OTHER_TRIAL, pairs=0,
        reason="asks for more speed",
    )  # fmt: skip
    good = judged(patient, ["wobble_straight"], [], Symptom.WOBBLE_STRAIGHT)
    found = visited(patient, [first, refused], [replace(good, tried=first)])
    told = "likely by reading: FollowPath.vx_max = 0.3 (asks for more speed)."
    assert verdict(found).endswith(told) == is_told


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
    visited.tried = [found.tried]
    # Of two that help the one without a price is the change.
    assert visited.cure is found
    visited.judged = [priced]
    told = "(door_stop) in 3 trials, before the change in 1."
    assert "0 after. In the 4 trials of all probes that did not end early before, " in verdict(
        visited
    )
    assert told in verdict(visited)
    one = replace(priced, instead={"too_slow": 1, "no_start": 2})
    visited.judged = [one]
    assert verdict(visited).endswith("it now shows: too_slow in 1 trial, no_start in 2 trials.")
    # A robot that spins and then stops in a door is no better off.
    assert not replace(priced, symptom=Symptom.SPINS).helps


@pytest.mark.parametrize(
    ("instead", "helps"),
    [
        # Who did not come to the goal comes now, and is slow or stops on the way.
        ("too_slow", True), ("stop_start_jerk", True),
        # As heavy, or heavier.
        ("goal_not_reached", False), ("near_miss", False), ("collision", False),
    ],
)  # fmt: skip
def test_a_change_helps_if_what_comes_is_lighter_than_what_goes(patient, instead, helps):
    good = judged(patient, ["false_abort"], [], Symptom.FALSE_ABORT)
    found = replace(good, after=good.after | {instead: good.before[instead] + 2})
    assert found.worse == [instead]
    assert found.helps is helps


def test_what_stands_where_there_was_a_touch_is_told_and_not_held_against_the_change(patient):
    found = judged(patient, ["collision"], ["gives_up_late"], Symptom.COLLISION)
    assert found.helps
    assert found.compared == 0
    # Eight seeds of the probe that showed it, two of the other two.
    assert found.instead == {"gives_up_late": 12}


def test_what_follows_where_the_robot_gave_up_before_is_told_and_not_held_against_the_change(
    patient,
):
    # Without the change every drive ends at its start; with it a box is passed closely.
    found = judged(patient, ["false_abort"], ["near_miss"], Symptom.FALSE_ABORT)
    assert found.helps
    assert (found.compared, found.instead) == (0, {"near_miss": 12})
    # To be stuck for ever in place of giving up is no cure, and a touch never is.
    for worse in ("goal_not_reached", "no_recovery", "collision"):
        assert judged(patient, ["false_abort"], [worse], Symptom.FALSE_ABORT).worse == [worse]
    # Where the robot arrives before the change, as close a pass counts.
    fine = judged(patient, ["spins"], ["near_miss"], Symptom.SPINS)
    assert fine.worse == ["near_miss"]


@pytest.mark.parametrize(
    ("ended", "why"),
    [("is_out_of_time", "had no time left (--budget)"), ("is_interrupted", "was interrupted")],
)
def test_a_visit_that_ends_before_a_cause_was_tried_says_why_and_what_to_try(patient, ended, why):
    found = visits.Visit(patient.facts(), probes=PROBES, treated=Symptom.WOBBLE_STRAIGHT)
    found.seen = {Symptom.WOBBLE_STRAIGHT: ["straight"]}
    found.suspicions = [Suspicion(CAUSE, 1.0, ("The reason.",))]
    setattr(found, ended, True)
    told = verdict(found)
    assert f"The visit {why} before a cause was tried; the same command goes on." in told
    assert told.endswith(": set FollowPath.CostCritic.consider_footprint to true.")
