"""A controller's weak points: the metrics in which it is shown to be behind the best, in words."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.metrics.definition import Better, Metric
from drake_navbench.analysis.numbers import number, typeset
from drake_navbench.analysis.verdicts import FirstPlace, MetricVerdict

DIGITS = 3
# A controller that is less than 10% behind has no weak point.
WEAK_RATIO = 1.1
MOST_TOLD = 2


class WeakPoint(NamedTuple):
    """One metric of one scenario in which a controller is shown to be behind the best one.

    what: the metric in words. where: the scenario. ratio: the factor by which the controller is
    worse; infinite if the best mean is 0. own: its mean. first: the best mean. best: the controller
    with the best mean.
    """

    metric: Metric
    what: str
    where: str
    ratio: float
    own: float
    first: float
    best: str

    def in_words(self, *, tells_where: bool) -> str:
        """Returns the weakness in words: "3.9 times mppi's jerk (1.27 against 0.32 m/s³)"."""
        place = f" in {self.where}" if tells_where else ""
        values = f"{_value(self.own, self.metric)} against {_value(self.first, self.metric)}"
        place += f" ({values} {typeset(self.metric.unit)})"
        if self.metric.better is not Better.LOWER:
            return f"{number(100.0 / self.ratio, 2)}% of {self.best}'s {self.what}{place}"
        if math.isinf(self.ratio):
            return f"more {self.what} than {self.best}{place}"
        return f"{number(self.ratio, 2)} times {self.best}'s {self.what}{place}"


def weak_point(
    name: str, verdict: MetricVerdict, means: pd.DataFrame, entry: Metric, what: str
) -> WeakPoint | None:
    """Returns the weak point of a controller in one metric of one scenario, or None.

    It has one only if the verdict shows the controller to be behind, and its mean is at least 10%
    worse. means: a row a controller, a column a metric.
    """
    is_behind = name in verdict.order and name not in verdict.leaders
    if not is_behind or verdict.standing is FirstPlace.NO_CONTEST:
        return None
    best = verdict.order[0]
    own, first = (float(means.loc[who, entry.name]) for who in (name, best))
    worse, better = (own, first) if entry.better is Better.LOWER else (first, own)
    ratio = worse / better if better > 0.0 else math.inf
    if ratio < WEAK_RATIO:
        return None
    return WeakPoint(entry, what, verdict.scenario, ratio, own, first, best)


def worst_of(found: Sequence[WeakPoint], praised_in: Collection[str]) -> list[WeakPoint]:
    """Returns the weak points to name: those in the praised scenarios first, then the largest.

    At most MOST_TOLD are returned, and at most one for each metric.
    """
    order = sorted(found, key=lambda point: (point.where not in praised_in, -point.ratio))
    by_metric: dict[str, WeakPoint] = {}
    for point in order:
        by_metric.setdefault(point.metric.name, point)
    return list(by_metric.values())[:MOST_TOLD]


def _value(value: float, entry: Metric) -> str:
    if 0.0 < abs(value) < entry.relevant:
        return f"less than {entry.relevant:g}"
    return number(value, DIGITS)
