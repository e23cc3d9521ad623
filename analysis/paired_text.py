"""Writes the results of paired tests as sentences and as rows of tables."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from drake_navbench.analysis.numbers import counted
from drake_navbench.analysis.paired_tests import (
    ALARM_RATE,
    ALARM_RATES,
    Family,
    Finding,
    Judged,
    PairedVerdict,
)
from drake_navbench.analysis.paired_trials import LostTrial
from drake_navbench.kernels.percent import PERCENT
from drake_navbench.logs.text_tables import markdown_table

# The most seeds that a line names; the results folder has all of them.
MOST_SEEDS = 20
PROMISE = (
    f"Corrected over everything that is judged: if only noise differs, at most {ALARM_RATE:.0%} of "
    f"comparisons report any change "
    f"({', '.join(f'{family} {rate:.0%}' for family, rate in ALARM_RATES.items())})."
)


def sentence(finding: Finding) -> str:
    """Returns a finding as one line."""
    quantity, found = finding.quantity, finding.comparison
    return (
        f"{finding.scenario}, {finding.controller}: {quantity.name} {finding.verdict}: "
        f"{finding.base_mean:.4g} -> {finding.head_mean:.4g} {quantity.unit}".rstrip()
        + f" ({found.difference:+.3g}{_interval(finding)} {_pairs(finding)})"
    )


def undecided_sentence(finding: Finding) -> str:
    """Returns one line on an undecided finding, with the number of trials that would decide it."""
    fewest, needed = finding.fewest_differing, finding.trials_needed
    text = f"{sentence(finding)}; a decision needs at least {fewest} pairs that differ one way"
    if needed is not None:
        text += f", a change of this size about {needed} trials"
    return text


def lost_lines(lost: Sequence[LostTrial]) -> list[str]:
    """Returns lines on the trials that are errors, or missing, only in the judged table."""
    groups: dict[tuple[str, ...], list[LostTrial]] = {}
    for trial in lost:
        ending = "missing" if trial.is_missing else "ended as an error"
        groups.setdefault((trial.scenario, trial.controller, ending, trial.reason), []).append(
            trial
        )
    lines = []
    for (scenario, controller, ending, reason), trials in groups.items():
        seeds = ", ".join(str(trial.seed) for trial in trials[:MOST_SEEDS])
        more = f" and {len(trials) - MOST_SEEDS} more" if len(trials) > MOST_SEEDS else ""
        why = f": {reason}" if reason else ""
        lines.append(
            f"{scenario}, {controller}: {counted(len(trials), 'trial')} {ending}, "
            f"seed{'s' if len(trials) > 1 else ''} {seeds}{more}{why}"
        )
    return lines


def cells_text(cells: Iterable[tuple[str, str, str]]) -> str:
    """Returns cells as 'controller in scenario', a comma between them."""
    named = (
        f"{controller} in {scenario}{f' ({label})' if label else ''}"
        for label, scenario, controller in cells
    )
    return ", ".join(named)


def equal_text(judged: Judged) -> str:
    """Returns a sentence with the number of equal pairs and the cells whose trials are all equal.

    Two trials are equal if their outcome and all their metrics are.
    """
    text = f"{judged.equal} of {judged.pairs} pairs of trials are equal in outcome and all metrics"
    if judged.equal_cells:
        text += f"; equal in every trial: {cells_text(judged.equal_cells)}"
    return f"{text}."


def table(findings: Sequence[Finding]) -> list[str]:
    """Returns findings as a table in Markdown."""
    has_labels = any(finding.label for finding in findings)
    titles = ["folder"] * has_labels + ["scenario", "controller", "metric", "base", "head"]
    titles += ["change", "95% interval", "pairs", "differing", "p (corrected)"]
    rows = []
    for finding in findings:
        quantity, found = finding.quantity, finding.comparison
        low, high = found.interval
        cells = [finding.label] * has_labels + [finding.scenario, finding.controller]
        cells += [f"{quantity.name} [{quantity.unit}]" if quantity.unit else quantity.name]
        cells += [
            f"{finding.base_mean:.4g}",
            f"{finding.head_mean:.4g}",
            f"{found.difference:+.3g}",
        ]
        cells += [f"[{low:+.3g}, {high:+.3g}]" if math.isfinite(low) else "–"]
        cells += [str(found.pairs), str(finding.differing)]
        cells += ["one trial" if finding.is_one_trial else f"{finding.p_value:.2g}"]
        rows.append(cells)
    return markdown_table(titles, rows, "l" * (has_labels + 3) + "rrrlrrr")


def _interval(finding: Finding) -> str:
    low, high = finding.comparison.interval
    return f" [{low:+.3g}, {high:+.3g}]" if math.isfinite(low) else ""


def _pairs(finding: Finding) -> str:
    if finding.is_one_trial:
        return "in one trial, in which nothing is random"
    found = finding.comparison
    text = f"in {counted(found.pairs, 'pair')}"
    if finding.quantity.family is Family.OUTCOMES:
        net = round(found.difference / PERCENT * found.pairs)
        more, less = (finding.differing + net) // 2, (finding.differing - net) // 2
        text += f", {more} more and {less} fewer"
    if finding.verdict is PairedVerdict.UNDECIDED or math.isfinite(finding.p_value):
        text += f", p {finding.p_value:.2g}"
    return text
