"""report.html: one static page that opens from the results folder, without server or network."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from drake_navbench.analysis.chart_library import chart_library
from drake_navbench.analysis.figures.choice import FIGURES_FOLDER, FigureChoice
from drake_navbench.analysis.folder_analysis import FolderAnalysis, analyse_folder
from drake_navbench.analysis.html import inline_svg, page_environment, script_json
from drake_navbench.analysis.invariants import warnings_of
from drake_navbench.analysis.many_trials import MOST_LOGS_OPENED
from drake_navbench.analysis.metrics.definition import Better
from drake_navbench.analysis.metrics.registry import all_metrics, installed_metrics
from drake_navbench.analysis.numbers import EMPTY, short_number, typeset
from drake_navbench.analysis.overview import overview_of
from drake_navbench.analysis.rank_changes import rank_changes, sentence
from drake_navbench.analysis.report_sections import (
    compute_note,
    legs_table,
    link_to,
    listed_trials,
    metric_rows,
    pair_rows,
    scenario_section,
    trial_rows,
)
from drake_navbench.analysis.report_summary import summary_of
from drake_navbench.analysis.reproduction.page import ParametersOf, nothing_known
from drake_navbench.analysis.reproduction.reproduction import (
    PAGE_NAME,
    has_published_scenarios,
    write_reproduction,
)
from drake_navbench.analysis.scenario_analysis import HEADLINE_METRICS, LeftOut, ScenarioAnalysis
from drake_navbench.analysis.statistics import Interval
from drake_navbench.analysis.sweeps import PAGE_NAME as SWEEP_PAGE_NAME
from drake_navbench.analysis.tables import (
    COUNT_UNIT,
    scenario_table,
    suite_tables,
    table_to_markdown,
)
from drake_navbench.analysis.totals import differences, totals, totals_csv
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.results import ResultsFolder, file_name, require_own_folders
from drake_navbench.logs.text_tables import csv_text
from drake_navbench.typed_files.output_file import write_text
from drake_navbench.typed_files.typed_yaml import read_yaml

REPORT_NAME = "report.html"
# The page that an import of recordings writes: the gap between simulation and recording.
SIMULATION_GAP_PAGE = "simulation_gap.html"
TOTALS_NAME = "totals.csv"
# The page loads this file to learn whether the replays were copied along with it: a page opened
# from a disk may load a script, but no other file.
REPLAYS_SCRIPT = "replays/are_here.js"
REPLAYS_SCRIPT_TEXT = "// The report asks for this file to learn whether the replays are here.\n"
# The report tells how many trials show a difference of this share of the mean; argument
# `difference`.
DEFAULT_DIFFERENCE = 0.05


class ReportResult(NamedTuple):
    """A written report: its path, the files left out, and the sentences of its verdict."""

    path: Path
    trial_count: int
    left_out: list[LeftOut]
    verdict: tuple[str, ...] = ()


def build_report(
    folder: Path,
    *,
    figures: FigureChoice = FigureChoice.KEY,
    jobs: int = 2,
    difference: float = DEFAULT_DIFFERENCE,
    measured: pd.DataFrame | None = None,
    parameters_of: ParametersOf = nothing_known,
) -> ReportResult:
    """Computes tables, figures and report.html of a results folder from its logs, and writes them.

    With trials of the published scenarios it also writes the reproduction of the publication.
    figures: the choice of figures to draw. difference: the share of the mean for which the report
    tells the needed number of trials. measured: rows as from `trial_row` of logs that need no
    measuring. parameters_of: as for `write_reproduction`. Raises InputError where the folder is no
    results folder, or contains links to other folders.
    """
    results = ResultsFolder(folder)
    results.read_manifest()
    require_own_folders(folder)
    analysis = analyse_folder(folder, figures=figures, jobs=jobs, measured=measured, keeps=True)
    trials = analysis.trials
    for scenario in analysis.scenarios:
        if scenario.trials and not scenario.is_in_totals:
            table = scenario_table(trials, scenario.scenario)
            write_text(
                results.table_path(scenario.scenario, ".csv"), csv_text(table, has_index=True)
            )
            write_text(results.table_path(scenario.scenario, ".md"), table_to_markdown(table))
            legs = legs_table(scenario.trials)
            if len(legs):
                path = results.table_path(f"{scenario.scenario}_legs", ".csv")
                write_text(path, csv_text(legs))
    if told := totals(trials):
        write_text(folder / TOTALS_NAME, totals_csv(told))
    publication = ""
    if has_published_scenarios(trials["scenario"]):
        publication = write_reproduction(folder, trials, parameters_of).sentence
    if sweep := analysis.manifest.get("sweep"):
        from drake_navbench.analysis.sweep_page import write_sweep

        write_sweep(folder, trials, sweep)
    path = folder / REPORT_NAME
    page = page_of(analysis, difference, publication)
    write_text(path, render(analysis, page))
    if results.replays_path.is_dir():
        write_text(folder / REPLAYS_SCRIPT, REPLAYS_SCRIPT_TEXT)
    return ReportResult(path, len(trials), analysis.left_out, tuple(page["summary"].sentences))


def render(analysis: FolderAnalysis, page: Mapping[str, Any]) -> str:
    """Returns the page's HTML, with everything that it shows; page: as from `page_of`."""
    environment = page_environment(_columns(analysis))
    environment.globals.update(
        figures_folder=FIGURES_FOLDER,
        figure_source=lambda stem: inline_svg(analysis.path / FIGURES_FOLDER / f"{stem}.svg"),
    )
    environment.filters.update(
        number=short_number,
        interval=interval,
        typeset=typeset,
        script_json=script_json,
        sort_key=sort_key,
    )
    return environment.get_template("report.html").render(page=page)


