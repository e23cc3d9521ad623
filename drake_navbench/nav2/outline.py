"""The robot's outline as the costmaps of a Nav2 file give it, and points in text.

Source: nav2_costmap_2d (array_parser, footprint), branches humble to lyrical.
"""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np
import shapely

from drake_navbench.inputs.check import Status
from drake_navbench.inputs.known_base import around_origin
from drake_navbench.nav2.node_reader import NodeReader
from drake_navbench.navigation.costmaps.costmap_settings import (
    CostmapSettings,
    LocalCostmapSettings,
)
from drake_navbench.typed_files.usual_values import doubt_about

# The largest distance of the base frame's origin from a footprint that is made larger, m.
MAX_BESIDE_M = 0.05
PADDING = "footprint_padding"
# Values of `footprint` with which Nav2 uses the radius.
NO_FOOTPRINT: tuple[Any, ...] = ("", "[]", [])
# A number as C++ reads one from a stream, which leaves out white space before it.
NUMBER = re.compile(r"\s*[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


class Outline(NamedTuple):
    """A robot's outline as a costmap gives it: corners or a radius, m, and the padding, m.

    remark: on corners that are not taken as they are; '' without one.
    """

    footprint: list[list[float]] | None
    radius_m: float | None
    padding_m: float | None
    remark: str = ""

    @property
    def is_given(self) -> bool:
        """Whether the costmap gives an outline."""
        return self.footprint is not None or self.radius_m is not None


def note_small_inflation(
    reader: NodeReader, costmap: CostmapSettings, inscribed_radius_m: float
) -> None:
    """Notes an inflation radius below the robot's inscribed radius, as Nav2 warns of it."""
    radius_m = costmap.inflation_layer.inflation_radius
    if not costmap.is_active("inflation_layer") or radius_m >= inscribed_radius_m:
        return
    given = (name for name in reader.node.parameters if name.endswith(".inflation_radius"))
    remark = (
        f"{radius_m:g} is less than the robot's inscribed radius, {inscribed_radius_m:.4g} m: "
        "plans may touch obstacles"
    )
    name = next(given, "inflation_layer.inflation_radius")
    reader.note(Status.DOUBTFUL, name, remark)


def note_wide_cells(reader: NodeReader, cell_m: float, inscribed_radius_m: float) -> None:
    """Notes a costmap's cells that are wider than the robot."""
    width_m = 2.0 * inscribed_radius_m
    if reader.given("resolution") and cell_m > width_m:
        remark = f"a cell of {cell_m:g} m is wider than the robot, {width_m:.2g} m: in metres?"
        reader.note(Status.DOUBTFUL, "resolution", remark)


def read_outline(reader: NodeReader) -> Outline:
    """Returns the outline of a costmap; a footprint prevails over a radius, as in Nav2."""
    padding = reader.number(PADDING, 0.0) if reader.given(PADDING) else None
    doubt = doubt_about(LocalCostmapSettings.model_fields[PADDING], padding)
    if doubt:
        reader.note(Status.DOUBTFUL, PADDING, doubt)
    footprint = _footprint(reader)
    if footprint is None:
        is_wrong = reader.node.get("footprint") not in (None, *NO_FOOTPRINT)
        return Outline(None, reader.value("robot_radius", 0.1 if is_wrong else None), padding)
    if reader.given("robot_radius"):
        reader.note(Status.UNREAD, "robot_radius", "footprint is given, too, and overrides it")
    polygon, origin = shapely.Polygon(footprint), shapely.Point(0.0, 0.0)
    is_near = polygon.is_valid and polygon.distance(origin) <= MAX_BESIDE_M
    if not is_near or polygon.contains(origin):
        return Outline(footprint, None, padding)
    taken = around_origin(np.array(footprint)).tolist()
    remark = "the base frame's origin is no point inside it; here it is made larger around it"
    reader.note(Status.STAND_IN, "footprint", remark)
    return Outline(taken, None, padding, remark)


def _footprint(reader: NodeReader) -> list[list[float]] | None:
    given = reader.value("footprint")
    if given is None or given in NO_FOOTPRINT:
        return None
    corners = corners_of(given)
    if isinstance(given, list):
        remark = "a list; Nav2 takes text only, '[[x, y], ...]'"
        reader.note(Status.OTHER_FORM, "footprint", remark)
    if not is_footprint(given):
        text = "expected '[[x, y], [x, y], ...]' with at least 3 corners"
        listed = corners if isinstance(corners, list) else []
        wrong = next((corner for corner in listed if not are_corners([corner])), None)
        got = f"{str(given)[:60]!r}" if wrong is None else f"the corner {str(wrong)[:60]}"
        if not isinstance(given, str):
            raise reader.fault("footprint", f"{text}, got {got}")
        remark = f"{text}, got {got}: robot_radius, by default 0.1 m, is used in its place"
        reader.note(Status.DOUBTFUL, "footprint", remark)
        return None
    return [[float(x), float(y)] for x, y in corners]


def is_footprint(given: Any) -> bool:
    """Returns whether a value of `footprint` has at least three corners that can be read."""
    corners = corners_of(given)
    return are_corners(corners) and len(corners) >= 3


def corners_of(given: Any) -> Any:
    """Returns the corners that a list gives, or a text; None for a text that Nav2 cannot read."""
    return parse_points(given) if isinstance(given, str) else given


def parse_points(text: str) -> list[list[float]] | None:
    """Returns the lists of numbers in a text as Nav2 reads them; None where Nav2 takes none of it.

    Commas, blanks and tabs part numbers alike; a line break may only stand before a number.
    """
    lists: list[list[float]] = []
    numbers: list[float] = []
    depth = place = 0
    while place < len(text):
        sign, end = text[place], place + 1
        if sign == "[":
            depth, numbers = depth + 1, []
        elif sign == "]":
            depth -= 1
            if depth == 1:
                lists.append(numbers)
        elif sign not in ", \t":
            found = NUMBER.match(text, place)
            if found is None or depth != 2:
                return None
            numbers.append(float(found[0]))
            end = found.end()
        if not 0 <= depth <= 2:
            return None
        place = end
    return lists if depth == 0 else None


def are_corners(corners: Any) -> bool:
    """Tells whether a value is a list of corners, [x, y] each."""
    return isinstance(corners, list) and all(
        isinstance(corner, list)
        and len(corner) == 2
        and all(isinstance(v, int | float) and not isinstance(v, bool) for v in corner)
        for corner in corners
    )
