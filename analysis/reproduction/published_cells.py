"""Comparison of every published number with ours."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pandas as pd

from drake_navbench.analysis.repeats import repeated_cells
from drake_navbench.analysis.reproduction.judgement import SUCCESS_RATE, Estimate, estimate
from drake_navbench.analysis.reproduction.lineups import (
    PUBLISHED_SETTINGS,
    Lineup,
    repeated_in,
    trial_values,
)
from drake_navbench.analysis.reproduction.publication import PUBLISHED_CONTROLLERS, published_table
from drake_navbench.analysis.tables import STD_HEADING_ERROR
from drake_navbench.kernels.arrays import Array


class Comparison(NamedTuple):
    """A published number beside ours; difference: relative, NaN if the published number is 0."""

    scenario: str
    metric: str
    unit: str
    controller: str
    published: float
    ours: Estimate
    relative_difference: float


class RelativeError(NamedTuple):
    """The size of the relative differences of some cells: their median and upper quartile.

    cells: the number of cells that have both numbers, the published one not 0.
    """

    cells: int
    median: float
    upper_quartile: float


def compare_numbers(
    trials: pd.DataFrame,
    lineup: Lineup = PUBLISHED_SETTINGS,
    *,
    repeated: frozenset[tuple[str, str]] | None = None,
) -> list[Comparison]:
    """Returns every published number beside ours, in the publication's order.

    repeated: as from `repeats.repeated_cells`.
    """
    if repeated is None:
        repeated = repeated_cells(trials)
    rows = []
    for row in published_table().to_dict("records"):
        scenario, metric = row["scenario"], row["metric"]
        is_spread = metric == STD_HEADING_ERROR
        source = "avg_heading_error" if is_spread else metric
        values = trial_values(trials, scenario, source, lineup)
        once = repeated_in(repeated, scenario, lineup)
        for name in PUBLISHED_CONTROLLERS:
            column = values[name].to_numpy()
            if is_spread:
                ours = _spread(column, is_repeated=name in once)
            else:
                ours = estimate(column, is_repeated=name in once, is_rate=metric == SUCCESS_RATE)
            published = float(row[name])
            relative = ours.mean / published - 1.0 if published != 0.0 else math.nan
            rows.append(Comparison(scenario, metric, row["unit"], name, published, ours, relative))
    return rows


def relative_error(cells: Iterable[Comparison]) -> RelativeError:
    """Returns median and upper quartile of the cells' relative differences, without their signs."""
    errors = np.abs([cell.relative_difference for cell in cells])
    errors = errors[np.isfinite(errors)]
    if len(errors) == 0:
        return RelativeError(0, math.nan, math.nan)
    return RelativeError(len(errors), float(np.median(errors)), float(np.quantile(errors, 0.75)))


def _spread(values: Array, *, is_repeated: bool) -> Estimate:
    """Returns the spread over the trials (divisor n), without an interval."""
    known = values[~np.isnan(values)]
    if is_repeated or len(known) < 2:
        return Estimate(count=min(len(known), 1))
    return Estimate(float(known.std()), count=len(known))
