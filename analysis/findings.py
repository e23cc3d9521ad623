"""The publication's findings, judged on trials: each holds, does not hold, or stays undecided."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from drake_navbench.analysis.relations import Relation, parse_relation
from drake_navbench.analysis.statistics import (
    BOOTSTRAP_RESAMPLES,
    BOOTSTRAP_SEED,
    CONFIDENCE,
    UNDEFINED_INTERVAL,
    Interval,
)
from drake_navbench.analysis.tables import (
    PUBLISHED_CONTROLLERS,
    published_findings,
    published_table,
)

Array = NDArray[np.float64]

# Findings 56 and 57 speak of "all" scenarios; the publication means those whose goal is reached.
ALL_SCENARIOS = "all"
GOAL_SCENARIOS = ("empty", "static_obstacles", "one_obstacle")
NO_SPREAD = "no spread between the trials: decided by the means"


class Verdict(StrEnum):
    """What the trials say of a finding."""

    HOLDS = "holds"
    CONTRADICTED = "does not hold"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Lineup:
    """Which preset stands for which published controller.

    presets: published name -> preset.
    """

    name: str
    description: str
    presets: Mapping[str, str]


PUBLISHED_SETTINGS = Lineup(
    "published settings",
    "the settings that fit the publication; MPPI is the sampler alone, as Nav2's",
    {"dwb": "dwb", "rpp": "rpp", "teb": "teb", "mppi": "mppi_nav2"},
)
LINEUPS = (
    PUBLISHED_SETTINGS,
    Lineup(
        "polished MPPI",
        "the same, but MPPI's command is polished by a nonlinear program",
        {"dwb": "dwb", "rpp": "rpp", "teb": "teb", "mppi": "mppi"},
    ),
    Lineup(
        "bringup settings",
        "what nav2_bringup ships (DWB: until Iron); TEB is no part of Nav2 and stays as it is",
        {"dwb": "dwb_bringup", "rpp": "rpp_bringup", "teb": "teb", "mppi": "mppi_bringup"},
    ),
)


@dataclass(frozen=True)
class Estimate:
    """A mean over trials with its 95% bootstrap interval; count: the trials with a value."""

    mean: float = math.nan
    interval: Interval = UNDEFINED_INTERVAL
    count: int = 0


@dataclass(frozen=True)
class Finding:
    """A row of findings.csv. number: its id. published: the printed values by controller."""

    number: int
    scenario: str
    metric: str
    relation_text: str
    controllers_text: str
    where: str
    relation: Relation
    published: Mapping[str, float]

    @property
    def text(self) -> str:
        """The relation and its controllers in one line."""
        return f"{self.relation_text}: {self.controllers_text}"


@dataclass(frozen=True)
class Judgement:
    """A finding judged on trials.

    ours: by published controller. pairs: trials in which all controllers of the relation have a
    value; the verdict rests on these. margin: positive where the relation holds, see relations.py.
    deciding: what the margin rests on. note: why undecided, or what else is to be known.
    """

    finding: Finding
    verdict: Verdict
    ours: Mapping[str, Estimate]
    pairs: int = 0
    margin: Estimate = field(default_factory=Estimate)
    deciding: str = ""
    note: str = ""


def findings() -> list[Finding]:
    """Returns the 57 findings in their order."""
    return [
        Finding(
            number=int(row.id),
            scenario=row.scenario,
            metric=row.metric,
            relation_text=row.relation,
            controllers_text=row.controllers,
            where=row.where,
            relation=parse_relation(row.relation, row.controllers, everyone=PUBLISHED_CONTROLLERS),
            published=published_values(row.scenario, row.metric),
        )
        for row in published_findings().itertuples()
    ]


def published_values(scenario: str, metric: str) -> dict[str, float]:
    """Returns the printed values by controller; of 'all', the mean of the goal scenarios'."""
    table = published_table()
    wanted = GOAL_SCENARIOS if scenario == ALL_SCENARIOS else (scenario,)
    rows = table[table["scenario"].isin(wanted) & (table["metric"] == metric)]
    return {name: float(rows[name].mean()) for name in PUBLISHED_CONTROLLERS}


