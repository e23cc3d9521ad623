"""Share of the published orderings of two controllers that our trials reproduce.

The findings are claims that the authors chose to make; this share counts all pairs of controllers
in all numbers of the published tables. The ceiling beside it is the agreement of two runs of our
own system that are as small as the published one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations, islice, permutations
from typing import NamedTuple

import numpy as np
import pandas as pd

from drake_navbench.analysis.pairs import RELEVANT_RATIO
from drake_navbench.analysis.repeats import repeated_cells
from drake_navbench.analysis.reproduction.findings import Finding, is_published_tie
from drake_navbench.analysis.reproduction.lineups import (
    ALL_SCENARIOS,
    GOAL_SCENARIOS,
    PUBLISHED_SETTINGS,
    Lineup,
    repeated_in,
    trial_values,
)
from drake_navbench.analysis.reproduction.publication import (
    PUBLISHED_CONTROLLERS,
    published_table,
    published_units,
)
from drake_navbench.analysis.reproduction.relations import Inequalities, relative_difference
from drake_navbench.analysis.tables import STD_HEADING_ERROR
from drake_navbench.kernels.arrays import Array

# Metrics of whole per cent that hardly differ, a metric near zero, and a spread that four trials
# cannot show.
EXCLUDED_METRICS = ("success_rate", "max_velocity", "min_path_error", STD_HEADING_ERROR)
PUBLISHED_TRIALS = 4
MAX_SPLITS = 200
SPLIT_SEED = 0


class Ordering(NamedTuple):
    """Two controllers in a published row, and the same two in our trials.

    published, ours: the second's mean minus the first's as a share of the larger mean; ours is NaN
    where one of them has no value.
    """

    scenario: str
    metric: str
    first: str
    second: str
    published: float
    ours: float

    @property
    def agreement(self) -> float:
        """1 if both have the same order, 0 if not, one half for an exact tie in our trials."""
        return 0.5 + 0.5 * float(np.sign(self.published) * np.sign(self.ours))


class Concordance(NamedTuple):
    """Number of published orderings that our trials reproduce.

    orderings: the published orderings for which our trials have values. agreeing: number of
    orderings in which our values are in the same order; an exact tie counts one half. level: number
    of orderings in which our values differ by less than 1%, in either direction. without_value: the
    orderings left out because our trials have no value.
    """

    orderings: int
    agreeing: float
    level: int
    without_value: int

    @property
    def ratio(self) -> float:
        """The share of orderings that agree; NaN without orderings."""
        return self.agreeing / self.orderings if self.orderings else math.nan


class Ceiling(NamedTuple):
    """Agreement between the orderings in two halves of our own trials, over all splits.

    orderings: mean number of orderings in a split. ratio: mean share of them that agree. low, high:
    the middle 95% of the splits.
    """

    orderings: float
    ratio: float
    low: float
    high: float


def published_orderings(
    trials: pd.DataFrame, lineup: Lineup = PUBLISHED_SETTINGS
) -> list[Ordering]:
    """Returns all orderings in the published tables, without ties, beside ours."""
    found = []
    for scenario, metric, published, unit in _published_rows():
        ours = trial_values(trials, scenario, metric, lineup).mean()
        for first, second in combinations(PUBLISHED_CONTROLLERS, 2):
            if is_published_tie(published[first], published[second], printed_unit=unit):
                continue
            found.append(
                Ordering(
                    scenario,
                    metric,
                    first,
                    second,
                    relative_difference(published[first], published[second]),
                    relative_difference(ours[first], ours[second])
                    if math.isfinite(ours[first] + ours[second])
                    else math.nan,
                )
            )
    return found


class Baseline(NamedTuple):
    """Agreement with the published orderings after the controllers' labels are permuted.

    permutations: the number of permutations, without the identity. median, best: over them, the
    median and the largest share of orderings that agree.
    """

    permutations: int
    median: float
    best: float


def permutation_baseline(trials: pd.DataFrame, lineup: Lineup = PUBLISHED_SETTINGS) -> Baseline:
    """Returns the agreement by chance: our columns with their labels permuted in every other way.

    A permutation renames the controllers in all scenarios and metrics alike. The scenarios and the
    differences between columns stay; only the assignment of controllers to columns is lost.
    """
    published_signs, our_signs = [], []
    for scenario, metric, published, unit in _published_rows():
        ours = trial_values(trials, scenario, metric, lineup).mean()
        published_signs.append(
            [
                0.0
                if is_published_tie(published[a], published[b], printed_unit=unit)
                else np.sign(published[b] - published[a])
                for a, b in permutations(PUBLISHED_CONTROLLERS, 2)
            ]
        )
        our_signs.append([np.sign(ours[b] - ours[a]) for a, b in permutations(ours.index, 2)])
    pairs = list(permutations(range(len(PUBLISHED_CONTROLLERS)), 2))
    column = {pair: place for place, pair in enumerate(pairs)}
    published_of, ours_of = np.array(published_signs), np.array(our_signs)
    others = []
    # The first permutation is the identity.
    for labels in islice(permutations(range(len(PUBLISHED_CONTROLLERS))), 1, None):
        ours_then = ours_of[:, [column[labels[a], labels[b]] for a, b in pairs]]
        is_known = (published_of != 0.0) & np.isfinite(ours_then)
        if is_known.any():
            others.append(float((0.5 + 0.5 * published_of * ours_then)[is_known].mean()))
    if not others:
        return Baseline(0, math.nan, math.nan)
    return Baseline(len(others), float(np.median(others)), max(others))


def concordance(orderings: Iterable[Ordering]) -> Concordance:
    """Counts the orderings that agree."""
    orderings = list(orderings)
    known = [ordering for ordering in orderings if math.isfinite(ordering.ours)]
    return Concordance(
        orderings=len(known),
        agreeing=sum(ordering.agreement for ordering in known),
        level=sum(abs(ordering.ours) < RELEVANT_RATIO for ordering in known),
        without_value=len(orderings) - len(known),
    )


def is_covered(ordering: Ordering, findings: Sequence[Finding]) -> bool:
    """Whether a finding makes a claim about this ordering."""
    pair = {ordering.first, ordering.second}
    return any(
        ordering.metric == finding.metric
        and (
            ordering.scenario == finding.scenario
            or (finding.scenario == ALL_SCENARIOS and ordering.scenario in GOAL_SCENARIOS)
        )
        and isinstance(finding.relation, Inequalities)
        and any(p.is_ordering and {p.lower, p.higher} == pair for p in finding.relation.parts)
        for finding in findings
    )


def ceilings(
    trials: pd.DataFrame,
    lineup: Lineup = PUBLISHED_SETTINGS,
    *,
    repeated: frozenset[tuple[str, str]] | None = None,
    size: int = PUBLISHED_TRIALS,
) -> dict[str, Ceiling]:
    """Returns the ceiling by published scenario, controller, and '' for all together.

    One half of every split stands for the publication: its means are rounded as in print, and ties
    of rounded means do not count. Trials are split by number, so that pairs stay pairs; pairs of
    controllers in which nothing is random (`repeated`, as from `repeats.repeated_cells`) are left
    out. Empty where a cell has fewer than two times `size` trials.
    """
    splits = _splits(trials, lineup, size)
    if splits is None:
        return {}
    first_half, second_half = splits
    if repeated is None:
        repeated = repeated_cells(trials)
    agreeing: dict[str, list[Array]] = {}
    for scenario, metric, _, unit in _published_rows():
        once = repeated_in(repeated, scenario, lineup)
        values = trial_values(trials, scenario, metric, lineup).to_numpy()[: first_half.shape[1]]
        halves = [_means(half, values) for half in (first_half, second_half)]
        for a, b in combinations(range(len(PUBLISHED_CONTROLLERS)), 2):
            names = PUBLISHED_CONTROLLERS[a], PUBLISHED_CONTROLLERS[b]
            if once.issuperset(names):
                continue
            counts = _agreements(halves, a, b, printed_unit=unit)
            for key in ("", scenario, *names):
                agreeing.setdefault(key, []).append(counts)
    return {key: _ceiling(np.array(counts)) for key, counts in agreeing.items()}


def _published_rows() -> Iterator[tuple[str, str, dict[str, float], float]]:
    """Yields scenario, metric, printed values by controller, unit of the last printed digit."""
    for row in published_table().to_dict("records"):
        if row["metric"] not in EXCLUDED_METRICS:
            key = row["scenario"], row["metric"]
            yield *key, {n: float(row[n]) for n in PUBLISHED_CONTROLLERS}, published_units()[key]


def _splits(trials: pd.DataFrame, lineup: Lineup, size: int) -> tuple[Array, Array] | None:
    """Returns weights (splits, trials) of two disjoint halves; None with too few trials."""
    counts = [
        int(((trials["scenario"] == lineup.scenario(scenario)) & (trials["controller"] == p)).sum())
        for scenario in published_table()["scenario"].unique()
        for p in lineup.presets.values()
    ]
    count = min(counts)
    if count < 2 * size:
        return None
    generator = np.random.default_rng(SPLIT_SEED)
    orders = np.array([generator.permutation(count) for _ in range(MAX_SPLITS)])
    weights = np.zeros((2, MAX_SPLITS, count))
    rows = np.arange(MAX_SPLITS)[:, None]
    weights[0, rows, orders[:, :size]] = 1.0
    weights[1, rows, orders[:, size : 2 * size]] = 1.0
    return weights[0], weights[1]


def _means(weights: Array, values: Array) -> Array:
    """Returns (splits, controllers) means over the trials of a split that have a value."""
    known = np.isfinite(values)
    with np.errstate(invalid="ignore"):
        return weights @ np.where(known, values, 0.0) / (weights @ known)


def _agreements(halves: Sequence[Array], a: int, b: int, *, printed_unit: float) -> Array:
    """Returns (splits,) agreement of the order of controllers a and b in two halves.

    NaN where the first half, rounded as in print, has a tie or no value.
    """
    printed = np.round(halves[0][:, [a, b]] / printed_unit) * printed_unit
    ours = halves[1][:, [a, b]]
    agreement = 0.5 + 0.5 * np.sign(printed[:, 1] - printed[:, 0]) * np.sign(
        ours[:, 1] - ours[:, 0]
    )
    ties = [
        not np.isfinite(first + second)
        or is_published_tie(first, second, printed_unit=printed_unit)
        for first, second in printed
    ]
    return np.where(ties, np.nan, agreement)


def _ceiling(agreements: Array) -> Ceiling:
    """Returns the ceiling; agreements: (orderings, splits), NaN where there is no ordering."""
    counts = np.isfinite(agreements).sum(axis=0)
    with np.errstate(invalid="ignore"):
        ratios = np.nansum(agreements, axis=0) / counts
    low, high = np.nanquantile(ratios, [0.025, 0.975])
    return Ceiling(float(counts.mean()), float(np.nanmean(ratios)), float(low), float(high))
