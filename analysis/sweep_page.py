"""sweep.html: the effect of a sweep's fields on each controller, in one file of its own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
from markupsafe import Markup

from drake_navbench.analysis.figures.style import Look, figure_style, written_svg
from drake_navbench.analysis.figures.sweeps import (
    ResponsePanel,
    heat_map_figure,
    response_figure,
)
from drake_navbench.analysis.html import page_environment
from drake_navbench.analysis.numbers import number, typeset
from drake_navbench.analysis.pairs import ComparedPair
from drake_navbench.analysis.scenario_analysis import headline_metrics
from drake_navbench.analysis.sweeps import (
    PAGE_NAME,
    SUCCEEDED,
    Slope,
    constants,
    heat_maps,
    is_numeric,
    long_table,
    responses,
    slope_differences,
    slopes,
    swept_fields,
)
from drake_navbench.analysis.verdicts import comparable_trials
from drake_navbench.logs.results import ResultsFolder, file_name
from drake_navbench.logs.text_tables import csv_text
from drake_navbench.typed_files.output_file import write_text

TABLE_NAME = "sweep"
FIGURES = Path("figures") / "sweep"
# The metrics that are mapped over two fields; the table has all others.
MAPPED_METRICS = (SUCCEEDED, "time_to_goal_s", "min_clearance_m")
# The most cells of a map for each driven point; a Latin hypercube would fill only a diagonal.
MOST_CELLS_PER_POINT = 4


class Steepness(NamedTuple):
    """A metric's slopes over a field, one a controller, and the pairs whose slopes differ."""

    metric: str
    unit: str
    slopes: list[Slope]
    apart: list[ComparedPair]


class AxisSection(NamedTuple):
    """One field in one scenario; figure: as SVG."""

    field: str
    figure: Markup
    steepness: list[Steepness]
    is_compared: bool


class ScenarioSection(NamedTuple):
    """One scenario; maps: as SVG."""

    scenario: str
    axes: list[AxisSection]
    maps: list[Markup]


def write_sweep(folder: Path, trials: pd.DataFrame, sweep: Mapping[str, Mapping[str, Any]]) -> Path:
    """Writes tables/sweep.csv, the figures and sweep.html of a results folder; returns the page.

    trials: as from `trial_row`. sweep: the manifest's.
    """
    table = long_table(trials, sweep)
    write_text(ResultsFolder(folder).table_path(TABLE_NAME, ".csv"), csv_text(table))
    fields = swept_fields(sweep)
    columns = list(dict.fromkeys(table["controller"]))
    with figure_style():
        sections = [
            _scenario_section(folder, str(scenario), rows, fields, columns)
            for scenario, rows in table.groupby("scenario", sort=False)
        ]
    environment = page_environment(columns)
    environment.filters.update(number=number)
    page = {
        "folder": folder.resolve().name,
        "fields": fields,
        "sections": sections,
        "trial_count": len(table),
        "controllers": columns,
        "seeds": table["seed"].nunique() // max(table["scenario"].nunique(), 1),
    }
    path = folder / PAGE_NAME
    write_text(path, environment.get_template("sweep.html").render(page=page))
    return path


def _scenario_section(
    folder: Path, scenario: str, rows: pd.DataFrame, fields: list[str], columns: list[str]
) -> ScenarioSection:
    look = Look(list(dict.fromkeys(rows["controller"])), columns)
    rows = comparable_trials(rows, [entry.name for entry in headline_metrics()])
    stem = folder / FIGURES / file_name(scenario)
    axes = [_axis_section(stem, rows, field, look) for field in fields if rows[field].notna().any()]
    return ScenarioSection(scenario, axes, list(_maps(stem, rows, fields)))


def _metrics() -> list[tuple[str, str]]:
    """Returns name and unit of the metrics that are shown along a field."""
    headline = [(entry.name, typeset(entry.unit)) for entry in headline_metrics()]
    return [(SUCCEEDED, "share"), *headline]


def _axis_section(stem: Path, rows: pd.DataFrame, field: str, look: Look) -> AxisSection:
    panels = [
        ResponsePanel(
            f"{name} [{unit}]", [*responses(rows, field, name), *constants(rows, field, name)]
        )
        for name, unit in _metrics()
        if rows[name].notna().any()
    ]
    figure = written_svg(response_figure(panels, field, look), stem / file_name(field))
    steepness = []
    is_compared = False
    if is_numeric(rows, field):
        for name, unit in _metrics():
            differences = slope_differences(rows, field, name)
            is_compared |= bool(differences)
            apart = [entry for entry in differences if entry.is_shown]
            steepness.append(Steepness(name, unit, slopes(rows, field, name), apart))
    return AxisSection(field, figure, [entry for entry in steepness if entry.slopes], is_compared)


def _maps(stem: Path, rows: pd.DataFrame, fields: list[str]) -> Iterator[Markup]:
    units = dict(_metrics())
    for pair in combinations(fields, 2):
        both = rows.dropna(subset=list(pair))
        points = len(both.drop_duplicates(subset=list(pair)))
        cells = both[pair[0]].nunique() * both[pair[1]].nunique()
        if points == 0 or cells > MOST_CELLS_PER_POINT * points:
            continue
        if not all(is_numeric(both, field) for field in pair):
            continue
        for name in MAPPED_METRICS:
            if both[name].notna().any() and (maps := heat_maps(both, pair, name)):
                label = f"{name} [{units[name]}]"
                figure = heat_map_figure(maps, pair, label)
                yield written_svg(figure, stem / file_name(f"{'-'.join(pair)}-{name}"))
