"""A robot as known besides its model, by a Nav2 file: base link, outline, topics of scans."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import shapely

from drake_navbench.kernels.arrays import Array

# The least distance of the base origin from the outline around it, m.
ORIGIN_MARGIN_M = 0.01


class KnownBase(NamedTuple):
    """link: of the base, None where nothing names it. footprint: corners (K, 2) m; radius_m: of a
    round robot. Both outlines are None where none is given; a model with shapes has its own.
    scans: the topics of the scans that the costmaps take. is_omni: whether AMCL takes the base for
    an omnidirectional one, or a controller drives it sideways.
    """

    link: str | None = None
    footprint: tuple[tuple[float, float], ...] | None = None
    radius_m: float | None = None
    scans: tuple[str, ...] = ()
    is_omni: bool = False

    @property
    def outline(self) -> dict[str, Any]:
        """The outline as fields of a robot; {} without one."""
        if self.footprint is not None:
            return {"footprint": [list(corner) for corner in self.footprint]}
        return {} if self.radius_m is None else {"robot_radius": self.radius_m}


NOTHING_KNOWN = KnownBase()


def around_origin(outline: Array) -> Array:
    """Returns an outline (K, 2) around the base origin: `outline`, or its hull with the origin.

    Costmaps here only take a footprint around the base frame's origin.
    """
    polygon = shapely.Polygon(outline)
    if polygon.contains(shapely.Point(0.0, 0.0)):
        return outline
    hull = shapely.union(polygon, shapely.Point(0.0, 0.0).buffer(ORIGIN_MARGIN_M)).convex_hull
    return np.round(shapely.get_coordinates(hull.normalize())[:-1], 4)[::-1]
