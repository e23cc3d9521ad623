"""A metric of every trial as a dot: one row for each controller, one panel for each scenario."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from drake_navbench.analysis.colors import controller_color
from drake_navbench.analysis.figures.style import INK, figure_style
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.numbers import typeset

ROW_IN, PANEL_IN, WIDTH_IN = 0.32, 0.75, 7.0
# If there are more scenarios than this, one panel shows all of them together.
MOST_PANELS = 8
SPREAD = 0.18


def dots_figure(trials: pd.DataFrame, metric: str) -> Figure:
    """Returns the figure; a bar marks the mean of a controller."""
    controllers = list(dict.fromkeys(trials["controller"]))
    scenarios = list(dict.fromkeys(trials["scenario"]))
    panels = {name: trials[trials["scenario"] == name] for name in scenarios}
    if len(scenarios) > MOST_PANELS:
        panels = {f"{len(scenarios)} scenarios": trials}
    entry = next((found for found in all_metrics() if found.name == metric), None)
    unit = "" if entry is None else typeset(entry.unit)
    height_in = len(panels) * (PANEL_IN + ROW_IN * len(controllers))
    with figure_style():
        figure = Figure(figsize=(WIDTH_IN, height_in), layout="constrained")
        for axes, (name, own) in zip(
            np.atleast_1d(figure.subplots(len(panels), 1)), panels.items(), strict=True
        ):
            for row, controller in enumerate(controllers):
                values = own.loc[own["controller"] == controller, metric].dropna().to_numpy()
                if not len(values):
                    continue
                offsets = SPREAD * (np.arange(len(values)) % 3 - 1)
                color = controller_color(controller, controllers)
                axes.plot(values, row + offsets, "o", color=color, alpha=0.55, markersize=4)
                mean = values.mean()
                axes.plot([mean, mean], [row - 0.35, row + 0.35], color=INK, linewidth=1.6)
            axes.set_yticks(range(len(controllers)), controllers)
            axes.set_ylim(len(controllers) - 0.4, -0.6)
            axes.set_title(name)
        axes.set_xlabel(f"{metric}, {unit}" if unit else metric)
    return figure
