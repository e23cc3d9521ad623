"""The page of the planted faults: what was read, and what was driven.

`python studies/planted_faults_page.py` writes docs/doctor_planted_faults.md; it drives nothing.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from harmful_faults_page import harmful_lines
from planted_faults import FAULTS_EACH, HERE, drawn, read_score

PAGE = HERE.parent / "docs" / "doctor_planted_faults.md"
HEAD = f"""\
# Planted faults

Does the doctor find a parameter that somebody spoilt? A fault is one spoilt parameter in a sound
Nav2 file for the TurtleBot 4. Below, five controllers (Regulated Pure Pursuit, DWB, MPPI, TEB,
Graceful) have {FAULTS_EACH} faults each, drawn by a seed from all numbers and switches of the file
with equal chances: a number times 1/4, 2/5, 5/2 or 4, a switch turned round. The rules (at the top
of the study) were written before any file was read or driven. The findings about values far from
Nav2's, and about costmaps that disagree, were written with these 60 faults known.
`python studies/planted_faults_page.py` makes this page.

## Read
"""


def page_lines() -> Iterator[str]:
    """Yields the page."""
    faults, rows = drawn(), read_score(drawn())
    yield from HEAD.splitlines()
    yield ""
    count = len(faults)
    yield f"| of {count} faults | number | share |"
    yield "|---|---|---|"
    for name, told in (
        ("first", "the rules' first cure names the spoilt parameter and the right direction"),
        ("named", "some cure of the rules does"),
    ):
        number = sum(row[name] for row in rows)
        yield f"| {told} | {number} | {number / count:.0%} |"
    silent = sum(row["findings"] == 0 for row in rows)
    yield f"| the rules find no more than in the sound file | {silent} | {silent / count:.0%} |"
    farthest = sum(row["farthest"] for row in rows)
    told = "no skill: the value farthest from its default in Nav2"
    yield f"| {told} | {farthest} | {farthest / count:.0%} |"
    chance = sum(row["chance"] for row in rows)
    told = "no skill: any parameter and direction at random"
    yield f"| {told} | {chance:.1f} | {chance / count:.0%} |"
    yield from harmful_lines()
    yield ""


def main() -> None:
    """Writes the page."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    PAGE.write_text("\n".join(page_lines()), encoding="utf-8")


if __name__ == "__main__":
    main()
