"""Prints to the terminal: the progress of compiling and of trials, failed trials."""

from __future__ import annotations

import os
import re
from collections.abc import Collection
from pathlib import Path
from typing import Self

import pandas as pd
from rich.console import Console
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
from rich.text import Text

from drake_navbench.analysis.numbers import counted
from drake_navbench.campaign.driving import Progress
from drake_navbench.logs.outcome import Outcome

# The width for a file or a pipe, unless COLUMNS gives one.
PIPE_WIDTH = 160
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


class _Progress:
    """A progress bar, for a `with` statement."""

    _bar: RichProgress

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.stop()


class CampaignProgress(_Progress):
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


class CompileProgress(_Progress):
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
    count, outcome = counted(len(group), "trial"), first.outcome.replace("_", " ")
    return f"{first.controller}, {count} {outcome} in {where}: {first.reason}"
