"""Compiles a checkout's controllers: `drake-navbench nav2-build CHECKOUT`."""

from __future__ import annotations

import argparse
from pathlib import Path

from drake_navbench.commands.command_line import (
    CommandParser,
    Options,
    command,
    listed_names,
    positive_number,
)
from drake_navbench.errors import printable

EPILOG = """\
example:
  drake-navbench nav2-build ~/nav2_ws/src/navigation2 --as mine
  drake-navbench run one_obstacle --controllers rpp,rpp@mine

exit status: 0 done, 2 wrong input: no checkout, an unknown release, a missing
compiler or library, nothing that can be compiled, or a package of --packages
that cannot be compiled
"""


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench nav2-build",
        description="Compiles the controllers of a Nav2 checkout, without ROS, into a\n"
        "program that drives trials: the column rpp@NAME is the original of rpp.",
        epilog=EPILOG,
    )
    option = Options(parser)
    option(
        "checkout",
        "folder of navigation2, or a folder in it; only the packages in it are built",
        Path,
        metavar="CHECKOUT",
    )
    option("--as NAME", "name of the build (the name of its release)", dest="name")
    option(
        "--packages LIST",
        "packages with controllers or planners to build, or folders of packages (every controller "
        "that can be built here)",
        listed_names,
        (),
    )
    option(
        "--noise",
        "source of MPPI's random numbers: its own generator, or the benchmark's, which the port "
        "draws in the same cycle (own)",
        default="own",
        choices=("own", "benchmark"),
    )
    option(
        "--flags",
        "compiler options: those with which every machine computes the same, or those of each "
        "package's CMakeLists.txt; CXXFLAGS is added to either (portable)",
        default="portable",
        choices=("portable", "package"),
    )
    option("--jobs N", "number of files compiled at once (2)", positive_number, 2)
    return parser


def _build(arguments: argparse.Namespace) -> None:
    from drake_navbench.native.build import build_checkout
    from drake_navbench.native.builds import FlagSet, NoiseSource

    build = build_checkout(
        arguments.checkout,
        name=arguments.name,
        wanted=arguments.packages,
        noise=NoiseSource(arguments.noise),
        flags=FlagSet(arguments.flags),
        jobs=arguments.jobs,
        tell=lambda line: print(printable(line), flush=True),
    )
    print(printable(f"{build.name}: Nav2 {build.where_from}, in {build.seconds:.0f} s"))
    if build.more_flags:
        print(printable(f"  flags: {build.more_flags}"))
    for plugin in (*build.controllers, *build.planners):
        print(f"  {plugin}")
    for reason in dict.fromkeys(build.left_out.values()):
        print(printable(f"  without {reason}"))


main = command(build_parser, _build, interrupted="interrupted; the same command goes on")
