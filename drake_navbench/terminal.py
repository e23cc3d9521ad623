"""The console that everything is printed to."""

from __future__ import annotations

from rich.console import Console

# In a file or a pipe there is no width to respect; tables should come out whole.
PIPE_WIDTH = 160


def terminal(*, quiet: bool = False, stderr: bool = False) -> Console:
    """Returns the console that everything is printed to; stderr: the one for errors."""
    console = Console(quiet=quiet, stderr=stderr, highlight=False)
    if not console.is_terminal:
        console.width = PIPE_WIDTH
    return console
