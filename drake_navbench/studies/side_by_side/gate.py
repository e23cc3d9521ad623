"""Whether a change to Nav2's controllers changes how they drive: equal seeds, in pairs.

`analysis/paired_tests.py` has the tests and their corrections.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.metrics.definition import Better
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.paired_tests import (
    DEFAULT_LISTED,
    DEFAULT_TOLERANCE,
    Family,
    Finding,
    Judged,
    PairedVerdict,
    judge_pairs,
)
from drake_navbench.analysis.paired_trials import IDENTITY, Contest
from drake_navbench.campaign.benchmark import run_benchmark
from drake_navbench.errors import InputError, one_line
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS
from drake_navbench.native.builds import Build
from drake_navbench.trial.trial import DEFAULT_ROBOT

DEFAULT_SCENARIOS = (*PUBLISHED_SCENARIOS, "doorway")
DEFAULT_TRIALS = 64

# The colon before a variant's first parameter; a plugin's type has two colons together.
_VALUES = re.compile(r"(?<!:):(?!:)")


class Light(StrEnum):
    """The verdict of a gate on a change."""

    RED = "red"
    GREEN = "green"
    NOT_JUDGED = "not judged"


class Side(NamedTuple):
    """One of the two programs. name: as in its columns, `rpp@name`. about: its source in words."""

    name: str
    about: str = ""
    flags: str = ""


class GateResult(NamedTuple):
    """The result of two builds in equal trials.

    base, head: the two programs. trials: the number in each scenario and with each controller.
    judged: None where both builds are one program: then nothing was driven. folder: folder of the
    logs, None without logs. table: one row a trial.
    """

    base: Side
    head: Side
    scenarios: tuple[str, ...] = ()
    trials: int = 0
    judged: Judged | None = None
    folder: Path | None = None
    table: pd.DataFrame = pd.DataFrame()

    @property
    def regressions(self) -> list[Finding]:
        """The findings that became worse: touches first, then success, then the most certain."""
        return self.judged.of(PairedVerdict.WORSE) if self.judged else []

    @property
    def gone(self) -> list[Finding]:
        """The listed metrics that have values in the base and none in the head."""
        found = self.judged.of(PairedVerdict.GONE) if self.judged else []
        return [finding for finding in found if finding.quantity.family is Family.LISTED]

    @property
    def light(self) -> Light:
        """RED, NOT_JUDGED or GREEN, by the tests and by the trials that came to no end.

        RED: a test shows a change for the worse, or the head lost trials (error, or missing) of a
        controller and scenario of which the base lost none. NOT_JUDGED: the head lost trials only
        where the base lost some, too, or a listed metric has no value any more.
        """
        if self.judged is None:
            return Light.GREEN
        if self.regressions or self.judged.new_failures:
            return Light.RED
        return Light.NOT_JUDGED if self.judged.lost or self.gone else Light.GREEN


class GateDrives(NamedTuple):
    """The trials of each of two builds: a number for each scenario, one robot, and a first seed.

    jobs: parallel workers; None: as many as the machine has processors.
    """

    scenarios: Sequence[str] = DEFAULT_SCENARIOS
    trials: int = DEFAULT_TRIALS
    jobs: int | None = None
    seed: int = 0
    robot: str = DEFAULT_ROBOT


def drive_gate(
    base: Build,
    head: Build,
    controllers: Sequence[str],
    folder: Path,
    *,
    drives: GateDrives | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
    tell: Callable[[str], None] = lambda line: None,
) -> GateResult:
    """Drives the controllers of two builds through equal trials, and tests what has changed.

    folder: new; the logs go there. drives: the trials to drive, by default GateDrives(). Two builds
    that are the same program are not driven. Raises InputError where a build has no such
    controller, or where other input is wrong.
    """
    drives = drives or GateDrives()
    sides = side_of(base), side_of(head)
    if base.host == head.host:
        tell("both are the same program, down to the last byte; nothing was driven")
        return GateResult(*sides, tuple(drives.scenarios))
    columns = [column_of(name, side) for name in controllers for side in sides]
    results = run_benchmark(
        drives.scenarios,
        columns,
        trials=drives.trials,
        seed=drives.seed,
        jobs=drives.jobs,
        robot=drives.robot,
        out=folder,
    )
    judged = judge_rows(results.trials, controllers, *sides, tolerance=tolerance)
    return judged._replace(folder=folder)


def judge_rows(
    table: pd.DataFrame,
    controllers: Sequence[str],
    base: Side,
    head: Side,
    *,
    tolerance: float = DEFAULT_TOLERANCE,
) -> GateResult:
    """Tests the changes between two builds in trials that were driven.

    table: one row a trial, with the columns `rpp@base` and `rpp@head` as controllers. Metrics
    without a good direction are not tested, nor are those that depend on the machine. Raises
    InputError where one of the builds has no trial.
    """
    before, after = (_of_side(table, controllers, side) for side in (base, head))
    metrics = [m for m in all_metrics() if m.better is not Better.NEITHER and m.is_repeatable]
    judged = judge_pairs([Contest(before, after)], metrics=metrics, tolerance=tolerance)
    return GateResult(
        base,
        head,
        tuple(dict.fromkeys(before["scenario"])),
        int(before.groupby(IDENTITY[:2]).size().max()),
        judged,
        table=table,
    )


def read_rows(path: Path) -> pd.DataFrame:
    """Returns the table of trials that a gate wrote; raises InputError for any other file."""
    try:
        table = pd.read_parquet(path)
    except (OSError, ValueError) as error:
        raise InputError(f"--rows {path}: cannot be read: {one_line(error)}") from error
    needed = (*IDENTITY, "outcome", *(m.name for m in all_metrics() if m.name in DEFAULT_LISTED))
    if missing := [name for name in needed if name not in table]:
        raise InputError(
            f"--rows {path}: has no column {missing[0]!r}; expected the trials.parquet of a gate"
        )
    return table


def side_of(build: Build) -> Side:
    """Returns a build as a side of the gate."""
    return Side(build.name, f"Nav2 {build.where_from}", build.more_flags)


def column_of(controller: str, side: Side | Build) -> str:
    """Returns the column of a controller's original in a build: 'rpp:a=1' is 'rpp@build:a=1'."""
    name, values = split_column(controller)
    return f"{name}@{side.name}{values}"


def split_column(controller: str) -> tuple[str, str]:
    """Splits a variant 'rpp:a=1' into its name 'rpp' and the rest ':a=1'."""
    found = _VALUES.search(controller)
    return (controller[: found.start()], controller[found.start() :]) if found else (controller, "")


def _of_side(trials: pd.DataFrame, controllers: Sequence[str], side: Side) -> pd.DataFrame:
    """Returns the trials of a build, its columns under the names of the controllers."""
    names = {column_of(name, side): name for name in controllers}
    chosen = trials[trials["controller"].isin(list(names))]
    for column in names:
        if column not in set(chosen["controller"]):
            raise InputError(f"build {side.name!r}: no trial of {column!r}")
    return chosen.assign(controller=chosen["controller"].map(names))
