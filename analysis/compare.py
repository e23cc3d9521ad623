"""Results folders side by side: what became better, what worse, and how sure that is.

Trials are paired by scenario, controller and seed. The first folder is the baseline. All numbers
are computed again from the logs, so that both folders are measured with the same metrics.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.compared_inputs import lines_on_inputs
from drake_navbench.analysis.contests import (
    Match,
    contest_of,
    matched_trials,
    matches_between,
    matches_within,
    read_matches,
)
from drake_navbench.analysis.folder_analysis import FolderAnalysis, analyse_folder, find_logs
from drake_navbench.analysis.metrics.definition import Better
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.pair_verdict import PairVerdict, pair_verdicts
from drake_navbench.analysis.paired_tests import (
    DEFAULT_LISTED,
    DEFAULT_TOLERANCE,
    OUTCOMES,
    Finding,
    Judged,
    PairedVerdict,
    judge_pairs,
)
from drake_navbench.analysis.paired_text import lost_lines, undecided_sentence
from drake_navbench.analysis.paired_trials import Contest, LostTrial
from drake_navbench.analysis.scenario_analysis import LeftOut
from drake_navbench.errors import InputError, nearest_name_hint

# The most lines that a comparison prints in a terminal unless all are asked for.
MOST_LINES = 8


class Unmatched(NamedTuple):
    """Trials of a controller in a scenario that cannot be compared. reason: the seeds, and why.

    is_new: whether only the judged folder has this controller in this scenario.
    """

    folder: str
    scenario: str
    controller: str
    reason: str
    is_new: bool = False

    def __str__(self) -> str:
        return f"{self.scenario} / {self.controller}: {self.reason}"


@dataclass(frozen=True)
class FolderComparison:
    """Every finding, and what could not be compared.

    listed: the metrics whose getting worse is a regression. unmatched: trials and columns that only
    one of the folders has. left_out: unreadable files. changed_inputs: lines on scenarios and
    robots that differ. contests: the compared tables, one contest a folder. matches: the pairs of
    columns of each contest. analyses: the analyses of the folders.
    """

    baseline: str
    listed: tuple[str, ...]
    judged: Judged
    unmatched: tuple[Unmatched, ...]
    left_out: tuple[LeftOut, ...]
    changed_inputs: tuple[str, ...] = ()
    contests: tuple[Contest, ...] = ()
    matches: tuple[tuple[Match, ...], ...] = ()
    analyses: tuple[FolderAnalysis, ...] = ()

    def __str__(self) -> str:
        return in_short(self)

    @property
    def verdicts(self) -> list[PairVerdict]:
        """The verdict on each pair of columns, in words."""
        return pair_verdicts(self.judged)

    @property
    def listed_findings(self) -> list[Finding]:
        """The findings of listed metrics."""
        return [f for f in self.judged.findings if f.quantity.name in self.listed]

    @property
    def regressions(self) -> list[Finding]:
        """The listed metrics that became worse, touches first."""
        return [f for f in self.judged.of(PairedVerdict.WORSE) if f.quantity.name in self.listed]

    @property
    def errors(self) -> list[LostTrial]:
        """Trials that ended as an error where that controller had no error in the baseline."""
        lost = self.judged.new_failures if self.listed else []
        return [trial for trial in lost if not trial.is_missing]

    @property
    def undecided_losses(self) -> list[str]:
        """A line for each loss for which there are too few trials to decide, touches first.

        Trials that ended as an error are losses, too, where the baseline has such trials.
        """
        if not self.listed:
            return []
        lost = (trial for trial in self.judged.lost if trial.is_new and trial.base_fails)
        errors = [trial for trial in lost if not trial.is_missing]
        lines = [f"{line} (the baseline has errors there, too)" for line in lost_lines(errors)]
        return [*lines, *map(undecided_sentence, self.judged.undecided_losses)]

    @property
    def not_compared(self) -> list[str]:
        """A line for everything that could not be compared."""
        return [
            *map(str, self.unmatched),
            *(f"{entry.path}: {entry.reason}" for entry in self.left_out),
            *(
                f"{f.scenario} / {f.controller}: {f.quantity.name} has no value any more"
                for f in self.listed_findings
                if f.verdict is PairedVerdict.GONE
            ),
        ]

    @property
    def is_complete(self) -> bool:
        """Whether everything is compared, but for columns and scenarios that are new."""
        return len(self.not_compared) == sum(entry.is_new for entry in self.unmatched)

    @property
    def summary(self) -> str:
        """The comparison in one line: counts of worse and better, and other counts above 0."""
        count = Counter(finding.verdict for finding in self.listed_findings)
        always = (PairedVerdict.WORSE, PairedVerdict.BETTER)
        told = [f"{count[v]} {v}" for v in PairedVerdict if count[v] or v in always]
        if self.not_compared:
            told.append(f"{len(self.not_compared)} not compared")
        return (
            f"{count.total()} comparisons of {len(self.listed)} listed metrics "
            f"(each controller in each scenario): {', '.join(told)}"
        )


def compare_folders(
    folders: Sequence[Path],
    *,
    listed: Sequence[str] = DEFAULT_LISTED,
    tolerance: float = DEFAULT_TOLERANCE,
    jobs: int = 2,
    matches: Sequence[str] = (),
) -> FolderComparison:
    """Compares every folder with the first one; of a single folder its columns with the first.

    matches: columns of different names to compare, 'OLD=NEW'; see `contests` for those found.

    listed: names of metrics whose getting worse counts as a regression; success_rate and touch_rate
    are always among them unless the list is empty: a controller that fails has no time to the goal
    that could get worse. tolerance: share of the baseline; a smaller change counts as none. Raises
    InputError for a name that is no metric, a folder that is no results folder (all are looked at
    before the work begins), or folders without a common trial.
    """
    listed = _checked(listed)
    for folder in folders:
        find_logs(folder)
    analyses = [analyse_folder(folder, jobs=jobs) for folder in folders]
    baseline, *others = analyses
    found = [_matches(baseline, other, matches) for other in others]
    found = found or [_matches_within(baseline, matches)]
    contests = [
        _contest(baseline, other, own)
        for other, own in zip(others or [baseline], found, strict=True)
    ]
    judged = judge_pairs(contests, listed=listed, tolerance=tolerance)
    compared = {finding.label for finding in judged.findings}
    unmatched: list[Unmatched] = []
    for contest, other, own in zip(contests, others or [baseline], found, strict=True):
        if contest.label not in compared:
            raise InputError(_nothing_common(contest, str(folders[0])))
        unmatched += _unmatched(*matched_trials(baseline.trials, other.trials, own), contest.label)
    return FolderComparison(
        baseline=str(folders[0]),
        listed=listed,
        judged=judged,
        unmatched=tuple(unmatched),
        left_out=tuple(
            LeftOut(f"{a.path}/{entry.path}", entry.reason)
            for a in analyses
            for entry in a.left_out
        ),
        changed_inputs=tuple(
            f"{other.path}: {line}" for other in others for line in _changes(baseline, other)
        ),
        contests=tuple(contests),
        matches=tuple(tuple(own) for own in found),
        analyses=tuple(analyses),
    )


def _columns(folder: FolderAnalysis) -> list[str]:
    return list(dict.fromkeys(folder.trials["controller"]))


def _matches(baseline: FolderAnalysis, other: FolderAnalysis, texts: Sequence[str]) -> list[Match]:
    before, after = _columns(baseline), _columns(other)
    files = (
        baseline.manifest.get("nav2_columns", {}),
        other.manifest.get("nav2_columns", {}),
    )
    return matches_between(before, after, read_matches(texts, before, after), files)


def _matches_within(folder: FolderAnalysis, texts: Sequence[str]) -> list[Match]:
    """Returns the pairs of columns of one folder; raises InputError where it has one column."""
    columns = _columns(folder)
    if len(columns) < 2:
        raise InputError(f"{folder.path}: has one column; expected a second folder to compare with")
    asked_pairs = read_matches(texts, columns, columns)
    return matches_within(columns, folder.manifest.get("nav2_columns", {}), asked_pairs)


def _contest(baseline: FolderAnalysis, other: FolderAnalysis, matches: Sequence[Match]) -> Contest:
    suites = {**baseline.manifest.get("suites", {}), **other.manifest.get("suites", {})}
    return contest_of(baseline.trials, other.trials, matches, suites, str(other.path))


def _changes(baseline: FolderAnalysis, other: FolderAnalysis) -> list[str]:
    versions = [analysis.manifest.get("drake_navbench") for analysis in (baseline, other)]
    lines = lines_on_inputs(baseline.path, other.path)
    if all(versions) and versions[0] != versions[1]:
        lines.append(f"driven by version {versions[1]}, the baseline by {versions[0]}")
    return lines


def _nothing_common(contest: Contest, baseline: str) -> str:
    """Returns why no trial of a contest has a partner, and what to do about it."""
    before, after = (list(dict.fromkeys(t["controller"])) for t in contest[:2])
    if not set(before) & set(after):
        return (
            f"{contest.label}: no column in common with {baseline}: {', '.join(after)} here, "
            f"{', '.join(before)} there; --match OLD=NEW pairs two"
        )
    return f"{contest.label}: no scenario, controller and seed in common with {baseline}"


def _checked(listed: Sequence[str]) -> tuple[str, ...]:
    """Returns the listed names, outcomes first; raises InputError for one that is no metric."""
    outcomes = [quantity.name for quantity in OUTCOMES]
    known = {entry.name: entry.better for entry in all_metrics()}
    known |= {quantity.name: quantity.better for quantity in OUTCOMES}
    for name in listed:
        if name not in known:
            raise InputError(f"metric {name!r} is unknown{nearest_name_hint(name, known)}")
        if known[name] is Better.NEITHER:
            raise InputError(
                f"metric {name!r}: cannot get worse; expected one with a good direction"
            )
    return tuple(dict.fromkeys([*outcomes, *listed])) if listed else ()


def in_short(comparison: FolderComparison) -> str:
    """Returns the comparison in at most MOST_LINES lines: the verdicts and their findings."""
    lines = []
    for verdict in comparison.verdicts:
        lines += [verdict.text, *(f"  {detail}" for detail in verdict.details)]
    if len(lines) > MOST_LINES:
        left = len(lines) - MOST_LINES + 1
        lines = [*lines[: MOST_LINES - 1], f"... and {left} more lines (--all)"]
    return "\n".join(lines) + "\n"


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
        Unmatched(name, scenario, controller, reason, (scenario, controller) not in before)
        for (scenario, controller), reason in reasons.items()
        if reason
    ]


def _why_unmatched(before: set[int], after: set[int], name: str) -> str:
    """Returns why the trials with these seeds cannot be compared, '' where they can."""
    if not after:
        return f"missing in {name}"
    if not before:
        return f"only in {name}"
    alone = len(before ^ after)
    if not alone:
        return ""
    have = "trial has" if alone == 1 else "trials have"
    return f"{alone} {have} no partner in {name} or in the baseline"
