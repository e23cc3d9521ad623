"""kept/drawn/SCENARIO.json: the inputs from which a scenario's figures and charts were drawn.

If logs, code and choice of figures are unchanged, and the figures' files are as they were written,
nothing is drawn again.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from drake_navbench.analysis.content_stamps import code_stamp, file_stamp, stamp_of
from drake_navbench.analysis.figures.choice import FIGURES_FOLDER, FigureChoice, FigureEntry
from drake_navbench.logs.results import ResultsFolder, file_name
from drake_navbench.typed_files.output_file import write_text

# The stem of a figure's files, without folders.
STEM = re.compile(r"\w[\w.-]*")


class Drawing(NamedTuple):
    """The figures of a scenario and the numbers of its charts. log_count: number of drawn logs."""

    figures: list[FigureEntry]
    chart: dict[str, Any] | None
    log_count: int


def drawing_stamp(paths: Mapping[str, str], choice: FigureChoice, columns: Sequence[str]) -> str:
    """Returns the stamp of a scenario's drawing. paths: the stamps of its logs by path in POSIX
    form. columns: all of the results, which have colours of their own.
    """
    return stamp_of(code_stamp(), str(choice), list(columns), paths)


def read_drawing(root: Path, scenario: str, stamp: str) -> Drawing | None:
    """Returns the drawing of a scenario with this stamp; None if it must be drawn.

    root: the results folder.
    """
    own = root / FIGURES_FOLDER / file_name(scenario)
    try:
        kept = json.loads(_path(root, scenario).read_text(encoding="utf-8"))
        if kept["stamp"] != stamp:
            return None
        figures = [_figure(own, scenario, figure) for figure in kept["figures"]]
        return Drawing(figures, kept["chart"], int(kept["log_count"]))
    except (OSError, KeyError, TypeError, ValueError, RecursionError):
        return None


def _figure(own: Path, scenario: str, kept: Mapping[str, Any]) -> FigureEntry:
    """Returns a figure; raises ValueError if one of its files has changed since it was written."""
    name, files = str(kept["name"]), kept["files"]
    if not STEM.fullmatch(name):
        raise ValueError(name)
    for suffix, stamp in files.items():
        if (
            not STEM.fullmatch(suffix.removeprefix("."))
            or file_stamp(own / f"{name}{suffix}") != stamp
        ):
            raise ValueError(suffix)
    width, height = map(int, kept["size"])
    controller, kind, title = (str(kept[key]) for key in ("controller", "kind", "title"))
    return FigureEntry(scenario, controller, kind, title, f"{own.name}/{name}", (width, height))


def write_drawing(
    root: Path, scenario: str, stamp: str, choice: FigureChoice, drawing: Drawing
) -> None:
    """Keeps the drawing of a scenario, whose figures are written already."""
    folder = root / FIGURES_FOLDER
    kept = {
        "stamp": stamp,
        "log_count": drawing.log_count,
        "figures": [
            {
                "name": figure.stem.partition("/")[2],
                "controller": figure.controller,
                "kind": figure.kind,
                "title": figure.title,
                "size": figure.size,
                "files": {s: file_stamp(folder / f"{figure.stem}{s}") for s in choice.suffixes},
            }
            for figure in drawing.figures
        ],
        "chart": drawing.chart,
    }
    write_text(_path(root, scenario), json.dumps(kept, allow_nan=False) + "\n")


def _path(root: Path, scenario: str) -> Path:
    return ResultsFolder(root).kept_path / "drawn" / f"{file_name(scenario)}.json"
