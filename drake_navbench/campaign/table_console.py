"""Prints tables of metrics and controllers to the terminal, with every number whole."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import NamedTuple

import pandas as pd
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from drake_navbench.analysis.numbers import number
from drake_navbench.analysis.tables import COUNT_UNIT, PRINTED, count_name, metrics_table
from drake_navbench.analysis.verdicts import is_failed

BEST_MARK = "★"
NOBODY_IS_BEST: Mapping[str, str] = {}
IMPOSSIBLE = "impossible on purpose, every trial should be aborted"
# A longer name of a controller or a metric takes several lines.
NAME_WIDTH = 12
NAME_WORD = re.compile(r"[^:_=/. -]*[:_=/. -]|[^:_=/. -]+")
# How names of metrics end that have these units.
UNIT_ENDS = {"m/s": "mps", "m/s^2": "mps2", "m/s^3": "mps3", "rad/s": "radps"}
# No table is wider than this.
MAX_WIDTH = 100_000


class _Cells(NamedTuple):
    """A table as text. labels: the headings of the columns that stand in each block, before the
    others; rows: the labels of a row, then its cells; headings: of the cells."""

    labels: list[str]
    headings: list[str]
    rows: list[tuple[list[str], list[str]]]


def print_first_column(console: Console, trials: pd.DataFrame) -> None:
    """Prints the trials of one controller, a line for each scenario.

    Trials that did not reach their goal are only counted: if another controller reaches it, the
    scenario's table leaves their metrics out, too.

    trials: rows as from `trial_row`, of one controller.
    """
    name = str(trials["controller"].iloc[0])
    scenarios = list(dict.fromkeys(trials["scenario"]))
    metrics = [metric for metric in PRINTED if metric in trials]
    counted = trials.copy()
    counted.loc[is_failed(trials), metrics] = math.nan
    tables = {one: metrics_table(counted, one, PRINTED)[name] for one in scenarios}
    print_table(console, pd.DataFrame(tables), f"{name}, the first column", lines_of="scenario")


def print_table(
    console: Console,
    table: pd.DataFrame,
    title: str,
    *,
    lines_of: str = "controller",
    best: Mapping[str, str] = NOBODY_IS_BEST,
) -> None:
    """Prints a table of metrics by controllers, and how the trials ended.

    Controllers or metrics stand below one another, whichever takes fewer lines. What does not fit
    the console's width is spread evenly over several tables. No number is ever wrapped or cut.

    lines_of: noun for the columns, for the heading. best: the controller that is shown to be best,
    by metric; its number gets a star.
    """
    console.print(Text(title, style="bold"))
    layouts = [
        _by_controller(table, lines_of, best, in_lines=str),
        _by_controller(table, lines_of, best, in_lines=name_lines),
        _by_metric(table, best),
    ]
    spread = [blocks for cells in layouts if (blocks := _blocks(console, cells))]
    if not spread:
        _print_as_list(console, table)
        return
    for block in min(spread, key=_line_count):
        console.print(_shown(block))
        console.print()


def name_lines(name: str) -> str:
    """Returns a name on lines of at most NAME_WIDTH letters, broken behind : _ = / . - and blanks.

    A word that is longer than a line is broken within.
    """
    lines = [""]
    for word in NAME_WORD.findall(name):
        if lines[-1] and len(lines[-1]) + len(word) > NAME_WIDTH:
            lines.append("")
        line = lines.pop() + word
        lines += [line[at : at + NAME_WIDTH] for at in range(0, len(line), NAME_WIDTH)]
    return "\n".join(line.rstrip() for line in lines)


def fits(console: Console, table: Table) -> bool:
    """Returns whether a table can be printed with nothing in it wrapped."""
    unlimited = console.options.update(max_width=MAX_WIDTH)
    return Measurement.get(console, unlimited, table).maximum <= console.width


def _by_controller(
    table: pd.DataFrame,
    lines_of: str,
    best: Mapping[str, str],
    in_lines: Callable[[str], str],
) -> _Cells:
    """Returns a line for each controller: how its trials ended, then its metrics.

    in_lines: writes a controller's name, on one line or on several.
    """
    told = [key for key, values in table.iterrows() if key[1] != COUNT_UNIT or values.any()]
    told.sort(key=lambda key: key[1] != COUNT_UNIT)
    headings = [_heading(*key) for key in told]
    rows = [
        ([in_lines(str(name))], [_cell(table, key, name, best) for key in told])
        for name in table.columns
    ]
    return _Cells([lines_of], headings, rows)


def _heading(metric: str, unit: str) -> str:
    """Returns a metric's name on lines, and its unit where the name does not end with one."""
    ends_with_unit = unit == COUNT_UNIT or metric.endswith(f"_{UNIT_ENDS.get(unit, unit)}")
    return name_lines(count_name(metric)) + ("" if ends_with_unit else f"\n{unit}")


def _by_metric(table: pd.DataFrame, best: Mapping[str, str]) -> _Cells:
    """Returns a line for each metric, then how the trials ended."""
    told = [key for key, values in table.iterrows() if key[1] != COUNT_UNIT or values.any()]
    rows = [
        (
            [count_name(key[0]), "" if key[1] == COUNT_UNIT else key[1]],
            [_cell(table, key, name, best) for name in table.columns],
        )
        for key in told
    ]
    return _Cells(["metric", "unit"], [name_lines(str(name)) for name in table.columns], rows)


def _cell(table: pd.DataFrame, key: tuple[str, str], column: str, best: Mapping[str, str]) -> str:
    value = table.at[key, column]
    if key[1] == COUNT_UNIT:
        return f"{value:.0f}"
    return f"{BEST_MARK} {number(value)}" if best.get(key[0]) == column else number(value)


def _blocks(console: Console, cells: _Cells) -> list[_Cells]:
    """Returns the cells in as few blocks of about equal width as fit the console.

    No block where even a single column of cells is too wide.
    """
    count = len(cells.headings)
    for parts in range(1, count + 1):
        bounds = [round(part * count / parts) for part in range(parts + 1)]
        blocks = [
            _Cells(
                cells.labels,
                cells.headings[first:last],
                [(labels, values[first:last]) for labels, values in cells.rows],
            )
            for first, last in pairwise(bounds)
        ]
        if all(fits(console, _shown(block)) for block in blocks):
            return blocks
    return []


def _line_count(blocks: list[_Cells]) -> int:
    """Returns the printed lines: headings, a rule, rows and an empty line for each block."""
    heads = sum(1 + max(text.count("\n") for text in block.headings) for block in blocks)
    names = sum(max(text.count("\n") + 1 for text in row) for row, _ in blocks[0].rows)
    return heads + len(blocks) * (names + 2)


def _shown(block: _Cells) -> Table:
    shown = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=0)
    for label in block.labels:
        shown.add_column(label, no_wrap=True)
    for heading in block.headings:
        shown.add_column(heading, justify="right", no_wrap=True)
    for labels, values in block.rows:
        shown.add_row(*labels, *values)
    return shown


def _print_as_list(console: Console, table: pd.DataFrame) -> None:
    """Prints one line for each number, where a terminal is too narrow even for one controller."""
    for controller, values in table.items():
        console.print(str(controller), soft_wrap=True)
        for (metric, unit), value in values.items():
            shown = f"{value:.0f}" if unit == COUNT_UNIT else f"{number(value)} {unit}"
            console.print(f"  {count_name(metric)}: {shown}", soft_wrap=True)
    console.print()
