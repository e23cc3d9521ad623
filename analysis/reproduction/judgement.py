"""The publication's findings, judged on trials, inequality by inequality.

Means over paired trials are judged by Student's intervals and by the size of the difference: a
difference of less than 1% is level, even where its sign is certain.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import partial

import numpy as np
import pandas as pd

from drake_navbench.analysis.pairs import RELEVANT_RATIO, confidence_of_each
from drake_navbench.analysis.repeats import repeated_cells
from drake_navbench.analysis.reproduction.findings import Finding, findings
from drake_navbench.analysis.reproduction.lineups import (
    PUBLISHED_SETTINGS,
    Lineup,
    repeated_in,
    trial_values,
)
from drake_navbench.analysis.reproduction.relations import Equals, Inequality
from drake_navbench.analysis.statistics import (
    UNDEFINED_INTERVAL,
    Interval,
    mean_interval,
    success_interval,
)
from drake_navbench.analysis.verdicts import NOTHING_RANDOM
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.percent import PERCENT

SUCCESS_RATE = "success_rate"
ALONE = "one trial alone has no interval"
NO_SPREAD = "no spread between the trials: decided by the means"
INCLUDES_TIE = "the interval of the deciding difference includes the tie"
INCLUDES_TIE_OF_MANY = "its interval includes the tie, as one of {count} differences looked at"


class FindingVerdict(StrEnum):
    """The verdict of the trials on a finding."""

    HOLDS = "holds"
    LEVEL = "level"
    CONTRADICTED = "does not hold"
    UNDECIDED = "undecided"


# The verdict on a finding is the first of these that one of its parts has.
SEVERITY = (
    FindingVerdict.CONTRADICTED,
    FindingVerdict.UNDECIDED,
    FindingVerdict.LEVEL,
    FindingVerdict.HOLDS,
)


@dataclass(frozen=True)
class Estimate:
    """A mean over trials with its 95% interval; count: of the different trials with a value."""

    mean: float = math.nan
    interval: Interval = UNDEFINED_INTERVAL
    count: int = 0


@dataclass(frozen=True)
class Part:
    """One inequality of a finding, or one controller's printed value, judged.

    difference: the margin of the inequality, in the metric's unit; negative if it does not hold.
    size, published_size: the effect here and in the publication, see `Inequality.size`; NaN where
    there is none. is_ordering: whether the sizes are differences.
    """

    text: str
    verdict: FindingVerdict
    difference: Estimate = field(default_factory=Estimate)
    size: float = math.nan
    published_size: float = math.nan
    is_ordering: bool = False
    note: str = ""

    @property
    def share_of_published(self) -> float:
        """The difference here as a share of the published one; NaN where there is none."""
        if not self.is_ordering or not self.published_size > 0.0:
            return math.nan
        return self.size / self.published_size


@dataclass(frozen=True)
class Judgement:
    """A finding judged on trials.

    ours: by published controller. parts: the judged ones. note: a remark for the reader.
    """

    finding: Finding
    verdict: FindingVerdict
    ours: Mapping[str, Estimate]
    parts: tuple[Part, ...] = ()
    note: str = ""

    @property
    def deciding(self) -> Part | None:
        """The part that decides: of those with the verdict, the one with the least margin.

        None where every part is a tie in the publication.
        """
        own = [part for part in self.parts if part.verdict is self.verdict]
        return min(own, key=_room, default=None)

    @property
    def is_one_trial(self) -> bool:
        """Whether the verdict rests on one trial that has nothing random in it."""
        return self.deciding is not None and self.deciding.note == NOTHING_RANDOM


def judge_all(
    trials: pd.DataFrame,
    lineup: Lineup = PUBLISHED_SETTINGS,
    *,
    repeated: frozenset[tuple[str, str]] | None = None,
) -> list[Judgement]:
    """Judges all findings in their order; arguments as of `judge`."""
    if repeated is None:
        repeated = repeated_cells(trials)
    return [judge(finding, trials, lineup, repeated=repeated) for finding in findings()]


def judge(
    finding: Finding,
    trials: pd.DataFrame,
    lineup: Lineup = PUBLISHED_SETTINGS,
    *,
    repeated: frozenset[tuple[str, str]] | None = None,
) -> Judgement:
    """Judges a finding on trials, rows as from `trial_row`.

    Every part is judged by itself, except ties in the publication. A part holds if the whole 95%
    interval of its difference is positive; it does not hold if the whole interval is negative,
    widened for the number of parts, since one failing part is enough. An ordering is level if its
    difference is less than 1% of the larger mean. Any other part is undecided. The finding does not
    hold if one part does not; it holds if all parts do. repeated: as from `repeats.repeated_cells`.
    """
    if repeated is None:
        repeated = repeated_cells(trials)
    table = trial_values(trials, finding.scenario, finding.metric, lineup)
    values = {name: table[name].to_numpy() for name in table}
    once = repeated_in(repeated, finding.scenario, lineup)
    is_rate = finding.metric == SUCCESS_RATE
    ours = {
        name: estimate(column, is_repeated=name in once, is_rate=is_rate)
        for name, column in values.items()
    }
    if isinstance(finding.relation, Equals):
        parts = [
            _judge_value(finding.relation, name, values[name], is_repeated=name in once)
            for name in finding.relation.controllers
        ]
    else:
        judged = [part for part in finding.relation.parts if part not in finding.ties]
        parts = [
            _judge_inequality(
                part, values, finding.published, repeated=once, part_count=len(judged)
            )
            for part in judged
        ]
    verdict = next(
        (v for v in SEVERITY if any(p.verdict is v for p in parts)), FindingVerdict.LEVEL
    )
    judgement = Judgement(finding, verdict, ours, tuple(parts))
    notes = [judgement.deciding.note] if judgement.deciding is not None else []
    if finding.ties:
        notes.append(f"not judged, a tie in the publication: {_listed(finding.ties)}")
    return Judgement(finding, verdict, ours, tuple(parts), "; ".join(filter(None, notes)))


def estimate(values: Array, *, is_repeated: bool = False, is_rate: bool = False) -> Estimate:
    """Returns the mean of the values that are not NaN, with its interval.

    is_repeated: whether all values are from equal trials, which have no interval. is_rate: whether
    each value is 0 or 100, so that the interval is Wilson's.
    """
    known = values[~np.isnan(values)]
    if len(known) == 0:
        return Estimate()
    mean = float(known.mean())
    if is_repeated:
        return Estimate(float(known[0]), UNDEFINED_INTERVAL, 1)
    if is_rate:
        share = success_interval(int((known > 0.0).sum()), len(known))
        return Estimate(mean, Interval(*(PERCENT * end for end in share)), len(known))
    return Estimate(mean, mean_interval(known), len(known))


def _judge_value(relation: Equals, controller: str, values: Array, *, is_repeated: bool) -> Part:
    """Judges whether every trial has the printed value; one trial with another value is enough."""
    text = f"{controller} = {relation.value:g}"
    known = values[~np.isnan(values)]
    if len(known) == 0:
        return Part(text, FindingVerdict.UNDECIDED, note=f"no value for {controller}")
    holds = relation.holds(known)
    failing = len(known) - int(holds.sum())
    verdict = FindingVerdict.CONTRADICTED if failing else FindingVerdict.HOLDS
    if is_repeated:
        return Part(text, verdict, Estimate(count=1), note=NOTHING_RANDOM)
    if len(known) == 1 and not failing:
        return Part(text, FindingVerdict.UNDECIDED, Estimate(count=1), note="one trial alone")
    note = f"{failing} of {len(known)} trials have another value" if failing else ""
    return Part(text, verdict, Estimate(count=len(known)), note=note)


def _judge_inequality(
    part: Inequality,
    values: Mapping[str, Array],
    published: Mapping[str, float],
    *,
    repeated: frozenset[str],
    part_count: int,
) -> Part:
    lower, higher = values[part.lower], values[part.higher]
    is_pair = ~np.isnan(lower + higher)
    published_size = part.size(published[part.lower], published[part.higher])
    judged = partial(Part, part.text, published_size=published_size, is_ordering=part.is_ordering)
    if not is_pair.any():
        missing = [n for n in (part.lower, part.higher) if np.isnan(values[n]).all()]
        lack = (
            f"no value for {', '.join(missing)}" if missing else "no trial in which both have one"
        )
        return judged(verdict=FindingVerdict.UNDECIDED, note=lack)
    left_out = int(np.count_nonzero(~is_pair))
    is_one_trial = repeated >= {part.lower, part.higher}
    lower, higher = lower[is_pair], higher[is_pair]
    if is_one_trial:
        lower, higher = lower[:1], higher[:1]
    differences = part.difference(lower, higher)
    difference = Estimate(float(differences.mean()), mean_interval(differences), len(differences))
    means = float(lower.mean()), float(higher.mean())
    bar = RELEVANT_RATIO * max(map(abs, means)) if part.is_ordering else 0.0
    if is_one_trial:
        verdict, note = _by_sign(difference.mean, bar), NOTHING_RANDOM
    else:
        # One failing part is enough against a finding: the more parts, the wider this interval.
        widened = mean_interval(differences, confidence=confidence_of_each(part_count))
        verdict, note = _by_intervals(difference, widened, bar=bar, part_count=part_count)
    if left_out and not is_one_trial:
        lack = "trials lack" if left_out > 1 else "trial lacks"
        note = "; ".join(filter(None, [note, f"{left_out} {lack} a value"]))
    return judged(verdict=verdict, difference=difference, size=part.size(*means), note=note)


def _by_sign(difference: float, bar: float) -> FindingVerdict:
    if abs(difference) < bar or difference == 0.0:
        return FindingVerdict.LEVEL
    return FindingVerdict.HOLDS if difference > 0.0 else FindingVerdict.CONTRADICTED


def _by_intervals(
    difference: Estimate, widened: Interval, *, bar: float, part_count: int
) -> tuple[FindingVerdict, str]:
    low, high = difference.interval
    if math.isnan(low):
        return FindingVerdict.UNDECIDED, ALONE
    if low == high:
        return _by_sign(difference.mean, bar), NO_SPREAD
    excludes_tie = low > 0.0 or high < 0.0
    if abs(difference.mean) < bar:
        is_small = -bar < low and high < bar
        return (
            (FindingVerdict.LEVEL, "")
            if excludes_tie or is_small
            else (FindingVerdict.UNDECIDED, INCLUDES_TIE)
        )
    if low > 0.0:
        return FindingVerdict.HOLDS, ""
    if widened.high < 0.0:
        return FindingVerdict.CONTRADICTED, ""
    if high < 0.0:
        return FindingVerdict.UNDECIDED, INCLUDES_TIE_OF_MANY.format(count=part_count)
    return FindingVerdict.UNDECIDED, INCLUDES_TIE


def _room(part: Part) -> float:
    """Returns the margin by which a part holds; the part with the smallest one is the tightest.

    Only margins of one finding's parts can be compared. A part without a size has the margin inf.
    """
    if math.isnan(part.size):
        return math.inf
    return part.size if part.is_ordering else -part.size


def _listed(ties: Iterable[Inequality]) -> str:
    return ", ".join(part.text for part in ties)
