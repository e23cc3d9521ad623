"""Tells why a controller decided as it did: `drake-navbench why LOG --at 12.3`."""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drake_navbench.commands.command_line import CommandParser, Options, command, print_text
from drake_navbench.errors import InputError, printable

if TYPE_CHECKING:
    from drake_navbench.trial.why import Why

WIDTH = 80
GAP = "  "


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench why",
        description="Tells why the controller of a trial decided as it did at a time. The trial is "
        "driven again up to there, and must equal the log to the last bit.",
        epilog="exit status: 0 done, 1 the trial driven again is another one, 2 wrong input",
    )
    option = Options(parser)
    option("log", "log of a trial, trials/*/*/trial_*.parquet", Path, metavar="LOG")
    option("--at SECONDS", "time of the trial [s]", float, required=True)
    return parser


def _why(path: Path, time_s: float) -> int:
    from drake_navbench.campaign.logged_trial import logged_trial
    from drake_navbench.logs.log import TrialLog
    from drake_navbench.trial.why import require_explainable, why

    log = TrialLog.read(path)
    try:
        require_explainable(log)
        found = why(logged_trial(log, path), log, time_s)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    print_text("\n".join(map(printable, lines_of(found, log.info["controller"]))) + "\n")
    return 1 if found.doubt else 0


def lines_of(found: Why, column: str) -> list[str]:
    """Returns the answer as lines of 80 columns at most."""
    explanation = found.explanation
    lines = _wrapped(
        f"{column} at {found.time_s:.2f} s, control cycle {found.cycle}: {explanation.sentence}"
    )
    if explanation.rows:
        lines += ["", *table_lines(explanation.columns, explanation.rows)]
    if explanation.notes:
        lines += [""]
    for note in explanation.notes:
        lines += _wrapped(note)
    lines += [""]
    for sentence in found.assurance:
        lines += _wrapped(sentence)
    return lines


def table_lines(
    columns: Sequence[str], rows: Sequence[Sequence[float | int | str | None]]
) -> list[str]:
    """Returns a table as lines; numbers stand right, and the last column is wrapped at 80."""
    from drake_navbench.logs.text_tables import cell_text

    texts = [list(columns), *([cell_text(value) for value in row] for row in rows)]
    widths = [max(len(row[k]) for row in texts) for k in range(len(columns))]
    right = [
        k > 0 and all(not isinstance(row[k], str) or row[k] == "" for row in rows)
        for k in range(len(columns))
    ]
    before = sum(widths[:-1]) + len(GAP) * (len(widths) - 1)
    widths[-1] = min(widths[-1], max(WIDTH - before, 12))
    lines = []
    for row in texts:
        pieces = textwrap.wrap(row[-1], widths[-1]) or [""]
        for number, piece in enumerate(pieces):
            cells = [*(row[:-1] if number == 0 else [""] * (len(row) - 1)), piece]
            padded = [
                text.rjust(width) if is_right else text.ljust(width)
                for text, width, is_right in zip(cells, widths, right, strict=True)
            ]
            lines.append(GAP.join(padded).rstrip())
    lines.insert(1, GAP.join("-" * width for width in widths))
    return lines


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH)


main = command(build_parser, lambda arguments: _why(arguments.log, arguments.at))
