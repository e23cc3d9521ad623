"""The publication's claims, each checked against the precision of the published tables."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

from drake_navbench.analysis.pairs import RELEVANT_RATIO
from drake_navbench.analysis.reproduction.lineups import ALL_SCENARIOS, GOAL_SCENARIOS
from drake_navbench.analysis.reproduction.publication import (
    PUBLISHED_CONTROLLERS,
    published_findings,
    published_table,
    published_units,
)
from drake_navbench.analysis.reproduction.relations import (
    Inequalities,
    Inequality,
    Relation,
    parse_relation,
    relative_difference,
)


@dataclass(frozen=True)
class Finding:
    """A row of findings.csv.

    number: its id. published: the printed values by controller, NaN where only the text makes the
    claim. ties: the inequalities of the relation for which the printed values are too close.
    """

    number: int
    scenario: str
    metric: str
    relation_text: str
    controllers_text: str
    where: str
    relation: Relation
    published: Mapping[str, float]
    ties: tuple[Inequality, ...] = ()

    @property
    def text(self) -> str:
        """The relation and its controllers in one line."""
        return f"{self.relation_text}: {self.controllers_text}"


@lru_cache(maxsize=1)
def findings() -> tuple[Finding, ...]:
    """Returns the findings in the order of the file."""
    return tuple(
        _finding(int(row.id), row.scenario, row.metric, row.relation, row.controllers, row.where)
        for row in published_findings().itertuples()
    )


def published_values(scenario: str, metric: str) -> dict[str, float]:
    """Returns the printed values by controller; for 'all', their mean over the goal scenarios."""
    table = published_table()
    wanted = GOAL_SCENARIOS if scenario == ALL_SCENARIOS else (scenario,)
    rows = table[table["scenario"].isin(wanted) & (table["metric"] == metric)]
    return {name: float(rows[name].mean()) for name in PUBLISHED_CONTROLLERS}


def is_published_tie(first: float, second: float, *, printed_unit: float) -> bool:
    """Whether two printed values are too close for an order.

    Two numbers that differ by at most one unit of the last printed digit may be equal before
    rounding; differences below 1% count as ties, too. Without printed values there is no tie.
    """
    difference = abs(first - second)
    # A margin of a tenth of a digit: 0.857 - 0.856 is a little more than 0.001 in binary.
    return difference <= 1.1 * printed_unit or (
        abs(relative_difference(first, second)) < RELEVANT_RATIO
    )


def _finding(
    number: int, scenario: str, metric: str, relation_text: str, controllers: str, where: str
) -> Finding:
    relation = parse_relation(relation_text, controllers, everyone=PUBLISHED_CONTROLLERS)
    published = published_values(scenario, metric)
    wanted = GOAL_SCENARIOS if scenario == ALL_SCENARIOS else (scenario,)
    unit = max(published_units().get((name, metric), 0.0) for name in wanted)
    ties: tuple[Inequality, ...] = ()
    if isinstance(relation, Inequalities):
        ties = tuple(
            part
            for part in relation.parts
            if part.is_ordering
            and not math.isnan(published[part.lower] + published[part.higher])
            and is_published_tie(published[part.lower], published[part.higher], printed_unit=unit)
        )
    return Finding(
        number, scenario, metric, relation_text, controllers, where, relation, published, ties
    )
