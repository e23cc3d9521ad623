"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

PLACES = {"l": "---", "r": "---:"}


def markdown_row(cells: Iterable[str]) -> str:
    """Returns a row of a table; a bar in a cell is escaped."""
    return "| " + " | ".join(cell.strip().replace("|", "\\|") for cell in cells) + " |"


def markdown_table(
    titles: Sequence[str], rows: Iterable[Iterable[str]], alignment: str = ""
) -> list[str]:
    """Returns the lines of a table; alignment: `l` or `r` for each column, `l` without."""
    places = "|".join(PLACES[letter] for letter in alignment.ljust(len(titles), "l"))
    return [markdown_row(titles), f"|{places}|", *map(markdown_row, rows)]
