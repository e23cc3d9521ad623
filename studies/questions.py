"""The studies of docs/questions: `python studies/questions.py NAME FOLDER`.

Drives the trials of a page that FOLDER/trials.csv does not hold yet, prints the page's tables, and
says how many trials are equal to the rows that the page ships. With --write it puts rows, tables
and picture into docs/questions.
"""

from __future__ import annotations

import argparse
from importlib import import_module
from pathlib import Path

from question_trials import answer

NAMES = ("arrival", "late_cycles", "casters", "recordings", "bypass")


def main() -> None:
    """Drives and judges the study that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("name", choices=NAMES)
    parser.add_argument("folder", type=Path, help="keeps trials.csv; the command goes on from it")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--try-out", type=int, metavar="UNITS", help="seeds that do not count")
    parser.add_argument("--write", action="store_true", help="write rows, tables and picture")
    arguments = parser.parse_args()
    module = import_module(f"question_{arguments.name}")
    if arguments.name == "recordings":
        module.answer(arguments)
    else:
        answer(module.STUDY, arguments)


if __name__ == "__main__":
    main()
