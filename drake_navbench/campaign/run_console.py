"""Lines and tables that a run prints: its inputs, results, verdict and errors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import pandas as pd
from rich.console import Console

from drake_navbench.analysis.pair_verdict import verdicts_within
from drake_navbench.analysis.rank_changes import rank_changes
from drake_navbench.analysis.sweeps import SUCCEEDED, long_table, response_table, swept_fields
from drake_navbench.analysis.tables import PRINTED, best_of, metrics_table, suite_tables
from drake_navbench.analysis.totals import totals
from drake_navbench.analysis.verdicts import comparable_trials
from drake_navbench.campaign.campaign import Campaign
from drake_navbench.campaign.console import terminal, unsuccessful_lines
from drake_navbench.campaign.driving import Undriven
from drake_navbench.campaign.manifest import add_verdict, columns_by_file
from drake_navbench.campaign.request import Request
from drake_navbench.campaign.request_arguments import file_lines
from drake_navbench.campaign.suite_console import print_rank_changes, print_totals
from drake_navbench.campaign.table_console import BEST_MARK, IMPOSSIBLE, print_table
from drake_navbench.errors import printable
from drake_navbench.inputs.speed_check import lines_of
from drake_navbench.logs.results import ResultsFolder

# Sentences of the report's verdict: who arrived, and who touched something or is best.
TOLD_OF_REPORT = 2
# What a table shows in place of another metric, where nobody can reach the goal.
IN_IMPOSSIBLE = {"time_to_goal_s": "stall_time_s"}
OF_ARRIVALS = {"time_to_goal_s": "s", "min_clearance_m": "m"}
PRINTED_IN_SWEEP = {SUCCEEDED: "share"} | OF_ARRIVALS


def lines_on_inputs(request: Request, campaign: Campaign) -> Iterator[str]:
    """Yields the lines on files, columns and robot that are printed before anything drives."""
    yield from file_lines(request, campaign.nav2)
    for preset in campaign.presets:
        if preset.read_as:
            yield f"{preset.source}: drives by the rules of Nav2 {preset.read_as}"
        if preset.ignored:
            ignored = ", ".join(preset.ignored)
            yield f"{preset.source}: parameters without effect here, ignored: {ignored}"
    columns = {spec.preset.name: (spec.preset, spec.robot) for spec in campaign.specs}
    yield from lines_of(columns.values())
    if campaign.model is not None:
        yield f"Robot's model: {campaign.model.summary()} (--check lists all parts)"


def print_tables(
    console: Console,
    campaign: Campaign,
    trials: pd.DataFrame,
    told: frozenset[str],
    names: Sequence[str],
) -> None:
    """Prints a table for each scenario that the totals leave out, then the totals.

    told: the scenarios in the totals. names: names of the metrics in the tables.
    """
    impossible = {spec.scenario.name for spec in campaign.specs if spec.scenario.is_impossible}
    if campaign.sweep:
        for scenario, rows in long_table(trials, campaign.sweep).groupby("scenario", sort=False):
            rows = comparable_trials(rows, OF_ARRIVALS)
            table = response_table(rows, swept_fields(campaign.sweep), PRINTED_IN_SWEEP)
            print_table(console, table, str(scenario))
    else:
        marks = False
        for scenario in dict.fromkeys(trials["scenario"]):
            if scenario in told:
                continue
            title, own = scenario, names
            if scenario in impossible:
                title = f"{scenario}: {IMPOSSIBLE}"
                own = [IN_IMPOSSIBLE.get(name, name) for name in names]
            best = best_of(trials, scenario, own)
            marks = marks or bool(best)
            print_table(console, metrics_table(trials, scenario, own), title, best=best)
        if marks:
            console.print(
                f"{BEST_MARK} shown to be best: each star by itself with 95% confidence against "
                "all others"
            )
        for suite, table in suite_tables(trials, names).items():
            print_table(console, table, f"{suite}: each controller's means over its own arrivals")
    print_totals(console, totals(trials))
    if lines := () if campaign.sweep else unsuccessful_lines(trials, impossible):
        console.print("Trials that did not reach the goal")
        for line in lines:
            console.print(f"- {line}", soft_wrap=True, highlight=False, markup=False)
        console.print()
    print_rank_changes(console, rank_changes(trials, campaign.clean_of))


def printed_metrics(request: Request) -> tuple[str, ...]:
    """Returns the metrics that the tables show."""
    own = [reference.rpartition(":")[2] for reference in request.metrics]
    return tuple(dict.fromkeys([*(request.columns or PRINTED), *own]))


def tell_verdict(
    console: Console,
    campaign: Campaign,
    folder: ResultsFolder,
    trials: pd.DataFrame,
    of_report: Sequence[str],
) -> None:
    """Prints the verdict and keeps it in the manifest.

    Whole Nav2 files are each judged against the first; otherwise it is the report's verdict,
    shortened.
    """
    if campaign.sweep or len(campaign.columns) < 2:
        return
    details: list[str] = []
    if len(campaign.nav2) > 1:
        verdicts = verdicts_within(trials, columns_by_file(campaign), campaign.suites)
        told = [verdict.text for verdict in verdicts]
        details = [detail for verdict in verdicts for detail in verdict.details]
    else:
        told = list(of_report[:TOLD_OF_REPORT])
    add_verdict(folder, " ".join(told))
    for line in [f"Verdict: {' '.join(told)}", *(f"  {detail}" for detail in details)]:
        console.print(printable(line), soft_wrap=True)


def undriven_line(entry: Undriven) -> str:
    """Returns the line on a trial that was not driven, with the reason."""
    spec = entry.spec
    where = f"{spec.scenario.name}, {spec.preset.name}, trial {spec.trial}"
    return f"not driven: {where}: {entry.reason}"


def print_error(text: str) -> None:
    """Prints lines that may contain anything, however quiet the run is."""
    for line in text.split("\n"):
        terminal(stderr=True).print(printable(line), soft_wrap=True)
