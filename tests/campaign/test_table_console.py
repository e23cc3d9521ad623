"""The tables in the terminal: every number whole, at any width."""

from __future__ import annotations

import io
import re

import pandas as pd
import pytest
from rich.console import Console

from drake_navbench.analysis.tables import published_rows
from drake_navbench.campaign.console import PIPE_WIDTH, terminal
from drake_navbench.campaign.table_console import name_lines, print_first_column, print_table

CONTROLLERS = ("dwb", "rpp", "teb", "mppi", "mppi_nav2", "rpp:lookahead_dist=0.9", "a", "b")


def scenario_table(controllers: int) -> pd.DataFrame:
    """Returns a table of which every number is another one, with four digits each."""
    rows = [*published_rows("own"), ("trials", "trials"), ("succeeded", "trials")]
    index = pd.MultiIndex.from_tuples(rows, names=["metric", "unit"])
    columns = {
        name: [1.001 + 0.1 * row + 0.001 * column for row in range(len(rows) - 2)] + [4.0, 4.0]
        for column, name in enumerate(CONTROLLERS[:controllers])
    }
    return pd.DataFrame(columns, index=index)


def printed(table: pd.DataFrame, width: int) -> str:
    stream = io.StringIO()
    console = Console(file=stream, width=width, highlight=False, markup=False)
    print_table(console, table, "own")
    return stream.getvalue()


@pytest.mark.parametrize("width", [20, 60, 80, 120])
@pytest.mark.parametrize("controllers", [1, 5, 8])
def test_every_number_is_printed_whole_at_any_width(width, controllers):
    table = scenario_table(controllers)
    text = printed(table, width)
    shown = re.findall(r"(?<![\d.=])\d\.\d{3}(?!\d)", text)
    wanted = [f"{value:.3f}" for value in table[:-2].to_numpy().flat]
    assert sorted(shown) == sorted(wanted)
    assert "…" not in text


@pytest.mark.parametrize("width", [60, 80, 120])
def test_no_line_is_longer_than_the_terminal_is_wide(width):
    assert max(map(len, printed(scenario_table(8), width).splitlines())) <= width


def few_metrics(controllers: int) -> pd.DataFrame:
    """Returns a table of time and clearance, both 1.5, and of 4 trials that arrived."""
    rows = [("time_to_goal_s", "s"), ("min_clearance_m", "m"), ("succeeded", "trials")]
    index = pd.MultiIndex.from_tuples(rows, names=["metric", "unit"])
    return pd.DataFrame({name: [1.5, 1.5, 4] for name in CONTROLLERS[:controllers]}, index=index)


def test_controllers_stand_below_one_another_where_they_do_not_fit_side_by_side():
    assert printed(few_metrics(2), 50).splitlines() == [
        "own",
        "                     time_to_        min_",
        "controller succeeded   goal_s clearance_m",
        "─────────────────────────────────────────",
        "dwb                4    1.500       1.500",
        "rpp                4    1.500       1.500",
        "",
    ]


def test_a_long_name_is_broken_only_where_the_table_would_be_too_wide():
    table = few_metrics(2).rename(columns={"rpp": "rpp:lookahead_dist=0.9"})
    assert "rpp:lookahead_dist=0.9         4    1.500       1.500" in printed(table, 60)
    assert "\nrpp:               4    1.500       1.500\nlookahead_" in printed(table, 45)


def test_a_heading_has_its_unit_below_it_where_its_name_does_not_end_with_one():
    rows = [("success_rate", "%"), ("min_clearance_m", "m"), ("jerk_rms_mps3", "m/s^3")]
    index = pd.MultiIndex.from_tuples(rows, names=["metric", "unit"])
    table = pd.DataFrame({name: [1.0, 2.0, 3.0] for name in "abcdefgh"}, index=index)
    assert printed(table, 50).splitlines()[1:3] == [
        "           success_rate        min_ jerk_rms_",
        "controller            % clearance_m      mps3",
    ]


def test_metrics_stand_below_one_another_where_that_takes_fewer_lines():
    lines = printed(few_metrics(8).drop(columns="rpp:lookahead_dist=0.9"), 120).splitlines()
    assert [line.split()[0] for line in lines[1:] if line] == [
        "metric",
        "──────────────────────────────────────────────────────────────────",
        "time_to_goal_s",
        "min_clearance_m",
        "succeeded",
    ]


def test_what_does_not_fit_is_spread_evenly():
    lines = printed(scenario_table(8), 80).splitlines()
    parts = [len(re.findall(r"\d\.\d{3}", line)) for line in lines if "path_length" in line]
    assert parts == [4, 4]


def test_numbers_have_four_significant_digits():
    index = pd.MultiIndex.from_tuples([("m", "s")], names=["metric", "unit"])
    values = {"dwb": [1234.56], "rpp": [0.0123456], "teb": [float("nan")]}
    text = printed(pd.DataFrame(values, index=index), 20)
    assert [line.split()[-1] for line in text.splitlines()[4:7]] == ["1235", "0.01235", "–"]


@pytest.mark.parametrize(("columns", "width"), [("72", 72), ("", PIPE_WIDTH), ("0", PIPE_WIDTH)])
def test_in_a_pipe_the_width_is_that_of_columns_where_it_is_given(columns, width, monkeypatch):
    monkeypatch.setenv("COLUMNS", columns)
    assert terminal().width == width


@pytest.mark.parametrize(
    ("name", "lines"),
    [
        ("teb_upstream", ["teb_upstream"]),
        ("rpp:lookahead_dist=0.4", ["rpp:", "lookahead_", "dist=0.4"]),
        ("mppi_nav2_ackermann", ["mppi_nav2_", "ackermann"]),
        ("abcdefghijklmnop", ["abcdefghijkl", "mnop"]),
        ("a:abcdefghijklmnop", ["a:", "abcdefghijkl", "mnop"]),
        ("s at rpp.lookahead_dist=0.6", ["s at rpp.", "lookahead_", "dist=0.6"]),
    ],
)
def test_a_long_name_is_broken_between_its_words(name, lines):
    assert name_lines(name).split("\n") == lines


def test_the_first_column_shows_no_metrics_of_trials_that_gave_up():
    rows = pd.DataFrame(
        {
            "scenario": ["doorway", "doorway", "box"],
            "controller": "rpp",
            "outcome": ["succeeded", "aborted", "aborted"],
            "time_to_goal_s": [13.5, 2.25, 4.25],
        }
    )
    stream = io.StringIO()
    print_first_column(Console(file=stream, width=80, highlight=False, markup=False), rows)
    assert "13.50" in stream.getvalue()
    assert not re.search(r"2\.25|4\.25|7\.875", stream.getvalue())
    assert re.search(r"box +0 +1 +–", stream.getvalue())
