"""Totals of the comparison with the publication: verdicts, orderings and relative errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.repeats import repeated_cells
from drake_navbench.analysis.reproduction.concordance import (
    EXCLUDED_METRICS,
    Baseline,
    Ceiling,
    Concordance,
    Ordering,
    ceilings,
    concordance,
    is_covered,
    permutation_baseline,
    published_orderings,
)
from drake_navbench.analysis.reproduction.findings import findings
from drake_navbench.analysis.reproduction.judgement import FindingVerdict, Judgement, judge_all
from drake_navbench.analysis.reproduction.lineups import PUBLISHED_SETTINGS, Lineup
from drake_navbench.analysis.reproduction.publication import PUBLISHED_CONTROLLERS, published_table
from drake_navbench.analysis.reproduction.published_cells import (
    Comparison,
    RelativeError,
    compare_numbers,
    relative_error,
)
from drake_navbench.analysis.tables import STD_HEADING_ERROR

# Metrics that hardly any run could miss: the task fixes success at 100 or 0%, a setting the top
# speed.
NEAR_TRIVIAL_METRICS = ("success_rate", "max_velocity")
# A metric near zero, and a spread that four trials cannot show.
UNCERTAIN_METRICS = ("min_path_error", STD_HEADING_ERROR)
# The title of the row of sums.
TOGETHER = "together"


@dataclass(frozen=True)
class LineupResult:
    """One lineup: its findings, orderings and errors against the publication."""

    lineup: Lineup
    judgements: list[Judgement]
    cells: list[Comparison]
    orderings: list[Ordering]
    ceilings: dict[str, Ceiling]
    baseline: Baseline

    @property
    def compared_cells(self) -> list[Comparison]:
        """The published numbers of the metrics whose orderings count."""
        return [cell for cell in self.cells if cell.metric not in EXCLUDED_METRICS]


Row = Ordering | Comparison


class Share(NamedTuple):
    """Number of a scenario's findings with each verdict.

    from_one_trial: the findings that rest on a single trial. holds_from_one_trial: those of them
    that hold.
    """

    scenario: str
    holds: int
    level: int
    contradicted: int
    undecided: int
    from_one_trial: int
    holds_from_one_trial: int

    @property
    def total(self) -> int:
        """All findings of the scenario."""
        return self.holds + self.level + self.contradicted + self.undecided


class Agreement(NamedTuple):
    """Orderings and numbers of some cells. ceiling: None if it is unknown."""

    title: str
    concordance: Concordance
    ceiling: Ceiling | None
    error: RelativeError


def lineup_result(trials: pd.DataFrame, lineup: Lineup = PUBLISHED_SETTINGS) -> LineupResult:
    """Computes everything about one lineup; trials: rows as from `trial_row`."""
    repeated = repeated_cells(trials)
    return LineupResult(
        lineup,
        judge_all(trials, lineup, repeated=repeated),
        compare_numbers(trials, lineup, repeated=repeated),
        published_orderings(trials, lineup),
        ceilings(trials, lineup, repeated=repeated),
        permutation_baseline(trials, lineup),
    )


def shares(judgements: Sequence[Judgement]) -> list[Share]:
    """Returns the count of verdicts per scenario, in the order of the findings, then of all."""
    scenarios = list(dict.fromkeys(j.finding.scenario for j in judgements))
    rows = [
        _share(name, [j for j in judgements if j.finding.scenario == name]) for name in scenarios
    ]
    return [*rows, _share(TOGETHER, judgements)]


def shares_by_difficulty(judgements: Sequence[Judgement]) -> tuple[Share, Share]:
    """Returns the counts of verdicts of findings that nearly every run meets, and of the others.

    Nearly every run meets those on success rates, which the task fixes at 0 or 100%, and on the top
    speed, which a setting fixes.
    """
    easy = [j for j in judgements if j.finding.metric in NEAR_TRIVIAL_METRICS]
    rest = [j for j in judgements if j.finding.metric not in NEAR_TRIVIAL_METRICS]
    return _share("success rate and top speed", easy), _share("all others", rest)


def errors_by_metric(own: LineupResult) -> dict[str, RelativeError]:
    """Returns the relative errors of the printed numbers, by group of metrics.

    Groups: 'compared', whose orderings count; 'uncertain', for which four trials are too few;
    'trivial', which nearly every run meets; 'all'.
    """
    return {
        "compared": relative_error(own.compared_cells),
        "all": relative_error(own.cells),
        "uncertain": relative_error(c for c in own.cells if c.metric in UNCERTAIN_METRICS),
        "trivial": relative_error(c for c in own.cells if c.metric in NEAR_TRIVIAL_METRICS),
    }


def agreements(own: LineupResult, noisy: LineupResult | None = None) -> list[Agreement]:
    """Returns concordance and relative error by scenario, by controller, and of all together.

    There are also rows for the orderings that the findings cover, and for the others. noisy: the
    result of a lineup with other scenarios; each gets a row beside the scenario it stands for.
    """
    claimed = findings()
    rows = []
    for scenario in published_table()["scenario"].unique():
        rows.append(_agreement(own, scenario, scenario, _is_of_scenario(scenario)))
        if noisy is not None and noisy.lineup.scenario(scenario) != scenario:
            title = noisy.lineup.scenario(scenario)
            rows.append(_agreement(noisy, title, scenario, _is_of_scenario(scenario)))
    for name in PUBLISHED_CONTROLLERS:
        rows.append(_agreement(own, own.lineup.presets[name], name, _is_of_controller(name)))
    covered = {ordering for ordering in own.orderings if is_covered(ordering, claimed)}
    for title, wanted in (("claimed in a finding", True), ("not claimed", False)):
        some = [o for o in own.orderings if (o in covered) is wanted]
        rows.append(Agreement(title, concordance(some), None, relative_error(())))
    return [*rows, _agreement(own, TOGETHER, "", lambda row: True)]


def lineup_agreements(own: LineupResult) -> list[Agreement]:
    """Returns concordance and relative error of a lineup, by scenario and of all together."""
    by_scenario = [
        _agreement(own, name, name, _is_of_scenario(name))
        for name in published_table()["scenario"].unique()
    ]
    return [*by_scenario, _agreement(own, TOGETHER, "", lambda row: True)]


def _share(name: str, judgements: Sequence[Judgement]) -> Share:
    verdicts = [judgement.verdict for judgement in judgements]
    once = sum(judgement.is_one_trial for judgement in judgements)
    counts = {verdict.name.lower(): verdicts.count(verdict) for verdict in FindingVerdict}
    held = sum(j.is_one_trial and j.verdict is FindingVerdict.HOLDS for j in judgements)
    return Share(name, **counts, from_one_trial=once, holds_from_one_trial=held)


def _agreement(
    own: LineupResult, title: str, key: str, is_wanted: Callable[[Row], bool]
) -> Agreement:
    return Agreement(
        title,
        concordance(filter(is_wanted, own.orderings)),
        own.ceilings.get(key),
        relative_error(filter(is_wanted, own.compared_cells)),
    )


def _is_of_scenario(name: str) -> Callable[[Row], bool]:
    return lambda row: row.scenario == name


def _is_of_controller(name: str) -> Callable[[Row], bool]:
    return lambda row: name in _controllers_of(row)


def _controllers_of(row: Ordering | Comparison) -> tuple[str, ...]:
    return (row.first, row.second) if isinstance(row, Ordering) else (row.controller,)
