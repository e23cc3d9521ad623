"""simulation_gap.html: differences between the robots' models and a results folder's recordings."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from matplotlib.figure import Figure

from drake_navbench.analysis.html import page_environment
from drake_navbench.analysis.numbers import number
from drake_navbench.analysis.report import SIMULATION_GAP_PAGE
from drake_navbench.logs.log import METADATA_KEY
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
    figure = Figure(figsize=FIGURE_SIZE_IN, layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    since_s = gap.time_s - gap.time_s[0]
    for index, (one, label) in enumerate(zip(axes, ("v [m/s]", "w [rad/s]"), strict=True)):
        one.plot(since_s, gap.recorded[:, index], color=RECORDED_COLOR, lw=1.0, label="recorded")
        one.plot(since_s, gap.simulated[:, index], color=SIMULATED_COLOR, lw=1.0, label="model")
        one.set_ylabel(label)
        one.grid(alpha=0.3)
    axes[0].legend(loc="upper right", fontsize=8)
    axes[1].set_xlabel("time [s]")
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    write_text(curves_path(log_path), text.getvalue())


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
            info = json.loads((pq.read_metadata(file).metadata or {})[METADATA_KEY])
            gap = info["recording"]["simulation_gap"]
        except (OSError, KeyError, TypeError, ValueError, pa.ArrowException):
            # Simulated, without commands, or unreadable: the report lists those.
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
