"""How harmony's comparison is judged: rows with known answers."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest


@pytest.fixture(scope="module")
def judgement(study):
    return study("harmony_judgement")


def rows_of(controller, times_s, *, scenario="empty", outcome="succeeded", path_error_m=0.02):
    """Returns a row a time to the goal; scalars are held."""
    return pd.DataFrame(
        {
            "family": scenario,
            "scenario": scenario,
            "seed": np.arange(len(times_s)),
            "controller": controller,
            "outcome": outcome,
            "time_to_goal_s": times_s,
            "cross_track_error_mean_m": path_error_m,
            "jerk_rms_mps3": 0.3,
            "min_clearance_m": 0.4,
            "lateral_acceleration_max_mps2": 0.1,
            "simulated_time_s": times_s,
        }
    )


def noisy(mean, count=30):
    return mean + 0.1 * np.random.default_rng(3).standard_normal(count)


def verdict(judgement, rows, measure, rivals=("rpp",)):
    table = judgement.by_family(judgement.verdicts(rows, list(rivals)))
    return table[table["measure"] == measure].iloc[0]


def test_a_repeated_trial_counts_once(judgement):
    rows = pd.concat([rows_of("harmony", [10.4] * 32), rows_of("rpp", [10.0] * 32)])
    told = verdict(judgement, rows, "time")
    # 4% behind: without chance the difference is what it is.
    assert (told["units"], told["not inferior"]) == (1, "yes")
    assert told["at most"] == pytest.approx(0.4)
    # It counts once too where a third column is by chance.
    rows = pd.concat([rows, rows_of("mppi", noisy(12.0, 32))])
    table = judgement.verdicts(rows, ["rpp", "mppi"])
    units = table[table["measure"] == "time"].set_index("rival")["units"]
    assert units.to_dict() == {"rpp": 1, "mppi": 32}


def test_one_trial_alone_shows_nothing(judgement):
    rows = pd.concat([rows_of("harmony", [9.0]), rows_of("rpp", [10.0])])
    assert verdict(judgement, rows, "time")["not inferior"] == "not shown"
    assert verdict(judgement, rows, "success")["not inferior"] == "not shown"


def test_no_loss_in_30_trials_is_at_most_a_tenth(judgement):
    # 1 - 0.05^(1/30) and, of 300, 1 - 0.05^(1/300).
    assert judgement.share_bound(0, 30) == pytest.approx(0.0950, abs=1e-4)
    assert judgement.share_bound(0, 300) == pytest.approx(0.00994, abs=1e-5)
    rows = pd.concat([rows_of("harmony", noisy(10.0)), rows_of("rpp", noisy(10.1))])
    told = verdict(judgement, rows, "success")
    assert (told["worse by"], told["not inferior"]) == (0.0, "yes")
    lost = rows["controller"].eq("harmony") & rows["seed"].eq(4)
    rows.loc[lost, "outcome"] = "aborted"
    assert verdict(judgement, rows, "success")["not inferior"] == "not shown"


@pytest.mark.parametrize(
    ("rivals_m", "ours_m", "expected"),
    # 0.015 m beside a near one; beside a far one 20% of it.
    [
        (0.01, 0.024, "yes"),
        (0.01, 0.026, "inferior"),
        (0.2, 0.235, "yes"),
        (0.2, 0.245, "inferior"),
    ],
)
def test_the_margin_of_path_error_is_the_larger_of_both(judgement, rivals_m, ours_m, expected):
    rows = pd.concat(
        [
            rows_of("harmony", noisy(10.0), path_error_m=ours_m),
            rows_of("rpp", noisy(10.1), path_error_m=rivals_m),
        ]
    )
    assert verdict(judgement, rows, "path error")["not inferior"] == expected


def test_who_did_not_arrive_has_no_clearance(judgement):
    stood = rows_of("harmony", noisy(10.0), outcome="aborted")
    rows = pd.concat([stood, rows_of("rpp", noisy(10.1))])
    assert set(judgement.verdicts(rows, ["rpp"])["measure"]) == {"success"}


def test_the_best_rival_is_every_rival(judgement):
    rows = pd.concat(
        [
            rows_of("harmony", noisy(10.0)),
            rows_of("rpp", noisy(10.1)),
            rows_of("teb", noisy(9.0)),
        ]
    )
    told = verdict(judgement, rows, "time", ("rpp", "teb"))
    assert (told["rival"], told["not inferior"]) == ("teb", "inferior")


def test_a_loss_is_inferior_beyond_the_margin_and_not_shown_about_it(judgement):
    # Of 30 differences with a standard deviation of 0.1 the limits are 0.03 to either side.
    spread = noisy(0.0) - noisy(0.0).mean()
    own, its = rows_of("harmony", 10.52 + spread), rows_of("rpp", np.full(30, 10.0))
    rows = pd.concat([own, its])
    told = verdict(judgement, rows, "time")
    assert (told["not inferior"], told["margin"]) == ("not shown", 0.5)
    assert told["at most"] - 0.52 == pytest.approx(0.52 - told["at least"])
    own["time_to_goal_s"] += 0.02
    assert verdict(judgement, pd.concat([own, its]), "time")["not inferior"] == "inferior"
    lost = judgement.losses(judgement.verdicts(rows, ["rpp"]))
    assert lost[["measure", "rival"]].to_numpy().tolist() == [["time", "rpp"]]


def test_the_page_tells_who_succeeds_and_the_worst_rival(judgement):
    rows = pd.concat(
        [
            rows_of("harmony", noisy(10.0)),
            rows_of("rpp", noisy(10.1)),
            rows_of("teb", noisy(9.0)),
        ]
    )
    told = judgement.page_table(rows, ["rpp", "teb"]).iloc[0]
    assert told["succeed: harmony; rpp, teb"] == "30; 30, 30"
    assert told["success"] == "at most 9.5%"
    assert told["time or abort time"] == "10.006, `teb` 9.006 **inferior**"


def test_giving_up_is_success_where_the_way_is_closed(judgement):
    settings = {"scenario": "restricted_small_noisy", "outcome": "aborted"}
    rows = pd.concat(
        [rows_of("harmony", noisy(3.0), **settings), rows_of("rpp", noisy(2.5), **settings)]
    )
    assert verdict(judgement, rows, "success")["ours"] == 1.0
    told = verdict(judgement, rows, "abort time")
    assert (told["not inferior"], round(told["worse by"], 6)) == ("inferior", 0.5)


def test_touches_have_an_exact_bound(judgement):
    rows = rows_of("harmony", noisy(10.0))
    assert judgement.touches(rows).iloc[0].tolist()[:4] == ["empty", "harmony", 0, 30]
    rows.loc[0, "outcome"] = "collided"
    told = judgement.touches(rows).iloc[0]
    assert told["touches"] == 1
    assert told["at most"] == pytest.approx(0.1486, abs=1e-4)
