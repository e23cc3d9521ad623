"""compare.html: a comparison as a page: verdict, parameters that differ, pairs, tasks, losses."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from drake_navbench.analysis.compare import FolderComparison
from drake_navbench.analysis.contests import Match
from drake_navbench.analysis.folder_analysis import FolderAnalysis
from drake_navbench.analysis.html import page_environment
from drake_navbench.analysis.metrics.definition import Better
from drake_navbench.analysis.numbers import number, short_number, typeset
from drake_navbench.analysis.pair_verdict import NO_DIFFERENCE, WORDS, finding_words
from drake_navbench.analysis.paired_tests import Family, Finding
from drake_navbench.analysis.paired_text import PROMISE
from drake_navbench.analysis.paired_trials import Contest
from drake_navbench.logs.outcome import FROM_WORST, Outcome
from drake_navbench.logs.results import ResultsFolder, file_name
from drake_navbench.typed_files.dotted_names import SEPARATOR, flattened
from drake_navbench.typed_files.input_file import read_input
from drake_navbench.typed_files.output_file import write_text
from drake_navbench.typed_files.typed_yaml import MAX_FILE_BYTES

MOST_LOSSES = 6
MOST_TASKS = 200
TIME = "time_to_goal_s"
CLEARANCE = "min_clearance_m"
# The size of a strip of dots, points of a page (px).
STRIP_WIDTH, STRIP_HEIGHT, STRIP_MARGIN = 460.0, 46.0, 12.0


class Strip(NamedTuple):
    """Paired differences on a line: dots, mean and interval in px, and words.

    zero: x of a difference of 0. dots: (x, y, title). ends: x of the interval's ends; None without
    an interval.
    """

    title: str
    verdict: str
    words: str
    zero: float
    mean: float
    ends: tuple[float, float] | None
    dots: tuple[tuple[float, float, str], ...]
    low: str
    high: str


class Parameter(NamedTuple):
    """A resolved parameter that differs between two columns."""

    name: str
    old: str
    new: str


class TaskRow(NamedTuple):
    """A pair of trials, or of tasks, in words. loss: the sorting key, larger for a worse change."""

    scenario: str
    outcomes: tuple[str, str]
    numbers: tuple[str, ...]
    loss: tuple[float, float]
    commands: tuple[str, ...]


class Pair(NamedTuple):
    """A section of the page: one column against another. arrivals: lines on the outcomes."""

    name: str
    old: str
    new: str
    arrivals: tuple[str, ...]
    verdict: str
    details: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    strips: tuple[Strip, ...]
    tasks: tuple[TaskRow, ...]
    losses: tuple[TaskRow, ...]
    pair_count: int


def write_compare_page(comparison: FolderComparison, path: Path) -> None:
    """Writes the page of a comparison; raises CannotBeWritten."""
    verdicts = {(v.label, v.name): v for v in comparison.verdicts}
    pairs = []
    others = comparison.analyses[1:] or comparison.analyses[:1]
    for contest, matches, other in zip(
        comparison.contests, comparison.matches, others, strict=True
    ):
        folders = (comparison.analyses[0], other)
        for match in matches:
            verdict = verdicts.get((contest.label, match.name))
            if verdict is not None:
                rows = _pairs_of(contest, match)
                tasks = [_task_row(row, match, folders) for row in rows]
                by_loss = sorted(tasks, key=lambda task: task.loss, reverse=True)
                findings = [
                    f
                    for f in comparison.judged.findings
                    if (f.label, f.controller) == (contest.label, match.name)
                ]
                pairs.append(
                    Pair(
                        match.name,
                        match.old if match.old != match.new else "before",
                        match.new if match.old != match.new else "after",
                        tuple(map(finding_words, _outcomes(findings))),
                        verdict.text.replace(NO_DIFFERENCE, NO_DIFFERENCE.capitalize()),
                        verdict.details,
                        tuple(parameters_that_differ(folders, match)),
                        tuple(_strips(findings, rows)),
                        tuple(tasks[:MOST_TASKS]),
                        tuple(t for t in by_loss[:MOST_LOSSES] if t.loss > (0.0, 0.0)),
                        len(rows),
                    )
                )
    environment = page_environment()
    environment.filters.update(number=number)
    page = {
        "baseline": comparison.baseline,
        "others": [str(analysis.path) for analysis in comparison.analyses[1:]],
        "pairs": pairs,
        "summary": comparison.summary,
        "promise": PROMISE,
        "not_compared": comparison.not_compared,
        "changed_inputs": comparison.changed_inputs,
        "strip": (STRIP_WIDTH, STRIP_HEIGHT),
    }
    write_text(path, environment.get_template("compare.html").render(page=page))


def _outcomes(findings: Sequence[Finding]) -> list[Finding]:
    return [f for f in findings if f.quantity.family is Family.OUTCOMES and f.comparison.pairs]


def parameters_that_differ(
    folders: tuple[FolderAnalysis, FolderAnalysis], match: Match
) -> Iterator[Parameter]:
    """Yields the resolved parameters and settings of the robot that differ between two columns.

    Their names are those of a Nav2 file: `FollowPath.lookahead_dist`,
    `local_costmap.inflation_layer.inflation_radius`. Parameters of a preset have no plugin's name
    in front.
    """
    plugin = _plugin_of(folders[0], match.old) or _plugin_of(folders[1], match.new)
    old, new = (
        _resolved(folder, column, plugin) for folder, column in zip(folders, match, strict=True)
    )
    for name in dict.fromkeys((*old, *new)):
        values = [values.get(name, "not there") for values in (old, new)]
        if values[0] != values[1]:
            yield Parameter(name, *map(str, values))


def _plugin_of(folder: FolderAnalysis, column: str) -> str:
    """Returns the name that a column's controller has in its Nav2 file; '' for a preset."""
    files = folder.manifest.get("nav2_columns", {})
    return next(
        (name for own in files.values() for name, found in own.items() if found == column), ""
    )


