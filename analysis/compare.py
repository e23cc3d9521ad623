"""Results folders side by side: what became better, what worse, and how sure that is.

Trials are paired by scenario, controller and seed. The first folder is the baseline. All numbers
are computed again from the logs, so that both folders are measured with the same metrics.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import pandas as pd

from drake_navbench.analysis.folder_analysis import analyse_folder, find_logs
from drake_navbench.analysis.metrics.definition import Better, Metric
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.scenario_analysis import LeftOut
from drake_navbench.analysis.statistics import (
    ROUNDING,
    PairedComparison,
    paired_comparison,
)
from drake_navbench.errors import InputError, nearest_name_hint

SUCCESS = "success_rate"
DEFAULT_LISTED = (
    SUCCESS,
    "min_clearance_m",
    "time_to_goal_s",
    "cross_track_error_mean_m",
    "heading_error_mean_deg",
)
# A change below this share of the baseline is none, however certain.
DEFAULT_TOLERANCE = 0.01
IDENTITY = ["scenario", "controller", "seed"]


class Change(StrEnum):
    """What became of a metric."""

    BETTER = "better"
    WORSE = "worse"
    CHANGED = "changed"
    SAME = "same"
    UNDECIDED = "undecided"
    UNDEFINED = "undefined"


class Finding(NamedTuple):
    """A metric of a controller in a scenario, in the baseline and in another folder."""

    folder: str
    scenario: str
    controller: str
    metric: str
    unit: str
    baseline_mean: float
    mean: float
    comparison: PairedComparison
    change: Change


class Unmatched(NamedTuple):
    """Trials of a controller in a scenario that cannot be compared. reason: which and why."""

    folder: str
    scenario: str
    controller: str
    reason: str

    def __str__(self) -> str:
        return f"{self.scenario} / {self.controller}: {self.reason}"


@dataclass(frozen=True)
class FolderComparison:
    """Every finding, and what could not be compared.

    listed: the metrics whose getting worse is a regression. unmatched: trials and columns that only
    one of the folders has. left_out: unreadable files.
    """

    baseline: str
    listed: tuple[str, ...]
    findings: tuple[Finding, ...]
    unmatched: tuple[Unmatched, ...]
    left_out: tuple[LeftOut, ...]

    @property
    def regressions(self) -> list[Finding]:
        """The listed metrics that became worse."""
        return [f for f in self.findings if f.metric in self.listed and f.change is Change.WORSE]

    @property
    def not_compared(self) -> list[str]:
        """A line for everything that could not be compared."""
        return [
            *map(str, self.unmatched),
            *(f"{entry.path}: {entry.reason}" for entry in self.left_out),
        ]

    @property
    def summary(self) -> str:
        """The whole in a line."""
        listed = [f for f in self.findings if f.metric in self.listed]
        cells = {(f.folder, f.scenario, f.controller) for f in self.findings}
        count = Counter(f.change for f in listed)
        told = ", ".join(f"{count[change]} {change}" for change in Change)
        return (
            f"compared {len(cells)} pairs of scenario and controller in {len(self.listed)} listed "
            f"metrics: {told}; not compared: {len(self.not_compared)}"
        )


def compare_folders(
    folders: Sequence[Path],
    *,
    listed: Sequence[str] = DEFAULT_LISTED,
    tolerance: float = DEFAULT_TOLERANCE,
    jobs: int = 2,
) -> FolderComparison:
    """Compares every folder with the first one.

    listed: names of metrics whose getting worse counts as a regression; success_rate is always one
    of them unless there is none: who fails has no time to the goal that could get worse.
    tolerance: share of the baseline below which a change is none. Raises InputError for a name
    that is no metric, a folder that is no results folder (all are looked at before the work
    begins), or folders without a common trial.
    """
    known = {entry.name: entry for entry in all_metrics()}
    for name in listed:
        if name not in known:
            raise InputError(f"metric {name!r} is unknown{nearest_name_hint(name, known)}")
        if known[name].better is Better.NEITHER:
            raise InputError(f"metric {name!r} has no good direction; it cannot get worse")
    if listed and SUCCESS not in listed:
        listed = (SUCCESS, *listed)
    for folder in folders:
        find_logs(folder)
    analyses = [analyse_folder(folder, jobs=jobs) for folder in folders]
    baseline, *others = analyses
    findings: list[Finding] = []
    unmatched: list[Unmatched] = []
    for other in others:
        name = str(other.path)
        found = compare_trials(baseline.trials, other.trials, folder=name, tolerance=tolerance)
        if not found:
            raise InputError(
                f"{name}: no scenario, controller and seed in common with {folders[0]}"
            )
        findings += found
        unmatched += _unmatched(baseline.trials, other.trials, name)
    return FolderComparison(
        baseline=str(folders[0]),
        listed=tuple(listed),
        findings=tuple(findings),
        unmatched=tuple(unmatched),
        left_out=tuple(
            LeftOut(f"{a.path}/{entry.path}", entry.reason)
            for a in analyses
            for entry in a.left_out
        ),
    )


def compare_trials(
    baseline: pd.DataFrame,
    other: pd.DataFrame,
    *,
    folder: str,
    tolerance: float = DEFAULT_TOLERANCE,
) -> list[Finding]:
    """Returns a finding for every metric of every scenario and controller in both tables."""
    before, after = (table.set_index(IDENTITY).sort_index() for table in (baseline, other))
    common = before.index.intersection(after.index)
    cells = list(dict.fromkeys((scenario, controller) for scenario, controller, _ in common))
    findings = []
    for scenario, controller in cells:
        first, second = (table.loc[(scenario, controller)] for table in (before, after))
        seeds = first.index.intersection(second.index)
        first, second = first.loc[seeds], second.loc[seeds]
        for entry in all_metrics():
            comparison = paired_comparison(first[entry.name], second[entry.name])
            baseline_mean = float(first[entry.name].mean())
            findings.append(
                Finding(
                    folder=folder,
                    scenario=scenario,
                    controller=controller,
                    metric=entry.name,
                    unit=entry.unit,
                    baseline_mean=baseline_mean,
                    mean=float(second[entry.name].mean()),
                    comparison=comparison,
                    change=judge(entry, comparison, baseline_mean, tolerance=tolerance),
                )
            )
    return findings


def judge(
    entry: Metric, comparison: PairedComparison, baseline_mean: float, *, tolerance: float
) -> Change:
    """Returns what a paired comparison shows.

    A change counts where its 95% interval excludes zero and it exceeds the tolerance. Success is
    judged by the trials themselves: a seed that no longer succeeds meets the same noise as before,
    so more seeds lost than won is worse, however few they are.
    """
    if comparison.pairs == 0:
        return Change.UNDEFINED
    size = abs(comparison.difference)
    if size <= max(tolerance * abs(baseline_mean), ROUNDING):
        return Change.SAME
    is_certain = entry.name == SUCCESS or comparison.interval.excludes(0.0)
    if not is_certain:
        return Change.UNDECIDED
    if entry.better is Better.NEITHER:
        return Change.CHANGED
    is_lower = comparison.difference < 0.0
    return Change.BETTER if is_lower == (entry.better is Better.LOWER) else Change.WORSE


def to_markdown(comparison: FolderComparison) -> str:
    """Returns the comparison as Markdown: regressions first, then all significant changes."""
    regressions = comparison.regressions
    lines = [f"# Compared with {comparison.baseline}", ""]
    lines.append(f"Listed metrics: {', '.join(comparison.listed) or 'none'}.")
    lines += [f"{len(regressions)} of them became worse.", "", f"In all: {comparison.summary}.", ""]
    for title, chosen in (
        ("Regressions", regressions),
        ("Worse", _of(comparison, Change.WORSE)),
        ("Better", _of(comparison, Change.BETTER)),
        ("Changed, neither better nor worse", _of(comparison, Change.CHANGED)),
        ("Not decided by so few trials", _of(comparison, Change.UNDECIDED)),
    ):
        if chosen:
            lines += [f"## {title}", "", *_markdown_table(chosen), ""]
    if comparison.not_compared:
        lines += ["## Not compared", ""]
        lines += [f"- {line}" for line in comparison.not_compared]
        lines.append("")
    return "\n".join(lines)


def to_junit(comparison: FolderComparison) -> str:
    """Returns JUnit XML: a test case a listed metric, scenario and controller.

    What could not be compared is a skipped test case.
    """
    cases = [f for f in comparison.findings if f.metric in comparison.listed]
    skipped = [f for f in cases if f.change is Change.UNDEFINED]
    suite = ElementTree.Element(
        "testsuite",
        name="drake_navbench.compare",
        tests=str(len(cases) + len(comparison.unmatched) + len(comparison.left_out)),
        failures=str(len(comparison.regressions)),
        errors="0",
        skipped=str(len(skipped) + len(comparison.unmatched) + len(comparison.left_out)),
    )
    for finding in cases:
        case = ElementTree.SubElement(
            suite,
            "testcase",
            classname=f"{finding.folder}.{finding.scenario}.{finding.controller}",
            name=finding.metric,
        )
        if finding.change is Change.WORSE:
            failure = ElementTree.SubElement(case, "failure", message=sentence(finding))
            failure.text = sentence(finding)
        elif finding.change is Change.UNDEFINED:
            ElementTree.SubElement(case, "skipped", message="no pair of trials with a value")
    for entry in comparison.unmatched:
        classname = f"{entry.folder}.{entry.scenario}.{entry.controller}"
        _add_skipped(suite, classname, "trials", entry.reason)
    for file in comparison.left_out:
        _add_skipped(suite, "files", file.path, file.reason)
    suites = ElementTree.Element("testsuites")
    suites.append(suite)
    ElementTree.indent(suites)
    return ElementTree.tostring(suites, encoding="unicode", xml_declaration=True) + "\n"


def _add_skipped(suite: ElementTree.Element, classname: str, name: str, reason: str) -> None:
    case = ElementTree.SubElement(suite, "testcase", classname=classname, name=name)
    ElementTree.SubElement(case, "skipped", message=reason)


def sentence(finding: Finding) -> str:
    """Returns a finding as one line."""
    found = finding.comparison
    low, high = found.interval
    certainty = f" [{low:+.3g}, {high:+.3g}]" if math.isfinite(low) else ""
    return (
        f"{finding.scenario}, {finding.controller}: {finding.metric} {finding.change}: "
        f"{finding.baseline_mean:.4g} -> {finding.mean:.4g} {finding.unit}".rstrip()
        + f" ({found.difference:+.3g}{certainty} in {found.pairs} pairs)"
    )


def _of(comparison: FolderComparison, change: Change) -> list[Finding]:
    return [finding for finding in comparison.findings if finding.change is change]


def _markdown_table(findings: Sequence[Finding]) -> list[str]:
    lines = [
        "| folder | scenario | controller | metric | baseline | now | difference | 95% interval |"
        " pairs | p | effect |",
        "|---|---|---|---|---:|---:|---:|---|---:|---:|---:|",
    ]
    for f in findings:
        found = f.comparison
        low, high = found.interval
        span = f"[{low:+.3g}, {high:+.3g}]" if math.isfinite(low) else "–"
        cells = [
            f.folder,
            f.scenario,
            f.controller,
            f"{f.metric} [{f.unit}]" if f.unit else f.metric,
        ]
        cells += [f"{f.baseline_mean:.4g}", f"{f.mean:.4g}", f"{found.difference:+.3g}", span]
        cells += [str(found.pairs), f"{found.p_value:.3g}", f"{found.effect:+.2f}"]
        lines.append("| " + " | ".join(cell.strip().replace("|", "\\|") for cell in cells) + " |")
    return lines


def _unmatched(baseline: pd.DataFrame, other: pd.DataFrame, name: str) -> list[Unmatched]:
    before, after = (
        table.groupby(["scenario", "controller"])["seed"].agg(set).to_dict()
        for table in (baseline, other)
    )
    reasons = {
        cell: _why_unmatched(before.get(cell, set()), after.get(cell, set()), name)
        for cell in dict.fromkeys([*before, *after])
    }
    return [
        Unmatched(name, scenario, controller, reason)
        for (scenario, controller), reason in reasons.items()
        if reason
    ]


def _why_unmatched(before: set[int], after: set[int], name: str) -> str:
    """Returns what keeps the trials with these seeds from being compared, '' for nothing."""
    if not after:
        return f"missing in {name}"
    if not before:
        return f"only in {name}"
    alone = len(before ^ after)
    if not alone:
        return ""
    have = "trial has" if alone == 1 else "trials have"
    return f"{alone} {have} no partner in {name} or in the baseline"
