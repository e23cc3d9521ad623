"""How the ablations of harmony are compared: rows with known answers."""

from __future__ import annotations

import pandas as pd
import pytest


@pytest.fixture(scope="module")
def ablations(study):
    return study("harmony_ablations")


def rows_of(column, times_s, *, family="s_curve", outcome="succeeded", jerk=0.3):
    """Returns a row a time to the goal; scalars are held."""
    return pd.DataFrame(
        {
            "column": column,
            "family": family,
            "scenario": [f"{family}_{place}" for place in range(len(times_s))],
            "seed": 1,
            "outcome": outcome,
            "simulated_time_s": times_s,
            "time_to_goal_s": times_s,
            "cross_track_error_mean_m": 0.02,
            "jerk_rms_mps3": jerk,
            "min_clearance_m": 0.4,
            "lateral_acceleration_max_mps2": 0.1,
            "matters": "backing up",
        }
    )


def test_a_part_is_worth_what_harmony_loses_without_it_in_parts_of_the_margin(ablations):
    whole = [20.0, 20.2, 19.8, 20.1, 19.9, 20.0]
    rows = pd.concat(
        [
            rows_of("harmony", whole),
            # 0.5 s of the allowed 1 s; twice the jerk, of which a tenth is allowed.
            rows_of("backing up", [time_s + 0.5 for time_s in whole], jerk=0.6),
        ]
    )
    told = ablations.compared(rows, "backing up").set_index("measure")
    assert told["in margins"].to_dict() == pytest.approx(
        {"time": 0.5, "path error": 0.0, "jerk": 10.0, "clearance": 0.0}
    )
    assert told.loc["jerk", "p"] < 1e-6
    assert told.loc["clearance", "p"] == pytest.approx(0.5)
    # The other families are not driven: the part does nothing there.
    pooled = ablations.with_pooled(told.reset_index(), 5).set_index(["family", "measure"])
    assert pooled.loc[("pooled", "jerk"), "in margins"] == pytest.approx(2.0)


def test_arrivals_are_lost_and_gained_by_unit(ablations):
    rows = pd.concat(
        [
            rows_of("harmony", [20.0] * 3, outcome=["succeeded", "aborted", "succeeded"]),
            rows_of("backing up", [20.0] * 3, outcome=["collided", "succeeded", "succeeded"]),
        ]
    )
    told = ablations.arrivals(rows, "backing up")
    assert (told["lost"], told["gained"], told["units"], told["touches"]) == (1, 1, 3, 1)
    assert told["fewer in"] == ""


def test_a_column_whose_first_trial_of_a_scenario_equals_harmonys_is_not_driven_further(ablations):
    rows = pd.concat(
        [rows_of(name, [20.0, 21.0], family="doorway") for name in ("harmony", "backing up")]
    )
    assert ablations.does_nothing(rows, "backing up", "doorway")
    rows.loc[(rows["column"] == "backing up"), "jerk_rms_mps3"] += 1e-12
    assert not ablations.does_nothing(rows, "backing up", "doorway")
    # Worlds differ: they are driven in any case.
    worlds = pd.concat([rows_of(name, [20.0]) for name in ("harmony", "backing up")])
    assert not ablations.does_nothing(worlds, "backing up", "s_curve")


def test_every_part_is_found_where_it_is_replaced(ablations):
    for part in ablations.COLUMNS.values():
        before = [getattr(owner, name) for owner, name, _ in part.replaced]
        with part.off():
            pass
        assert before == [getattr(owner, name) for owner, name, _ in part.replaced]


def test_a_missing_file_of_rows_is_one_line(ablations, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["harmony_ablations.py", "--judge", "nowhere.csv"])
    with pytest.raises(SystemExit, match="2"):
        ablations.main()
    assert "--judge nowhere.csv: no such file" in capsys.readouterr().err
