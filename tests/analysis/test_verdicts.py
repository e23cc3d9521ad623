"""Words follow the intervals, and say nothing that they do not support."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from drake_navbench.analysis.metrics import metric
from drake_navbench.analysis.verdicts import comparable_trials, values_by_seed, verdict


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


def test_a_lead_within_the_noise_is_not_claimed_and_the_trials_needed_are_told():
    found = verdict(trials(rpp=[10.0, 12.0, 11.0], dwb=[12.0, 11.0, 11.5]), "empty", time_s)
    assert found.best is None
    assert found.text.startswith("not decided between rpp, dwb")
    assert "needs about" in found.text


def test_a_lead_over_some_names_those_that_are_level():
    found = verdict(
        trials(rpp=[10.0, 12.0, 11.0], dwb=[10.5, 11.5, 11.2], teb=[20.0, 22.0, 21.0]),
        "empty",
        time_s,
    )
    assert found.best is None
    assert "teb" not in found.text


def test_a_certain_but_tiny_difference_is_no_lead():
    found = verdict(trials(rpp=[10.0] * 4, dwb=[10.01] * 4), "empty", time_s)
    assert found.best is None
    assert found.text == "level: rpp, dwb differ by less than 1%"


def test_rounding_is_no_difference():
    found = verdict(trials(rpp=[1e-19] * 4, dwb=[2e-19] * 4), "empty", time_s)
    assert found.best is None


def test_a_repeated_difference_without_noise_is_certain():
    assert verdict(trials(rpp=[10.0] * 4, dwb=[11.0] * 4), "empty", time_s).best == "rpp"


def test_one_trial_shows_nothing():
    found = verdict(trials(rpp=[10.0], dwb=[20.0]), "empty", time_s)
    assert found.best is None
    assert "in one trial" in found.text


def test_missing_values_are_mentioned():
    found = verdict(
        trials(rpp=[1.0, 1.0, math.nan], dwb=[2.0, 2.0, 2.0], teb=[math.nan] * 3), "empty", time_s
    )
    assert found.best == "rpp"
    assert "rpp lack some" in found.text
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
    assert "dwb lack some" in found.text


def test_where_nobody_succeeds_all_trials_are_compared():
    rows = trials(rpp=[1.0, 1.0], dwb=[2.0, 2.0])
    rows["outcome"] = "aborted"
    assert verdict(comparable_trials(rows, ["time_s"]), "empty", time_s).best == "rpp"
