"""Colours of a costmap, the same in replays and in figures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.grid import (
    FREE,
    INSCRIBED,
    LETHAL,
    MAX_NON_OBSTACLE,
    NO_INFORMATION,
)

# The number of shades between free and inscribed; few shades compress well.
GRADE_COUNT = 12
FREE_RGBA = (70, 130, 200, 30)
GRADED_RGB, GRADED_ALPHA = (235, 150, 60), (30, 170)
INSCRIBED_RGBA = (220, 90, 40, 210)
LETHAL_RGBA = (110, 20, 35, 255)
UNKNOWN_RGBA = (120, 120, 120, 110)


def palette() -> NDArray[np.uint8]:
    """Returns (GRADE_COUNT + 4, 4) RGBA: free, the grades, inscribed, lethal, unknown."""
    grades = [(*GRADED_RGB, alpha) for alpha in np.linspace(*GRADED_ALPHA, GRADE_COUNT)]
    rows = [FREE_RGBA, *grades, INSCRIBED_RGBA, LETHAL_RGBA, UNKNOWN_RGBA]
    return np.array(rows).astype(np.uint8)


def palette_rows() -> NDArray[np.uint8]:
    """Returns (256,) for each cost the row of the palette that shows it."""
    rows = np.empty(NO_INFORMATION + 1, dtype=np.uint8)
    graded = np.arange(1, MAX_NON_OBSTACLE + 1)
    rows[FREE] = 0
    rows[graded] = 1 + (graded - 1) * GRADE_COUNT // MAX_NON_OBSTACLE
    rows[[INSCRIBED, LETHAL, NO_INFORMATION]] = GRADE_COUNT + np.array([1, 2, 3])
    return rows
