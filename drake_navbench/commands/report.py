"""The command line: `drake-navbench report DIR`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from drake_navbench.commands.command_line import (
    CommandParser,
    Options,
    command,
    positive_number,
    positive_percentage,
)
from drake_navbench.errors import as_line


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench report",
        description="Makes tables, figures and report.html of a results folder again, from its "
        "logs, without simulating.",
        epilog="exit status: 0 done, 1 a worker was ended from outside, 2 wrong input",
    )
    option = Options(parser)
    option("folder", "a results folder", Path, metavar="DIR")
    option(
        "--figures",
        "key: figures that compare the controllers of a scenario; all: also the motion of each "
        "controller, and every figure as PNG (key)",
        default="key",
        choices=("none", "key", "all"),
    )
    option("--metric FILE.py:NAME ...", "also measure a function of yours, decorated with @metric")
    option("--jobs N", "parallel processes (2)", positive_number, 2)
    option(
        "--difference PERCENT",
        "estimate how many trials would show a difference of this size (5)",
        positive_percentage,
        0.05,
    )
    return parser


def _report(arguments: argparse.Namespace) -> None:
    from drake_navbench.analysis.figures.choice import FigureChoice
    from drake_navbench.analysis.metrics.registry import use_metric_files
    from drake_navbench.analysis.numbers import counted
    from drake_navbench.analysis.report import build_report

    use_metric_files(arguments.metric)
    result = build_report(
        arguments.folder,
        figures=FigureChoice(arguments.figures),
        jobs=arguments.jobs,
        difference=arguments.difference,
        parameters_of=_parameters_of_preset,
    )
    for entry in result.left_out:
        print(as_line(f"left out: {entry.path}: {entry.reason}"), file=sys.stderr)
    print(f"{result.path}: {counted(result.trial_count, 'trial')}")


def _parameters_of_preset(name: str) -> dict[str, Any]:
    # Imported here, as only a report on the publication needs the controllers, which take long.
    from drake_navbench.inputs.presets import resolved_parameters

    return resolved_parameters(name)


main = command(build_parser, _report)