def _columns(analysis: FolderAnalysis) -> list[str]:
    """Returns all columns of the results: the requested ones, and those that were driven."""
    driven = [
        name for entry in analysis.scenarios if entry.trials for name in entry.table["controller"]
    ]
    return [*analysis.manifest.get("controllers", []), *driven]


def interval(bounds: Interval) -> str:
    """Returns '[low, high]', a dash where it is undefined."""
    if not math.isfinite(bounds.low):
        return EMPTY
    return f"[{short_number(bounds.low)}, {short_number(bounds.high)}]"


def sort_key(value: float | None) -> str:
    """Returns the key by which a cell is sorted, '' for a cell without a value."""
    return "" if value is None or math.isnan(value) else f"{value:.7g}"


def _suite_means(trials: pd.DataFrame) -> list[tuple[str, str, str, str, float]]:
    """Returns (suite, metric, controller, unit, mean) of every metric that has a mean."""
    names = [metric.name for metric in all_metrics() if metric.name in trials]
    return [
        (suite, str(metric), str(controller), unit, mean)
        for suite, table in suite_tables(trials, names).items()
        for (metric, unit), means in table.iterrows()
        for controller, mean in means.items()
        if unit != COUNT_UNIT and math.isfinite(mean)
    ]


def page_of(
    analysis: FolderAnalysis, difference: float = DEFAULT_DIFFERENCE, publication: str = ""
) -> dict[str, Any]:
    """Returns the contents of the page.

    publication: a sentence on what the trials say about the publication.
    """
    driven = [s for s in analysis.scenarios if s.trials]
    scenarios = [s for s in driven if not s.is_in_totals]
    trials = analysis.trials
    outcomes = trials["outcome"].value_counts()
    missing = _missing(analysis)
    clean_of = {s.scenario: s.clean_scenario for s in driven if s.clean_scenario}
    changes = rank_changes(trials, clean_of)
    listed = listed_trials(driven)
    return {
        "manifest": analysis.manifest,
        "summary": summary_of(
            scenarios, totals(trials), _descriptions_of_touching(analysis, scenarios)
        ),
        "overview": overview_of(scenarios),
        "rank_changes": changes,
        "rank_sentences": [
            sentence([change for change in changes if change.scenario == name])
            for name in dict.fromkeys(change.scenario for change in changes)
        ],
        "publication": publication,
        "compute_note": compute_note(analysis.manifest),
        "glossary": list(installed_metrics().items()),
        "charts": list(analysis.charts),
        "chart_library": chart_library() if analysis.charts else "",
        "replays_script": REPLAYS_SCRIPT if _has_replays(analysis) else "",
        "reproduction": link_to(analysis.path, analysis.path / PAGE_NAME),
        "simulation_gap": link_to(analysis.path, analysis.path / SIMULATION_GAP_PAGE),
        "sweep": link_to(analysis.path, analysis.path / SWEEP_PAGE_NAME),
        "folder": analysis.path.resolve().name,
        "trial_count": len(trials),
        "outcomes": [
            (str(outcome).replace("_", " "), int(outcomes.get(str(outcome), 0)))
            for outcome in Outcome
        ],
        "controllers": list(dict.fromkeys(trials["controller"])),
        "scenario_count": len(driven),
        "scenarios": [scenario_section(analysis, entry) for entry in scenarios],
        "totals": totals(trials),
        "suite_means": _suite_means(trials),
        "differences": differences(trials),
        "headlines": _headlines(scenarios),
        "without_arrival": [s.scenario for s in scenarios if not s.anyone_arrived],
        "impossible": [s.scenario for s in driven if s.is_impossible],
        "expected_aborts": sum(_aborts(s) for s in driven if s.is_impossible),
        "left_out": analysis.left_out,
        "missing": missing,
        "missing_count": sum(count.total() for count in missing.values()),
        "wanted_count": sum(1 for _ in _wanted(analysis)),
        "warnings": _warnings(driven),
        "stand_ins": analysis.manifest.get("stand_ins", ()),
        "stand_ins_of_columns": analysis.manifest.get("stand_ins_of_columns", {}),
        "metric_rows": [row for entry in scenarios for row in metric_rows(entry)],
        "themes": list(installed_metrics()),
        "pair_rows": [row for entry in scenarios for row in pair_rows(entry, difference)],
        "trial_rows": [row for entry in driven for row in trial_rows(analysis, entry, listed)],
        "unlisted_count": len(trials) - sum(map(len, listed.values())),
        "most_logs_opened": MOST_LOGS_OPENED,
        "difference": difference,
        "has_all_figures": any(entry.controller for entry in analysis.figures),
    }


