"""Several seeds of one identification: which ones, and what they agree on."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from drake_navbench.errors import InputError
from drake_navbench.identification.outcome import Data, Identified
from drake_navbench.identification.prediction import agreements_of
from drake_navbench.identification.profile import FOUND_SHARE, Profile, share_of_all
from drake_navbench.identification.ranges import place_of
from drake_navbench.tuning.search_space import Dimension

OPTION = "--seed"


def parse_seeds(text: str) -> tuple[int, ...]:
    """Returns the seeds of a text such as 0 or 0,1; raises InputError."""
    if re.fullmatch(r"\d+(,\d+)*", text, re.ASCII) is None:
        raise InputError(f"{OPTION} {text!r}: expected whole numbers such as 0, or 0,1")
    seeds = tuple(map(int, text.split(",")))
    if len(set(seeds)) < len(seeds):
        raise InputError(f"{OPTION} {text!r}: expected each seed once")
    return seeds


def agreement(runs: Sequence[Identified]) -> Data:
    """Returns what several seeds agree on, as plain values: settings, and what they predict."""
    return {
        "values": list(_values(runs)),
        "predictions": {kind: _predictions(runs, kind) for kind in runs[0].found.numbers},
    }


def is_told(dimension: Dimension, found: Sequence[Profile]) -> bool:
    """Whether every seed tells a value, and all that is as good by any lies within half a range."""
    return share_of_all(dimension, found) <= FOUND_SHARE and all(p.is_told for p in found)


def _values(runs: Sequence[Identified]) -> Iterator[Data]:
    """Yields of every value whether the seeds tell it, and how far apart what they find is."""
    for number, block in enumerate(runs[0].whole.blocks):
        for place, dimension in enumerate(block.dimensions):
            found = [run.profiles[number][place] for run in runs]
            yield {
                "block": block.title,
                "name": dimension.name,
                "is_told_by": sum(profile.is_told for profile in found),
                "is_told": is_told(dimension, found),
                "apart": _apart(dimension, found),
            }


def _apart(dimension: Dimension, found: Sequence[Profile]) -> float:
    """Returns how far apart the seeds' values lie, as a share of the searched range."""
    places = [place_of(dimension, profile.found) for profile in found]
    return max(places) - min(places)


def _predictions(runs: Sequence[Identified], kind: str) -> Data:
    """Returns how many orderings come out with all seeds, and how far apart two numbers are.

    apart: of the numbers of two seeds for a cell, relative to the table's; the median.
    """
    targets = runs[0].targets
    by_run = [agreements_of(run.found, kind, targets) for run in runs]
    counts = {"all": 0, "some": 0, "none": 0}
    for pair in by_run[0]:
        here = [found[pair] for found in by_run]
        if not all(map(math.isfinite, here)):
            continue
        name = "all" if min(here) == 1.0 else "none" if max(here) == 0.0 else "some"
        counts[name] += 1
    numbers = [run.found.numbers[kind] for run in runs]
    differences = [
        abs(a[cell] - b[cell]) / targets.scales[cell]
        for a, b in combinations(numbers, 2)
        for cell in a
        if math.isfinite(a[cell]) and math.isfinite(b[cell])
    ]
    return {**counts, "apart": float(np.median(differences)) if differences else None}
