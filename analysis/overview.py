"""The overview: one small bar for each controller, scenario and quantity that counts.

It has only numbers and shares of widths; the page draws the bars.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from drake_navbench.analysis.metrics.definition import Better, Metric
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.numbers import number, typeset
from drake_navbench.analysis.scenario_analysis import ScenarioAnalysis
from drake_navbench.analysis.task_summary import QUANTITIES, means_of

ARRIVED = "Goals reached"
DIGITS = 3


class Bar(NamedTuple):
    """One controller in one cell.

    share: length of the bar, 0 to 1, NaN where there is no value. text: the value in words.
    is_best: whether the verdict names it. is_partial: whether some of its trials failed.
    """

    controller: str
    share: float
    text: str
    is_best: bool = False
    is_partial: bool = False


class OverviewColumn(NamedTuple):
    """The head of a column. hint: which direction is good."""

    title: str
    hint: str


class OverviewRow(NamedTuple):
    """A scenario: a group of bars for every column. note: a text in place of the bars, or ''."""

    scenario: str
    cells: list[list[Bar]]
    note: str = ""


class Overview(NamedTuple):
    """The contents of the overview picture."""

    columns: list[OverviewColumn]
    rows: list[OverviewRow]


def overview_of(scenarios: Sequence[ScenarioAnalysis]) -> Overview:
    """Returns the contents of the overview picture; each of these scenarios has trials."""
    shown = [entry for entry in all_metrics() if entry.name in QUANTITIES]
    hints = {
        Better.LOWER: "shorter is better",
        Better.HIGHER: "longer is better",
        Better.NEITHER: "",
    }
    columns = [OverviewColumn(ARRIVED, hints[Better.HIGHER])]
    columns += [OverviewColumn(entry.title, hints[entry.better]) for entry in shown]
    return Overview(columns, [_row(scenario) for scenario in scenarios])


def _row(scenario: ScenarioAnalysis) -> OverviewRow:
    if scenario.is_impossible:
        return OverviewRow(scenario.scenario, [], "impossible on purpose: see below how it ended")
    if not scenario.anyone_arrived:
        return OverviewRow(scenario.scenario, [], "nobody reached the goal")
    arrivals = [
        Bar(
            success.controller,
            success.succeeded / success.trials,
            f"{success.succeeded} of {success.trials}",
        )
        for success in scenario.successes
    ]
    partial = {s.controller for s in scenario.successes if s.succeeded < s.trials}
    means = means_of(scenario)
    best = {verdict.metric: verdict.best for verdict in scenario.verdicts}
    cells = [arrivals]
    for entry in all_metrics():
        if entry.name not in QUANTITIES:
            continue
        longest = float(means[entry.name].abs().max())
        cells.append(
            [
                Bar(
                    name,
                    abs(value) / longest if longest > 0.0 else 0.0 * value,
                    _text(entry, value),
                    is_best=best.get(entry.name) == name,
                    is_partial=name in partial,
                )
                for name, value in means[entry.name].items()
            ]
        )
    return OverviewRow(scenario.scenario, cells)


def _text(entry: Metric, value: float) -> str:
    if not math.isfinite(value):
        return "no value"
    unit = typeset(entry.unit)
    if 0.0 < abs(value) < entry.relevant:
        return f"<{entry.relevant:g} {unit}"
    return f"{number(value, DIGITS)} {unit}"