def _resolved(folder: FolderAnalysis, column: str, plugin: str) -> dict[str, Any]:
    """Returns the parameters of a column and its robot in a results folder, by dotted name."""
    inputs = folder.path / "inputs"
    own = _read(inputs / "controllers" / f"{file_name(column)}.yaml")
    scenario = file_name(str(folder.trials["scenario"].iloc[0]))
    robot = inputs / "robots" / f"{scenario}.yaml"
    for alias, columns in folder.manifest.get("nav2_columns", {}).items():
        of_file = inputs / "robots" / f"{scenario}.{file_name(alias)}.yaml"
        if column in columns.values() and of_file.exists():
            robot = of_file
    settings = {key: value for key, value in _read(robot).items() if key != "description"}
    navigation = settings.pop("navigation", {})
    prefix = f"{plugin}{SEPARATOR}" if plugin else ""
    return {
        f"{prefix}controller": own.get("controller"),
        **dict(flattened(own.get("parameters", {}), prefix)),
        **dict(flattened(own.get("path_handler", {}), f"path_handler{SEPARATOR}")),
        **dict(flattened(navigation)),
        **dict(flattened(settings, f"robot{SEPARATOR}")),
    }


def _read(path: Path) -> Mapping[str, Any]:
    if not path.is_file():
        return {}
    data = yaml.safe_load(read_input(path, max_bytes=MAX_FILE_BYTES))
    return data if isinstance(data, Mapping) else {}


def _pairs_of(contest: Contest, match: Match) -> list[tuple[Mapping[str, Any], Mapping[str, Any]]]:
    """Returns the rows of both columns that are paired."""
    tables = []
    for table in contest[:2]:
        own = table[table["controller"] == match.name]
        tables.append({(row["scenario"], row["seed"]): row for row in own.to_dict("records")})
    return [(tables[0][key], tables[1][key]) for key in tables[0] if key in tables[1]]


