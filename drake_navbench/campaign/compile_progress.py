"""The progress bar for compiling kernels: steps, number of compiled kernels, time."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn, TimeElapsedColumn
from rich.text import Text

# The pattern of the files of numba's compiled kernels in their folder.
KERNEL_FILES = "*/*.nbc"


class CompileProgress:
    """A progress bar over the steps of compiling; one step may take a minute.

    So it also shows the number of compiled kernels, counted as files in their folder, and the time.
    """

    def __init__(self, console: Console, kernel_folder: Path) -> None:
        self._bar = Progress(
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
