"""Tables of a scenario, one row a metric: the publication's tables, or those of a run."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pandas as pd

from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.reproduction.publication import (
    published_table,
)
from drake_navbench.analysis.reproduction.published import PUBLISHED_METRICS
from drake_navbench.analysis.verdicts import comparable_trials, scenario_verdicts
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.text_tables import markdown_table

STD_HEADING_ERROR = "std_heading_error"
TABLE_DECIMALS = 3
# The unit of the rows that count trials.
COUNT_UNIT = "trials"
# Ends the name of the row that counts the trials with a value.
DEFINED = "_defined"
SUCCESS_RATE, TOUCH_RATE = "success_rate", "touch_rate"
# The metrics that a run prints beside how its trials ended, unless others are asked for.
PRINTED = (
    "time_to_goal_s",
    "min_clearance_m",
    "driven_length_m",
    "cross_track_error_mean_m",
    "jerk_rms_mps3",
)


def published_rows(scenario: str) -> list[tuple[str, str]]:
    """Returns (metric, unit) of the rows that the publication prints, in its order.

    For a published scenario the rows of its own table, for any other all published metrics.
    """
    units = {entry.name: entry.unit for entry in PUBLISHED_METRICS} | {STD_HEADING_ERROR: "deg"}
    table = published_table()
    printed = list(table.loc[table["scenario"] == scenario, "metric"])
    if not printed:
        printed = [entry.name for entry in PUBLISHED_METRICS]
        printed.insert(printed.index("avg_heading_error") + 1, STD_HEADING_ERROR)
    return [(name, units[name]) for name in printed]


def scenario_table(trials: pd.DataFrame, scenario: str) -> pd.DataFrame:
    """Returns a scenario's table as the publication prints it.

    trials: rows as from `trial_row`. The result has one row a published metric, indexed by (metric,
    unit), and one column a controller in the order of `trials`. A cell is the mean over all trials
    of the controller, failed ones included; where some trials have no value, a row
    `<metric>_defined` counts those that have. The last rows count the outcomes.
    """
    own = trials[trials["scenario"] == scenario]
    # A trial without a readable log has no metrics at all.
    own = own.reindex(columns=own.columns.union([m.name for m in PUBLISHED_METRICS], sort=False))
    columns = {
        controller: _controller_column(own[own["controller"] == controller], scenario)
        for controller in dict.fromkeys(own["controller"])
    }
    table = pd.DataFrame({name: pd.Series(column) for name, column in columns.items()})
    rows = [
        key for key in _row_order(scenario) if key in table.index and _says_something(table, key)
    ]
    return table.loc[rows].rename_axis(["metric", "unit"])


def metrics_table(trials: pd.DataFrame, scenario: str, names: Sequence[str]) -> pd.DataFrame:
    """Returns a scenario's table of these metrics, shaped as `scenario_table`.

    A cell is the mean over the controller's trials that have a value; for metrics that mean
    something only for trials that arrived, over those. `touch_rate` is the share of trials that
    ended at a touch. The last rows count the outcomes.
    """
    own = trials[trials["scenario"] == scenario]
    units = {entry.name: entry.unit for entry in all_metrics()} | {TOUCH_RATE: "%"}
    arrived = comparable_trials(own, [name for name in names if name in own])
    columns: dict[str, dict[tuple[str, str], float]] = {}
    for controller in dict.fromkeys(own["controller"]):
        rows = own[own["controller"] == controller]
        counted = arrived[arrived["controller"] == controller]
        outcomes = rows["outcome"].value_counts()
        column = {}
        for name in names:
            if name == TOUCH_RATE:
                column[name, "%"] = 100.0 * float((rows["outcome"] == Outcome.COLLIDED).mean())
            else:
                source = rows if name == SUCCESS_RATE else counted
                column[name, units.get(name, "")] = (
                    source[name].mean() if name in source else math.nan
                )
        column |= {(str(o), COUNT_UNIT): int(outcomes.get(str(o), 0)) for o in Outcome}
        columns[controller] = column
    return pd.DataFrame(columns).rename_axis(["metric", "unit"])


def suite_tables(trials: pd.DataFrame, names: Sequence[str]) -> dict[str, pd.DataFrame]:
    """Returns, for each suite of more than one world, the table of these metrics over all worlds.

    It is shaped as `metrics_table`; trials of all worlds count as trials of one scenario.
    """
    if "suite" not in trials:
        return {}
    named = trials[trials["suite"].fillna("") != ""]
    return {
        str(suite): metrics_table(own.assign(scenario=suite), str(suite), names)
        for suite, own in named.groupby("suite", sort=False)
        if own["scenario"].nunique() > 1
    }


def best_of(trials: pd.DataFrame, scenario: str, names: Sequence[str]) -> dict[str, str]:
    """Returns for each of these metrics the controller that is shown to be best.

    A metric in which no controller is shown to be best is left out.
    """
    own = trials[trials["scenario"] == scenario]
    return {v.metric: v.best for v in scenario_verdicts(own, scenario, names) if v.best}


def table_to_markdown(table: pd.DataFrame) -> str:
    """Returns a Markdown table of a frame with (metric, unit) rows; NaN becomes a dash."""
    header = ["metric", "unit", *map(str, table.columns)]
    rows = (
        [name, unit, *(_cell(value, unit) for value in cells)]
        for (name, unit), cells in table.iterrows()
    )
    return "\n".join(markdown_table(header, rows, "ll" + "r" * len(table.columns))) + "\n"


def _controller_column(trials: pd.DataFrame, scenario: str) -> dict[tuple[str, str], float]:
    column: dict[tuple[str, str], float] = {}
    for name, unit in published_rows(scenario):
        source = "avg_heading_error" if name == STD_HEADING_ERROR else name
        values = trials[source].dropna()
        if name == STD_HEADING_ERROR:
            column[name, unit] = values.std(ddof=0)
        else:
            column[name, unit] = values.mean()
        column[f"{name}{DEFINED}", "trials"] = len(values)
    column["trials", COUNT_UNIT] = len(trials)
    for outcome in Outcome:
        column[str(outcome), "trials"] = int((trials["outcome"] == str(outcome)).sum())
    return column


def _row_order(scenario: str) -> list[tuple[str, str]]:
    order = []
    for name, unit in published_rows(scenario):
        order += [(name, unit), (f"{name}{DEFINED}", "trials")]
    return [*order, ("trials", "trials"), *((str(outcome), "trials") for outcome in Outcome)]


def count_name(row: str) -> str:
    """Returns the words for a row of counts: 'with path_length' for `path_length_defined`."""
    return f"with {row.removesuffix(DEFINED)}" if row.endswith(DEFINED) else row


def _says_something(table: pd.DataFrame, key: tuple[str, str]) -> bool:
    """Whether a row is worth printing: a count of defined trials only if some are not defined."""
    if not key[0].endswith(DEFINED):
        return True
    return bool((table.loc[key] < table.loc["trials", "trials"]).any())


def _cell(value: float, unit: str) -> str:
    if math.isnan(value):
        return "–"
    return f"{value:.0f}" if unit == "trials" else f"{value:.{TABLE_DECIMALS}f}"