def _descriptions_of_touching(
    analysis: FolderAnalysis, scenarios: Sequence[ScenarioAnalysis]
) -> dict[str, str]:
    """Returns the descriptions of the presets that touched something, by name."""
    touching = [s.controller for entry in scenarios for s in entry.successes if s.touched]
    folder = analysis.path / "inputs/controllers"
    paths = {name: folder / f"{file_name(name)}.yaml" for name in dict.fromkeys(touching)}
    return {
        name: str(read_yaml(path).get("description", ""))
        for name, path in paths.items()
        if path.is_file()
    }


def _aborts(scenario: ScenarioAnalysis) -> int:
    return sum(entry.row["outcome"] == Outcome.ABORTED for entry in scenario.trials)


def _wanted(analysis: FolderAnalysis) -> Iterator[tuple[str, str, int]]:
    """Returns scenario, controller and number of every trial that the manifest requests."""
    manifest = analysis.manifest
    count = manifest.get("request", {}).get("trials", 0)
    return product(manifest.get("scenarios", ()), manifest.get("controllers", ()), range(count))


def _missing(analysis: FolderAnalysis) -> dict[str, Counter[str]]:
    """Returns the number of trials that an interrupted run lacks, by scenario and controller."""
    results = ResultsFolder(analysis.path)
    missing: dict[str, Counter[str]] = {}
    for scenario, controller, trial in _wanted(analysis):
        if not results.log_path(scenario, controller, trial).is_file():
            missing.setdefault(scenario, Counter())[controller] += 1
    return missing


def _warnings(scenarios: Sequence[ScenarioAnalysis]) -> list[str]:
    """Returns one line for every invariant that does not hold in some log."""
    return warnings_of(
        (f"{scenario.scenario}, {entry.row['controller']}, trial {entry.row['trial']}", found)
        for scenario in scenarios
        for entry in scenario.trials
        if (found := entry.violations)
    )


def _headlines(scenarios: Sequence[ScenarioAnalysis]) -> list[dict[str, Any]]:
    """Returns one row for each headline metric, with one verdict for each scenario."""
    rows = []
    for entry in all_metrics():
        if entry.name not in HEADLINE_METRICS or entry.better is Better.NEITHER:
            continue
        cells = [
            next((v for v in scenario.verdicts if v.metric == entry.name), None)
            for scenario in scenarios
        ]
        rows.append({"metric": entry, "verdicts": cells})
    return rows


def _has_replays(analysis: FolderAnalysis) -> bool:
    return ResultsFolder(analysis.path).replays_path.is_dir()
