"""Holds ports against a build's originals: `drake-navbench nav2-parity NAME`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from drake_navbench.commands.command_line import (
    CommandParser,
    Options,
    command,
    listed_names,
    positive_number,
    whole_number,
)
from drake_navbench.errors import printable


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench nav2-parity",
        description="Measures how closely the ports drive like the originals of a Nav2 build: "
        "in random scenes, in whole trials, and as planners on random maps.",
    )
    option = Options(parser)
    option("build", "name that nav2-build gave the build", metavar="NAME")
    option(
        "--controllers LIST",
        "presets, or variants of them (every one whose original is in the build)",
        listed_names,
    )
    option("--scenes N", "random scenes (500)", positive_number, 500)
    option(
        "--scenarios LIST",
        "scenarios of the whole trials (one_obstacle,doorway)",
        listed_names,
        ("one_obstacle", "doorway"),
    )
    option("--seeds N", "trials in each scenario (2)", whole_number, 2)
    option(
        "--maps N", "number of random maps for each planner in the build (200)", whole_number, 200
    )
    option("--out FILE", "file for the page (standard output)", Path)
    return parser


def _compare(arguments: argparse.Namespace) -> None:
    from drake_navbench.native.builds import find_build
    from drake_navbench.studies.side_by_side.parity import compare_port, ports_in
    from drake_navbench.studies.side_by_side.parity_page import TITLE, to_markdown
    from drake_navbench.studies.side_by_side.planner_parity import compare_planners
    from drake_navbench.typed_files.output_file import require_replaceable, write_text

    def tell(line: str) -> None:
        print(printable(line), file=sys.stderr, flush=True)

    require_replaceable("--out", arguments.out, TITLE)
    build = find_build(arguments.build)
    parities = [
        compare_port(
            name,
            build,
            scenes=arguments.scenes,
            scenarios=arguments.scenarios,
            seeds=arguments.seeds,
            tell=tell,
        )
        for name in arguments.controllers or ports_in(build)
    ]
    planners = compare_planners(build, maps=arguments.maps, tell=tell)
    text = to_markdown(build, parities, planners)
    if arguments.out is None:
        sys.stdout.write(text)
    else:
        write_text(arguments.out, text)


main = command(build_parser, _compare)
