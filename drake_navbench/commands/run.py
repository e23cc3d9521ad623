"""The command line: `drake-navbench run`.

Only the standard library is imported before the arguments are read, so that --help is quick.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from drake_navbench.commands.command_line import (
    EXIT_DONE,
    EXIT_FAILED,
    CommandParser,
    exit_status_of,
    listed_names,
    positive_number,
    whole_number,
)
from drake_navbench.errors import InputError, InputWarning, printable
from drake_navbench.releases import Release

ALLOWED_WITH_RESUME = {"cluster", "cluster_tls", "trust_network", "resume", "jobs", "quiet"}
MAX_PORT = 65535

EPILOG = """\
examples (python -m drake_navbench.run is the same):
  drake-navbench run                            the published benchmark
  drake-navbench run empty --controllers rpp    one scenario, one controller
  drake-navbench run mine.yaml --controllers rpp,rpp:lookahead_dist=0.9
  drake-navbench run --params nav2_params.yaml  the controllers of a Nav2 file
  drake-navbench run --nav2 nav2_params.yaml    the whole of a Nav2 file
  drake-navbench run --nav2 a.yaml --against b.yaml --map map.yaml --goals 20
  drake-navbench run doorway --controllers rpp \\
      --sweep rpp.lookahead_dist=0.3:0.9:4      one parameter, four values
  drake-navbench run --map map.yaml --goals 10 --controllers rpp,dwb

exit status: 0 every trial ran (an abort is a result), 1 some trial ended in an
error, 2 wrong input, 130 interrupted
"""


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench run",
        usage="%(prog)s [SCENARIO ...] [OPTIONS]",
        description="Drives mobile-robot controllers through scenarios in Drake and compares them.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_what_drives(parser)
    add_where(parser)
    add_nav2_files(parser)
    _add_sweeps(parser)
    _add_how(parser)
    _add_results(parser)
    return parser


def add_what_drives(parser: argparse.ArgumentParser) -> None:
    """Adds the options of controllers and robot."""
    add = parser.add_argument_group("robot and controllers").add_argument
    add(
        "--controllers",
        metavar="LIST",
        help="presets, comma-separated; name:param=value[:param=value] is a variant, "
        "path/to/file.py:Class a controller of yours (default: dwb, rpp, teb, "
        "teb_upstream, mppi, mppi_nav2)",
    )
    add(
        "--original",
        metavar="BUILD",
        help="drive the original C++ of each column's controller, too, from a build of nav2-build",
    )
    add(
        "--robot",
        default="wheelchair",
        metavar="NAME|FILE",
        help="robot: a name, a robot file, or a model in URDF, SDF or xacro (wheelchair)",
    )
    add(
        "--package",
        action="append",
        default=[],
        type=Path,
        metavar="DIR",
        help="repository of a robot: its model, its Nav2 file, and its map or world "
        "are found and used; drives --goals 5",
    )
    add(
        "--pick",
        action="append",
        default=[],
        metavar="KIND=N",
        help="use another robot, nav2, map or world of the list that --package prints, or none",
    )
    add(
        "--packages",
        action="append",
        default=[],
        type=Path,
        metavar="DIR",
        help="folders in which ROS packages and Gazebo models are searched, besides "
        "the repository around a file that names them",
    )


class _Once(argparse.Action):
    """Refuses an option that is given twice: the later value would silently replace the first."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        if getattr(namespace, self.dest) != self.default:
            parser.error(f"{option_string} is given twice; expected once")
        setattr(namespace, self.dest, values)


def add_where(parser: argparse.ArgumentParser) -> None:
    """Adds scenarios, and the options of maps and worlds."""
    add = parser.add_argument_group("scenarios and maps").add_argument
    add(
        "scenarios",
        nargs="*",
        default=[],
        metavar="SCENARIO",
        help="scenarios: names, YAML files, or Gazebo worlds with --start and --goal "
        "or with --goals (default: the published five)",
    )
    add(
        "--map",
        type=Path,
        action=_Once,
        metavar="FILE",
        help="map to navigate on, in the format of Nav2's map server or MovingAI, with "
        "--start and --goal or with --goals; beside a Gazebo world: what the robot knows of it",
    )
    for name in ("start", "goal"):
        add(
            f"--{name}",
            type=float,
            nargs=3,
            metavar=("X", "Y", "YAW"),
            help=f"{name} pose on the map or in the world, m, m, rad",
        )
    add(
        "--goals",
        type=positive_number,
        metavar="N",
        help="draw N tasks on the map or in the world: a goal each, and a start unless "
        "--start is given",
    )
    add(
        "--barn",
        type=Path,
        metavar="DIR",
        help="folder of BARN worlds: world_N.world and path_files/",
    )
    add(
        "--worlds",
        metavar="LIST",
        help="numbers of the BARN worlds, such as 3,10-20,100-299:50 (all)",
    )


