"""Effect of a sweep's fields on the metrics: the long table, the responses, the slopes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from drake_navbench.analysis.pairs import ComparedPair, compare_every_pair
from drake_navbench.analysis.statistics import (
    Interval,
    mean_interval,
    success_interval,
)
from drake_navbench.logs.outcome import Outcome

PAGE_NAME = "sweep.html"
SUCCEEDED = "succeeded"
WHO = ("scenario", "controller")


class Response(NamedTuple):
    """A metric at each value of a field, of one controller in one scenario.

    values: (N,) of the field. means: (N,) of the metric. intervals: N, 95%. counts: (N,) the trials
    with a value.
    """

    controller: str
    values: list[Any]
    means: list[float]
    intervals: list[Interval]
    counts: list[int]


class Slope(NamedTuple):
    """The change of a metric for one unit of a field: mean over the seeds with its 95% interval."""

    controller: str
    mean: float
    interval: Interval
    seeds: int


def long_table(trials: pd.DataFrame, sweep: Mapping[str, Mapping[str, Any]]) -> pd.DataFrame:
    """Returns the rows of trials with one more column for each swept field, under its name.

    trials: as from `trial_row`. sweep: the manifest's. A field of a controller has no value in the
    rows of others.
    """
    table = trials.copy()
    fields: dict[str, list[Any]] = {field: [] for field in swept_fields(sweep)}
    for names in zip(*(trials[kind] for kind in WHO), strict=True):
        values = {}
        for kind, name in zip(WHO, names, strict=True):
            values.update(sweep[f"{kind}s"][name]["values"])
        for field, column in fields.items():
            column.append(values.get(field))
    for kind in WHO:
        table[kind] = [sweep[f"{kind}s"][name]["of"] for name in trials[kind]]
    behind = table.columns.get_loc(WHO[-1]) + 1
    for place, (field, values_of_field) in enumerate(fields.items()):
        table.insert(behind + place, field, values_of_field)
    table[SUCCEEDED] = (table["outcome"] == Outcome.SUCCEEDED).astype(float)
    return table


def swept_fields(sweep: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Returns the fields of a sweep, in order."""
    origins = [*sweep["scenarios"].values(), *sweep["controllers"].values()]
    return list(dict.fromkeys(field for origin in origins for field in origin["values"]))


def is_numeric(table: pd.DataFrame, field: str) -> bool:
    """Returns whether all values of a field are numbers, so that it can have a slope."""
    known = table[field].dropna()
    return all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in known)


def responses(table: pd.DataFrame, field: str, metric: str) -> list[Response]:
    """Returns the response of each controller that has the field, in one scenario.

    table: rows of one scenario from `long_table`. At each value of the field, each seed's results
    are first averaged over the other fields, since only seeds are independent; the interval is over
    the seeds.
    """
    found = []
    for controller, rows in _by_controller(table, field):
        values = list(dict.fromkeys(sorted(rows[field])))
        cells = [_by_seed(rows[rows[field] == value], metric) for value in values]
        found.append(
            Response(
                controller,
                values,
                [float(cell.mean()) if len(cell) else np.nan for cell in cells],
                [_interval(cell, metric) for cell in cells],
                [len(cell) for cell in cells],
            )
        )
    return found


def constants(table: pd.DataFrame, field: str, metric: str) -> list[Response]:
    """Returns the mean of each controller that does not have the field, in one scenario.

    Such a mean does not depend on the field: its response has one value, None. table: as for
    `responses`.
    """
    found = []
    for controller, rows in table[table[field].isna()].groupby("controller", sort=False):
        cell = _by_seed(rows, metric)
        mean = float(cell.mean()) if len(cell) else np.nan
        found.append(
            Response(str(controller), [None], [mean], [_interval(cell, metric)], [len(cell)])
        )
    return found


def _interval(by_seed: np.ndarray, metric: str) -> Interval:
    if metric == SUCCEEDED and np.isin(by_seed, (0.0, 1.0)).all():
        return success_interval(int(by_seed.sum()), len(by_seed))
    return mean_interval(by_seed)


def _by_seed(rows: pd.DataFrame, metric: str) -> np.ndarray:
    return rows.groupby("seed")[metric].mean().dropna().to_numpy(dtype=float)


