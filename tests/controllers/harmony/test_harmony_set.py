"""How harmony without several parts is judged: rows with known answers."""

from __future__ import annotations

import pandas as pd
import pytest


@pytest.fixture(scope="module")
def parts_set(study):
    return study("harmony_set")


def rows_of(column, digests, *, family="s_curve", outcome="succeeded", time_s=20.0, speed_mps=0.3):
    """Returns a row a digest; scalars are held."""
    return pd.DataFrame(
        {
            "column": column,
            "map": "families",
            "family": family,
            "scenario": [f"{family}_{place}" for place in range(len(digests))],
            "seed": 1,
            "outcome": outcome,
            "digest": digests,
            "simulated_time_s": time_s,
            "time_to_goal_s": time_s,
            "cross_track_error_mean_m": 0.02,
            "jerk_rms_mps3": 0.3,
            "min_clearance_m": 0.4,
            "end_speed_mps": speed_mps,
        }
    )


def wide_of(parts_set, *rows):
    return pd.concat(rows).pivot(index=parts_set.KEYS, columns="column")


def test_equal_trials_touches_and_arrivals_are_counted(parts_set):
    ends = ["succeeded", "collided", "succeeded"]
    wide = wide_of(
        parts_set,
        rows_of("harmony", ["a", "b", "c"]),
        rows_of("without", ["a", "x", "y"], outcome=ends),
    )
    told = parts_set.counts(wide)
    assert "1 of 3 trials are equal to the last bit; touches 0, without 1" in told
    assert "right ends 3, without 2: 1 lost, 0 gained" in told


def test_what_is_lost_is_told_in_parts_of_the_margin(parts_set):
    # 0.5 s of the allowed 5% of 20 s.
    open_way = wide_of(parts_set, rows_of("harmony", ["a"]), rows_of("without", ["b"], time_s=20.5))
    told = parts_set.differences(open_way).set_index("measure")["in margins"]
    assert told.to_dict() == pytest.approx(
        {"time": 0.5, "path error": 0.0, "jerk": 0.0, "clearance": 0.0}
    )
    # At a closed door 0.1 m/s of the allowed 0.05 m/s.
    door = {"family": "restricted_large", "outcome": "aborted"}
    closed = wide_of(
        parts_set,
        rows_of("harmony", ["a"], **door).assign(scenario="restricted_large"),
        rows_of("without", ["b"], **door, speed_mps=0.4).assign(scenario="restricted_large"),
    )
    told = parts_set.differences(closed).set_index("measure")["in margins"]
    assert told.to_dict() == pytest.approx({"abort time": 0.0, "speed at the end": 2.0})


def test_the_parts_that_are_left_can_be_taken_out(parts_set):
    replaced = [place for name in parts_set.SET for place in parts_set.PARTS[name].replaced]
    assert len(replaced) >= len(parts_set.SET)
    as_they_are = [getattr(owner, name) for owner, name, _ in replaced]
    with parts_set.without(tuple(parts_set.SET)):
        assert all(getattr(owner, name) is value for owner, name, value in replaced)
    assert [getattr(owner, name) for owner, name, _ in replaced] == as_they_are


def test_a_missing_file_of_rows_is_one_line(parts_set, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["harmony_set.py", "--judge", "nowhere.csv"])
    with pytest.raises(SystemExit, match="2"):
        parts_set.main()
    assert "nowhere.csv: no such file" in capsys.readouterr().err
