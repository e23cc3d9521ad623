"""Ages of published figures: `python studies/figure_ages.py` lists those older than their code.

studies/figures.yaml names for each page the command that makes its figures and the code that they
speak of. A figure is older where this code differs from the code at the commit at which it was
made: the last one that changed its pictures or, without pictures, brought a number into its section
of the page; or `again`, at which its command gave the same figures once more. So another wording of
a page, or a shorter one, makes no figure newer. Comments, docstrings and sentences in Python files
do not count.
"""

from __future__ import annotations

import argparse
import ast
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import yaml

REPOSITORY = Path(__file__).parents[1]
LIST = Path(__file__).with_name("figures.yaml")
MOST_SHOWN = 3


class Figure(NamedTuple):
    """Figures of a page.

    pictures: their files; () for figures in the text, which stand below the heading `section`, or
    anywhere on the page where it is ''. code: files and folders that they speak of. again: the
    commit whose code gave the same figures once more, '' without one.
    """

    page: str
    command: str
    pictures: tuple[str, ...]
    code: tuple[str, ...]
    section: str = ""
    again: str = ""

    @property
    def made(self) -> tuple[str, ...]:
        """The files that hold the figures."""
        return self.pictures or (self.page,)


def figures() -> list[Figure]:
    """Returns the figures of figures.yaml."""
    entries = yaml.safe_load(LIST.read_text(encoding="utf-8"))["figures"]
    return [
        Figure(
            page=entry["page"],
            command=entry["command"],
            pictures=tuple(entry.get("pictures", ())),
            code=tuple(entry["code"]),
            section=entry.get("section", ""),
            again=entry.get("again", ""),
        )
        for entry in entries
    ]


def changed_since(figure: Figure, repository: Path = REPOSITORY) -> list[str]:
    """Returns the files of a figure's code that have changed since the figure was made."""
    made = made_at(figure, repository)
    if not made:
        return ["never committed"]
    names = _git(repository, "diff", "--name-only", made, "HEAD", "--", *figure.code).splitlines()
    return [name for name in names if _at(repository, made, name) != _at(repository, "HEAD", name)]


def made_at(figure: Figure, repository: Path = REPOSITORY) -> str:
    """Returns the commit at which a figure was made last, '' where it was never committed."""
    if figure.again:
        return figure.again
    commits = _git(repository, "log", "--format=%H", "--", *figure.made).split()
    if figure.pictures or not commits:
        return "".join(commits[:1])
    made = commits[0]
    numbers = numbers_of(_text(repository, "HEAD", figure.page), figure.section)
    for commit in commits:
        if not numbers <= numbers_of(_text(repository, commit, figure.page), figure.section):
            break
        made = commit
    return made


def numbers_of(page: str, section: str) -> set[str]:
    """Returns the numbers below a heading of a page, up to the next one of its rank or a higher."""
    if section:
        rank = len(section) - len(section.lstrip("#"))
        _, heading, below = f"\n{page}".partition(f"\n{section}\n")
        if not heading:
            return set()
        page = re.split(rf"^#{{1,{rank}}} ", below, maxsplit=1, flags=re.MULTILINE)[0]
    return set(re.findall(r"\d+(?:[.,]\d+)*", page))


def without_words(source: str) -> str:
    """Returns a Python file as its syntax tree, without comments, docstrings and sentences."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value:
            node.value = ""
        elif isinstance(node, ast.JoinedStr):
            node.values = [part for part in node.values if isinstance(part, ast.FormattedValue)]
    return ast.dump(tree)


def _at(repository: Path, commit: str, name: str) -> str:
    """Returns a file of a commit without its words; empty where the commit does not have it."""
    text = _text(repository, commit, name)
    return without_words(text) if name.endswith(".py") else text


def _text(repository: Path, commit: str, name: str) -> str:
    """Returns a file of a commit; empty where the commit does not have it."""
    if not _git(repository, "ls-tree", commit, "--", name):
        return ""
    return _git(repository, "show", f"{commit}:{name}")


def _git(repository: Path, *arguments: str) -> str:
    done = subprocess.run(
        ["git", "-C", str(repository), *arguments],
        capture_output=True,
        encoding="utf-8",
        errors="replace",
        check=True,
    )
    return done.stdout


def main() -> int:
    """Prints a line a figure; returns the exit status, 1 where a figure is older than its code."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    is_any_older = False
    for figure in figures():
        changed = changed_since(figure)
        is_any_older |= bool(changed)
        if not changed:
            print(f"{figure.page}: as new as its code")
            continue
        others = f" and {len(changed) - MOST_SHOWN} more" if len(changed) > MOST_SHOWN else ""
        print(f"{figure.page}: older than {', '.join(changed[:MOST_SHOWN])}{others}")
        print(f"    {figure.command}")
    return int(is_any_older)


if __name__ == "__main__":
    sys.exit(main())
