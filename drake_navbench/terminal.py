"""The console that everything is printed to."""

from __future__ import annotations

from rich.console import Console

# In a file or a pipe there is no width to respect; tables should come out whole.
PIPE_WIDTH = 160


def terminal(*, quiet: bool = False) -> Console:
    """Returns the console that everything is printed to."""
    console = Console(quiet=quiet, highlight=False)
    if not console.is_terminal:
        console.width = PIPE_WIDTH
    return console
