"""What the trials say of the publication, added up: verdicts, orderings, and relative errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.concordance import (
    EXCLUDED_METRICS,
    Ceiling,
    Concordance,
    Ordering,
    ceilings,
    concordance,
    is_covered,
    published_orderings,
)
from drake_navbench.analysis.findings import findings
from drake_navbench.analysis.judgement import Judgement, Verdict, judge_all
from drake_navbench.analysis.lineups import PUBLISHED_SETTINGS, Lineup
from drake_navbench.analysis.published_cells import (
    Comparison,
    RelativeError,
    compare_numbers,
    relative_error,
)
from drake_navbench.analysis.repeats import repeated_cells
from drake_navbench.analysis.tables import PUBLISHED_CONTROLLERS, published_table

# The title of the row of sums.
TOGETHER = "together"


@dataclass(frozen=True)
class Account:
    """All that is computed of one lineup."""

    lineup: Lineup
    judgements: list[Judgement]
    cells: list[Comparison]
    orderings: list[Ordering]
    ceilings: dict[str, Ceiling]

    @property
    def compared_cells(self) -> list[Comparison]:
        """The published numbers whose orderings count, too."""
        return [cell for cell in self.cells if cell.metric not in EXCLUDED_METRICS]


Row = Ordering | Comparison


class Share(NamedTuple):
    """How many findings of a scenario came to which verdict, and how many rest on one trial."""

    scenario: str
    holds: int
    level: int
    contradicted: int
    undecided: int
    from_one_trial: int

    @property
    def total(self) -> int:
        """All findings of the scenario."""
        return self.holds + self.level + self.contradicted + self.undecided


class Agreement(NamedTuple):
    """Orderings and numbers of some cells. ceiling: None where it is not known."""

    title: str
    concordance: Concordance
    ceiling: Ceiling | None
    error: RelativeError


def account(trials: pd.DataFrame, lineup: Lineup = PUBLISHED_SETTINGS) -> Account:
    """Computes all of one lineup; trials: rows as from `tables.trial_row`."""
    repeated = repeated_cells(trials)
    return Account(
        lineup,
        judge_all(trials, lineup, repeated=repeated),
        compare_numbers(trials, lineup, repeated=repeated),
        published_orderings(trials, lineup),
        ceilings(trials, lineup, repeated=repeated),
    )


def shares(judgements: Sequence[Judgement]) -> list[Share]:
    """Returns the count of verdicts per scenario, in the order of the findings, then of all."""
    scenarios = list(dict.fromkeys(j.finding.scenario for j in judgements))
    rows = [
        _share(name, [j for j in judgements if j.finding.scenario == name]) for name in scenarios
    ]
    return [*rows, _share(TOGETHER, judgements)]


def agreements(own: Account, noisy: Account | None = None) -> list[Agreement]:
    """Returns concordance and relative error by scenario, by controller, and of all together.

    Between them those of the orderings that the findings cover and of those that they do not.
    noisy: the account of a lineup whose scenarios are set beside those that they stand for.
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


def lineup_agreements(own: Account) -> list[Agreement]:
    """Returns concordance and relative error by scenario and of all together."""
    by_scenario = [
        _agreement(own, name, name, _is_of_scenario(name))
        for name in published_table()["scenario"].unique()
    ]
    return [*by_scenario, _agreement(own, TOGETHER, "", lambda row: True)]


def _share(name: str, judgements: Sequence[Judgement]) -> Share:
    verdicts = [judgement.verdict for judgement in judgements]
    once = sum(judgement.is_one_trial for judgement in judgements)
    counts = {verdict.name.lower(): verdicts.count(verdict) for verdict in Verdict}
    return Share(name, **counts, from_one_trial=once)


def _agreement(own: Account, title: str, key: str, is_wanted: Callable[[Row], bool]) -> Agreement:
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
