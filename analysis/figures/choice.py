"""The choice of figures, and the record of a written figure; imports no drawing code."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

FIGURES_FOLDER = "figures"
SVG, PNG = ".svg", ".png"
# The labels of both axes by kind of figure, for paper and for the page's charts alike.
AXES = {
    "paths": ("x [m]", "y [m]"),
    "clearance": ("driven length [m]", "clearance of the footprint [m]"),
    "pareto": ("time to goal [s]  (← better)", "smallest clearance [m]  (↑ better)"),
    "compute": ("compute time of a control cycle [ms]", "share of cycles at least as long"),
}


class FigureChoice(StrEnum):
    """The choice of figures to draw.

    KEY: the figures that compare a scenario's controllers, as SVG. ALL: also the motion of each
    controller, and each figure as PNG too, which takes three times as long.
    """

    NONE = "none"
    KEY = "key"
    ALL = "all"

    @property
    def suffixes(self) -> tuple[str, ...]:
        """The suffixes of a figure's files."""
        return {FigureChoice.NONE: (), FigureChoice.KEY: (SVG,)}.get(self, (SVG, PNG))


class FigureEntry(NamedTuple):
    """A figure that was written.

    controller: '' where the figure compares all controllers. stem: its path in the figures folder,
    without suffix, in POSIX form. size: width and height, points.
    """

    scenario: str
    controller: str
    kind: str
    title: str
    stem: str
    size: tuple[int, int]
