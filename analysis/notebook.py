"""A trial's log in a notebook: its metrics as a table, its curves as a picture, its replay."""

from __future__ import annotations

import io
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path
from urllib.parse import quote

import pandas as pd
from matplotlib.figure import Figure

from drake_navbench.analysis.figures.dots import dots_figure
from drake_navbench.analysis.figures.motion import MotionSheet, sheet_of
from drake_navbench.analysis.figures.style import Look, figure_style
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.numbers import typeset
from drake_navbench.errors import InputError
from drake_navbench.logs.log import TrialLog

REPLAY_HEIGHT_PX = 620


@dataclass(frozen=True)
class Picture:
    """A figure that notebooks show by themselves."""

    figure: Figure

    def _repr_png_(self) -> bytes:
        picture = io.BytesIO()
        with figure_style():
            self.figure.savefig(picture, format="png", dpi=90)
        return picture.getvalue()


@dataclass(frozen=True)
class ReplayPage:
    """A replay; a notebook beside or above it shows it in a frame."""

    path: Path

    def _repr_html_(self) -> str:
        address, name = quote(self.path.as_posix()), escape(self.path.as_posix())
        frame = f'<iframe src="{address}" width="100%" height="{REPLAY_HEIGHT_PX}"></iframe>'
        return f'{frame}<p><a href="{address}">{name}</a></p>'


def dots(trials: pd.DataFrame, metric: str) -> Picture:
    """Returns a figure that shows a metric of every trial as a dot."""
    return Picture(dots_figure(trials, metric))


def metrics_of(log: TrialLog) -> pd.DataFrame:
    """Returns every metric of a trial by name: title, value, unit, and the reason for no value."""
    rows = {}
    for entry in all_metrics():
        found = entry.measure(log)
        rows[entry.name] = {
            "metric": entry.title,
            "value": found.value,
            "unit": typeset(entry.unit),
            "empty because": found.reason,
        }
    return pd.DataFrame.from_dict(rows, orient="index")


def plot(log: TrialLog) -> Picture:
    """Returns path, velocities, accelerations and energy of a trial.

    Raises InputError if the trial ended before its first sample.
    """
    _require_samples(log)
    controller = log.info["controller"]
    with figure_style():
        return Picture(MotionSheet().draw(sheet_of([log], controller), Look([controller])))


def replay(log: TrialLog, path: Path | str) -> ReplayPage:
    """Writes the replay of a trial to a file.

    Raises InputError if the trial ended before its first sample.
    """
    from drake_navbench.analysis.replay import write_trial_replay

    _require_samples(log)
    write_trial_replay(log, Path(path), model=model_of(log))
    return ReplayPage(Path(path))


def model_of(log: TrialLog) -> Path | None:
    """Returns the model of a robot that comes with the package; None for any other robot."""
    name = log.info["robot"].get("model")
    if not isinstance(name, str) or not name:
        return None
    path = Path(str(files("drake_navbench.models"))) / name
    return path if path.is_file() else None


def _require_samples(log: TrialLog) -> None:
    if log.samples.empty:
        raise InputError("the trial ended before its first sample; nothing to show")
