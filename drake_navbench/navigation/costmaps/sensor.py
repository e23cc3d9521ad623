"""The facts about a lidar that the costmap layers which read its scans need."""

from __future__ import annotations

from typing import Protocol


class RangeSensor(Protocol):
    """A planar lidar.

    range_min_m, range_max_m: between which ranges it sees, m. height_m: height of the scanned plane
    over the floor, m.
    """

    @property
    def range_min_m(self) -> float: ...

    @property
    def range_max_m(self) -> float: ...

    @property
    def height_m(self) -> float: ...
