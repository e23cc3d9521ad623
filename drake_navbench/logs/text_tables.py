"""Tables as text: CSV that a spreadsheet shows as it is and never runs, and Markdown."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

import pandas as pd

# The beginning of a text that a spreadsheet takes for a formula; leading blanks do not help.
FORMULA = re.compile(r"\s*[=+\-@]")
AS_TEXT = "'"
# The line under the titles of a column in Markdown, by its alignment.
PLACES = {"l": "---", "r": "---:"}


def csv_text(table: pd.DataFrame, *, has_index: bool = False) -> str:
    """Returns a table as CSV with one line end everywhere.

    A cell or name that begins as a formula does and is no number has AS_TEXT before it.
    has_index: whether the index is written, too.
    """
    shown = table.reset_index() if has_index else table.copy()
    # By place, since two columns may have one name.
    columns = [
        column
        if pd.api.types.is_numeric_dtype(column) or pd.api.types.is_bool_dtype(column)
        else column.map(_as_text)
        for _, column in shown.items()
    ]
    names = [_as_text(name) for name in shown.columns]
    written = pd.concat(columns, axis=1, keys=range(len(columns))) if columns else shown
    return str(written.to_csv(index=False, header=names, lineterminator="\n"))


def _as_text(value: object) -> object:
    if not isinstance(value, str):
        return value
    # A lone carriage return would end the row, which the writer does not know.
    text = value.replace("\r", " ")
    return AS_TEXT + text if FORMULA.match(text) and not _is_number(text) else text


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def cell_text(value: float | int | str | None) -> str:
    """Returns a cell as it is printed: numbers with three figures, '' for None."""
    if value is None:
        return ""
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def markdown_row(cells: Iterable[str]) -> str:
    """Returns a row of a table; a bar in a cell is escaped."""
    return "| " + " | ".join(cell.strip().replace("|", "\\|") for cell in cells) + " |"


def markdown_table(
    titles: Sequence[str], rows: Iterable[Iterable[str]], alignment: str = ""
) -> list[str]:
    """Returns the lines of a table; alignment: `l` or `r` for each column, `l` without."""
    places = "|".join(PLACES[letter] for letter in alignment.ljust(len(titles), "l"))
    return [markdown_row(titles), f"|{places}|", *map(markdown_row, rows)]
