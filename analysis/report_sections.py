"""One scenario in the report's page: its section, and its rows in the common tables."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from shlex import quote
from typing import Any, NamedTuple

import pandas as pd

from drake_navbench.analysis.folder_analysis import FolderAnalysis
from drake_navbench.analysis.html import relative_change
from drake_navbench.analysis.many_trials import MOST_LOGS_OPENED
from drake_navbench.analysis.metrics.registry import all_metrics, installed_metrics
from drake_navbench.analysis.numbers import counted, short_number
from drake_navbench.analysis.paired_comparison import trials_needed
from drake_navbench.analysis.reproduction.lineups import PUBLISHED_SETTINGS
from drake_navbench.analysis.reproduction.publication import published_table
from drake_navbench.analysis.scenario_analysis import ScenarioAnalysis, TrialEntry
from drake_navbench.analysis.tables import scenario_table
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.results import ResultsFolder

# A page with more rows opens slowly, and nobody reads them; trials.parquet has all rows.
MOST_TRIALS_LISTED = 1000


class PublishedCell(NamedTuple):
    """One metric of a controller in a scenario's table.

    value, ours: our value as a number and as text. published: the published value. change: the
    relative difference of ours; '' where one of them is missing.
    """

    value: float
    ours: str
    published: str
    change: str


def scenario_section(analysis: FolderAnalysis, scenario: ScenarioAnalysis) -> dict[str, Any]:
    """Returns the template's values for the section of one scenario."""
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
        "replay": link_to(analysis.path, replay),
        "journeys": [
            entry
            for entry in scenario.trials
            if len(entry.legs) > 1 or any(leg.floor for leg in entry.legs)
        ],
        "has_floors": any(leg.floor for entry in scenario.trials for leg in entry.legs),
        "narrated": [entry for entry in scenario.trials if entry.actions],
    }


def _published_rows(
    analysis: FolderAnalysis, scenario: ScenarioAnalysis
) -> list[tuple[str, str, str, list[PublishedCell]]]:
    """Returns name, title, unit and the controllers' cells of each metric of a scenario."""
    table = scenario_table(analysis.trials, scenario.scenario)
    published = published_table()
    published = published[published["scenario"] == scenario.scenario].set_index("metric")
    # A preset of our own may have the name of a published controller.
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
                PublishedCell(
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


def metric_rows(scenario: ScenarioAnalysis) -> list[dict[str, Any]]:
    """Returns one row for each controller and metric."""
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


def pair_rows(scenario: ScenarioAnalysis, difference: float) -> list[dict[str, Any]]:
    """Returns one row a pair of controllers and metric; difference: as for `build_report`."""
    means = {(cell.controller, cell.metric): cell.summary.mean for cell in scenario.cells}
    metrics = {entry.name: entry for entry in all_metrics()}
    rows = []
    for pair in scenario.pairs:
        found = pair.compared.comparison
        scale = difference * abs(means[pair.compared.first, pair.metric])
        needed = None
        if found.pairs > 1 and scale > 0.0 and math.isfinite(scale):
            needed = trials_needed(found.sd, scale)
        rows.append(
            {
                "scenario": scenario.scenario,
                "pair": pair.compared,
                "metric": metrics[pair.metric],
                "needed": needed,
            }
        )
    return rows


def listed_trials(scenarios: Sequence[ScenarioAnalysis]) -> dict[str, set[str]]:
    """Returns, by scenario, the logs of the trials that the page lists.

    If there are too many, it lists trials that did not reach the goal, then the first ones of each
    scenario.
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


def trial_rows(
    analysis: FolderAnalysis, scenario: ScenarioAnalysis, listed: Mapping[str, Collection[str]]
) -> list[dict[str, Any]]:
    """Returns one row for each listed trial, with its replay or the command that makes one."""
    return [
        {
            "row": entry.row,
            "path": entry.path,
            "replay": _replay_of(analysis.path, entry),
            "command": f"drake-navbench replay {quote(entry.path)}",
        }
        for entry in scenario.trials
        if entry.path in listed[scenario.scenario]
    ]


def _replay_of(root: Path, entry: TrialEntry) -> str:
    """Returns a link to a replay that shows this trial, '' if there is none.

    A run's own replays (the race, and each controller's) show the first trial.
    """
    own = link_to(root, (root / entry.path).with_suffix(".html"))
    if own or entry.row["trial"] != 0:
        return own
    results = ResultsFolder(root)
    scenario, controller = str(entry.row["scenario"]), str(entry.row["controller"])
    return link_to(root, results.replay_path(scenario, controller)) or link_to(
        root, results.replay_path(scenario)
    )


def link_to(root: Path, path: Path) -> str:
    """Returns a link from the report to a file, '' if the file does not exist."""
    return path.relative_to(root).as_posix() if path.is_file() else ""


def legs_table(trials: Sequence[TrialEntry]) -> pd.DataFrame:
    """Returns a row for each finished leg of a mission: controller, trial, leg counted from 1.

    Then come the fields of `journey.Leg` except the goal; `lift_s` is the time at the lift.
    """
    rows = [
        {"controller": entry.row["controller"], "trial": entry.row["trial"], "leg": number}
        | {name: value for name, value in leg._asdict().items() if name != "goal"}
        for entry in trials
        for number, leg in enumerate(entry.legs, start=1)
        if leg.floor
    ]
    return pd.DataFrame(rows)


def compute_note(manifest: Mapping[str, Any]) -> str:
    """Returns processor, workers and load from a manifest in words; '' if it names no machine."""
    machines = [entry for entry in manifest.get("machines", []) if isinstance(entry, Mapping)]
    if not machines:
        return ""
    told = "; then ".join(dict.fromkeys(map(_machine, machines)))
    if cluster := _cluster(manifest):
        told = f"{cluster}; trials that no cluster drove on {told}"
    text = f"Compute times were measured on {told}."
    if any(_is_shared(machine) for machine in machines):
        text += (
            " Trials shared the machine, with one another or with other programs, which makes "
            "wall-clock times longer. Processor times leave out waiting; --jobs 1 on a quiet "
            "machine measures best."
        )
    return text


def _cluster(manifest: Mapping[str, Any]) -> str:
    """Returns a cluster's processors with the number of trials that each kind drove."""
    driven: dict[str, int] = {}
    for entry in manifest.get("cluster", []):
        name = str(entry.get("processor", "an unknown processor"))
        driven[name] = driven.get(name, 0) + int(entry.get("trials", 0))
    return ", ".join(f"a cluster of {name} ({count} trials)" for name, count in driven.items())


def _machine(entry: Mapping[str, Any]) -> str:
    jobs, cores = entry.get("jobs", 1), entry.get("cores", 1)
    text = f"{entry.get('processor', 'an unknown processor')}, {counted(cores, 'core')}, "
    text += f"{counted(jobs, 'trial')} at a time"
    load = entry.get("load_before")
    return text if load is None else f"{text}, load {load:g} before the run"


def _is_shared(entry: Mapping[str, Any]) -> bool:
    """Whether another process may have run on the same processor, with its caches and clock."""
    return entry.get("jobs", 1) > 1 or (entry.get("load_before") or 0.0) >= 0.5