def trial_values(
    trials: pd.DataFrame, scenario: str, metric: str, lineup: Lineup = PUBLISHED_SETTINGS
) -> pd.DataFrame:
    """Returns one row a trial number and one column a published controller; NaN without a value.

    Trials of one number share their seed in a scenario, so that rows are pairs. Of 'all', the value
    is the mean over the goal scenarios, NaN where one is missing: each counts alike.
    """
    if scenario == ALL_SCENARIOS:
        parts = [trial_values(trials, name, metric, lineup) for name in GOAL_SCENARIOS]
        total = parts[0]
        for part in parts[1:]:
            total = total + part
        return total / len(parts)
    # As arrays: selecting rows of a frame copies all of its columns.
    values = trials[metric].to_numpy(float) if metric in trials else np.full(len(trials), math.nan)
    is_own = (trials["scenario"] == scenario).to_numpy()
    numbers, controllers = trials["trial"].to_numpy(), trials["controller"].to_numpy(object)
    columns = {}
    for name, preset in lineup.presets.items():
        rows = is_own & (controllers == preset)
        columns[name] = pd.Series(values[rows], index=numbers[rows])
    return pd.DataFrame(columns, columns=list(columns), dtype=float)


def judge(finding: Finding, trials: pd.DataFrame, lineup: Lineup = PUBLISHED_SETTINGS) -> Judgement:
    """Judges a finding on trials, rows as from `tables.trial_row`.

    It holds, or does not, where the sign of the margin is that of the whole 95% interval; else it
    stays undecided. The interval is a percentile bootstrap over trials that keeps their pairing.
    """
    values = trial_values(trials, finding.scenario, finding.metric, lineup)
    ours = {name: estimate(values[name]) for name in values}
    relation = finding.relation
    compared = values[list(relation.controllers)]
    missing = [name for name in compared if compared[name].notna().sum() == 0]
    if missing:
        absent = ", ".join(lineup.presets[name] for name in missing)
        return Judgement(finding, Verdict.UNDECIDED, ours, note=f"no value for {absent}")
    whole = compared.dropna()
    pairs = len(whole)
    if pairs == 0:
        note = "no trial in which all of them have a value"
        return Judgement(finding, Verdict.UNDECIDED, ours, note=note)
    rows = whole.to_numpy()
    means = rows.mean(axis=0)
    bounds = percentile_interval(relation.margin(resampled_means(rows)))
    margin = Estimate(float(relation.margin(means)), bounds, pairs)
    verdict, note = _verdict(margin)
    if dropped := len(compared) - pairs:
        note = "; ".join(filter(None, [note, f"{dropped} trials lack a value and are left out"]))
    return Judgement(finding, verdict, ours, pairs, margin, relation.deciding(means), note)


def estimate(values: pd.Series) -> Estimate:
    """Returns the mean of the values that are not NaN, with its interval."""
    known = values.dropna().to_numpy(dtype=float)
    if len(known) == 0:
        return Estimate()
    bounds = percentile_interval(resampled_means(known[:, None])[:, 0])
    return Estimate(float(known.mean()), bounds, len(known))


def resampled_means(rows: Array) -> Array:
    """Returns bootstrap means (B, C) of rows (N, C): whole rows are drawn, so pairs stay pairs.

    Every call draws the same rows. One row alone gives NaN: it says nothing about spread.
    """
    count = len(rows)
    if count < 2:
        return np.full((BOOTSTRAP_RESAMPLES, rows.shape[1]), math.nan)
    generator = np.random.default_rng(BOOTSTRAP_SEED)
    drawn = generator.integers(count, size=(BOOTSTRAP_RESAMPLES, count))
    # A column without spread keeps its value to the last bit.
    means = rows[drawn].mean(axis=1)
    return np.where(np.ptp(rows, axis=0) == 0.0, rows[0], means)


def percentile_interval(values: Array) -> Interval:
    """Returns the middle 95% of bootstrap values, undefined where one is NaN."""
    if np.isnan(values).any():
        return UNDEFINED_INTERVAL
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = np.quantile(values, [tail, 1.0 - tail])
    return Interval(float(low), float(high))


def _verdict(margin: Estimate) -> tuple[Verdict, str]:
    low, high = margin.interval
    if math.isnan(low):
        return Verdict.UNDECIDED, "one trial alone has no interval"
    if margin.mean == 0.0 and low == high:
        return Verdict.UNDECIDED, "a tie in every trial"
    note = NO_SPREAD if low == high else ""
    if low > 0.0:
        return Verdict.HOLDS, note
    if high < 0.0:
        return Verdict.CONTRADICTED, note
    return Verdict.UNDECIDED, "the interval of the deciding difference includes the tie"
