"""Prints to the terminal: the progress of compiling and of trials, tables, failed trials."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Mapping
from itertools import pairwise
from pathlib import Path

import pandas as pd
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.measure import Measurement
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as RichProgress
from rich.table import Table
from rich.text import Text

from drake_navbench.analysis.numbers import number
from drake_navbench.analysis.tables import COUNT_UNIT, PRINTED, count_name, metrics_table
from drake_navbench.campaign.driving import Progress
from drake_navbench.logs.log import Outcome

BEST_MARK = "★"
NOBODY_IS_BEST: Mapping[str, str] = {}
IMPOSSIBLE = "impossible on purpose, every trial should be aborted"
# The width for a file or a pipe, unless COLUMNS gives one.
PIPE_WIDTH = 160
# A longer name of a controller takes several lines.
NAME_WIDTH = 12
NAME_WORD = re.compile(r"[^:_=/-]*[:_=/-]|[^:_=/-]+")
# No table is wider than this.
MAX_WIDTH = 100_000
# The pattern of the files of numba's compiled kernels in their folder.
KERNEL_FILES = "*/*.nbc"
# The most lines on unsuccessful trials, and the most scenarios in a line.
MAX_LINES = 6
MAX_SCENARIOS = 3
NUMBER = re.compile(r"-?\d+(\.\d+)?")


def terminal(*, quiet: bool = False, stderr: bool = False) -> Console:
    """Returns the console that everything is printed to; stderr: the one for errors."""
    # Names may contain any text, which must not be read as rich's markup.
    console = Console(quiet=quiet, stderr=stderr, highlight=False, markup=False, emoji=False)
    if not console.is_terminal and not _columns_asked():
        console.width = PIPE_WIDTH
    return console


def _columns_asked() -> bool:
    """Returns whether COLUMNS gives a width, which rich then takes."""
    columns = os.environ.get("COLUMNS", "")
    return columns.isdecimal() and int(columns) > 0


class CampaignProgress:
    """A progress bar with the trials done, running and failed, the time left, and the parts of
    trials whose kernels are being compiled."""

    def __init__(self, console: Console) -> None:
        self._bar = RichProgress(
            TextColumn("trials"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[running]} running, {task.fields[failed]} failed,"),
            TimeRemainingColumn(compact=True),
            TextColumn("left{task.fields[compiling]}"),
            console=console,
            disable=console.quiet,
        )
        self._task = self._bar.add_task("trials", total=None, running=0, failed=0, compiling="")

    def __enter__(self) -> CampaignProgress:
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.stop()

    def update(self, progress: Progress) -> None:
        """Shows how far the campaign is."""
        self._bar.update(
            self._task,
            total=progress.total,
            completed=progress.done,
            running=progress.running,
            failed=progress.failed,
            compiling=f", compiling {', '.join(progress.compiling)}" if progress.compiling else "",
        )


def print_first_column(console: Console, trials: pd.DataFrame) -> None:
    """Prints the trials of one column, a column of the table for each scenario.

    trials: rows as from `trial_row`, of one controller.
    """
    name = str(trials["controller"].iloc[0])
    scenarios = list(dict.fromkeys(trials["scenario"]))
    tables = {one: metrics_table(trials, one, PRINTED)[name] for one in scenarios}
    print_scenario(console, pd.DataFrame(tables), f"{name}, the first column")


def print_scenario(
    console: Console,
    table: pd.DataFrame,
    scenario: str,
    *,
    is_impossible: bool = False,
    best: Mapping[str, str] = NOBODY_IS_BEST,
) -> None:
    """Prints one scenario's table: metrics by controllers, then how the trials ended.

    Where not all controllers fit beside one another, they are spread evenly over several tables. No
    number is ever wrapped or cut.

    is_impossible: whether the task is meant to be given up. best: the controller that is shown to
    be best, by metric; its number gets a star.
    """
    note = f": {IMPOSSIBLE}" if is_impossible else ""
    console.print(Text(f"{scenario}{note}", style="bold"))
    for block in _blocks(console, table):
        if fits(console, _shown(block, best)):
            console.print(_shown(block, best))
        else:
            _print_as_list(console, block)
        console.print()


def _blocks(console: Console, table: pd.DataFrame) -> list[pd.DataFrame]:
    """Returns the columns in as few blocks of about equal size as fit the console's width."""
    count = len(table.columns)
    for parts in range(1, count + 1):
        bounds = [round(part * count / parts) for part in range(parts + 1)]
        blocks = [table.iloc[:, first:last] for first, last in pairwise(bounds)]
        if all(fits(console, _shown(block)) for block in blocks):
            break
    return blocks


