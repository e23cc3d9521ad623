"""The command line: `drake-navbench compare BASELINE OTHER...`."""

from __future__ import annotations

import argparse
import shutil
import sys
import textwrap
from pathlib import Path

from drake_navbench.commands.command_line import (
    EXIT_DONE,
    EXIT_WRONG_INPUT,
    CommandParser,
    Options,
    command,
    listed_names,
    percentage,
    positive_number,
)

EXIT_REGRESSION = 1
# The most lines that are printed about regressions, undecided losses and columns not compared,
# each; --all prints all.
MOST_OF_A_KIND = 4

EPILOG = """\
Trials of equal seed are paired. Arrivals and touches are judged by the exact
sign test, metrics by Wilcoxon's test, corrected for the number of tests: if
only noise differs, at most 5% of comparisons report any change. A loss that too
few trials leave undecided is listed, and does not count as a regression.
A regression test for CI:

  drake-navbench compare results/main results/branch --junit compare.xml

exit status: 0 no metric of --fail-on got worse; 1 one did, or a trial ended in
an error that did not in BASELINE, or with --require-all something could not be
compared that is not new in OTHER; 2 wrong input, or nothing could be compared
"""


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench compare",
        description="Compares results folders: what became better, and what became worse.",
        epilog=EPILOG,
    )
    option = Options(parser)
    option("baseline", "results folder to compare with", Path, metavar="BASELINE")
    option(
        "others",
        "results folders to judge; without one, the columns of BASELINE are compared with its "
        "first one",
        Path,
        [],
        nargs="*",
        metavar="OTHER",
    )
    option(
        "--match OLD=NEW ...",
        "compare these two columns although their names differ (default: columns of equal name, "
        "then the only column that each folder has left)",
    )
    option("--metric FILE.py:NAME ...", "also compare a function of yours, decorated with @metric")
    option("--all", "print every change, not 20 lines")
    option("--html FILE", "also write the comparison as an HTML page", Path)
    option(
        "--fail-on LIST",
        "metrics, comma-separated, that count as a regression when they get worse, besides "
        "touch_rate and success_rate; none: no further metric (min_clearance_m, time_to_goal_s, "
        "cross_track_error_mean_m, heading_error_mean_deg)",
    )
    option("--tolerance PERCENT", "smaller changes of a mean do not count (1)", percentage, 0.01)
    option("--markdown FILE", "also write all changes as Markdown", Path)
    option("--junit FILE", "also write all changes as JUnit XML", Path)
    option(
        "--require-all",
        "fail, too, for a trial that one folder lacks or that cannot be read, and for a listed "
        "metric without any value in OTHER; not for a scenario or controller that only OTHER has",
    )
    option("--jobs N", "parallel processes (2)", positive_number, 2)
    return parser


def _compare(arguments: argparse.Namespace) -> int:
    from drake_navbench.analysis import compare, compare_files
    from drake_navbench.analysis.metrics.registry import use_metric_files
    from drake_navbench.analysis.paired_tests import DEFAULT_LISTED
    from drake_navbench.analysis.paired_text import lost_lines, sentence
    from drake_navbench.typed_files.output_file import HTML, JUNIT, require_replaceable

    require_replaceable("--html", arguments.html, HTML)
    require_replaceable("--markdown", arguments.markdown, compare_files.TITLE)
    require_replaceable("--junit", arguments.junit, JUNIT)
    use_metric_files(arguments.metric)
    comparison = compare.compare_folders(
        [arguments.baseline, *arguments.others],
        listed=_listed(arguments.fail_on, DEFAULT_LISTED),
        tolerance=arguments.tolerance,
        jobs=arguments.jobs,
        matches=arguments.match,
    )
    if arguments.markdown is not None:
        _write(arguments.markdown, compare_files.to_markdown(comparison))
    if arguments.all or arguments.markdown is None:
        shown = compare_files.to_markdown if arguments.all else compare.in_short
        _write(None, shown(comparison))
    if arguments.html is not None:
        from drake_navbench.analysis.compare_page import write_compare_page

        write_compare_page(comparison, arguments.html)
        print(f"Open {arguments.html}", file=sys.stderr)
    if arguments.junit is not None:
        _write(arguments.junit, compare_files.to_junit(comparison))
    found = {
        "regression": [*lost_lines(comparison.errors), *map(sentence, comparison.regressions)],
        "not decided": comparison.undecided_losses,
        "not compared": comparison.not_compared,
        "other inputs": comparison.changed_inputs,
    }
    for kind, lines in found.items():
        most = len(lines) if arguments.all or arguments.markdown else MOST_OF_A_KIND
        for line in lines[:most]:
            print(f"{kind}: {line}", file=sys.stderr)
        if lines[most:]:
            print(f"{kind}: {len(lines) - most} more (--all)", file=sys.stderr)
    print(comparison.summary, file=sys.stderr)
    worse = comparison.regressions or comparison.errors
    fails = worse or (arguments.require_all and not comparison.is_complete)
    return EXIT_REGRESSION if fails else EXIT_DONE


def _listed(text: str | None, default: tuple[str, ...]) -> tuple[str, ...]:
    if text is None:
        return default
    if text == "none":
        return ()
    return listed_names(text)


def wrapped_lines(text: str, width: int) -> str:
    """Returns Markdown with its long lines broken at spaces; rows of tables stay whole."""
    lines = []
    for line in text.splitlines():
        wraps = len(line) > width and not line.startswith("|")
        lines += (
            textwrap.wrap(line, width, break_long_words=False, break_on_hyphens=False)
            if wraps
            else [line]
        )
    return "\n".join(lines) + "\n"


def _write(path: Path | None, text: str) -> None:
    if path is None:
        is_terminal = sys.stdout.isatty()
        width = shutil.get_terminal_size().columns
        sys.stdout.write(wrapped_lines(text, width) if is_terminal else text)
        return
    from drake_navbench.typed_files.output_file import write_text

    write_text(path, text)


# The status for faults also holds where a worker was ended from outside: 1 means regressions.
main = command(build_parser, _compare, failed=EXIT_WRONG_INPUT)
