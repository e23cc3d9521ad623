"""report.html: one static page that opens from the results folder, without server or network."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from shlex import quote
from typing import Any, NamedTuple

import pandas as pd

from drake_navbench.analysis.chart_library import chart_library
from drake_navbench.analysis.circumstances import compute_note
from drake_navbench.analysis.figures.album import FigureChoice
from drake_navbench.analysis.folder_analysis import FIGURES_FOLDER, FolderAnalysis, analyse_folder
from drake_navbench.analysis.html import (
    inline_svg,
    page_environment,
    relative_change,
    script_json,
)
from drake_navbench.analysis.invariants import warnings_of
from drake_navbench.analysis.lead import lead_of
from drake_navbench.analysis.leg_tables import legs_table
from drake_navbench.analysis.lineups import PUBLISHED_SETTINGS
from drake_navbench.analysis.many_trials import MOST_LOGS_OPENED
from drake_navbench.analysis.metrics.definition import Better
from drake_navbench.analysis.metrics.registry import all_metrics, installed_metrics
from drake_navbench.analysis.numbers import EMPTY, PLAIN_BELOW, number, typeset
from drake_navbench.analysis.overview import overview_of
from drake_navbench.analysis.rank_changes import rank_changes, sentence
from drake_navbench.analysis.reproduction import (
    PAGE_NAME,
    has_published_scenarios,
    write_reproduction,
)
from drake_navbench.analysis.reproduction_page import ParametersOf, nothing_known
from drake_navbench.analysis.scenario_analysis import (
    HEADLINE_METRICS,
    LeftOut,
    ScenarioAnalysis,
    TrialEntry,
)
from drake_navbench.analysis.statistics import Interval, trials_needed
from drake_navbench.analysis.sweep_page import PAGE_NAME as SWEEP_PAGE_NAME
from drake_navbench.analysis.sweep_page import write_sweep
from drake_navbench.analysis.tables import published_table, scenario_table, table_to_markdown
from drake_navbench.analysis.totals import differences, totals, totals_csv
from drake_navbench.log import Outcome
from drake_navbench.results import ResultsFolder, write_text

REPORT_NAME = "report.html"
# Written where recordings were imported: how far the simulation is from them.
SIMULATION_GAP_PAGE = "simulation_gap.html"
TOTALS_NAME = "totals.csv"
DIGITS = 3
NARROW_SPACE = "\u202f"
# The page asks for this file to learn whether the replays came along with it: a script is the one
# thing that a page opened from a disk may ask for without being refused.
REPLAYS_SCRIPT = "replays/are_here.js"
REPLAYS_SCRIPT_TEXT = "// The report asks for this file to learn whether the replays are here.\n"
# A page of more rows than these opens slowly, and nobody reads them; trials.parquet has them all.
MOST_TRIALS_LISTED = 1000
# Two trials that differ by this share of the mean should be told apart; asked for as `difference`.
DEFAULT_DIFFERENCE = 0.05


class ReportResult(NamedTuple):
    """Where the report is, and which files it had to leave out."""

    path: Path
    trial_count: int
    left_out: list[LeftOut]


class Column(NamedTuple):
    """A controller's cell in a scenario's table: ours, the published value, their difference."""

    value: float
    ours: str
    published: str
    change: str


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

    With trials of the published scenarios comes the reproduction of the publication, too.
    figures: which of them to draw. difference: share of the mean for which the needed number of
    trials is told. measured: rows of these logs as from `tables.trial_row`, not to be measured
    again. parameters_of: as for `write_reproduction`. Raises InputError where the folder is no
    results folder.
    """
    analysis = analyse_folder(folder, figures=figures, jobs=jobs, measured=measured)
    results = ResultsFolder(folder)
    trials = analysis.trials
    for scenario in analysis.scenarios:
        if scenario.trials and not scenario.is_told_by_totals:
            table = scenario_table(trials, scenario.scenario)
            write_text(results.table_path(scenario.scenario, ".csv"), table.to_csv())
            write_text(results.table_path(scenario.scenario, ".md"), table_to_markdown(table))
            legs = legs_table(scenario.trials)
            if len(legs):
                path = results.table_path(f"{scenario.scenario}_legs", ".csv")
                write_text(path, legs.to_csv(index=False))
    if told := totals(trials):
        write_text(folder / TOTALS_NAME, totals_csv(told))
    publication = ""
    if has_published_scenarios(trials["scenario"]):
        publication = write_reproduction(folder, trials, parameters_of).sentence
    if sweep := analysis.manifest.get("sweep"):
        write_sweep(folder, trials, sweep)
    path = folder / REPORT_NAME
    write_text(path, render(analysis, difference=difference, publication=publication))
    if results.replays_path.is_dir():
        write_text(folder / REPLAYS_SCRIPT, REPLAYS_SCRIPT_TEXT)
    return ReportResult(path, len(trials), analysis.left_out)


