"""tuning.html: what a search of parameters found, and what is left of it on fresh seeds."""

from __future__ import annotations

import json
from pathlib import Path

from markupsafe import Markup
from matplotlib.figure import Figure

from drake_navbench.analysis.figures.style import SVG, figure_style, write_figure
from drake_navbench.analysis.figures.tuning import front_figure, slices_figure
from drake_navbench.analysis.html import page_environment
from drake_navbench.analysis.numbers import number
from drake_navbench.parameter_names import flattened
from drake_navbench.results import file_name, write_text

RESULT_NAME = "tuning.json"
PAGE_NAME = "tuning.html"
FIGURES = Path("figures") / "tuning"
PERCENT = 100.0
# Parts of a front point's judgement, with what they are called on the page.
PARTS = {"fresh": "fresh seeds", "held_out": "held-out scenarios"}


def write_tuning_page(folder: Path) -> Path:
    """Writes the page of a tuning folder from its tuning.json; returns its path."""
    result = json.loads((folder / RESULT_NAME).read_text(encoding="utf-8"))
    objectives = result["task"]["objectives"]
    configurations, front = result["configurations"], result["front"]
    searched = list(configurations[0]["parameters"]) if configurations else []
    with figure_style():
        shown = (
            _written(front_figure(configurations, front, objectives), folder / FIGURES / "front")
            if configurations
            else Markup()
        )
        slices = {
            name: _written(
                slices_figure(configurations, name, objectives),
                folder / FIGURES / file_name(f"slice-{name}"),
            )
            for name in searched
        }
    environment = page_environment()
    environment.filters.update(number=number, percent=_percent)
    page = {
        "result": result,
        "objectives": objectives,
        "searched": searched,
        "baseline": dict(flattened(result["task"]["parameters"])),
        "front_figure": shown,
        "slices": slices,
        "parts": {key: title for key, title in PARTS.items() if front and key in front[0]},
        "dropped": sum(entry["is_dropped"] for entry in configurations),
        "trials": sum(entry["pairs"] for entry in configurations),
    }
    path = folder / PAGE_NAME
    write_text(path, environment.get_template("tuning.html").render(page=page))
    return path


def _percent(share: float) -> str:
    """Returns a signed share in percent with one decimal."""
    text = f"{PERCENT * share:+.1f}"
    return f"{text if float(text) else '0.0'}%"


def _written(figure: Figure, stem: Path) -> Markup:
    """Writes a figure as SVG, and returns it as it stands in a page."""
    (path,) = write_figure(figure, stem, (SVG,))
    text = path.read_text(encoding="utf-8")
    # Ours, not anybody's text: matplotlib has escaped the names in it.
    return Markup(text[text.index("<svg") :])
