"""tuning.html: the results of a tuning study, and their validation on fresh seeds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from markupsafe import Markup

from drake_navbench.analysis.figures.style import figure_style, written_svg
from drake_navbench.analysis.figures.tuning import front_figure, slices_figure
from drake_navbench.analysis.html import page_environment
from drake_navbench.analysis.numbers import number
from drake_navbench.logs.results import file_name
from drake_navbench.typed_files.dotted_names import flattened
from drake_navbench.typed_files.output_file import write_text

RESULT_NAME = "tuning.json"
PAGE_NAME = "tuning.html"
FIGURES = Path("figures") / "tuning"
# The parts of a front point's judgement -> their names on the page.
PARTS = {"fresh": "fresh seeds", "held_out": "held-out scenarios"}
# The scenarios in which only touches count -> their names on the page.
GUARDS = {"closed_way": "a closed way", "random_worlds": "random worlds"}


def write_tuning_page(folder: Path) -> Path:
    """Writes the page of a tuning folder from its tuning.json; returns its path."""
    result = json.loads((folder / RESULT_NAME).read_text(encoding="utf-8"))
    objectives = result["task"]["objectives"]
    configurations, front = result["configurations"], result["front"]
    judged = [*front, *result["touching"]]
    searched = list(configurations[0]["parameters"]) if configurations else []
    with figure_style():
        shown = (
            written_svg(front_figure(configurations, front, objectives), folder / FIGURES / "front")
            if configurations
            else Markup()
        )
        slices = {
            name: written_svg(
                slices_figure(configurations, name, objectives),
                folder / FIGURES / file_name(f"slice-{name}"),
            )
            for name in searched
        }
    environment = page_environment()
    environment.filters.update(number=number, percent=_percent, places=_places)
    page = {
        "result": result,
        "objectives": objectives,
        "searched": searched,
        "baseline": dict(flattened(result["task"]["parameters"])),
        "front_figure": shown,
        "slices": slices,
        "parts": _in_all(PARTS, front),
        "driven_parts": _in_all(PARTS | GUARDS, judged),
        "guards": _in_all(GUARDS, judged),
        "judged": judged,
        "dropped": sum(entry["ending"] == "dropped" for entry in configurations),
        "touching": [entry for entry in configurations if entry["touches"]],
        "trials": sum(entry["trials"] for entry in configurations),
    }
    path = folder / PAGE_NAME
    write_text(path, environment.get_template("tuning.html").render(page=page))
    return path


def _in_all(titles: dict[str, str], points: list[dict[str, Any]]) -> dict[str, str]:
    """Returns the titles of the parts that these points drove; all points drove the same parts."""
    return {key: title for key, title in titles.items() if points and key in points[0]}


def _places(touches: dict[str, int]) -> str:
    """Returns the places of touches with their numbers: 'doorway 3, random_world_7 1'."""
    return ", ".join(f"{name} {count}" for name, count in touches.items())


def _percent(share: float) -> str:
    """Returns a signed share in percent with one decimal."""
    text = f"{share:+.1%}"
    return text if float(text[:-1]) else "0.0%"
