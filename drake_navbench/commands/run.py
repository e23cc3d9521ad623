"""The command line: `drake-navbench run`."""

from __future__ import annotations

import argparse
import shlex
import time
import warnings
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

from drake_navbench.commands.command_line import EXIT_DONE, EXIT_FAILED, exit_status_of
from drake_navbench.commands.run_options import DEFAULT_ROBOT, build_parser
from drake_navbench.errors import InputError, InputWarning

if TYPE_CHECKING:
    from drake_navbench.nav2.whole_files import FileColumns

ALLOWED_WITH_RESUME = {"cluster", "cluster_tls", "trust_network", "resume", "jobs", "quiet"}


def _require_nothing_else(parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> None:
    """Raises InputError where --resume is given with options of a new run."""
    for name, value in vars(arguments).items():
        if name not in ALLOWED_WITH_RESUME and value != parser.get_default(name):
            option = "SCENARIO" if name == "scenarios" else f"--{name.replace('_', '-')}"
            raise InputError(
                f"--resume {arguments.resume}: continues a run with its own options; "
                f"expected no {option}, got {value!r}"
            )


def _commas_wanted(names: Sequence[str]) -> str:
    """Returns the error for controllers that were given as several arguments."""
    return (
        f"--controllers: expected names separated by commas, --controllers {','.join(names)}; "
        f"got {' '.join(names)}"
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit status."""
    parser = build_parser()
    return exit_status_of(lambda: _main(parser, argv))


def _main(parser: argparse.ArgumentParser, argv: Sequence[str] | None) -> int:
    arguments = arguments_of(parser, argv)
    if arguments.quiet:
        warnings.simplefilter("ignore", InputWarning)
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


def _remarks(arguments: argparse.Namespace, files: Sequence[FileColumns]) -> list[str]:
    """Returns the lines on what the doctor's rules find in the Nav2 files of a run.

    There is none where a run goes on, as it told them at its beginning.
    """
    if not files or arguments.resume is not None:
        return []
    from drake_navbench.campaign.request_arguments import read_assignments
    from drake_navbench.studies.doctor.files import Patient
    from drake_navbench.studies.doctor.on_files import lines_on_change, lines_on_file

    if len(files) > 1:
        return lines_on_change(files)
    values = read_assignments(arguments.set)
    # Read as the command reads it: what the robot's model says against the file is no finding.
    patient = Patient(
        *(tuple(arguments.nav2), arguments.robot, values, arguments.nav2_release),
        packages=tuple(arguments.packages),
    )
    with suppress(InputError):
        return lines_on_file(patient, _doctor_command(arguments))
    return []


def _doctor_command(arguments: argparse.Namespace) -> str:
    """Returns the command, for a shell, that shows the doctor's findings on the run's Nav2 file."""
    options = {
        "--robot": [arguments.robot] if arguments.robot != DEFAULT_ROBOT else [],
        "--packages": arguments.packages,
        "--set": arguments.set or [],
        "--nav2-release": [arguments.nav2_release] if arguments.nav2_release else [],
    }
    files = arguments.nav2
    if arguments.package and len(arguments.package) == 1:
        others = [folder for folder in arguments.packages if folder not in arguments.package]
        options |= {"--robot": [], "--packages": others, "--package": arguments.package}
        options["--pick"] = arguments.pick or []
        files = []
    words = [str(word) for name, found in options.items() for one in found for word in (name, one)]
    return shlex.join(["drake-navbench", "doctor", *map(str, files), "--read-only", *words])


def _run(parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> int:
    began_s = time.perf_counter()
    if arguments.list:
        from drake_navbench.campaign.console import terminal
        from drake_navbench.commands.listing import print_listing

        print_listing(terminal())
        return EXIT_DONE
    if arguments.resume is not None:
        _require_nothing_else(parser, arguments)
    for name in ("live_port", "live_wait"):
        if getattr(arguments, name) is not None and not arguments.live:
            raise InputError(f"--{name.replace('_', '-')}: expected --live as well")
    if arguments.package:
        arguments = with_package(parser, arguments)
    elif arguments.pick:
        raise InputError(f"--pick {arguments.pick[0]}: expected --package as well")
    from drake_navbench.campaign.package_arguments import advising_on_found_files

    with advising_on_found_files(arguments):
        return _checked_or_driven(arguments, began_s)


def _checked_or_driven(arguments: argparse.Namespace, began_s: float) -> int:
    if arguments.check:
        from drake_navbench.campaign.request_arguments import print_check

        print_check(arguments, partial(_remarks, arguments))
        return EXIT_DONE
    from drake_navbench.campaign.run_command import run_from_command_line

    any_error = run_from_command_line(
        arguments, began_s=began_s, remarks=partial(_remarks, arguments)
    )
    return EXIT_FAILED if any_error else EXIT_DONE
