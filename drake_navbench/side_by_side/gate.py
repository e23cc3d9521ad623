"""Whether a change to Nav2's controllers changes how they drive: equal seeds, paired, corrected.

Each metric of each controller in each scenario is a test; Holm's correction over all of them keeps
the chance of a false alarm of a whole change below `ALARM_RATE`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from drake_navbench.analysis.compare import DEFAULT_LISTED, IDENTITY, SUCCESS
from drake_navbench.analysis.metrics.definition import Better, Metric
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.statistics import (
    POWER,
    ROUNDING,
    PairedComparison,
    holm,
    paired_comparison,
    sign_test_p_value,
)
from drake_navbench.campaign.benchmark import run_benchmark
from drake_navbench.errors import InputError
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS
from drake_navbench.native.builds import Build
from drake_navbench.trial.trial import DEFAULT_ROBOT

DEFAULT_SCENARIOS = (*PUBLISHED_SCENARIOS, "doorway")
DEFAULT_TRIALS = 64
ALARM_RATE = 0.01
# A mean that changes by a smaller share of the base's matters to nobody, however certain it is.
DEFAULT_TOLERANCE = 0.01

# The colon before the first parameter; a plugin type has two together.
_VALUES = re.compile(r"(?<!:):(?!:)")


class Verdict(StrEnum):
    """What a change did to a metric."""

    WORSE = "worse"
    BETTER = "better"
    SAME = "same"
    SMALL = "too small to matter"
    UNDECIDED = "undecided"
    NO_VALUE = "no value"


class Finding(NamedTuple):
    """One test: a metric of a controller in a scenario.

    p_value: adjusted by Holm over all tests. detectable: the mean difference that so many pairs
    show with 80% power, at the level that the strictest of all tests has; NaN without spread.
    """

    scenario: str
    controller: str
    metric: Metric
    base_mean: float
    head_mean: float
    comparison: PairedComparison
    p_value: float
    detectable: float
    verdict: Verdict


class GateResult(NamedTuple):
    """What two builds did in equal trials.

    base, head: what was driven. trials: a scenario and controller. equal: pairs of trials whose
    metrics are all equal, and of how many. folder: where the logs are; None where nothing was
    driven. table: one row a trial. repeated: the scenarios and controllers in which all trials of a
    build are the same: what differs there does so for certain, but in one trial.
    """

    base: Build
    head: Build
    scenarios: tuple[str, ...]
    trials: int
    findings: tuple[Finding, ...]
    equal: tuple[int, int]
    folder: Path | None
    table: pd.DataFrame
    repeated: tuple[tuple[str, str], ...] = ()

    @property
    def regressions(self) -> list[Finding]:
        """What became worse, the surest first."""
        worse = [f for f in self.findings if f.verdict is Verdict.WORSE]
        return sorted(worse, key=lambda finding: finding.p_value)


def drive_gate(
    base: Build,
    head: Build,
    controllers: Sequence[str],
    folder: Path,
    *,
    scenarios: Sequence[str] = DEFAULT_SCENARIOS,
    trials: int = DEFAULT_TRIALS,
    jobs: int | None = None,
    seed: int = 0,
    robot: str = DEFAULT_ROBOT,
    tolerance: float = DEFAULT_TOLERANCE,
    tell: Callable[[str], None] = lambda line: None,
) -> GateResult:
    """Drives the controllers of two builds through equal trials, and tests what has changed.

    folder: new; the logs go there. Two builds that are the same program are not driven. Raises
    InputError where one has no such controller, or input is wrong otherwise.
    """
    if base.host == head.host:
        tell("both are the same program, down to the last byte; nothing was driven")
        return GateResult(base, head, tuple(scenarios), 0, (), (0, 0), None, pd.DataFrame())
    columns = [column_of(name, build) for name in controllers for build in (base, head)]
    results = run_benchmark(
        scenarios, columns, trials=trials, seed=seed, jobs=jobs, robot=robot, out=folder
    )
    before, after = (_of_build(results.trials, controllers, build) for build in (base, head))
    findings, equal = judge_trials(before, after, tolerance=tolerance)
    return GateResult(
        base,
        head,
        tuple(scenarios),
        trials,
        tuple(findings),
        equal,
        folder,
        results.trials,
        repeated_cells(before, after),
    )


def column_of(controller: str, build: Build) -> str:
    """Returns the column of a controller's original in a build: 'rpp:a=1' is 'rpp@build:a=1'."""
    name, values = split_column(controller)
    return f"{name}@{build.name}{values}"


def split_column(controller: str) -> tuple[str, str]:
    """Returns the name of a variant `name:param=value`, and what follows it with its colon."""
    found = _VALUES.search(controller)
    return (controller[: found.start()], controller[found.start() :]) if found else (controller, "")


