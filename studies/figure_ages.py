"""Ages of published figures: `python studies/figure_ages.py` lists those older than their code.

studies/figures.yaml names for each page the command that makes its figures and the code that they
speak of. A figure is older where this code differs from the code at the last commit that changed
the page or its pictures. Comments, docstrings and sentences in Python files do not count.
"""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import yaml

REPOSITORY = Path(__file__).parents[1]
LIST = Path(__file__).with_name("figures.yaml")
MOST_SHOWN = 3


class Figure(NamedTuple):
    """Figures of a page. made: page and pictures. code: files and folders that they speak of."""

    page: str
    command: str
    made: tuple[str, ...]
    code: tuple[str, ...]


def figures() -> list[Figure]:
    """Returns the figures of figures.yaml."""
    entries = yaml.safe_load(LIST.read_text(encoding="utf-8"))["figures"]
    return [
        Figure(
            page=entry["page"],
            command=entry["command"],
            made=tuple(entry.get("pictures", [entry["page"]])),
            code=tuple(entry["code"]),
        )
        for entry in entries
    ]


def changed_since(figure: Figure, repository: Path = REPOSITORY) -> list[str]:
    """Returns the files of a figure's code that have changed since the figure was made."""
    made = _git(repository, "log", "-1", "--format=%H", "--", *figure.made).strip()
    if not made:
        return ["never committed"]
    names = _git(repository, "diff", "--name-only", made, "HEAD", "--", *figure.code).splitlines()
    return [name for name in names if _at(repository, made, name) != _at(repository, "HEAD", name)]


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
    if not _git(repository, "ls-tree", commit, "--", name):
        return ""
    text = _git(repository, "show", f"{commit}:{name}")
    return without_words(text) if name.endswith(".py") else text


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
