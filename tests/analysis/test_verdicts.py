"""Words follow the intervals, and say nothing that they do not support."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from drake_navbench.analysis.metrics import metric
from drake_navbench.analysis.paired_comparison import trials_needed
from drake_navbench.analysis.pairs import values_by_seed
from drake_navbench.analysis.verdicts import FirstPlace, comparable_trials, verdict


@metric(unit="s", better="lower")
def time_s(log):
    """How long it took."""
    return 0.0


def trials(**values):
    rows = [
        {"scenario": "empty", "controller": name, "seed": seed, "time_s": value}
        for name, column in values.items()
        for seed, value in enumerate(column)
    ]
    return pd.DataFrame(rows)


def test_a_clear_lead_is_named_with_its_gap():
    found = verdict(trials(rpp=[10.0, 10.1, 9.9], dwb=[12.0, 12.2, 11.8]), "empty", time_s)
    assert found.best == "rpp"
    assert found.text.startswith("rpp is best: 10 s; next dwb, +2 s [")
    assert "in 3 trials" in found.text


def test_who_touched_something_is_first_and_not_best_whatever_its_name():
    rows = trials(best_yet=[10.0, 10.1, 9.9], dwb=[12.0, 12.2, 11.8])
    found = verdict(rows, "empty", time_s, faults={"best_yet": "touched something in 1 trial"})
    assert (found.standing, found.best) == (FirstPlace.FAULTY, None)
    assert found.text.startswith("best_yet is first: 10 s; next dwb, +2 s [")
    assert found.text.endswith(
        "; but best_yet touched something in 1 trial, so that nobody is best"
    )


def test_a_lead_within_the_noise_is_not_claimed_and_the_trials_needed_are_told():
    found = verdict(trials(rpp=[10.0, 12.0, 11.0], dwb=[12.0, 11.0, 11.5]), "empty", time_s)
    assert found.best is None
    assert found.text.startswith("not decided between rpp, dwb")
    assert "needs about" in found.text


def test_a_lead_over_some_names_those_that_are_level():
    found = verdict(
        trials(rpp=[10.0, 12.0, 11.0], dwb=[10.5, 12.0, 11.4], teb=[20.0, 22.0, 21.5]),
        "empty",
        time_s,
    )
    assert found.best is None
    assert (found.standing, found.leaders) == (FirstPlace.UNDECIDED, ("rpp", "dwb"))
    assert "teb" not in found.text


def test_a_certain_but_tiny_difference_is_no_lead():
    found = verdict(trials(rpp=[10.0] * 4, dwb=[10.01] * 4), "empty", time_s)
    assert found.best is None
    assert found.standing is FirstPlace.LEVEL
    assert found.text == "level: rpp, dwb differ by less than 1%"


def test_only_those_in_front_are_level():
    rows = trials(dwb=[12.0, 12.1, 12.3], teb=[10.05, 10.15, 10.25], rpp=[10.0, 10.1, 10.2])
    found = verdict(rows, "empty", time_s)
    assert (found.standing, found.leaders) == (FirstPlace.LEVEL, ("rpp", "teb"))


def test_rounding_is_no_difference():
    found = verdict(trials(rpp=[1e-19] * 4, dwb=[2e-19] * 4), "empty", time_s)
    assert found.best is None
    assert found.text == "level: rpp, dwb are equal"


def test_the_nearest_is_one_that_differs_by_more_than_rounding():
    rows = trials(rpp=[0.0] * 3, teb=[1e-17] * 3, mppi=[0.0, 0.001, 0.005])
    found = verdict(rows, "empty", time_s)
    assert found.leaders == ("rpp", "teb", "mppi")
    assert found.text.startswith("not decided between rpp, teb, mppi: mppi +0.002 s [")
    assert found.text.endswith("; rpp, teb are equal")


def test_of_many_undecided_ones_the_number_is_told_and_the_two_nearest_by_name():
    rows = trials(rpp=[10.0], dwb=[10.5], teb=[11.0], mppi=[12.0])
    found = verdict(rows, "empty", time_s)
    assert found.text.startswith("not decided between all 4: dwb +0.5 s against rpp in one trial")
    assert found.named_leaders == "all 4"
    three = verdict(rows[rows["controller"] != "mppi"], "empty", time_s)
    assert three.named_leaders == "rpp, dwb, teb"


def test_the_trials_needed_are_more_than_there_are():
    # Differences 0, 1, 2 and 1: mean 1, sd 0.816, t = 2.449. t(0.975, 3) = 3.18. To be shown is
    # what exceeds 1% of 11 s.
    columns = {"rpp": [10.0] * 4, "dwb": [10.0, 11.0, 12.0, 11.0]}
    alone = verdict(trials(**columns), "empty", time_s)
    assert alone.text.endswith(f"needs about {trials_needed(math.sqrt(2 / 3), 0.89)} trials")
    # One of four comparisons with the leader: each is made at 98.75% confidence.
    others = {name: [20.0, 20.5, 21.0, 20.2] for name in ("teb", "mppi", "mppi_nav2")}
    found = verdict(trials(**columns, **others), "empty", time_s)
    assert found.leaders == ("rpp", "dwb")
    needed = trials_needed(math.sqrt(2 / 3), 0.89, confidence=0.9875)
    assert needed > 4
    assert found.text.endswith(f"needs about {needed} trials")


def test_who_was_lucky_with_the_seeds_is_not_best():
    # rpp never arrived with seeds 0 and 1, which take long; with the others dwb is quicker.
    rows = trials(rpp=[math.nan, math.nan, 11.0, 11.1], dwb=[20.0, 20.0, 10.0, 10.1])
    found = verdict(rows, "empty", time_s)
    assert (found.standing, found.leaders) == (FirstPlace.UNDECIDED, ("rpp", "dwb"))
    assert "dwb -1 s" in found.text
    assert "needs" not in found.text


def test_without_a_common_trial_nothing_is_level():
    rows = trials(rpp=[1.0, math.nan, 1.0], dwb=[1.001, math.nan, 1.001], teb=[math.nan, 5.0, 5.0])
    rows.loc[(rows["controller"] == "teb") & (rows["seed"] == 2), "time_s"] = math.nan
    found = verdict(rows, "empty", time_s)
    assert found.standing is FirstPlace.UNDECIDED
    assert found.text.startswith(
        "not decided between rpp, dwb, teb: no trial in which both have a value; "
        "rpp, dwb differ by less than 1%"
    )


def test_a_repeated_difference_without_noise_is_certain():
    assert verdict(trials(rpp=[10.0] * 4, dwb=[11.0] * 4), "empty", time_s).best == "rpp"


def test_trials_that_are_one_trial_are_told_as_one_and_need_no_more():
    once = frozenset({"rpp", "dwb"})
    rows = trials(rpp=[10.0] * 4, dwb=[11.0] * 4)
    found = verdict(rows, "empty", time_s, repeated=once)
    assert found.best == "rpp"
    assert found.text == (
        "rpp is best: 10 s; next dwb, +1 s in one trial (n = 1: nothing in these trials is random)"
    )
    assert "needs" not in found.text
    # Beside a random one they are a constant.
    rows = trials(rpp=[10.0] * 4, dwb=[11.0, 12.0, 9.0, 11.0])
    found = verdict(rows, "empty", time_s, repeated=frozenset({"rpp"}))
    assert found.standing is FirstPlace.UNDECIDED
    assert "in 4 trials" in found.text


def test_compute_times_of_equal_trials_are_different_measurements():
    timed = metric(unit="ms", better="lower", name="time_s", is_repeatable=False)(lambda log: 0.0)
    rows = trials(rpp=[1.0, 1.1, 1.0], dwb=[2.0, 2.3, 2.1])
    found = verdict(rows, "empty", timed, repeated=frozenset({"rpp", "dwb"}))
    assert "in 3 trials" in found.text


def test_one_trial_shows_nothing():
    found = verdict(trials(rpp=[10.0], dwb=[20.0]), "empty", time_s)
    assert found.best is None
    assert "in one trial" in found.text


def test_two_trials_show_nothing_and_the_sentence_says_why():
    """Of two ways past, 10 and 12 s, both columns take either: twice alike in one case of eight."""
    found = verdict(trials(rpp=[10.0, 10.01], dwb=[12.0, 12.02]), "empty", time_s)
    assert found.standing is FirstPlace.UNDECIDED
    assert found.text.endswith(
        "against rpp in 2 trials; so few may be alike by chance: at least 3 are needed"
    )
    three = verdict(trials(rpp=[10.0, 10.01, 10.02], dwb=[12.0, 12.02, 12.0]), "empty", time_s)
    assert three.best == "rpp"


def test_missing_values_are_mentioned():
    found = verdict(
        trials(rpp=[1.0] * 3 + [math.nan], dwb=[2.0, 2.1, 2.0, 2.0], teb=[math.nan] * 4),
        "empty",
        time_s,
    )
    assert found.best == "rpp"
    assert "rpp lacks some" in found.text
    assert "no value for teb" in found.text


def test_a_metric_without_a_good_direction_has_no_best():
    neither = metric(unit="s", better="neither", name="time_s")(lambda log: 0.0)
    assert verdict(trials(rpp=[1.0, 1.0], dwb=[2.0, 2.0]), "empty", neither) is None


def test_values_keep_the_order_of_the_controllers():
    table = values_by_seed(trials(teb=[1.0], dwb=[np.nan]), "empty", "time_s")
    assert list(table.columns) == ["teb", "dwb"]
    assert np.isnan(table.loc[0, "dwb"])


def test_giving_up_early_is_not_being_quick():
    rows = trials(rpp=[10.0, 10.1, 10.2], dwb=[1.0, 1.1, 11.0])
    rows["outcome"] = ["succeeded"] * 3 + ["aborted", "aborted", "succeeded"]
    found = verdict(comparable_trials(rows, ["time_s"]), "empty", time_s)
    assert found.best != "dwb"
    assert "dwb lacks some" in found.text


def test_where_nobody_succeeds_all_trials_are_compared_but_nobody_is_best():
    rows = trials(rpp=[1.0, 1.0, 1.0], dwb=[2.0, 2.1, 2.05])
    rows["outcome"] = "aborted"
    found = verdict(comparable_trials(rows, ["time_s"]), "empty", time_s, anyone_arrived=False)
    assert (found.standing, found.best) == (FirstPlace.NO_CONTEST, None)
    assert found.text.startswith("rpp is lowest: 1 s; next dwb, +1.05 s")


@metric(unit="s", better="lower", relevant=0.5)
def coarse_s(log):
    """How long it took, to nobody's interest below half a second."""
    return 0.0


def test_a_certain_difference_below_what_matters_is_no_lead():
    rows = trials(rpp=[10.0] * 4, dwb=[10.4] * 4).rename(columns={"time_s": "coarse_s"})
    found = verdict(rows, "empty", coarse_s)
    assert found.standing is FirstPlace.LEVEL
    assert found.text == "level: rpp, dwb differ by no more than 0.5 s"
    rows = trials(rpp=[10.0] * 4, dwb=[10.6] * 4).rename(columns={"time_s": "coarse_s"})
    assert verdict(rows, "empty", coarse_s).best == "rpp"
