"""Pairs of trials from two tables: the trials that are compared, and those that did not end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from drake_navbench.analysis.metrics.definition import Metric
from drake_navbench.analysis.repeats import repeated_cells
from drake_navbench.analysis.statistics import ROUNDING
from drake_navbench.kernels.arrays import Array
from drake_navbench.logs.outcome import Outcome

Mask = NDArray[np.bool_]

# The columns in which a trial equals its partner in the other table.
IDENTITY = ["scenario", "controller", "seed"]


class Contest(NamedTuple):
    """Two tables of trials that are compared; one row a trial: IDENTITY, `outcome`, metrics.

    before: the base. after: the trials that are judged against it. label: distinguishes several
    contests that are judged together.
    """

    before: pd.DataFrame
    after: pd.DataFrame
    label: str = ""


class PairedCell(NamedTuple):
    """The pairs of trials of one controller in one scenario.

    first, second: (pairs, metrics), before and after, NaN where a trial has no value. repeatable:
    (metrics,), False for a metric that depends on the machine. outcomes: (pairs, 2). is_one_trial:
    whether, on each side, all trials are equal: nothing in them is random, and they count as one
    pair.
    """

    label: str
    scenario: str
    controller: str
    first: Array
    second: Array
    repeatable: Mask
    outcomes: NDArray[np.object_]
    is_one_trial: bool

    @property
    def arrived(self) -> Mask:
        """(pairs, 2): which trials reached the goal."""
        return self.outcomes == Outcome.SUCCEEDED

    @property
    def touched(self) -> Mask:
        """(pairs, 2): which trials ended at a touch."""
        return self.outcomes == Outcome.COLLIDED

    @property
    def ended(self) -> Mask:
        """(pairs,): where neither trial ended as an error."""
        return (self.outcomes != Outcome.ERROR).all(axis=1)

    @property
    def measured(self) -> Mask:
        """(pairs,): where metrics are compared: both trials arrived.

        A controller that gives up at once is neither quick nor smooth nor safe. If no trial
        arrived, every pair without an error counts: then the question is how the controllers gave
        up.
        """
        arrived = self.arrived
        if not arrived.any():
            return self.ended
        return np.asarray(arrived.all(axis=1))

    @property
    def equal(self) -> Mask:
        """(pairs,): where both trials are equal in outcome and every metric but compute times."""
        first, second = self.first[:, self.repeatable], self.second[:, self.repeatable]
        same = np.abs(second - first) <= ROUNDING
        same |= np.isnan(first) & np.isnan(second)
        return same.all(axis=1) & (self.outcomes[:, 0] == self.outcomes[:, 1])


class LostTrial(NamedTuple):
    """A trial that ended as an error, or is missing, in the judged table.

    reason: the log's; '' where the trial is missing. is_new: whether the trial came to an end in
    the base. base_fails: whether a trial of its controller and scenario, this one or another, was
    lost in the base, too, so that the change need not be the cause.
    """

    label: str
    scenario: str
    controller: str
    seed: int
    reason: str
    is_missing: bool
    is_new: bool
    base_fails: bool


def indexed(contest: Contest) -> Contest:
    """Returns a contest whose tables are indexed and sorted by IDENTITY.

    Of several trials of equal scenario, controller and seed, the first counts.
    """
    before, after = (
        table.drop_duplicates(IDENTITY).set_index(IDENTITY).sort_index() for table in contest[:2]
    )
    return Contest(before, after, contest.label)


def paired_cells(contest: Contest, metrics: Sequence[Metric]) -> Iterator[PairedCell]:
    """Yields every scenario and controller with a trial of equal seed in both `indexed` tables."""
    names = [metric.name for metric in metrics]
    repeatable = np.array([metric.is_repeatable for metric in metrics], dtype=bool)
    before, after = contest[:2]
    common = before.index.intersection(after.index)
    before, after = before.loc[common], after.loc[common]
    first, second = (table[names].to_numpy(dtype=float) for table in (before, after))
    outcomes = np.array([before["outcome"], after["outcome"]], dtype=object).T
    repeated = frozenset.intersection(
        *(repeated_cells(table.reset_index()) for table in (before, after))
    )
    places = before.reset_index()[IDENTITY[:2]]
    for (scenario, controller), rows in places.groupby(IDENTITY[:2], sort=False).indices.items():
        yield PairedCell(
            contest.label,
            scenario,
            controller,
            first[rows],
            second[rows],
            repeatable,
            outcomes[rows],
            is_one_trial=(scenario, controller) in repeated,
        )


def lost_trials(contest: Contest) -> list[LostTrial]:
    """Returns the trials that ended as an error, or are missing, in the judged `indexed` table."""
    before, after = contest[:2]
    errors = [set(table.index[table["outcome"] == Outcome.ERROR]) for table in (before, after)]
    missing = [set(a.index) - set(b.index) for a, b in ((after, before), (before, after))]
    lost_before = errors[0] | missing[0]
    unsound = {identity[:2] for identity in lost_before}
    reasons = after["reason"] if "reason" in after else pd.Series(dtype=object)
    return [
        LostTrial(
            contest.label,
            identity[0],
            identity[1],
            int(identity[2]),
            reason=str(reasons.get(identity, "")),
            is_missing=identity in missing[1],
            is_new=identity not in lost_before,
            base_fails=identity[:2] in unsound,
        )
        for identity in sorted(errors[1] | missing[1])
    ]
