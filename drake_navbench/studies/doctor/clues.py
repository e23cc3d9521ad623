"""Clues to a cause in the words of a complaint."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from drake_navbench.studies.doctor.causes import Cause
from drake_navbench.typed_files.typed_yaml import FrozenModel, read_yaml, validate

FILE = Path(__file__).parent / "words" / "clues.yaml"


class Clue(FrozenModel):
    """A pattern of words, and by glob of a cause's place the factor by which it is likelier."""

    words: str
    favours: dict[str, float]


class _ClueFile(FrozenModel):
    """The contents of the file of clues."""

    clues: tuple[Clue, ...]


@cache
def all_clues() -> tuple[Clue, ...]:
    """Returns all clues; raises InputError where the file is wrong."""
    return validate(_ClueFile, read_yaml(FILE), str(FILE)).clues


def favours_of(words: str) -> list[Mapping[str, float]]:
    """Returns the factors of the clues that match a user's words."""
    text = words.lower()
    return [clue.favours for clue in all_clues() if re.search(clue.words, text)]


def factor_for(cause: Cause, favours: list[Mapping[str, float]]) -> float:
    """Returns the factor by which words make a cause likelier: the product over the clues."""
    factor = 1.0
    for clue in favours:
        found = [value for glob, value in clue.items() if _matches(cause, glob)]
        factor *= max(found, default=1.0)
    return factor


def _matches(cause: Cause, glob: str) -> bool:
    place, _, direction = glob.partition(":")
    is_there = fnmatch.fnmatchcase(cause.place, place)
    return is_there and (not direction or direction == cause.direction)
