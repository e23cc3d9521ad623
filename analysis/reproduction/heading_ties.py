"""Effect of a choice in the published heading error: which of several equally near samples counts.

A robot that turns on the spot before a wall has many samples at one place. The publication does not
say which of them it takes. We take the first sample; this module computes the values for the last
one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.repeats import repeated_cells
from drake_navbench.analysis.reproduction.findings import findings, published_values
from drake_navbench.analysis.reproduction.judgement import FindingVerdict, Judgement, judge
from drake_navbench.analysis.reproduction.lineups import ALL_SCENARIOS, Lineup, trial_values
from drake_navbench.analysis.reproduction.publication import PUBLISHED_CONTROLLERS, published_table
from drake_navbench.analysis.reproduction.relations import relative_difference

FIRST, LAST = "avg_heading_error", "avg_heading_error_last"
# If the errors differ by a smaller share, the rule does not matter.
LEAST_DIFFERENCE = 0.1


class TiedCell(NamedTuple):
    """A mean heading error by each of the two rules, deg, beside the published one."""

    scenario: str
    controller: str
    first: float
    last: float
    published: float


class TiedFinding(NamedTuple):
    """A finding whose verdict changes if the last of the equally near samples counts."""

    number: int
    text: str
    first: FindingVerdict
    last: FindingVerdict


class HeadingTies(NamedTuple):
    """The heading errors and findings that depend on the rule for ties."""

    cells: list[TiedCell]
    findings: list[TiedFinding]


def heading_ties(
    trials: pd.DataFrame, lineup: Lineup, judgements: Sequence[Judgement]
) -> HeadingTies:
    """Returns the errors and findings that depend on the rule; none if trials lack LAST.

    judgements: judgements of all findings, with the rule of the first sample.
    """
    if LAST not in trials:
        return HeadingTies([], [])
    cells = []
    for scenario in published_table()["scenario"].unique():
        first = trial_values(trials, scenario, FIRST, lineup).mean()
        last = trial_values(trials, scenario, LAST, lineup).mean()
        published = published_values(scenario, FIRST)
        for name in PUBLISHED_CONTROLLERS:
            if abs(relative_difference(first[name], last[name])) > LEAST_DIFFERENCE:
                cells.append(TiedCell(scenario, name, first[name], last[name], published[name]))
    touched = {cell.scenario for cell in cells}
    if not touched:
        return HeadingTies([], [])
    by_last = trials.assign(**{FIRST: trials[LAST]})
    repeated = repeated_cells(trials)
    changed = []
    for finding, judgement in zip(findings(), judgements, strict=True):
        if finding.metric == FIRST and finding.scenario in {*touched, ALL_SCENARIOS}:
            verdict = judge(finding, by_last, lineup, repeated=repeated).verdict
            if verdict is not judgement.verdict:
                changed.append(
                    TiedFinding(finding.number, finding.text, judgement.verdict, verdict)
                )
    return HeadingTies(cells, changed)