def _task_row(
    pair: tuple[Mapping[str, Any], Mapping[str, Any]],
    match: Match,
    folders: tuple[FolderAnalysis, FolderAnalysis],
) -> TaskRow:
    old, new = pair
    scenario, trial = _scenario_of(old), int(old.get("trial", 0))
    shown = scenario if "task" in old and isinstance(old["task"], str) else f"{scenario}, {trial}"
    changes = [
        float(new.get(name, np.nan)) - float(old.get(name, np.nan)) for name in (TIME, CLEARANCE)
    ]
    both = old["outcome"] == new["outcome"] == Outcome.SUCCEEDED
    numbers = [
        short_number(value)
        for name in (TIME, CLEARANCE)
        for value in (old.get(name), new.get(name))
    ]
    lost = float(FROM_WORST.index(old["outcome"]) - FROM_WORST.index(new["outcome"]))
    loss = (lost, changes[0] if both and np.isfinite(changes[0]) else 0.0)
    return TaskRow(
        shown,
        (str(old["outcome"]), str(new["outcome"])),
        tuple(numbers),
        loss,
        _commands(scenario, trial, match, folders),
    )


def _scenario_of(row: Mapping[str, Any]) -> str:
    return str(row["task"]) if isinstance(row.get("task"), str) else str(row["scenario"])


def _commands(
    scenario: str,
    trial: int,
    match: Match,
    folders: tuple[FolderAnalysis, FolderAnalysis],
) -> tuple[str, ...]:
    """Returns the commands that draw a pair's replays: one if the columns' names differ."""
    logs = [
        str(ResultsFolder(folder.path).log_path(scenario, column, trial))
        for folder, column in zip(folders, match, strict=True)
    ]
    if match.old != match.new:
        return (shlex.join(["drake-navbench", "replay", logs[0], "--beside", logs[1]]),)
    return tuple(shlex.join(["drake-navbench", "replay", log]) for log in logs)


def _strips(
    findings: Sequence[Finding],
    rows: Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]],
) -> Iterator[Strip]:
    """Yields a strip for each listed metric and scenario that has pairs with a value."""
    for finding in findings:
        quantity = finding.quantity
        if quantity.family is not Family.LISTED or not finding.comparison.pairs:
            continue
        own = [
            (f"{_scenario_of(old)}: ", float(new[quantity.name]) - float(old[quantity.name]))
            for old, new in rows
            if old["scenario"] == finding.scenario
            and old["outcome"] == new["outcome"] == Outcome.SUCCEEDED
        ]
        own = [(name, value) for name, value in own if np.isfinite(value)]
        if own:
            yield _strip(finding, own)


def _strip(finding: Finding, values: Sequence[tuple[str, float]]) -> Strip:
    quantity, found = finding.quantity, finding.comparison
    low, high = found.interval
    has_interval = bool(np.isfinite(low) and np.isfinite(high))
    shown = [0.0, found.difference, *(value for _, value in values)]
    shown += [low, high] if has_interval else []
    least, most = min(shown), max(shown)
    span = (most - least) or 1.0

    def place(value: float) -> float:
        return round(STRIP_MARGIN + (value - least) / span * (STRIP_WIDTH - 2 * STRIP_MARGIN), 1)

    heights = [9.0 + 7.0 * (number % 3) for number in range(len(values))]
    unit = typeset(quantity.unit)
    good = "lower is better" if quantity.better is Better.LOWER else "higher is better"
    interval = f", 95% {low:+.2g} to {high:+.2g}" if has_interval else ""
    word = WORDS.get(quantity.name, quantity.name)
    return Strip(
        f"{word[0].upper()}{word[1:]} in {finding.scenario} ({good})",
        str(finding.verdict),
        f"{finding.base_mean:.3g} → {finding.head_mean:.3g} {unit}: "
        f"{found.difference:+.2g}{interval}, {found.pairs} pairs",
        place(0.0),
        place(found.difference),
        (place(low), place(high)) if has_interval else None,
        tuple(
            (place(value), height, f"{name}{value:+.3g} {unit}")
            for (name, value), height in zip(values, heights, strict=True)
        ),
        f"{least:+.2g}",
        f"{most:+.2g} {unit}",
    )