def judge_trials(
    before: pd.DataFrame, after: pd.DataFrame, *, tolerance: float = DEFAULT_TOLERANCE
) -> tuple[list[Finding], tuple[int, int]]:
    """Returns a finding a test, and how many pairs of trials are equal, of how many.

    before, after: one row a trial, with scenario, controller, seed and all metrics. A metric
    without a good direction is no test, nor is one that depends on the machine.
    """
    metrics = _judged_metrics()
    names = [metric.name for metric in metrics]
    first, second = (table.set_index(IDENTITY).sort_index() for table in (before, after))
    common = first.index.intersection(second.index)
    first, second = first.loc[common, names], second.loc[common, names]
    is_equal = ((second - first).abs() <= ROUNDING) | (first.isna() & second.isna())
    cells = list(dict.fromkeys((scenario, controller) for scenario, controller, _ in common))
    tests = []
    for scenario, controller in cells:
        mine, theirs = (table.loc[(scenario, controller)] for table in (first, second))
        for metric in metrics:
            found = paired_comparison(mine[metric.name], theirs[metric.name])
            p_value = _p_value(metric, mine[metric.name], theirs[metric.name], found)
            means = (float(mine[metric.name].mean()), float(theirs[metric.name].mean()))
            tests.append((scenario, controller, metric, means, found, p_value))
    adjusted = holm([test[-1] for test in tests])
    count = int(np.isfinite(adjusted).sum())
    findings = [
        Finding(
            scenario,
            controller,
            metric,
            *means,
            comparison=found,
            p_value=float(p_value),
            detectable=detectable_difference(found.sd, found.pairs, ALARM_RATE / max(count, 1)),
            verdict=_verdict(metric, found, means[0], float(p_value), tolerance),
        )
        for (scenario, controller, metric, means, found, _), p_value in zip(
            tests, adjusted, strict=True
        )
    ]
    return findings, (int(is_equal.all(axis=1).sum()), len(common))


def repeated_cells(before: pd.DataFrame, after: pd.DataFrame) -> tuple[tuple[str, str], ...]:
    """Returns the scenarios and controllers in which all trials of each build are one and the same.

    before, after: as for `judge_trials`. One trial alone is no repetition.
    """
    names = [metric.name for metric in _judged_metrics()]

    def repeated(table: pd.DataFrame) -> list[tuple[str, str]]:
        return [
            (scenario, controller)
            for (scenario, controller), cell in table.groupby(["scenario", "controller"])
            if len(cell) > 1 and not ((cell[names].max() - cell[names].min()) > ROUNDING).any()
        ]

    of_head = repeated(after)
    return tuple(cell for cell in repeated(before) if cell in of_head)


def detectable_difference(sd: float, pairs: int, level: float) -> float:
    """Returns the mean difference that a two-sided paired t-test shows with 80% power.

    sd: of the differences. level: of the test. NaN for fewer than two pairs.
    """
    if pairs < 2:
        return math.nan
    quantile = float(stats.t.ppf(1.0 - 0.5 * level, pairs - 1)) + float(stats.norm.ppf(POWER))
    return quantile * sd / math.sqrt(pairs)


def listed(findings: Sequence[Finding]) -> list[Finding]:
    """Returns the findings of the metrics that `compare` lists."""
    return [finding for finding in findings if finding.metric.name in DEFAULT_LISTED]


def _judged_metrics() -> list[Metric]:
    return [m for m in all_metrics() if m.better is not Better.NEITHER and m.is_repeatable]


def _of_build(trials: pd.DataFrame, controllers: Sequence[str], build: Build) -> pd.DataFrame:
    """Returns the trials of a build, its columns under the names of the controllers."""
    names = {column_of(name, build): name for name in controllers}
    chosen = trials[trials["controller"].isin(list(names))]
    if chosen.empty:
        raise InputError(f"build {build.name!r}: no trial came to an end")
    return chosen.assign(controller=chosen["controller"].map(names))


def _p_value(metric: Metric, first: pd.Series, second: pd.Series, found: PairedComparison) -> float:
    """Returns the test's p-value: of success the exact sign test, of all else Wilcoxon's."""
    if metric.name != SUCCESS:
        return found.p_value
    differences = (second - first).dropna()
    if not len(differences):
        return math.nan
    return sign_test_p_value(int((differences > 0.0).sum()), int((differences < 0.0).sum()))


def _verdict(
    metric: Metric, found: PairedComparison, base_mean: float, p_value: float, tolerance: float
) -> Verdict:
    if not found.pairs:
        return Verdict.NO_VALUE
    size = abs(found.difference)
    if size <= ROUNDING:
        return Verdict.SAME
    if not p_value <= ALARM_RATE:
        return Verdict.UNDECIDED
    if size <= max(tolerance * abs(base_mean), metric.relevant):
        return Verdict.SMALL
    is_lower = found.difference < 0.0
    return Verdict.BETTER if is_lower == (metric.better is Better.LOWER) else Verdict.WORSE
