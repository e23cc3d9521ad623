"""What is printed: the console, the progress of the trials, the tables after them."""

from __future__ import annotations

from types import TracebackType

import pandas as pd
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as RichProgress
from rich.table import Table

from drake_navbench.campaign.driving import Progress

COUNT_UNIT = "trials"
NOTHING = "–"
# In a file or a pipe there is no width to respect; tables should come out whole.
PIPE_WIDTH = 160


def terminal(*, quiet: bool = False, stderr: bool = False) -> Console:
    """Returns the console that everything is printed to; stderr: the one for errors."""
    # Names may be anybody's: what looks like markup in them is none.
    console = Console(quiet=quiet, stderr=stderr, highlight=False, markup=False, emoji=False)
    if not console.is_terminal:
        console.width = PIPE_WIDTH
    return console


class CampaignProgress:
    """A progress bar with the trials done, running and failed, and the time left."""

    def __init__(self, console: Console) -> None:
        self._bar = RichProgress(
            TextColumn("trials"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[running]} running, {task.fields[failed]} failed,"),
            TimeRemainingColumn(compact=True),
            TextColumn("left"),
            console=console,
            disable=console.quiet,
        )
        self._task = self._bar.add_task("trials", total=None, running=0, failed=0)

    def __enter__(self) -> CampaignProgress:
        self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._bar.stop()

    def update(self, progress: Progress) -> None:
        """Shows how far the campaign is."""
        self._bar.update(
            self._task,
            total=progress.total,
            completed=progress.done,
            running=progress.running,
            failed=progress.failed,
        )


def print_scenario(console: Console, table: pd.DataFrame, scenario: str) -> None:
    """Prints one scenario's table: metrics by controllers, then how the trials ended."""
    shown = Table(title=scenario, title_justify="left", title_style="bold")
    shown.add_column("metric", no_wrap=True)
    shown.add_column("unit", no_wrap=True)
    for controller in table.columns:
        shown.add_column(str(controller), justify="right", overflow="fold")
    counts = table.index.get_level_values("unit") == COUNT_UNIT
    for (metric, unit), values in table[~counts].iterrows():
        shown.add_row(metric, unit, *(NOTHING if pd.isna(v) else f"{v:.3f}" for v in values))
    shown.add_section()
    for (metric, _), values in table[counts].iterrows():
        if values.any():
            shown.add_row(metric, "", *(f"{v:.0f}" for v in values))
    console.print(shown)
