"""Columns without skill: standing still, crashing and giving up win no verdict.

Twenty goals on a map, one trial each, unless a test says otherwise.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from drake_navbench.analysis.contests import Match, contest_of
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.pair_verdict import PairVerdict, pair_verdicts
from drake_navbench.analysis.paired_tests import PairedVerdict, judge_pairs
from drake_navbench.analysis.verdicts import FirstPlace, faults_of, scenario_verdicts
from drake_navbench.campaign.run_results import Results

GOALS = 20
NAMES = ("time_to_goal_s", "min_clearance_m", "cross_track_error_mean_m", "jerk_rms_mps3")
METRICS = [entry for entry in all_metrics() if entry.name in NAMES]
SUITES = {f"map_{goal}": "map" for goal in range(GOALS)}
WANDERING = np.linspace(0.0, 0.01, GOALS)
NOTHING = dict.fromkeys(NAMES, np.nan)


def column(name, *, first=(0, "succeeded"), seed=0, others="succeeded", **metrics) -> pd.DataFrame:
    """A trial to each goal; first: how many of them end otherwise than the others, and how."""
    count, ending = first
    values = {"time_to_goal_s": 20.0, "min_clearance_m": 0.3}
    values |= {"cross_track_error_mean_m": 0.05, "jerk_rms_mps3": 1.0}
    measured = {key: value * (1.0 + WANDERING) for key, value in values.items()}
    identity = {"scenario": list(SUITES), "controller": name, "seed": seed, "trial": 0}
    outcome = [ending] * count + [others] * (GOALS - count)
    rows = pd.DataFrame(identity | {"suite": "map", "outcome": outcome, "reason": ""} | measured)
    return rows.assign(**metrics)


def verdict_on(old: pd.DataFrame, new: pd.DataFrame) -> PairVerdict:
    contest = contest_of(old, new, [Match("old", "new")], SUITES)
    (found,) = pair_verdicts(judge_pairs([contest], metrics=METRICS))
    return found


OLD = column("old")
QUICK = {"time_to_goal_s": OLD["time_to_goal_s"] - 5.0}


def test_who_crashes_everywhere_is_not_said_to_drive_alike():
    crashing = [column(name, others="error", **NOTHING) for name in ("old", "new")]
    assert verdict_on(*crashing).text == (
        "nothing is compared between old and new: in every pair a trial ended as an error."
    )


def test_who_fails_in_another_way_is_not_said_to_drive_alike():
    old = column("old", first=(19, "aborted"))
    new = column("new", first=(19, "timed_out"), jerk_rms_mps3=[3.0] * 19 + [1.0 + WANDERING[-1]])
    assert verdict_on(old, new).text == (
        "no difference is shown between old and new in 20 pairs: they differ only where they do "
        "not arrive."
    )
    same = old.assign(controller="new")
    assert verdict_on(old, same).text == "new drives exactly like old in every trial."


def test_who_stands_still_wins_nothing_where_nobody_arrives():
    old = column("old", others="timed_out")
    still = column("new", others="timed_out", min_clearance_m=1.0 + WANDERING, jerk_rms_mps3=0.0)
    for pair in ((old, still), (still.assign(controller="old"), old.assign(controller="new"))):
        found = verdict_on(*pair)
        assert found.text == (
            "no difference is shown between old and new in 20 pairs; neither arrives in map, where "
            "smallest clearance and jerk changed."
        )
    judged = judge_pairs([contest_of(old, still, [Match("old", "new")], SUITES)], metrics=METRICS)
    assert not judged.of(PairedVerdict.BETTER)


@pytest.mark.parametrize(
    ("ending", "reservation"),
    [
        ("aborted", "too few to decide: arrivals 20 -> 17 of 20 in map"),
        (
            "collided",
            "too few to decide: touches 0 -> 3 of 20 in map, arrivals 20 -> 17 of 20 in map",
        ),
        (
            "error",
            "new alone ended as an error in 3 pairs; too few to decide: arrivals 20 -> 17 of 20 in "
            "map",
        ),
    ],
)
def test_losses_that_are_not_decided_stand_beside_what_is_better(ending, reservation):
    new = column("new", first=(3, ending), **QUICK)
    assert verdict_on(OLD, new).text == (
        "new is better than old, in time to the goal, and is not shown to be worse in anything; "
        f"{reservation}."
    )


def test_a_loss_in_a_metric_that_is_not_listed_is_told():
    rough = {"jerk_rms_mps3": 3.0 * OLD["jerk_rms_mps3"]}
    both = verdict_on(OLD, column("new", **QUICK, **rough))
    assert both.text == "new is better than old in time to the goal, and worse in jerk."
    assert [detail.partition(" in ")[0] for detail in both.details] == [
        "jerk worse",
        "time to the goal better",
    ]
    assert verdict_on(OLD, column("new", **rough)).text == "new is worse than old, in jerk."


def test_a_mean_whose_interval_holds_zero_is_said_to_be_unsure():
    # 19 are 1 s quicker and one 12 s slower: -0.35 s in the mean, and 1.4 s to either side of it.
    gains = np.where(np.arange(GOALS) < 1, 12.0, -1.0) + WANDERING
    (detail,) = verdict_on(OLD, column("new", time_to_goal_s=OLD["time_to_goal_s"] + gains)).details
    assert detail.startswith("time to the goal better in map: 20.1 -> 19.8 s (-0.3")
    assert detail.endswith("; the ranks decide, as a few pairs make the mean unsure)")


def test_who_drives_to_each_goal_more_often_is_not_worse_for_it():
    """Of four trials a goal one fails; the other run has the first of them alone."""
    often = pd.concat([OLD.assign(seed=seed, outcome="succeeded") for seed in range(3)])
    often = pd.concat([often, column("old", seed=3, others="aborted")])
    once = column("new", seed=0)
    assert verdict_on(often, once).text == "new drives exactly like old in every trial."
    # Without a seed in common nothing is paired.
    contest = contest_of(OLD, column("new", seed=7), [Match("old", "new")], SUITES)
    assert not judge_pairs([contest], metrics=METRICS).findings


def test_the_best_of_a_map_is_judged_by_goals_and_not_by_trials():
    """New is 10 s slower to one goal of four and 1 s quicker to the others, in 8 trials each."""
    tables = []
    for seed in range(8):
        gains = np.array([10.0, -4.5, -4.4, -4.6]) + 0.001 * seed
        old = OLD[:4].assign(seed=seed)
        new = old.assign(controller="new", time_to_goal_s=old["time_to_goal_s"] + gains)
        tables += [old, new]
    table = pd.concat(tables, ignore_index=True)
    assert Results(table, Path()).best("time_to_goal_s") is None
    quicker = table["time_to_goal_s"].where(
        table["controller"] == "old", 15.0 + 0.1 * table["seed"]
    )
    assert Results(table.assign(time_to_goal_s=quicker), Path()).best("time_to_goal_s") == "new"


def in_one_place(*columns: pd.DataFrame) -> pd.DataFrame:
    """The goals as seeds of one scenario."""
    table = pd.concat(columns, ignore_index=True)
    return table.assign(scenario="door", seed=table.groupby("controller").cumcount())


@pytest.mark.parametrize(
    ("first", "fault"),
    [
        ((8, "aborted"), "arrived in 12 of 20 trials, old in 20 of 20"),
        ((1, "error"), "ended as an error in 1 trial"),
        ((1, "collided"), "touched something in 1 trial"),
    ],
)
def test_who_gives_up_where_it_is_slow_is_not_the_quickest(first, fault):
    table = in_one_place(OLD, column("new", first=first, **QUICK))
    assert faults_of(table) == {"new": fault}
    (found,) = scenario_verdicts(table, "door", ["time_to_goal_s"])
    assert (found.standing, found.best) == (FirstPlace.FAULTY, None)
    assert found.text.startswith("new is first: ")
    assert f"; but new {fault}, so that nobody is best" in found.text


def test_equal_differences_of_few_pairs_are_no_lead():
    # 14.0 and 14.5 s twice: coarse times of one law do that in up to one of eight pairs of trials.
    def best(count: int) -> str | None:
        times = [{"time_to_goal_s": value} for value in (14.5, 14.0)]
        sides = zip(("old", "new"), times, strict=True)
        table = in_one_place(*(column(name, **time)[:count] for name, time in sides))
        (found,) = scenario_verdicts(table, "door", ["time_to_goal_s"])
        return found.best

    assert [best(count) for count in (2, 3)] == [None, "new"]


def test_a_metric_that_only_the_base_has_is_gone():
    judged = judge_pairs(
        [contest_of(OLD, column("new", min_clearance_m=np.nan), [Match("old", "new")], SUITES)],
        metrics=METRICS,
    )
    (gone,) = judged.of(PairedVerdict.GONE)
    assert gone.quantity.name == "min_clearance_m"
