"""simulation_gap.html: differences between the robots' models and a results folder's recordings."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from drake_navbench.analysis.figures.choice import SVG
from drake_navbench.analysis.figures.style import figure_style, write_figure
from drake_navbench.analysis.html import page_environment
from drake_navbench.analysis.numbers import number
from drake_navbench.analysis.report import SIMULATION_GAP_PAGE
from drake_navbench.errors import InputError
from drake_navbench.logs.header import read_info
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.ros2.recordings.simulation_gap import SimulationGap
from drake_navbench.typed_files.output_file import write_text

FIGURE_SIZE_IN = (9.0, 3.6)
RECORDED_COLOR, SIMULATED_COLOR = "#0072b2", "#d55e00"


def as_plain(gap: SimulationGap) -> dict[str, Any]:
    """Returns a gap as the log keeps it: the numbers without the curves."""
    return {
        "poses": [entry._asdict() for entry in gap.poses],
        "v_rms_mps": gap.v_rms_mps,
        "w_rms_radps": gap.w_rms_radps,
    }


def write_curves(gap: SimulationGap, log_path: Path) -> None:
    """Draws recorded and simulated speeds beside the log."""
    since_s = gap.time_s - gap.time_s[0]
    with figure_style():
        figure = Figure(figsize=FIGURE_SIZE_IN, layout="constrained")
        axes = figure.subplots(2, 1, sharex=True)
        for index, (one, label) in enumerate(zip(axes, ("v [m/s]", "w [rad/s]"), strict=True)):
            one.plot(since_s, gap.recorded[:, index], color=RECORDED_COLOR, label="recorded")
            one.plot(since_s, gap.simulated[:, index], color=SIMULATED_COLOR, label="model")
            one.set_ylabel(label)
        axes[0].legend(loc="upper right")
        axes[1].set_xlabel("time [s]")
        write_figure(figure, curves_path(log_path).with_suffix(""), (SVG,))


def curves_path(log_path: Path) -> Path:
    """Returns the path of the figure with a recorded trial's curves."""
    return log_path.with_name(f"{log_path.stem}_gap.svg")


def write_gap_page(folder: ResultsFolder) -> Path | None:
    """Writes the page of all recordings in a folder; None where none of them has commands."""
    rows = list(_rows(folder.path))
    if not rows:
        return None
    environment = page_environment()
    environment.filters["number"] = number
    path = folder.path / SIMULATION_GAP_PAGE
    text = environment.get_template(SIMULATION_GAP_PAGE).render(
        folder=folder.path.resolve().name, rows=rows
    )
    write_text(path, text)
    return path


def _rows(path: Path) -> Iterator[dict[str, Any]]:
    """Yields the page's entry for each recorded trial, read from the header of its log alone."""
    for file in sorted((path / "trials").glob("*/*/trial_*.parquet")):
        try:
            info = read_info(file)
        except InputError:
            # The report lists what cannot be read.
            continue
        gap = info.get("recording", {}).get("simulation_gap")
        if gap is None:
            # Simulated, or without commands.
            continue
        figure = curves_path(file)
        yield {
            "scenario": info["scenario"]["name"],
            "controller": info["controller"],
            "trial": info["trial"],
            "bag": info["recording"]["bag"],
            "pose": info["recording"]["pose"],
            "robot": info["robot"]["description"],
            "drive": info["robot"]["drive"],
            "gap": gap,
            "figure": figure.relative_to(path).as_posix() if figure.is_file() else "",
        }