def render(
    analysis: FolderAnalysis,
    *,
    difference: float = DEFAULT_DIFFERENCE,
    publication: str = "",
) -> str:
    """Returns the page's HTML, which holds all that it shows.

    publication: a sentence on what the trials say of it.
    """
    environment = page_environment()
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
    page = _page(analysis, difference) | {"publication": publication}
    return environment.get_template("report.html").render(page=page)


def interval(bounds: Interval) -> str:
    """Returns '[low, high]', a dash where it is undefined."""
    if not math.isfinite(bounds.low):
        return EMPTY
    return f"[{short_number(bounds.low)}, {short_number(bounds.high)}]"


def sort_key(value: float | None) -> str:
    """Returns what a cell is sorted by, '' where there is no value."""
    return "" if value is None or math.isnan(value) else f"{value:.7g}"


def short_number(value: float | None) -> str:
    """Returns a value with 3 significant digits, thousands apart; a dash where it is undefined."""
    text = number(value, DIGITS)
    if value is None or not math.isfinite(value) or not 10.0**DIGITS <= abs(value) < PLAIN_BELOW:
        return text
    return f"{float(f'{value:.{DIGITS - 1}e}'):,.0f}".replace(",", NARROW_SPACE)


def _page(analysis: FolderAnalysis, difference: float) -> dict[str, Any]:
    driven = [s for s in analysis.scenarios if s.trials]
    scenarios = [s for s in driven if not s.is_told_by_totals]
    trials = analysis.trials
    outcomes = trials["outcome"].value_counts()
    missing = _missing(analysis)
    clean_of = {s.scenario: s.clean_scenario for s in driven if s.clean_scenario}
    changes = rank_changes(trials, clean_of)
    listed = _listed(driven)
    return {
        "manifest": analysis.manifest,
        "lead": lead_of(scenarios, totals(trials)),
        "overview": overview_of(scenarios),
        "rank_changes": changes,
        "rank_sentences": [
            sentence([change for change in changes if change.scenario == name])
            for name in dict.fromkeys(change.scenario for change in changes)
        ],
        "compute_note": compute_note(analysis.manifest),
        "glossary": list(installed_metrics().items()),
        "charts": list(analysis.charts),
        "chart_library": chart_library() if analysis.charts else "",
        "replays_script": REPLAYS_SCRIPT if _has_replays(analysis) else "",
        "reproduction": _relative(analysis.path, analysis.path / PAGE_NAME),
        "simulation_gap": _relative(analysis.path, analysis.path / SIMULATION_GAP_PAGE),
        "sweep": _relative(analysis.path, analysis.path / SWEEP_PAGE_NAME),
        "folder": analysis.path.resolve().name,
        "trial_count": len(trials),
        "outcomes": [
            (str(outcome).replace("_", " "), int(outcomes.get(str(outcome), 0)))
            for outcome in Outcome
        ],
        "controllers": list(dict.fromkeys(trials["controller"])),
        "scenario_count": len(driven),
        "scenarios": [_scenario(analysis, entry) for entry in scenarios],
        "totals": totals(trials),
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
        "metric_rows": [row for entry in scenarios for row in _metric_rows(entry)],
        "themes": list(installed_metrics()),
        "pair_rows": [row for entry in scenarios for row in _pair_rows(entry, difference)],
        "trial_rows": [row for entry in driven for row in _trial_rows(analysis, entry, listed)],
        "unlisted_count": len(trials) - sum(map(len, listed.values())),
        "most_logs_opened": MOST_LOGS_OPENED,
        "difference": difference,
        "has_all_figures": any(entry.controller for entry in analysis.figures),
    }


