"""The tables in the terminal: every number whole, at any width."""

from __future__ import annotations

import io
import re

import pandas as pd
import pytest
from rich.console import Console

from drake_navbench.analysis.tables import published_rows
from drake_navbench.campaign.console import PIPE_WIDTH, name_lines, print_scenario, terminal

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


def printed(table: pd.DataFrame, width: int, **options: bool) -> str:
    stream = io.StringIO()
    console = Console(file=stream, width=width, highlight=False, markup=False)
    print_scenario(console, table, "own", **options)
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
    lines = printed(scenario_table(8), width).splitlines()
    assert max(map(len, lines)) <= width
    # Every metric has one line in every part, none of them without its values.
    row = next(line for line in lines if line.startswith("path_length"))
    assert re.search(r"\d\.\d{3}", row)


def test_controllers_that_do_not_fit_are_spread_evenly():
    lines = printed(scenario_table(8), 80).splitlines()
    parts = [len(re.findall(r"\d\.\d{3}", line)) for line in lines if "path_length" in line]
    assert len(parts) > 1
    assert sum(parts) == 8
    assert max(parts) - min(parts) <= 1


def test_numbers_have_four_significant_digits():
    index = pd.MultiIndex.from_tuples([("m", "s")] * 3, names=["metric", "unit"])
    text = printed(pd.DataFrame({"rpp": [1234.56, 0.0123456, float("nan")]}, index=index), 80)
    assert [line.split()[-1] for line in text.splitlines()[3:6]] == ["1235", "0.01235", "–"]


def test_an_impossible_task_is_called_so():
    assert printed(scenario_table(1), 80, is_impossible=True).startswith(
        "own: impossible on purpose, every trial should be aborted"
    )


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
    ],
)
def test_a_long_name_is_broken_between_its_words(name, lines):
    assert name_lines(name).split("\n") == lines
