"""The fate of each parameter of a Nav2 file: rows of data, and the table that they make."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import groupby
from typing import NamedTuple

WIDTH = 80
INDENT = "    "


class Status(StrEnum):
    """The fate of a parameter of a Nav2 file."""

    USED = "used"
    OTHER_FORM = "used in another form"
    ASSUMED = "assumed; no file tells it"
    STAND_IN = "not supported; replaced"
    DOUBTFUL = "probably a mistake; Nav2 does the same"
    UNREAD = "not read by Nav2"
    NO_MEANING = "no effect in simulation"


# Parameters of these statuses are listed by name side by side; nothing more is said of them.
LISTED = (Status.USED, Status.NO_MEANING)


class CheckRow(NamedTuple):
    """The fate of a parameter, or of a whole node where `parameter` is ''.

    node: its name without the leading slash. remark: the reason or further facts; may be ''. line:
    the parameter's line in its file.
    """

    status: Status
    node: str
    parameter: str
    remark: str = ""
    line: int | None = None

    @property
    def place(self) -> str:
        """Node and parameter as one text, 'node: parameter'."""
        return ": ".join(filter(None, (self.node, self.parameter)))

    @property
    def text(self) -> str:
        """Place, line and remark as one line."""
        line = f" (line {self.line})" if self.line is not None else ""
        return f"{self.place}{line}: {self.remark}" if self.remark else f"{self.place}{line}"


@dataclass(frozen=True)
class Check:
    """The rows of one or several files, in the order of reading."""

    rows: tuple[CheckRow, ...]

    @property
    def stand_ins(self) -> tuple[CheckRow, ...]:
        """The rows of parameters that are not supported."""
        return self.of(Status.STAND_IN)

    @property
    def is_whole(self) -> bool:
        """Whether the check has no stand-ins."""
        return not self.stand_ins

    def of(self, status: Status) -> tuple[CheckRow, ...]:
        """Returns the rows with a status."""
        return tuple(row for row in self.rows if row.status == status)

    def summary(self) -> str:
        """Returns one line with the number of rows of each status."""
        counts = ((len(self.of(status)), status) for status in Status)
        return ", ".join(f"{count} {status.split(';')[0]}" for count, status in counts if count)

    def as_text(self, width: int = WIDTH) -> str:
        """Returns the table: first rows with remarks, then lists of names, a paragraph a node."""
        lines = []
        told = (
            Status.STAND_IN,
            Status.DOUBTFUL,
            Status.UNREAD,
            Status.OTHER_FORM,
            Status.ASSUMED,
            *LISTED,
        )
        for status in told:
            rows = self.of(status)
            if rows:
                lines += ["", f"{status[0].upper()}{status[1:]} ({len(rows)})"]
                lines += _listed(rows, width) if status in LISTED else _full_lines(rows, width)
        return "\n".join([*_wrapped(self.summary(), width), *lines])


def _full_lines(rows: Iterable[CheckRow], width: int) -> list[str]:
    return [line for row in rows for line in _wrapped(f"- {row.text}", width)]


def _listed(rows: Sequence[CheckRow], width: int) -> list[str]:
    nodes = list(dict.fromkeys(row.node for row in rows))
    by_node = sorted(rows, key=lambda row: nodes.index(row.node))
    lines = []
    for node, group in groupby(by_node, key=lambda row: row.node):
        names = [
            f"{row.parameter} ({row.remark})" if row.remark and row.parameter else row.parameter
            for row in group
        ]
        text = ", ".join(filter(None, names))
        if text:
            lines += _wrapped(f"- {node}: {text}", width)
    whole = [row.node for row in rows if not row.parameter and not row.remark]
    if whole:
        lines += _wrapped(f"- whole nodes: {', '.join(dict.fromkeys(whole))}", width)
    told = [row for row in rows if not row.parameter and row.remark]
    return lines + _full_lines(told, width)


def _wrapped(text: str, width: int) -> list[str]:
    return textwrap.wrap(
        text, width, subsequent_indent=INDENT, break_on_hyphens=False, break_long_words=True
    )
