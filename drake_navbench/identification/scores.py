"""How far numbers of ours are from a table's: relative errors, and orders of two controllers."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np

from drake_navbench.analysis.findings import is_published_tie
from drake_navbench.analysis.relations import relative_difference
from drake_navbench.identification.targets import Cell, Pair, Targets

# A cell that is farther off, or has no value here, counts as this much: one that has gone wrong
# altogether must not outweigh all others.
MOST_ERROR = 1.0


class Score(NamedTuple):
    """What some cells come to.

    cells: with a value here and a table's that is not 0; median_error: of their relative errors.
    mean_error: of all, as the search counts it. orderings: with a value here; agreeing: of these.
    """

    cells: int
    median_error: float
    mean_error: float
    orderings: int
    agreeing: float

    @property
    def concordance(self) -> float:
        """The share of the orderings that agree; NaN where there is none."""
        return self.agreeing / self.orderings if self.orderings else math.nan


def error_of(cell: Cell, ours: float, targets: Targets) -> float:
    """Returns how far off a number is, relative to the table's, not above `MOST_ERROR`."""
    return abs(deviation_of(cell, ours, targets))


def deviation_of(cell: Cell, ours: float, targets: Targets) -> float:
    """Returns by how much a number is too large, relative to the table's, within `MOST_ERROR`."""
    if not math.isfinite(ours):
        return MOST_ERROR
    deviation = (ours - targets.values[cell]) / targets.scales[cell]
    return min(max(deviation, -MOST_ERROR), MOST_ERROR)


def mean_error(cells: Collection[Cell], ours: Mapping[Cell, float], targets: Targets) -> float:
    """Returns the mean error of some cells, which a search makes small."""
    return float(np.mean([error_of(cell, ours.get(cell, math.nan), targets) for cell in cells]))


def score(
    cells: Collection[Cell],
    ours: Mapping[Cell, float],
    targets: Targets,
    others: Mapping[Cell, float] | None = None,
) -> Score:
    """Scores some cells.

    Counted are the orderings between two of the cells; with `others`, numbers of ours for cells
    that are not scored, those between one of the cells and one of the others as well.
    """
    errors = [
        abs(ours[cell] / targets.values[cell] - 1.0)
        for cell in cells
        if targets.values[cell] != 0.0 and math.isfinite(ours.get(cell, math.nan))
    ]
    counted = agreements(cells, ours, targets, others).values()
    known = [agreement for agreement in counted if math.isfinite(agreement)]
    return Score(
        cells=len(errors),
        median_error=float(np.median(errors)) if errors else math.nan,
        mean_error=mean_error(cells, ours, targets) if cells else math.nan,
        orderings=len(known),
        agreeing=float(sum(known)),
    )


def agreements(
    cells: Collection[Cell],
    ours: Mapping[Cell, float],
    targets: Targets,
    others: Mapping[Cell, float] | None = None,
) -> dict[tuple[Cell, Cell], float]:
    """Returns of every ordering that `score` counts how far ours agrees.

    1 for the same order, 0 for the other, one half for an exact tie; NaN where there is none.
    """
    everyone = dict(others or {}) | {cell: ours.get(cell, math.nan) for cell in cells}
    return {
        (first, second): _agreement(first, second, everyone, targets)
        for first, second in _orderings(everyone, targets)
        if first in cells or second in cells
    }


def ceiling(
    first: Mapping[Cell, float],
    second: Mapping[Cell, float],
    targets: Targets,
    fixed: Collection[Pair],
) -> Score:
    """Scores one run of ours against another one as if that had been published.

    fixed: controllers in whose trials nothing is random; the orderings of two of them do not count.
    """
    printed = as_printed(first, targets)
    agreements = [
        _agreement(a, b, second, printed)
        for a, b in _orderings(second, printed)
        if not {Pair(a.scenario, a.controller), Pair(b.scenario, b.controller)} <= set(fixed)
    ]
    known = [agreement for agreement in agreements if math.isfinite(agreement)]
    return Score(0, math.nan, math.nan, len(known), float(sum(known)))


def as_printed(values: Mapping[Cell, float], targets: Targets) -> Targets:
    """Returns numbers of ours as if they had been published: rounded as the tables are."""
    return Targets(
        {
            cell: round(value / targets.printed_units[cell[:2]]) * targets.printed_units[cell[:2]]
            for cell, value in values.items()
            if math.isfinite(value)
        },
        targets.printed_units,
    )


def _orderings(cells: Iterable[Cell], targets: Targets) -> list[tuple[Cell, Cell]]:
    """Returns the pairs of a row that a table puts in an order."""
    rows: dict[tuple[str, str], list[Cell]] = {}
    for cell in cells:
        if cell in targets.values:
            rows.setdefault(cell[:2], []).append(cell)
    return [
        (first, second)
        for row, members in rows.items()
        for first, second in combinations(members, 2)
        if not is_published_tie(
            targets.values[first], targets.values[second], printed_unit=targets.printed_units[row]
        )
    ]


def _agreement(first: Cell, second: Cell, ours: Mapping[Cell, float], targets: Targets) -> float:
    """Returns 1 for the same order, 0 for the other, one half for an exact tie; NaN for none."""
    if not math.isfinite(ours[first] + ours[second]):
        return math.nan
    published = relative_difference(targets.values[first], targets.values[second])
    return 0.5 + 0.5 * float(
        np.sign(published) * np.sign(relative_difference(ours[first], ours[second]))
    )