def name_lines(name: str) -> str:
    """Returns a name on lines of at most NAME_WIDTH letters, broken behind : _ = / and -.

    A word that is longer than a line is broken within.
    """
    lines = [""]
    for word in NAME_WORD.findall(name):
        if lines[-1] and len(lines[-1]) + len(word) > NAME_WIDTH:
            lines.append("")
        line = lines.pop() + word
        lines += [line[at : at + NAME_WIDTH] for at in range(0, len(line), NAME_WIDTH)]
    return "\n".join(lines)


def fits(console: Console, table: Table) -> bool:
    """Returns whether a table can be printed with nothing in it wrapped."""
    unlimited = console.options.update(max_width=MAX_WIDTH)
    return Measurement.get(console, unlimited, table).maximum <= console.width


def _shown(table: pd.DataFrame, best: Mapping[str, str] = NOBODY_IS_BEST) -> Table:
    shown = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
    shown.add_column("metric", no_wrap=True)
    shown.add_column("unit", no_wrap=True)
    for controller in table.columns:
        name = name_lines(str(controller))
        shown.add_column(name, justify="right", no_wrap=True)
    counts = table.index.get_level_values("unit") == COUNT_UNIT
    for (metric, unit), values in table[~counts].iterrows():
        cells = [
            f"{BEST_MARK} {number(value)}" if best.get(metric) == name else number(value)
            for name, value in values.items()
        ]
        shown.add_row(metric, unit, *cells)
    shown.add_section()
    for (metric, _), values in table[counts].iterrows():
        if values.any():
            shown.add_row(count_name(metric), "", *(f"{v:.0f}" for v in values))
    return shown


def _print_as_list(console: Console, table: pd.DataFrame) -> None:
    """Prints one line for each number, where a terminal is too narrow even for one controller."""
    for controller, values in table.items():
        console.print(str(controller), soft_wrap=True)
        for (metric, unit), value in values.items():
            shown = f"{value:.0f}" if unit == COUNT_UNIT else f"{number(value)} {unit}"
            console.print(f"  {count_name(metric)}: {shown}", soft_wrap=True)


class CompileProgress:
    """A progress bar over the steps of compiling; one step may take a minute.

    So it also shows the number of compiled kernels, counted as files in their folder, and the time.
    """

    def __init__(self, console: Console, kernel_folder: Path) -> None:
        self._bar = RichProgress(
            TextColumn("kernels"),
            BarColumn(),
            _KernelCount(kernel_folder),
            TimeElapsedColumn(),
            console=console,
            disable=console.quiet,
        )
        self._task = self._bar.add_task("kernels", total=None)

    def __enter__(self) -> CompileProgress:
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.stop()

    def update(self, done: int, total: int) -> None:
        """Shows how many steps are done; the first one leaves the bar pulsing."""
        self._bar.update(self._task, total=total if done else None, completed=done)


class _KernelCount(ProgressColumn):
    """The column of a progress bar with the number of kernels compiled since the bar began."""

    # Files are not counted more often than this, s.
    max_refresh = 0.5

    def __init__(self, kernel_folder: Path) -> None:
        super().__init__()
        self._folder = kernel_folder
        self._before = self._count()

    def render(self, task: Task) -> Text:
        """Returns the count as the bar shows it."""
        return Text(f"{self._count() - self._before} compiled,")

    def _count(self) -> int:
        return sum(1 for _ in self._folder.glob(KERNEL_FILES))


def unsuccessful_lines(trials: pd.DataFrame, impossible: Collection[str]) -> list[str]:
    """Returns a line for each controller, outcome and kind of reason; the most frequent first.

    Reasons that differ in their numbers alone are of one kind, shown by the first of them. trials:
    rows as from `trial_row`. impossible: scenarios in which giving up is right; their trials are
    left out, as are trials that ended in an error.
    """
    left_out = [Outcome.SUCCEEDED, Outcome.ERROR]
    rows = trials[~trials["outcome"].isin(left_out) & ~trials["scenario"].isin(impossible)]
    kinds = rows["reason"].astype(str).map(lambda reason: NUMBER.sub("#", reason))
    groups = [group for _, group in rows.groupby(["controller", "outcome", kinds], sort=False)]
    groups.sort(key=len, reverse=True)
    lines = [_line_of(group) for group in groups[:MAX_LINES]]
    if len(groups) > MAX_LINES:
        lines.append(f"{len(groups) - MAX_LINES} more reasons are in the report")
    return lines


def _line_of(group: pd.DataFrame) -> str:
    first = group.iloc[0]
    scenarios = list(dict.fromkeys(group["scenario"]))
    where = ", ".join(scenarios[:MAX_SCENARIOS])
    if len(scenarios) > MAX_SCENARIOS:
        where += f" and {len(scenarios) - MAX_SCENARIOS} more"
    count = f"{len(group)} trial{'s' if len(group) > 1 else ''}"
    return (
        f"{first.controller}, {count} {first.outcome.replace('_', ' ')} in {where}: {first.reason}"
    )
