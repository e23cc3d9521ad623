"""One colour a controller, the same in tables, figures and replays, safe for the colour-blind."""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from functools import lru_cache

# Okabe and Ito's palette, whose yellow and black are left to markers, and a violet that it lacks.
CONTROLLER_COLORS = {
    "dwb": "#d55e00",
    "rpp": "#0072b2",
    "teb": "#009e73",
    "teb_upstream": "#56b4e9",
    "mppi": "#e69f00",
    "mppi_nav2": "#cc79a7",
    "harmony": "#6a3d9a",
}
# Colours for all other columns. Among the colours that are legible on white and on black, each is
# the one that is farthest, in OKLab, from the table's colours and from those before it.
OTHER_COLORS = (
    "#c300ff",
    "#5a5a00",
    "#3cd200",
    "#0f2dff",
    "#c30069",
    "#8778ff",
    "#ff69ff",
    "#876969",
    "#87c396",
    "#a52d00",
)


def controller_color(name: str, beside: Iterable[str] = ()) -> str:
    """Returns the colour '#rrggbb' of a column.

    beside: all columns of the results. Every column has a colour of its own unless more columns
    than OTHER_COLORS has are missing in the table of known colours.
    """
    return _colors(frozenset({name, *beside}))[name]


@lru_cache
def _colors(names: frozenset[str]) -> dict[str, str]:
    """Returns a colour by name, the same whatever the order of the names.

    Each name has a first choice, so that its colour is mostly the same in other results, too.
    """
    chosen = {name: CONTROLLER_COLORS[name] for name in names & CONTROLLER_COLORS.keys()}
    free: list[str] = []
    for name in sorted(names - CONTROLLER_COLORS.keys()):
        free = free or list(OTHER_COLORS)
        first = OTHER_COLORS[zlib.crc32(name.encode()) % len(OTHER_COLORS)]
        chosen[name] = first if first in free else free[0]
        free.remove(chosen[name])
    return chosen