def _aborts(scenario: ScenarioAnalysis) -> int:
    return sum(entry.row["outcome"] == Outcome.ABORTED for entry in scenario.trials)


def _wanted(analysis: FolderAnalysis) -> Iterator[tuple[str, str, int]]:
    """Returns scenario, controller and number of every trial that was asked for, where known."""
    manifest = analysis.manifest
    count = manifest.get("request", {}).get("trials", 0)
    return product(manifest.get("scenarios", ()), manifest.get("controllers", ()), range(count))


def _missing(analysis: FolderAnalysis) -> dict[str, Counter[str]]:
    """Returns how many trials an interrupted run still lacks: scenario -> controller -> count."""
    results = ResultsFolder(analysis.path)
    missing: dict[str, Counter[str]] = {}
    for scenario, controller, trial in _wanted(analysis):
        if not results.log_path(scenario, controller, trial).is_file():
            missing.setdefault(scenario, Counter())[controller] += 1
    return missing


def _warnings(scenarios: Sequence[ScenarioAnalysis]) -> list[str]:
    """Returns a line for every invariant that does not hold in some log."""
    return warnings_of(
        (f"{scenario.scenario}, {entry.row['controller']}, trial {entry.row['trial']}", found)
        for scenario in scenarios
        for entry in scenario.trials
        if (found := entry.violations)
    )


def _headlines(scenarios: Sequence[ScenarioAnalysis]) -> list[dict[str, Any]]:
    """Returns a row a headline metric with one verdict a scenario."""
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


def _scenario(analysis: FolderAnalysis, scenario: ScenarioAnalysis) -> dict[str, Any]:
    figures = [f for f in analysis.figures if f.scenario == scenario.scenario]
    metrics = {entry.name: entry for entry in all_metrics()}
    results = ResultsFolder(analysis.path)
    replay = results.replay_path(scenario.scenario)
    controllers = [success.controller for success in scenario.successes]
    table = _published_rows(analysis, scenario)
    return {
        "name": scenario.scenario,
        "description": scenario.description,
        "is_impossible": scenario.is_impossible,
        "successes": {success.controller: success for success in scenario.successes},
        "none_succeeded": not scenario.anyone_arrived,
        "verdicts": [(v, metrics[v.metric]) for v in scenario.verdicts],
        "table": table,
        "has_published": any(column.published for *_, columns in table for column in columns),
        "stand_ins": [
            (name, preset)
            for name, preset in PUBLISHED_SETTINGS.presets.items()
            if name != preset and name in controllers
        ],
        "controllers": controllers,
        "has_many": len(scenario.trials) > MOST_LOGS_OPENED,
        "drawn": scenario.drawn,
        "trial_count": len(scenario.trials),
        "comparisons": [f for f in figures if not f.controller],
        "sheets": [f for f in figures if f.controller],
        "replay": _relative(analysis.path, replay),
        "journeys": [
            entry
            for entry in scenario.trials
            if len(entry.legs) > 1 or any(leg.floor for leg in entry.legs)
        ],
        "has_floors": any(leg.floor for entry in scenario.trials for leg in entry.legs),
        "narrated": [entry for entry in scenario.trials if entry.deeds],
    }


def _published_rows(
    analysis: FolderAnalysis, scenario: ScenarioAnalysis
) -> list[tuple[str, str, str, list[Column]]]:
    table = scenario_table(analysis.trials, scenario.scenario)
    published = published_table()
    published = published[published["scenario"] == scenario.scenario].set_index("metric")
    # A preset may have the name of a published controller and yet be another one.
    published_names = {preset: name for name, preset in PUBLISHED_SETTINGS.presets.items()}
    titles = {entry.name: entry.title for entry in all_metrics()}
    rows = []
    for (name, unit), cells in table.iterrows():
        if unit == "trials" and not cells.any():
            continue
        columns = []
        for controller, ours in cells.items():
            is_known = name in published.index and controller in published_names
            theirs = (
                float(published.loc[name, published_names[controller]]) if is_known else math.nan
            )
            is_count = unit == "trials" and math.isfinite(ours)
            columns.append(
                Column(
                    ours, f"{ours:.0f}" if is_count else short_number(ours), *_against(ours, theirs)
                )
            )
        rows.append((name, titles.get(name, name.replace("_", " ")), unit, columns))
    return rows