def _by_controller(table: pd.DataFrame, field: str) -> list[tuple[str, pd.DataFrame]]:
    groups = table[table[field].notna()].groupby("controller", sort=False)
    return [(str(name), rows) for name, rows in groups]


def seed_slopes(rows: pd.DataFrame, field: str, metric: str) -> pd.Series:
    """Returns the least-squares slope of a metric along a field for each seed, of one controller.

    A seed with fewer than two different values of the field has no slope.
    """
    found = {}
    for seed, own in rows.groupby("seed"):
        known = own[[field, metric]].dropna().astype(float)
        if known[field].nunique() > 1:
            deviation = known[field] - known[field].mean()
            found[seed] = float((deviation * known[metric]).sum() / (deviation**2).sum())
    return pd.Series(found, dtype=float)


def slopes(table: pd.DataFrame, field: str, metric: str) -> list[Slope]:
    """Returns the mean slope of each controller that has the field, in one scenario."""
    found = []
    for controller, rows in _by_controller(table, field):
        each = seed_slopes(rows, field, metric)
        if len(each):
            interval = mean_interval(each.to_numpy())
            found.append(Slope(controller, float(each.mean()), interval, len(each)))
    return found


def slope_differences(table: pd.DataFrame, field: str, metric: str) -> list[ComparedPair]:
    """Returns the differences of slopes of every two controllers in one scenario, paired by seed.

    Controllers with fewer than two slopes, and pairs with fewer than two seeds, are left out.
    """
    each = {name: seed_slopes(rows, field, metric) for name, rows in _by_controller(table, field)}
    known = {name: found for name, found in each.items() if len(found) > 1}
    return [pair for pair in compare_every_pair(known) if pair.comparison.pairs > 1]


def response_table(
    rows: pd.DataFrame, fields: Sequence[str], metrics: Mapping[str, str]
) -> pd.DataFrame:
    """Returns the means of some metrics at every value of every field, in one scenario.

    rows: rows of one scenario, from `long_table`. fields: the swept ones. metrics: name -> unit.
    The table is indexed by (metric at a value, unit), with one column a controller. A controller
    without the field has the same mean at every value; NaN stands for no mean.
    """
    cells: dict[tuple[str, str], dict[str, float]] = {}
    for field in fields:
        for metric, unit in metrics.items():
            for found in responses(rows, field, metric):
                for value, mean in zip(found.values, found.means, strict=True):
                    line = cells.setdefault((f"{metric} at {field}={value}", unit), {})
                    line[found.controller] = mean
            for found in constants(rows, field, metric):
                for at_value, line in cells.items():
                    if at_value[0].startswith(f"{metric} at {field}="):
                        line[found.controller] = found.means[0]
    table = pd.DataFrame(list(cells.values()), columns=list(dict.fromkeys(rows["controller"])))
    table.index = pd.MultiIndex.from_tuples(cells, names=["metric", "unit"])
    return table.dropna(how="all")


class HeatMap(NamedTuple):
    """A metric of one controller over two fields.

    across, down: values of the fields. means: (len(down), len(across)), NaN where unknown.
    half_widths: half the widths of the 95% intervals, of the same shape.
    """

    controller: str
    across: list[Any]
    down: list[Any]
    means: np.ndarray
    half_widths: np.ndarray


def heat_maps(table: pd.DataFrame, fields: Sequence[str], metric: str) -> list[HeatMap]:
    """Returns a heat map for each controller that has both fields, in one scenario."""
    first, second = fields
    maps = []
    for controller, rows in _by_controller(table[table[second].notna()], first):
        across, down = (sorted(rows[field].unique()) for field in (first, second))
        means = np.full((len(down), len(across)), np.nan)
        half_widths = means.copy()
        for (x, y), cell in rows.groupby([first, second]):
            values = _by_seed(cell, metric)
            place = down.index(y), across.index(x)
            interval = mean_interval(values)
            means[place] = values.mean() if len(values) else np.nan
            half_widths[place] = 0.5 * (interval.high - interval.low)
        maps.append(HeatMap(controller, across, down, means, half_widths))
    return maps
