"""Metrics of a user's file, and which metrics the terminal shows."""

from __future__ import annotations

import pandas as pd
import pytest

from drake_navbench.analysis.metrics.registry import all_metrics, use_metric_files
from drake_navbench.analysis.tables import best_of, metrics_table
from drake_navbench.commands.run import main
from drake_navbench.processes.workers import start_server

METRIC = '''
from drake_navbench.analysis.metrics import metric


@metric(unit="m", better="lower")
def last_x_m(log):
    """Where the robot ends, x [m]."""
    return float(log.samples["x_m"].iloc[-1])
'''


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """A file with a metric in the working directory; afterwards nothing of it is left."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(METRIC)
    yield "mine.py:last_x_m"
    use_metric_files([])


@pytest.mark.usefixtures("real_workers")
def test_a_metric_of_a_file_is_in_terminal_table_and_report(mine, tmp_path, capsys):
    # A server of workers that started before the metric was asked for.
    start_server([])
    arguments = ["restricted_small", "--controllers", "rpp", "--trials", "1", "--jobs", "1"]
    assert main([*arguments, "--metric", mine, "--replay", "none", "--out", "out"]) == 0
    assert "last_x_m" in capsys.readouterr().out
    trials = pd.read_parquet("out/trials.parquet")
    assert trials["last_x_m"].notna().all()
    assert "last_x_m" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("reference", "told"),
    [
        ("mine.py", "expected FILE.py:NAME"),
        ("mine.py:last_x", "did you mean 'last_x_m'"),
        ("none.py:x", "none.py"),
        ("broken.py:x", "cannot be loaded: ZeroDivisionError"),
    ],
)
def test_a_metric_that_cannot_be_had_is_one_line(mine, tmp_path, capsys, reference, told):
    (tmp_path / "broken.py").write_text("1 / 0\n")
    assert main(["empty", "--controllers", "rpp", "--metric", reference]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert told in line
    assert not (tmp_path / "results").exists()


def test_a_metric_of_a_name_that_exists_is_refused(mine, tmp_path, capsys):
    (tmp_path / "mine.py").write_text(METRIC.replace("last_x_m", "min_clearance_m"))
    assert main(["empty", "--controllers", "rpp", "--metric", "mine.py:min_clearance_m"]) == 2
    assert "a metric 'min_clearance_m' exists already" in capsys.readouterr().err
    assert len({entry.name for entry in all_metrics()}) == len(all_metrics())


def test_an_unknown_column_is_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["empty", "--controllers", "rpp", "--columns", "time_to_gaol_s"]) == 2
    assert "did you mean 'time_to_goal_s'" in capsys.readouterr().err


def table_of(outcomes, times):
    """Returns the trials of two controllers in one scenario."""
    return pd.DataFrame(
        {
            "scenario": "hall",
            "controller": ["a"] * 6 + ["b"] * 6,
            "seed": [*range(6)] * 2,
            "trial": [*range(6)] * 2,
            "outcome": outcomes,
            "time_to_goal_s": times,
            "success_rate": [100.0 * (outcome == "succeeded") for outcome in outcomes],
        }
    )


def test_a_failed_trial_is_no_time_to_the_goal_and_touches_are_a_share():
    outcomes = ["succeeded"] * 6 + ["succeeded"] * 3 + ["collided"] * 3
    trials = table_of(outcomes, [10.0] * 9 + [1.0] * 3)
    names = ("success_rate", "touch_rate", "time_to_goal_s")
    table = metrics_table(trials, "hall", names)
    assert list(table["b"])[:3] == [50.0, 50.0, 10.0]
    assert table.loc[("collided", "trials"), "b"] == 3


def test_the_best_mark_goes_to_who_is_shown_to_be_best_alone():
    faster = [10.0, 10.1, 10.2, 10.3, 10.4, 10.5, 12.0, 12.1, 12.2, 12.3, 12.4, 12.6]
    names = ("time_to_goal_s",)
    assert best_of(table_of(["succeeded"] * 12, faster), "hall", names) == {"time_to_goal_s": "a"}
    level = [*faster[:6], *reversed(faster[:6])]
    assert best_of(table_of(["succeeded"] * 12, level), "hall", names) == {}