def add_nav2_files(parser: argparse.ArgumentParser) -> None:
    """Adds the options of preset files and Nav2 files."""
    add = parser.add_argument_group("parameter files and Nav2").add_argument
    add(
        "--params",
        action="append",
        default=[],
        type=Path,
        metavar="FILE",
        help="controllers from a file: a preset file, or a Nav2 parameter file, of "
        "which the controllers alone become columns",
    )
    add(
        "--nav2",
        action="append",
        default=[],
        type=Path,
        metavar="FILE",
        help="whole Nav2 parameter file: controllers, costmaps, planner, checkers and "
        "so on; several files are merged, later ones override. To compare two "
        "files, use --against",
    )
    add(
        "--against",
        action="append",
        default=[],
        type=Path,
        metavar="FILE",
        help="Nav2 parameter file to compare with that of --nav2; each file's columns "
        "drive with its own costmaps, planner and so on",
    )
    add(
        "--name",
        action="append",
        default=[],
        metavar="ALIAS=FILE",
        help="names for the columns of a Nav2 file (the parts in which the files' paths differ)",
    )
    add(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="value for $(var NAME) or <NAME> in the Nav2 files, or of an argument of "
        "the robot's xacro file",
    )
    add(
        "--nav2-release",
        choices=tuple(Release),
        help="Nav2 release that the files of --nav2 and --params are written for "
        "(found by their parameters)",
    )
    add(
        "--check",
        action="store_true",
        help="print how each parameter of the Nav2 files and each part of the robot's "
        "model is used, and drive nothing",
    )


