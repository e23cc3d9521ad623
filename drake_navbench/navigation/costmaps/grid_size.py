"""The limit on the number of a grid's cells."""

from __future__ import annotations

from drake_navbench.errors import InputError

# 250 m by 250 m in cells of 5 cm. A costmap of it and a search on it take about 1 GB.
MAX_GRID_CELLS = 25_000_000


def require_grid_size(what: str, columns: float, rows: float) -> None:
    """Raises InputError where a grid would have too many cells; its message begins with `what`."""
    if columns * rows > MAX_GRID_CELLS:
        raise InputError(
            f"{what}: {columns:.0f} x {rows:.0f} cells are too many, expected at most "
            f"{MAX_GRID_CELLS:.3g} in all"
        )
