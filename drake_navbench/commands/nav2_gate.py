"""Drives two builds of Nav2 and tests what changed: `drake-navbench nav2-gate BASE HEAD`."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from drake_navbench.commands.command_line import (
    EXIT_DONE,
    EXIT_FAILED,
    EXIT_WRONG_INPUT,
    CommandParser,
    Options,
    command,
    listed_names,
    percentage,
    positive_number,
    whole_number,
)
from drake_navbench.errors import InputError, printable

# Options that say how to drive; --rows, which judges driven trials, allows none of them.
DRIVING = ("scenarios", "trials", "flags", "noise", "robot", "seed", "jobs", "out", "replay")
EXITS = {"GREEN": EXIT_DONE, "RED": EXIT_FAILED, "NOT_JUDGED": EXIT_WRONG_INPUT}

if TYPE_CHECKING:
    from drake_navbench.studies.side_by_side.gate import GateResult

EPILOG = """\
Trials of equal seed are paired. A trial that ends in an error, or is missing,
is listed; it makes the gate red if all trials of the base ended properly.
Arrivals, touches and every metric are tested, corrected for the number of
tests: a change without effect turns the gate red at most 5 times in 100. In CI:

  drake-navbench nav2-gate main_checkout branch_checkout \\
      --controllers rpp,mppi_nav2 --markdown gate.md --junit gate.xml

To judge the trials of an earlier gate again, without building or driving, give
--rows DIR/trials.parquet and the names of the two builds.

exit status: 0 green; 1 red: a trial ended in an error, or something became
worse by more than the tolerance; 2 wrong input, or not judged: trials ended in
errors in both builds, or a listed metric has no value any more
"""


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench nav2-gate",
        description="Tests whether a change to Nav2's controllers makes them drive worse.",
        epilog=EPILOG,
    )
    option = Options(parser)
    option("base", "build to compare with: a name of nav2-build, or a checkout", metavar="BASE")
    option("head", "build to judge: a name of nav2-build, or a checkout", metavar="HEAD")
    option(
        "--controllers LIST",
        "presets whose originals drive, such as rpp,mppi_nav2",
        listed_names,
        required=True,
    )
    option(
        "--scenarios LIST",
        "scenarios to drive in (the five published ones and doorway)",
        listed_names,
    )
    option("--trials N", "trials of each controller and scenario (64)", positive_number)
    option("--tolerance PERCENT", "smaller changes of a mean do not count (1)", percentage, 0.01)
    option(
        "--flags",
        "compiler options of checkouts: those of their packages, as users have them, or those "
        "with which every machine computes the same (package)",
        choices=("portable", "package"),
    )
    option(
        "--noise",
        "source of MPPI's random numbers: the benchmark's, different in each trial, or its own "
        "generator, equal in all trials (benchmark)",
        choices=("own", "benchmark"),
    )
    option("--robot NAME|FILE", "robot that drives (wheelchair)")
    option("--seed SEED", "seed of the first trial (0)", whole_number)
    option(
        "--rows FILE",
        "judge the table of an earlier gate (its trials.parquet) and drive nothing",
        Path,
    )
    option("--jobs N", "parallel workers (all cores)", positive_number)
    option("--out DIR", "folder for the logs (results/gate-<time>)", Path)
    option("--markdown FILE", "file for the report (standard output)", Path)
    option("--junit FILE", "also write the report as JUnit XML", Path)
    option(
        "--replay DIR", "folder for replays of the worst seed, one of base and one of head", Path
    )
    return parser


def _gate(arguments: argparse.Namespace) -> int:
    from drake_navbench.analysis.paired_text import lost_lines, sentence, undecided_sentence
    from drake_navbench.studies.side_by_side import gate, gate_report
    from drake_navbench.typed_files.output_file import JUNIT, require_replaceable, write_text

    require_replaceable("--markdown", arguments.markdown, gate_report.TITLE)
    require_replaceable("--junit", arguments.junit, JUNIT)
    say = partial(print, file=sys.stderr, flush=True)

    def tell(line: str) -> None:
        say(printable(line))

    if arguments.rows is None:
        result = _driven(arguments, tell)
    else:
        for name in DRIVING:
            if getattr(arguments, name) is not None:
                raise InputError(f"--{name}: expected no --rows beside it; --rows drives nothing")
        sides = gate.Side(arguments.base), gate.Side(arguments.head)
        table = gate.read_rows(arguments.rows)
        result = gate.judge_rows(
            table, arguments.controllers, *sides, tolerance=arguments.tolerance
        )
    text = gate_report.to_markdown(result)
    if arguments.markdown is None:
        sys.stdout.write(text)
    else:
        write_text(arguments.markdown, text)
    if arguments.junit is not None:
        write_text(arguments.junit, gate_report.to_junit(result))
    _show_worst(result, arguments.replay, say)
    if result.judged is not None:
        for line in lost_lines(result.judged.lost):
            tell(f"came to no end: {line}")
        for finding in result.regressions:
            tell(f"regression: {sentence(finding)}")
        for finding in result.gone:
            place = f"{finding.scenario}, {finding.controller}"
            tell(f"not judged: {place}: {finding.quantity.name} has no value any more")
        for finding in result.judged.undecided_losses:
            tell(f"not decided: {undecided_sentence(finding)}")
    return EXITS[result.light.name]


def _driven(arguments: argparse.Namespace, tell: Callable[[str], None]) -> GateResult:
    """Drives the trials with the two builds and returns the result."""
    from drake_navbench.native.builds import FlagSet, NoiseSource
    from drake_navbench.studies.side_by_side import gate
    from drake_navbench.studies.side_by_side.gate_builds import build_of, left_out_changes
    from drake_navbench.trial.trial import DEFAULT_ROBOT

    noise = arguments.noise and NoiseSource(arguments.noise)
    if noise is not NoiseSource.OWN:
        for name in left_out_changes(arguments.base, arguments.head, arguments.controllers):
            tell(f"{name} differs, and is not driven with the benchmark's noise: --noise own does")
    base, head = (
        build_of(
            text,
            side,
            arguments.controllers,
            flags=arguments.flags and FlagSet(arguments.flags),
            noise=noise,
            tell=tell,
        )
        for text, side in ((arguments.base, "gate-base"), (arguments.head, "gate-head"))
    )
    folder = arguments.out or Path("results") / time.strftime("gate-%Y-%m-%d_%H-%M-%S")
    return gate.drive_gate(
        base,
        head,
        arguments.controllers,
        folder.absolute(),
        drives=gate.GateDrives(
            scenarios=arguments.scenarios or gate.DEFAULT_SCENARIOS,
            trials=gate.DEFAULT_TRIALS if arguments.trials is None else arguments.trials,
            jobs=arguments.jobs,
            seed=arguments.seed or 0,
            robot=arguments.robot or DEFAULT_ROBOT,
        ),
        tolerance=arguments.tolerance,
        tell=tell,
    )


def _show_worst(result: GateResult, folder: Path | None, say: partial[None]) -> None:
    from drake_navbench.commands.replay import render
    from drake_navbench.studies.side_by_side.gate_report import worst_logs

    logs = worst_logs(result)
    if logs is None:
        return
    for side, log in zip(("base", "head"), logs, strict=True):
        if folder is None:
            say(f"worst seed, {side}: drake-navbench replay {log}")
        else:
            render(log, folder / f"worst_{side}.html", None)
            say(f"worst seed, {side}: {folder / f'worst_{side}.html'}")


# Status 1 is for regressions alone.
main = command(build_parser, _gate, failed=EXIT_WRONG_INPUT)
