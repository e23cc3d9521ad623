"""Prints the tables over several scenarios: totals of suites, and changes of ranks."""

from __future__ import annotations

from collections.abc import Sequence

from rich.box import SIMPLE_HEAD
from rich.console import Console, JustifyMethod
from rich.table import Table
from rich.text import Text

from drake_navbench.analysis.numbers import number
from drake_navbench.analysis.rank_changes import RankChange, sentence
from drake_navbench.analysis.statistics import Interval, Summary
from drake_navbench.analysis.totals import Share, Total
from drake_navbench.campaign.table_console import fits, name_lines

HEADINGS = ("controller", "worlds", "success", "collided", "time to goal, s")
# The headings for a suite with densities, such as BARN's.
WITH_DENSITIES = ("controller", "density", "worlds", "success", "collided", "scored", "BARN score")


def print_totals(console: Console, totals: Sequence[Total]) -> None:
    """Prints a table a suite: shares in percent and scores, with their 95% intervals."""
    for suite in dict.fromkeys(total.suite for total in totals):
        console.print(Text(f"{suite}: totals over its worlds, with 95% intervals", style="bold"))
        own = [total for total in totals if total.suite == suite]
        wide, narrow = (_totals_table(own, is_narrow=is_narrow) for is_narrow in (False, True))
        console.print(wide if fits(console, wide) else narrow)
        console.print()


def _totals_table(totals: Sequence[Total], *, is_narrow: bool) -> Table:
    """Returns a table, a line for each total; a narrow one breaks intervals and long names."""
    headings = WITH_DENSITIES if totals[0].has_densities else HEADINGS
    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
    for heading in headings:
        is_name = heading in ("controller", "density")
        table.add_column(heading, justify="left" if is_name else "right", no_wrap=True)
    for total in totals:
        told = _cells(total)
        cells = [told[heading] for heading in headings]
        if is_narrow:
            name, *others = cells
            cells = [name_lines(name), *(text.replace(" (", "\n").rstrip(")") for text in others)]
        table.add_row(*cells)
    return table


def print_rank_changes(console: Console, changes: Sequence[RankChange]) -> None:
    """Prints a table for each scenario that was driven together with its clean one."""
    for scenario in dict.fromkeys(change.scenario for change in changes):
        own = [change for change in changes if change.scenario == scenario]
        console.print(Text(sentence(own), style="bold"))
        table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
        for heading in ("controller", "arrived", "", "rank", "", "change"):
            # Only the column with the words of a change may take several lines.
            justify: JustifyMethod = "left" if heading == "controller" else "right"
            table.add_column(heading, justify=justify, no_wrap=heading != "change")
        for change in own:
            clean, harsh = change.clean, change.harsh
            table.add_row(
                name_lines(change.controller),
                f"{clean.arrived}/{clean.trials}",
                f"{harsh.arrived}/{harsh.trials}",
                str(clean.rank),
                str(harsh.rank),
                change.words,
            )
        console.print(table)
        console.print()


def _cells(total: Total) -> dict[str, str]:
    return {
        "controller": total.controller,
        "density": total.density or "all",
        "worlds": str(total.worlds),
        "success": _share(total.success),
        "collided": _share(total.collision),
        "time to goal, s": _mean(total.time_s),
        "scored": _share(total.scored),
        "BARN score": _mean(total.score),
    }


def _share(share: Share) -> str:
    low, high = share.interval
    return f"{100 * share.value:.0f}% ({100 * low:.0f} to {100 * high:.0f})"


def _mean(summary: Summary) -> str:
    interval: Interval = summary.interval
    if summary.count < 2:
        return number(summary.mean)
    return f"{number(summary.mean)} ({number(interval.low)} to {number(interval.high)})"
