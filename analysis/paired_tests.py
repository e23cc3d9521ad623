"""Paired tests of two tables of trials, corrected for the number of tests.

There are three families of tests: outcomes (arrivals and touches, by the exact sign test), the
listed metrics, and all other metrics (both by Wilcoxon's test). Each family is corrected for the
number of its own tests. If two programs differ by noise only, the probability that any change is
reported is at most `ALARM_RATE`, the sum of the rates of the three families.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from drake_navbench.analysis.metrics.definition import Better, Metric
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.paired_comparison import (
    PairedComparison,
    compare_differences,
    sign_test_p_value,
    trials_needed,
)
from drake_navbench.analysis.paired_shares import paired_share_interval
from drake_navbench.analysis.paired_trials import (
    Contest,
    LostTrial,
    PairedCell,
    indexed,
    lost_trials,
    paired_cells,
)
from drake_navbench.analysis.pairs import holm, smallest_p_value
from drake_navbench.analysis.statistics import ROUNDING, Interval
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.percent import PERCENT

SUCCESS = "success_rate"
TOUCH = "touch_rate"
DEFAULT_LISTED = (
    TOUCH,
    SUCCESS,
    "min_clearance_m",
    "time_to_goal_s",
    "cross_track_error_mean_m",
    "heading_error_mean_deg",
)
# A mean that changes by a smaller share of the base's mean does not matter, however certain the
# change is.
DEFAULT_TOLERANCE = 0.01
# No more pairs that differ are ever asked for.
MOST_DIFFERING = 1000


class Family(StrEnum):
    """A group of tests that are corrected together."""

    OUTCOMES = "outcomes"
    LISTED = "listed metrics"
    OTHERS = "other metrics"


# Outcomes have the largest rate: a touch matters more than a metric, and there are few outcomes.
ALARM_RATES: Mapping[Family, float] = {
    Family.OUTCOMES: 0.03,
    Family.LISTED: 0.01,
    Family.OTHERS: 0.01,
}
ALARM_RATE = sum(ALARM_RATES.values())


class PairedVerdict(StrEnum):
    """The verdict of the pairs on a quantity."""

    WORSE = "worse"
    BETTER = "better"
    CHANGED = "changed"
    SMALL = "too small to matter"
    UNDECIDED = "undecided"
    EQUAL = "equal in every trial"
    NO_VALUE = "no value"
    GONE = "no value any more"


class Quantity(NamedTuple):
    """An outcome or a metric that is tested. relevant: as of `Metric`."""

    name: str
    unit: str
    better: Better
    family: Family
    relevant: float = 0.0


OUTCOMES = (
    Quantity(TOUCH, "%", Better.LOWER, Family.OUTCOMES),
    Quantity(SUCCESS, "%", Better.HIGHER, Family.OUTCOMES),
)


class Finding(NamedTuple):
    """One test: a quantity of a controller in a scenario.

    base_mean, head_mean: over the pairs that count. comparison: after minus before; for an outcome
    with the exact interval. p_value: corrected within the family; NaN for one trial. level: the
    largest p-value of this test alone that decides it, by Bonferroni over the tests of its family
    that could be decided. differing: the number of pairs that differ. is_one_trial: whether nothing
    in these trials is random, so that they are one trial, whose difference is certain.
    """

    label: str
    scenario: str
    controller: str
    quantity: Quantity
    base_mean: float
    head_mean: float
    comparison: PairedComparison
    p_value: float
    level: float
    differing: int
    is_one_trial: bool
    verdict: PairedVerdict

    @property
    def is_loss(self) -> bool:
        """Whether the mean moved in the bad direction."""
        difference = self.comparison.difference
        return difference > 0.0 if self.quantity.better is Better.LOWER else difference < 0.0

    @property
    def fewest_differing(self) -> int:
        """The least number of pairs, all differing in one direction, that can decide this test."""
        return fewest_differing(self.level)

    @property
    def trials_needed(self) -> int | None:
        """The number of trials that would decide a difference of this size; None if unknown."""
        found = self.comparison
        if not found.difference or self.is_one_trial:
            return None
        if self.quantity.family is not Family.OUTCOMES:
            if not found.sd > 0.0:
                return self.fewest_differing
            return trials_needed(found.sd, abs(found.difference), confidence=1.0 - self.level)
        won = 0.5 * (1.0 + found.difference / PERCENT * found.pairs / self.differing)
        for differing in range(self.fewest_differing, MOST_DIFFERING):
            fewer = round(differing * min(won, 1.0 - won))
            if sign_test_p_value(fewer, differing - fewer) <= self.level:
                return math.ceil(differing * found.pairs / self.differing)
        return None


class Judged(NamedTuple):
    """The findings of one or several contests.

    lost: trials that ended as an error, or are missing, in the judged table; they count without a
    test. equal, pairs: the number of pairs that are equal in outcome and all metrics, and of all
    pairs. equal_cells, one_trial_cells: (label, scenario, controller) in which all pairs are equal,
    and in which nothing is random.
    """

    findings: tuple[Finding, ...]
    lost: tuple[LostTrial, ...]
    equal: int
    pairs: int
    equal_cells: tuple[tuple[str, str, str], ...]
    one_trial_cells: tuple[tuple[str, str, str], ...]

    def of(self, verdict: PairedVerdict) -> list[Finding]:
        """Returns the findings with a verdict: touches first, then success, then by p-value."""
        return in_order(finding for finding in self.findings if finding.verdict is verdict)

    @property
    def new_failures(self) -> list[LostTrial]:
        """The lost trials of each controller and scenario that had no lost trial in the base."""
        return [trial for trial in self.lost if not trial.base_fails]

    @property
    def undecided_losses(self) -> list[Finding]:
        """The findings of more touches or fewer arrivals with too few trials to decide."""
        return [
            finding
            for finding in self.of(PairedVerdict.UNDECIDED)
            if finding.quantity.family is Family.OUTCOMES and finding.is_loss
        ]

    def tests(self, family: Family) -> int:
        """Returns the number of tests of a family that have a p-value."""
        own = (f for f in self.findings if f.quantity.family is family)
        return sum(math.isfinite(finding.p_value) for finding in own)


def judge_pairs(
    contests: Sequence[Contest],
    *,
    listed: Collection[str] = DEFAULT_LISTED,
    metrics: Sequence[Metric] | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
) -> Judged:
    """Returns the changes, each family of tests corrected over all contests together.

    listed: names of metrics with a family of their own. metrics: the tested ones, besides the
    outcomes; None: all installed ones. tolerance: a change up to this share of the base's mean does
    not matter; not for outcomes.
    """
    tested = [m for m in (all_metrics() if metrics is None else metrics) if m.name != SUCCESS]
    tests: list[_Test] = []
    cells: list[PairedCell] = []
    contests = [indexed(contest) for contest in contests]
    for contest in contests:
        present = [m for m in tested if m.name in contest.before and m.name in contest.after]
        for cell in paired_cells(contest, present):
            cells.append(cell)
            tests += _tests_of(cell, present, listed)
    return Judged(
        findings=tuple(_findings(tests, tolerance)),
        lost=tuple(trial for contest in contests for trial in lost_trials(contest)),
        equal=sum(int(cell.equal.sum()) for cell in cells),
        pairs=sum(len(cell.first) for cell in cells),
        equal_cells=tuple(cell[:3] for cell in cells if cell.equal.all()),
        one_trial_cells=tuple(cell[:3] for cell in cells if cell.is_one_trial),
    )


def in_order(findings: Iterable[Finding]) -> list[Finding]:
    """Returns findings sorted: touches first, then success, then by rising p-value."""
    families, outcomes = list(Family), [quantity.name for quantity in OUTCOMES]

    def place(finding: Finding) -> tuple[int, int, float]:
        quantity = finding.quantity
        is_outcome = quantity.family is Family.OUTCOMES
        # A finding of one trial is certain, and has no p-value.
        p_value = finding.p_value if math.isfinite(finding.p_value) else 0.0
        return (
            families.index(quantity.family),
            outcomes.index(quantity.name) if is_outcome else 0,
            p_value,
        )

    return sorted(findings, key=place)


def fewest_differing(level: float) -> int:
    """Returns the least number of pairs, all with one sign, whose p-value is at most `level`."""
    count = max(math.ceil(1.0 - math.log2(level)), 1)
    return count if smallest_p_value(count, 1) <= level else count + 1


class _Test(NamedTuple):
    """A test before it is corrected. smallest: the smallest p-value that its pairs can give.

    is_gone: whether the base has values, and the head has none in any of these pairs.
    """

    cell: PairedCell
    quantity: Quantity
    base_mean: float
    comparison: PairedComparison
    differing: int
    is_one_trial: bool
    is_gone: bool

    @property
    def p_value(self) -> float:
        return math.nan if self.is_one_trial else self.comparison.p_value

    @property
    def smallest(self) -> float:
        return smallest_p_value(self.differing, 1)


def _tests_of(
    cell: PairedCell, metrics: Sequence[Metric], listed: Collection[str]
) -> Iterable[_Test]:
    for quantity, happened, rows in (
        (OUTCOMES[0], cell.touched, cell.ended),
        (OUTCOMES[1], cell.arrived, np.ones(len(cell.first), dtype=bool)),
    ):
        values = PERCENT * happened[rows].astype(float)
        yield _test(cell, quantity, values[:, 0], values[:, 1], is_one_trial=cell.is_one_trial)
    rows = cell.measured
    first, second = cell.first[rows], cell.second[rows]
    for column, metric in enumerate(metrics):
        family = Family.LISTED if metric.name in listed else Family.OTHERS
        quantity = Quantity(metric.name, metric.unit, metric.better, family, metric.relevant)
        # Compute times are measured in each trial anew, so they differ even between equal trials.
        once = cell.is_one_trial and metric.is_repeatable
        yield _test(cell, quantity, first[:, column], second[:, column], is_one_trial=once)


def _test(
    cell: PairedCell, quantity: Quantity, first: Array, second: Array, *, is_one_trial: bool
) -> _Test:
    if is_one_trial:
        first, second = first[:1], second[:1]
    by_pair = second - first
    has_both = np.isfinite(by_pair)
    base_mean = float(first[has_both].mean()) if has_both.any() else math.nan
    found = compare_differences(by_pair)
    differing = int((np.abs(by_pair[has_both]) > ROUNDING).sum())
    if quantity.family is Family.OUTCOMES and found.pairs and not is_one_trial:
        wins, losses = int((by_pair > 0.0).sum()), int((by_pair < 0.0).sum())
        low, high = paired_share_interval(wins, losses, found.pairs)
        found = found._replace(
            interval=Interval(PERCENT * low, PERCENT * high),
            p_value=sign_test_p_value(wins, losses),
        )
    is_gone = bool(np.isfinite(first).any()) and not np.isfinite(second).any()
    return _Test(cell, quantity, base_mean, found, differing, is_one_trial, is_gone)


def _findings(tests: Sequence[_Test], tolerance: float) -> list[Finding]:
    """Returns the tests, corrected within their families, in their given order."""
    adjusted = np.full(len(tests), math.nan)
    levels = {}
    for family, rate in ALARM_RATES.items():
        own = [index for index, test in enumerate(tests) if test.quantity.family is family]
        p_values = np.array([tests[index].p_value for index in own])
        smallest = np.array([tests[index].smallest for index in own])
        adjusted[own] = holm(p_values, smallest)
        could_be_decided = np.isfinite(p_values) & (smallest <= rate)
        levels[family] = rate / max(int(could_be_decided.sum()), 1)
    return [
        Finding(
            *test.cell[:3],
            test.quantity,
            test.base_mean,
            test.base_mean + test.comparison.difference,
            test.comparison,
            float(p_value),
            levels[test.quantity.family],
            test.differing,
            test.is_one_trial,
            _verdict(test, float(p_value), tolerance),
        )
        for test, p_value in zip(tests, adjusted, strict=True)
    ]


def _verdict(test: _Test, p_value: float, tolerance: float) -> PairedVerdict:
    quantity, found = test.quantity, test.comparison
    if not found.pairs:
        return PairedVerdict.GONE if test.is_gone else PairedVerdict.NO_VALUE
    if not test.differing:
        return PairedVerdict.EQUAL
    # The test uses ranks: if the mean has the opposite sign, a few trials make that mean.
    contradicts = found.effect * found.difference < 0.0
    is_decided = test.is_one_trial or p_value <= ALARM_RATES[quantity.family]
    if contradicts or not is_decided:
        return PairedVerdict.UNDECIDED
    size = abs(found.difference)
    is_outcome = quantity.family is Family.OUTCOMES
    if not is_outcome and size <= max(tolerance * abs(test.base_mean), quantity.relevant):
        return PairedVerdict.SMALL
    if quantity.better is Better.NEITHER:
        return PairedVerdict.CHANGED
    is_lower = found.difference < 0.0
    if is_lower != (quantity.better is Better.LOWER):
        return PairedVerdict.WORSE
    # Where neither column arrives, who stands still has the largest clearance.
    is_in_vain = not is_outcome and not test.cell.arrived.any()
    return PairedVerdict.CHANGED if is_in_vain else PairedVerdict.BETTER
