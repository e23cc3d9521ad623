"""What a terminal shows while trials run, and the tables after them."""

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

from drake_navbench.campaign import Progress


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


def print_scenario(
    console: Console, trials: pd.DataFrame, table: pd.DataFrame, scenario: str
) -> None:
    """Prints one scenario's table: metrics by controllers, and how the trials ended."""
    rows = trials[trials["scenario"] == scenario]
    rich_table = Table(title=scenario, title_justify="left", title_style="bold")
    rich_table.add_column("metric")
    rich_table.add_column("unit")
    for controller in table.columns.drop("unit"):
        rich_table.add_column(str(controller), justify="right")
    for metric, values in table.iterrows():
        cells = ["-" if pd.isna(v) else f"{v:.3f}" for v in values.drop("unit")]
        rich_table.add_row(str(metric), str(values["unit"]), *cells)
    rich_table.add_section()
    outcomes = []
    for controller in table.columns.drop("unit"):
        counts = rows[rows["controller"] == controller]["outcome"].value_counts()
        outcomes.append(", ".join(f"{count} {outcome}" for outcome, count in counts.items()))
    rich_table.add_row("outcome", "", *outcomes)
    console.print(rich_table)
