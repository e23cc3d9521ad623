"""A robot as known besides its model, by a Nav2 file: base link, outline, topics of scans."""

from __future__ import annotations

from typing import Any, NamedTuple


class KnownBase(NamedTuple):
    """link: of the base, None where nothing names it. footprint: corners (K, 2) m; radius_m: of a
    round robot. Both outlines are None where none is given; a model with shapes has its own.
    scans: the topics of the scans that the costmaps take.
    """

    link: str | None = None
    footprint: tuple[tuple[float, float], ...] | None = None
    radius_m: float | None = None
    scans: tuple[str, ...] = ()

    @property
    def outline(self) -> dict[str, Any]:
        """The outline as fields of a robot; {} without one."""
        if self.footprint is not None:
            return {"footprint": [list(corner) for corner in self.footprint]}
        return {} if self.radius_m is None else {"robot_radius": self.radius_m}


NOTHING_KNOWN = KnownBase()