def _add_sweeps(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument_group("sweeps").add_argument
    add(
        "--sweep",
        action="append",
        default=[],
        metavar="FIELD=VALUES",
        help="drive with each of these values of one field: of a controller "
        "(rpp.lookahead_dist), of the robot (localization.xy_std_m) or of the "
        "scenario. Values: 1,2,5 or LOW:HIGH:COUNT[:log]; several --sweep form a "
        "grid",
    )
    add(
        "--samples",
        type=positive_number,
        metavar="N",
        help="draw N points of a Latin hypercube over the --sweep fields instead of the grid",
    )


def _add_how(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument_group("number of trials, workers").add_argument
    add(
        "--trials",
        type=positive_number,
        default=4,
        metavar="N",
        help="number of trials per scenario and controller (4)",
    )
    add("--seed", type=whole_number, default=0, help="seed of the whole run (0)")
    add("--jobs", type=_jobs, default=None, metavar="N|auto", help="parallel workers (auto)")
    add(
        "--cluster",
        metavar="ADDRESS|local:N",
        help="drive on the workers of a dask scheduler, tls://HOST:PORT, or local:N: "
        "of one with N workers on this machine",
    )
    add(
        "--cluster-tls",
        type=Path,
        metavar="DIR",
        help="ca.pem, cert.pem and key.pem with which a tls:// cluster and this run "
        "recognise each other",
    )
    add(
        "--trust-network",
        action="store_true",
        help="accept a tcp:// cluster, where whoever reaches its machines may run code as you",
    )
    add(
        "--live",
        action="store_true",
        help="show each trial in a browser, in real time, one after another, with buttons and "
        "sliders; without --out no log is kept",
    )
    add(
        "--live-port",
        type=_port,
        metavar="N",
        help="port of the page of --live on this machine (a free one)",
    )
    add(
        "--live-wait",
        type=_seconds,
        metavar="SECONDS",
        help="time that --live waits for a browser, at the beginning and when it was closed (120)",
    )
    add("--resume", type=Path, metavar="DIR", help="continue an interrupted run")


def _add_results(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument_group("results and output").add_argument
    add("--out", type=Path, metavar="DIR", help="new folder for the results (results/<time>)")
    add(
        "--replay",
        choices=("race", "each", "none"),
        help="replays to write (race; for a sweep none)",
    )
    add(
        "--figures",
        choices=("none", "key", "all"),
        help="figures of the report. key: those that compare the controllers of a "
        "scenario; all: also the motion of each controller, and every figure as "
        "PNG (key; for a sweep none)",
    )
    add(
        "--metric",
        action="append",
        default=[],
        metavar="FILE.py:NAME",
        help="add a metric: a function of yours, decorated with @metric",
    )
    add(
        "--columns",
        type=listed_names,
        default=(),
        metavar="LIST",
        help="metrics that the terminal shows (success, touches, time, clearance, "
        "length, distance from the path, jerk; for the published benchmark those "
        "of the publication)",
    )
    add(
        "--no-costmaps",
        action="store_true",
        help="leave the local costmaps out of the logs, which makes logs smaller and "
        "replays poorer",
    )
    add("--list", action="store_true", help="list scenarios, controllers and robots")
    add("--quiet", action="store_true", help="print errors only")


def _jobs(text: str) -> int | None:
    return None if text == "auto" else positive_number(text)


def _port(text: str) -> int:
    number = positive_number(text)
    if number > MAX_PORT:
        raise argparse.ArgumentTypeError(f"got {text!r}, expected a port of at most {MAX_PORT}")
    return number


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = -1.0
    if not 0.0 < seconds < math.inf:
        raise argparse.ArgumentTypeError(f"got {text!r}, expected seconds above 0")
    return seconds


def _require_nothing_else(parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> None:
    """Raises InputError where --resume is given with options of a new run."""
    for name, value in vars(arguments).items():
        if name not in ALLOWED_WITH_RESUME and value != parser.get_default(name):
            option = "SCENARIO" if name == "scenarios" else f"--{name.replace('_', '-')}"
            raise InputError(
                f"--resume {arguments.resume}: goes on with what was asked then; "
                f"expected no {option}, got {value!r}"
            )


def _commas_wanted(names: Sequence[str]) -> str:
    """Returns the error for controllers that were given as several arguments."""
    return (
        f"--controllers: expected names separated by commas, --controllers {','.join(names)}; "
        f"got {' '.join(names)}"
    )


@contextmanager
def input_warnings_as_lines(*, quiet: bool) -> Iterator[None]:
    """Prints each warning about the input as a line on stderr; with `quiet`, prints none."""
    with warnings.catch_warnings():
        show_others = warnings.showwarning

        def show(
            message: Warning | str, category: type[Warning], *where: Any, **options: Any
        ) -> None:
            if issubclass(category, InputWarning):
                print(printable(str(message)), file=sys.stderr)
            else:
                show_others(message, category, *where, **options)

        warnings.showwarning = show
        if quiet:
            warnings.simplefilter("ignore", InputWarning)
        yield


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit status."""
    parser = build_parser()
    return exit_status_of(lambda: _main(parser, argv))


def _main(parser: argparse.ArgumentParser, argv: Sequence[str] | None) -> int:
    arguments = arguments_of(parser, argv)
    with input_warnings_as_lines(quiet=arguments.quiet):
        return _run(parser, arguments)


def arguments_of(parser: argparse.ArgumentParser, argv: Sequence[str] | None) -> argparse.Namespace:
    """Returns the arguments; raises InputError for controllers without commas between them."""
    arguments, rest = parser.parse_known_args(argv)
    if rest and arguments.controllers and not any(text.startswith("-") for text in rest):
        raise InputError(_commas_wanted([arguments.controllers, *rest]))
    if rest:
        parser.error(f"unrecognized arguments: {' '.join(rest)}")
    return arguments


def with_package(
    parser: argparse.ArgumentParser, arguments: argparse.Namespace
) -> argparse.Namespace:
    """Returns the arguments, completed from a robot's repository; prints the files found there."""
    from drake_navbench.campaign import package_arguments

    arguments, lines = package_arguments.with_package(arguments, parser.get_default("robot"))
    if not arguments.quiet:
        print("\n".join(lines), flush=True)
    return arguments


def _run(parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> int:
    began_s = time.perf_counter()
    if arguments.list:
        from drake_navbench.campaign.console import terminal
        from drake_navbench.commands.listing import print_listing

        print_listing(terminal())
        return EXIT_DONE
    if arguments.resume is not None:
        _require_nothing_else(parser, arguments)
    if arguments.package:
        arguments = with_package(parser, arguments)
    elif arguments.pick:
        raise InputError(f"--pick {arguments.pick[0]}: expected --package as well")
    if arguments.check:
        from drake_navbench.campaign.request_arguments import print_check

        print_check(arguments)
        return EXIT_DONE
    from drake_navbench.campaign.benchmark import run_from_command_line

    any_error = run_from_command_line(arguments, began_s=began_s)
    return EXIT_FAILED if any_error else EXIT_DONE


if __name__ == "__main__":
    sys.exit(main())
