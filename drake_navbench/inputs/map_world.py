"""The true world behind a map: its occupied cells as few boxes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drake_navbench.errors import InputError
from drake_navbench.inputs.world import Box
from drake_navbench.navigation.costmaps.map_file import OccupancyMap

# A rectangle of cells: first row, row past the last, first column, column past the last.
CellBox = tuple[int, int, int, int]
# Each rectangle takes 6 kB in a trial; the time to build a trial grows with the square of their
# number.
MAX_WALLS = 100_000


def occupied_boxes(grid: OccupancyMap) -> tuple[Box, ...]:
    """Returns boxes that cover exactly the occupied cells of a map, without overlap.

    Cells that are unknown or only partly occupied (mode scale) count as free: nothing is known to
    stand there. Runs of cells in a row are joined with the same run in the rows above. Raises
    InputError where there would be too many.
    """
    runs = list(_merged_runs(grid.is_occupied))
    if len(runs) > MAX_WALLS:
        named = grid.files[0] if grid.files else "map"
        raise InputError(
            f"{named}: its occupied cells make {len(runs)} rectangles, expected at most "
            f"{MAX_WALLS}; is it noise?"
        )
    boxes = []
    for first_row, past_row, first_column, past_column in runs:
        low = _corner(grid, first_column, first_row)
        high = _corner(grid, past_column, past_row)
        boxes.append(Box(type="box", min=low, max=high))
    return tuple(boxes)


def _corner(grid: OccupancyMap, column: int, row: int) -> tuple[float, float]:
    """Returns the lower left corner of a cell, m."""
    return grid.origin_x + column * grid.resolution, grid.origin_y + row * grid.resolution


def _merged_runs(occupied: np.ndarray) -> Iterator[CellBox]:
    """Yields rectangles of cells, each a run of a row that repeats in the rows above it."""
    open_runs: dict[tuple[int, int], int] = {}
    for row, runs in enumerate([*map(_runs, occupied), []]):
        repeated = set(runs)
        for run in [run for run in open_runs if run not in repeated]:
            yield open_runs.pop(run), row, *run
        for run in runs:
            open_runs.setdefault(run, row)


def _runs(cells: np.ndarray) -> list[tuple[int, int]]:
    """Returns the runs of true cells as (first, past the last)."""
    steps = np.flatnonzero(np.diff(cells, prepend=False, append=False))
    return list(zip(steps[::2].tolist(), steps[1::2].tolist(), strict=True))
