"""Compiles a checkout's controllers: `python -m drake_navbench nav2-build CHECKOUT`.

Only the standard library is imported before the arguments are read, so that --help is quick.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

EXIT_DONE = 0
EXIT_WRONG_INPUT = 2
EXIT_INTERRUPTED = 130

EPILOG = """\
example:
  python -m drake_navbench nav2-build ~/nav2_ws/src/navigation2 --as mine
  python -m drake_navbench run one_obstacle --controllers rpp,rpp@mine

exit status: 0 done, 2 wrong input: no checkout, a release that is not known, a compiler or a library
that is missing, or something that cannot be compiled
"""


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m drake_navbench nav2-build",
        description="Compiles the controllers of a checkout of Nav2, without ROS, into a program "
        "that drives trials: the column rpp@NAME is the original of rpp.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("checkout", type=Path, metavar="CHECKOUT", help="the folder of navigation2")
    add("--as", dest="name", metavar="NAME", help="what to call it (the name of its release)")
    add(
        "--packages",
        type=_names,
        default=(),
        metavar="LIST",
        help="packages with controllers to build (all for which the system has what they need)",
    )
    add("--jobs", type=_positive, default=2, metavar="N", help="files compiled at once (2)")
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit status."""
    arguments = build_parser().parse_args(argv)
    from drake_navbench.errors import InputError, printable
    from drake_navbench.native.build import build_checkout

    try:
        build = build_checkout(
            arguments.checkout,
            name=arguments.name,
            wanted=arguments.packages,
            jobs=arguments.jobs,
            tell=lambda line: print(printable(line), flush=True),
        )
    except InputError as error:
        print(error, file=sys.stderr)
        return EXIT_WRONG_INPUT
    except KeyboardInterrupt:
        print("interrupted; the same command goes on", file=sys.stderr)
        return EXIT_INTERRUPTED
    say = partial(print, flush=True)
    say(f"{build.name}: Nav2 {build.where_from}, in {build.seconds:.0f} s")
    for controller in build.controllers:
        say(f"  {controller}")
    return EXIT_DONE


def _names(text: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for name in map(str.strip, text.split(",")) if name))


def _positive(text: str) -> int:
    number = int(text) if text.isdecimal() else 0
    if number < 1:
        raise argparse.ArgumentTypeError(f"got {text!r}, expected a whole number of at least 1")
    return number


if __name__ == "__main__":
    sys.exit(main())
