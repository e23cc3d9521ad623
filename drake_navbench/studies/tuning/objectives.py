"""Objectives of a tuning study: relative differences to the baseline on the same seeds.

The difference of a pair is (candidate - baseline) / scale, with its sign such that lower is better.
The scale of a scenario is the mean of the baseline's trials there. A difference is clipped to
[-CENSORED, CENSORED]. A failed trial counts as CENSORED, so giving up early never pays.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.kernels.arrays import Array
from drake_navbench.logs.outcome import Outcome

Row = Mapping[str, Any]

CENSORED = 1.0
# The largest loss of successes against the baseline that is allowed, as a share.
SUCCESS_MARGIN = 0.02


class Objective(NamedTuple):
    """A metric that tuning improves. sign: 1 where lower is better, -1 where higher is."""

    name: str
    metric: str
    sign: int


OBJECTIVES = {
    entry.name: entry
    for entry in (
        Objective("time", "time_to_goal_s", 1),
        Objective("clearance", "min_clearance_m", -1),
        Objective("jerk", "jerk_rms_mps3", 1),
        Objective("turning_jerk", "angular_jerk_rms_radps3", 1),
        Objective("path_error", "cross_track_error_mean_m", 1),
        Objective("length", "driven_length_m", 1),
    )
}


def chosen_objectives(names: Sequence[str]) -> tuple[Objective, ...]:
    """Returns the objectives of these names; raises InputError."""
    for name in names:
        if name not in OBJECTIVES:
            raise InputError(
                f"--objectives: {name!r} is not known{nearest_name_hint(name, OBJECTIVES)}"
            )
        if names.count(name) > 1:
            raise InputError(f"--objectives: {name} is given twice")
    if not names:
        raise InputError("--objectives: expected at least one")
    return tuple(OBJECTIVES[name] for name in names)


def has_failed(row: Row) -> bool:
    """Returns whether a trial did not reach its goal."""
    return row["outcome"] != Outcome.SUCCEEDED


def require_comparable(
    rows: Sequence[Row], objectives: Sequence[Objective], tasks: Collection[str] = ()
) -> None:
    """Raises InputError where the baseline's trials, `rows`, leave nothing to compare with.

    That is so in a scenario in which it never reaches the goal, or in which nothing is random.
    tasks: scenarios that are goals of one map; the baseline may miss some of these, and a search
    may improve on that.
    """
    for scenario, own in _by_scenario(rows).items():
        if all(map(has_failed, own)) and scenario not in tasks:
            raise InputError(
                f"scenario {scenario}: the baseline reaches the goal in none of its trials there; "
                "nothing to compare with"
            )
        require_random(scenario, own, objectives)
    if all(map(has_failed, rows)):
        raise InputError(
            "the baseline reaches no goal on the map, so there is nothing to compare with"
        )


def require_random(scenario: str, rows: Sequence[Row], objectives: Sequence[Objective]) -> None:
    """Raises InputError if all trials of a scenario are equal, as nothing in it is random."""
    values = _values(rows, objectives)
    if len(values) > 1 and np.array_equal(
        values, np.tile(values[0], (len(values), 1)), equal_nan=True
    ):
        raise InputError(
            f"scenario {scenario}: nothing in it is random, so that all its trials are one; "
            "expected one with noise or a varied start, or a robot with noise: a robot file with "
            "`like: MODEL` and `lidar: {range_std_m: 0.01}`; where that changes no drive on a map, "
            "more --goals, so that each is driven once"
        )


def scales_of(rows: Sequence[Row], objectives: Sequence[Objective]) -> dict[str, Array]:
    """Returns, by scenario, the mean of the baseline's successes in each objective, (K,).

    NaN for an objective that has no value there, such as the clearance where nothing stands.
    """
    scales = {}
    for scenario, own in _by_scenario(rows).items():
        values = np.abs(_values([row for row in own if not has_failed(row)], objectives))
        known = [column[np.isfinite(column)] for column in values.T]
        scales[scenario] = np.array(
            [column.mean() if len(column) else math.nan for column in known]
        )
    return scales


def _by_scenario(rows: Sequence[Row]) -> dict[str, list[Row]]:
    found: dict[str, list[Row]] = {}
    for row in rows:
        found.setdefault(str(row["scenario"]), []).append(row)
    return found


def _values(rows: Sequence[Row], objectives: Sequence[Objective]) -> Array:
    """Returns (N, K) the value of each objective in each trial."""
    values = [[row[entry.metric] for entry in objectives] for row in rows]
    return np.array(values, dtype=float).reshape(len(rows), len(objectives))


def pair_difference(
    candidate: Row, baseline: Row, objectives: Sequence[Objective], scale: Array
) -> list[float]:
    """Returns the differences (K,) of a pair of trials, lower is better."""
    failed = has_failed(candidate), has_failed(baseline)
    if any(failed):
        return [CENSORED * (failed[0] - failed[1])] * len(objectives)
    differences = []
    for entry, size in zip(objectives, scale, strict=True):
        difference = candidate[entry.metric] - baseline[entry.metric]
        relative = entry.sign * difference / size if size > 0.0 else math.nan
        # Without a value, as where no obstacle is near, there is nothing to gain or lose.
        relative = 0.0 if math.isnan(relative) else relative
        differences.append(float(np.clip(relative, -CENSORED, CENSORED)))
    return differences


def excess_failures(candidate: Sequence[Row], baseline: Sequence[Row]) -> float:
    """Returns the candidate's share of failures minus the baseline's, less the allowed excess."""
    shares = [sum(map(has_failed, rows)) / len(rows) for rows in (candidate, baseline)]
    return shares[0] - shares[1] - SUCCESS_MARGIN
