"""Suggests a change of a Nav2 file for a symptom: `python -m drake_navbench doctor FILE`.

Only the standard library is imported before the arguments are read, so that --help is quick.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drake_navbench.commands.command_line import CommandParser, exit_status_of
from drake_navbench.errors import InputError

if TYPE_CHECKING:
    from drake_navbench.inputs.presets import Preset
    from drake_navbench.nav2.whole_files import FileColumns

EPILOG = """\
examples:
  drake-navbench doctor nav2_params.yaml --robot turtlebot4 --read-only
  drake-navbench doctor nav2_params.yaml --read-only --symptom wobble_straight \\
      --told "heavy robot, Raspberry Pi 4, swings on the way to the goal"
  drake-navbench doctor --score cases.yaml --files cases/ --page score.md

exit status: 0 done, 2 wrong input
"""


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="python -m drake_navbench doctor",
        description="Reads a Nav2 file with rules over the parameters of its release, and ranks\n"
        "what may cause a symptom.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("files", nargs="*", type=Path, metavar="FILE", help="a whole Nav2 file; of several, later "
        "ones override")  # fmt: skip
    add("--robot", default="wheelchair", metavar="NAME|FILE", help="robot for what no Nav2 file "
        "tells: mass, drive, lidar (wheelchair)")  # fmt: skip
    add("--controller", metavar="NAME", help="which of the file's controllers (the first)")
    add("--symptom", metavar="CLASS", help="what the robot does; a wrong name lists all classes")
    add("--told", default="", metavar="TEXT", help="symptom and robot in your own words")
    add("--nav2-release", choices=("humble", "iron", "jazzy", "kilted", "lyrical"), help="what the "
        "file is written for (told by its own marks)")  # fmt: skip
    add("--set", action="append", default=[], metavar="NAME=VALUE", help="value for $(var NAME) or "
        "<NAME> in the file")  # fmt: skip
    add("--read-only", action="store_true", help="read the file and drive nothing")
    score = parser.add_argument_group("score on known cases")
    score.add_argument("--score", type=Path, metavar="CASES", help="YAML file of known cases; each "
        "is given to the doctor")  # fmt: skip
    score.add_argument("--files", dest="case_files", type=Path, metavar="DIR", help="whole Nav2 "
        "files of the cases, ID.yaml or ID_1.yaml, ID_2.yaml")  # fmt: skip
    score.add_argument("--page", type=Path, metavar="FILE", help="where the page of the score goes")
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit status."""
    given = list(sys.argv[2:] if argv is None else argv)
    arguments = build_parser().parse_args(given)
    return exit_status_of(lambda: _doctor(arguments))


def _doctor(arguments: argparse.Namespace) -> None:
    if arguments.score is not None:
        _score(arguments)
        return
    for name in ("case_files", "page"):
        if getattr(arguments, name) is not None:
            option = "--files" if name == "case_files" else f"--{name}"
            raise InputError(f"{option}: goes with --score")
    if not arguments.files:
        raise InputError("doctor: expected a Nav2 file, or --score")
    _read(arguments)


def _read(arguments: argparse.Namespace) -> None:
    from drake_navbench.commands.command_line import print_text
    from drake_navbench.studies.doctor.facts import facts_of
    from drake_navbench.studies.doctor.reading import findings_of, suspicions_of
    from drake_navbench.studies.doctor.symptoms import symptom_called
    from drake_navbench.studies.doctor.told import told_of_reading

    symptom = None if arguments.symptom is None else symptom_called(arguments.symptom)
    file = whole_file(arguments)
    facts = facts_of(file.setup, chosen_column(file, arguments.controller))
    findings = findings_of(facts)
    words = f"{arguments.symptom or ''} {arguments.told}"
    suspects = [] if symptom is None else suspicions_of(facts, symptom, words)
    if symptom is not None:
        extra = [f for f in findings_of(facts, symptom) if f not in findings]
        findings += extra
    print_text("\n".join(told_of_reading(facts, findings, suspects, symptom)) + "\n")


def whole_file(arguments: argparse.Namespace) -> FileColumns:
    """Returns the columns of the file that the arguments name; raises InputError."""
    from drake_navbench.nav2.substitutions import read_assignments
    from drake_navbench.nav2.whole_files import WholeFile, columns_of_files

    file = WholeFile("", tuple(arguments.files))
    (columns,) = columns_of_files(
        [file], arguments.robot, read_assignments(arguments.set), release=arguments.nav2_release
    )
    return columns


def chosen_column(file: FileColumns, name: str | None) -> Preset:
    """Returns the column of a controller of the file, the first where no name is given."""
    plugins = file.plugins
    if not plugins:
        raise InputError(
            f"{file.file.told}: no controller_server with controller_plugins; expected one"
        )
    if name is None:
        return next(iter(plugins.values()))
    if name not in plugins:
        raise InputError(f"--controller {name!r}: expected one of {', '.join(plugins)}")
    return plugins[name]


def _score(arguments: argparse.Namespace) -> None:
    from drake_navbench.commands.command_line import print_text
    from drake_navbench.studies.doctor.known_cases import read_cases, score_case
    from drake_navbench.studies.doctor.score_page import score_page

    if arguments.files:
        raise InputError("--score: takes the files of its cases from --files; expected no FILE")
    if arguments.case_files is not None and not arguments.case_files.is_dir():
        raise InputError(f"--files {arguments.case_files}: expected a folder")
    cases = read_cases(arguments.score)
    scored = [score_case(case, arguments.case_files) for case in cases]
    page = score_page(scored, cases)
    if arguments.page is not None:
        try:
            arguments.page.write_text(page, encoding="utf-8")
        except OSError as error:
            raise InputError(f"--page {arguments.page}: {error.strerror}") from error
    print_text(page)


if __name__ == "__main__":
    sys.exit(main())
