"""A spreadsheet shows what a table holds and runs nothing of it."""

from __future__ import annotations

import csv
import io

import pandas as pd
import pytest

from drake_navbench.logs.text_tables import csv_text, markdown_table


def cells(table: pd.DataFrame, **options) -> list[list[str]]:
    return list(csv.reader(io.StringIO(csv_text(table, **options))))


@pytest.mark.parametrize(
    "text", ["=1+1", "+1+1", "-2+3+cmd|' /C calc'!A0", "@SUM(A1)", " =1", "\t=1", "-"]
)
def test_what_would_be_a_formula_is_text(text):
    assert cells(pd.DataFrame({"name": [text]}))[1] == [f"'{text}"]
    assert cells(pd.DataFrame({text: [1]}))[0] == [f"'{text}"]
    indexed = pd.DataFrame({"x": [1]}, index=pd.Index([text], name="controller"))
    assert cells(indexed, has_index=True)[1] == [f"'{text}", "1"]


@pytest.mark.parametrize("text", ["-0.5", "+1e-3", "-inf", "rpp", "a=1", "\u2013", ""])
def test_numbers_and_other_texts_stay_as_they_are(text):
    assert cells(pd.DataFrame({"name": [text, "x"]}))[1] == [text]


def test_no_cell_ends_its_row():
    table = pd.DataFrame({"name": ["a\r=1", "b\n=1"]})
    assert cells(table) == [["name"], ["a =1"], ["b\n=1"]]


def test_a_table_of_numbers_is_written_as_pandas_writes_it():
    table = pd.DataFrame({"a": [-1.5, float("nan")], "b": [True, False], "c": [-3, 4]})
    assert csv_text(table) == table.to_csv(index=False, lineterminator="\n")
    assert csv_text(table, has_index=True) == table.reset_index().to_csv(index=False)


def test_columns_are_aligned_by_their_letters_and_bars_escaped():
    assert markdown_table(("a", "b", "c"), [("x|y", " 1", "2")], "lr") == [
        "| a | b | c |",
        "|---|---:|---|",
        "| x\\|y | 1 | 2 |",
    ]