def _against(ours: float, published: float) -> tuple[str, str]:
    """Returns the published value and the relative difference of ours, as text."""
    if not math.isfinite(published):
        return "", ""
    if published == 0.0 or not math.isfinite(ours):
        return f"{published:g}", ""
    return f"{published:g}", relative_change(ours / published - 1.0)


def _metric_rows(scenario: ScenarioAnalysis) -> list[dict[str, Any]]:
    theme_of = {
        entry.name: (theme, entry)
        for theme, metrics in installed_metrics().items()
        for entry in metrics
    }
    rows = []
    for cell in scenario.cells:
        theme, entry = theme_of[cell.metric]
        rows.append(
            {
                "scenario": scenario.scenario,
                "controller": cell.controller,
                "theme": theme,
                "metric": entry,
                "summary": cell.summary,
                "reason": cell.reason,
            }
        )
    return rows


def _pair_rows(scenario: ScenarioAnalysis, difference: float) -> list[dict[str, Any]]:
    means = {(cell.controller, cell.metric): cell.summary.mean for cell in scenario.cells}
    metrics = {entry.name: entry for entry in all_metrics()}
    rows = []
    for pair in scenario.pairs:
        found = pair.comparison
        scale = difference * abs(means[pair.first, pair.metric])
        needed = None
        if found.pairs > 1 and scale > 0.0 and math.isfinite(scale):
            needed = trials_needed(found.sd, scale)
        rows.append(
            {
                "scenario": scenario.scenario,
                "pair": pair,
                "metric": metrics[pair.metric],
                "is_shown": found.interval.excludes(0.0),
                "needed": needed,
            }
        )
    return rows


def _listed(scenarios: Sequence[ScenarioAnalysis]) -> dict[str, set[str]]:
    """Returns, by scenario, the logs of the trials that the page lists.

    Of too many those that did not reach the goal come first, then the first ones of each scenario.
    """
    share = MOST_TRIALS_LISTED // max(1, len(scenarios))
    if sum(len(scenario.trials) for scenario in scenarios) <= MOST_TRIALS_LISTED:
        share = MOST_TRIALS_LISTED
    return {
        scenario.scenario: {
            entry.path
            for entry in sorted(
                scenario.trials, key=lambda entry: entry.row["outcome"] == Outcome.SUCCEEDED
            )[:share]
        }
        for scenario in scenarios
    }


def _trial_rows(
    analysis: FolderAnalysis, scenario: ScenarioAnalysis, listed: Mapping[str, Collection[str]]
) -> list[dict[str, Any]]:
    return [
        {
            "row": entry.row,
            "path": entry.path,
            "replay": _replay_of(analysis.path, entry),
            "command": f"python -m drake_navbench replay {quote(entry.path)}",
        }
        for entry in scenario.trials
        if entry.path in listed[scenario.scenario]
    ]


def _replay_of(root: Path, entry: TrialEntry) -> str:
    """Returns a link to a replay that shows this trial, '' where there is none.

    Of what a run writes, both the race and a controller's own replay show its first trial.
    """
    own = _relative(root, (root / entry.path).with_suffix(".html"))
    if own or entry.row["trial"] != 0:
        return own
    results = ResultsFolder(root)
    scenario, controller = str(entry.row["scenario"]), str(entry.row["controller"])
    return _relative(root, results.replay_path(scenario, controller)) or _relative(
        root, results.replay_path(scenario)
    )


def _has_replays(analysis: FolderAnalysis) -> bool:
    return ResultsFolder(analysis.path).replays_path.is_dir()


def _relative(root: Path, path: Path) -> str:
    """Returns a link from the report to a file, '' where there is none."""
    return path.relative_to(root).as_posix() if path.is_file() else ""
