"""The trials of a run that did not reach the goal, with their reasons, for the terminal."""

from __future__ import annotations

import re
from collections.abc import Collection

import pandas as pd

from drake_navbench.logs.log import Outcome

MAX_LINES = 6
MAX_SCENARIOS = 3
NUMBER = re.compile(r"-?\d+(\.\d+)?")


def unsuccessful_lines(trials: pd.DataFrame, impossible: Collection[str]) -> list[str]:
    """Returns a line for each controller, outcome and kind of reason; the most frequent first.

    Reasons that differ in their numbers alone are of one kind, shown by the first of them. trials:
    rows as from `trial_row`. impossible: scenarios in which giving up is right; their trials are
    left out, as are trials that ended in an error.
    """
    left_out = [Outcome.SUCCEEDED, Outcome.ERROR]
    rows = trials[~trials["outcome"].isin(left_out) & ~trials["scenario"].isin(impossible)]
    kinds = rows["reason"].astype(str).map(lambda reason: NUMBER.sub("#", reason))
    groups = [group for _, group in rows.groupby(["controller", "outcome", kinds], sort=False)]
    groups.sort(key=len, reverse=True)
    lines = [_line(group) for group in groups[:MAX_LINES]]
    if len(groups) > MAX_LINES:
        lines.append(f"{len(groups) - MAX_LINES} more reasons are in the report")
    return lines


def _line(group: pd.DataFrame) -> str:
    first = group.iloc[0]
    scenarios = list(dict.fromkeys(group["scenario"]))
    where = ", ".join(scenarios[:MAX_SCENARIOS])
    if len(scenarios) > MAX_SCENARIOS:
        where += f" and {len(scenarios) - MAX_SCENARIOS} more"
    count = f"{len(group)} trial{'s' if len(group) > 1 else ''}"
    return (
        f"{first.controller}, {count} {first.outcome.replace('_', ' ')} in {where}: {first.reason}"
    )
