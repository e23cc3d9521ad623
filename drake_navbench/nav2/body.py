"""The body of the robot that a Nav2 file drives: the costmaps' outline, and the true one.

The outline in a Nav2 file is the one that its costmaps use. If the user gives a robot file or a
model, its outline stays the true one, which decides about contacts.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely

from drake_navbench.inputs.check import Status
from drake_navbench.inputs.robot import ROBOT_FILES, Robot
from drake_navbench.kernels.footprint import circle_footprint, pad_footprint
from drake_navbench.nav2.node_reader import NodeReader
from drake_navbench.nav2.outline import Outline

Outlines = Sequence[tuple[NodeReader, Outline]]
# The body may reach this far beyond the costmaps' outline without a note, m: models are rounded.
TOLERANCE_M = 0.005


def costmap_body(outlines: Outlines) -> dict[str, Any]:
    """Returns the outline of a file as fields of a robot: the local costmap's, else the global's.

    Returns {} where no costmap gives one. Notes a difference of the two.
    """
    given = [(reader, outline) for reader, outline in outlines if outline.is_given]
    if not given:
        return {}
    reader, outline = given[0]
    for other_reader, other in given[1:]:
        if other != outline:
            name = _parameter(other)
            remark = "plans are made for the local costmap's outline and padding"
            if other[:2] == outline[:2]:
                name = "footprint_padding"
            other_reader.note(Status.OTHER_FORM, name, remark)
    if outline.footprint is not None:
        reader.checked(Robot, {"footprint": outline.footprint, "description": "outline"})
        return {"footprint": outline.footprint}
    reader.checked(Robot, {"robot_radius": outline.radius_m, "description": "outline"})
    return {"robot_radius": outline.radius_m}


def with_body(
    data: dict[str, Any], body: dict[str, Any], base: Robot, base_name: str
) -> dict[str, Any]:
    """Returns a base robot's fields with a file's outline for its costmaps.

    A built-in robot is a stand-in: the file's outline becomes its body, too, unless it has wheels,
    which its model places. A robot file or model of the user's keeps its own body.
    """
    is_own = base_name not in ROBOT_FILES.names
    kept = dict(data)
    for name in ("footprint", "robot_radius"):
        kept.pop(name, None)
    if is_own:
        same = all(data.get(name) == value for name, value in body.items())
        if not same or base.collision_outline is not None:
            kept["collision_outline"] = base.outline.tolist()
    elif not base.drive.has_wheels:
        kept.pop("model", None)
    return kept | body


def note_body(outlines: Outlines, robot: Robot, base_name: str) -> None:
    """Notes a difference between the robot's true outline and that of its costmaps.

    The note says how far the true outline reaches beyond the other.
    """
    if robot.collision_outline is None:
        return
    reader, outline = next(entry for entry in outlines if entry[1].is_given)
    if outline.footprint is not None:
        taken = np.array(outline.footprint, dtype=float)
    else:
        assert outline.radius_m is not None  # One of the two is given.
        taken = circle_footprint(outline.radius_m)
    padding = robot.navigation.local_costmap.footprint_padding
    padded = shapely.Polygon(pad_footprint(taken, padding))
    outside = max(padded.distance(shapely.Point(corner)) for corner in robot.outline)
    remark = f"what the costmaps take; the body of {base_name}, {_size(robot)}, touches obstacles"
    status = Status.OTHER_FORM
    if outside > TOLERANCE_M:
        remark += f", and reaches {outside:.2f} m beyond it"
        status = Status.DOUBTFUL
    reader.note(status, _parameter(outline), remark)


def _parameter(outline: Outline) -> str:
    return "footprint" if outline.footprint is not None else "robot_radius"


def _size(robot: Robot) -> str:
    length, width = np.ptp(robot.outline, axis=0)
    return f"{length:.2f} x {width:.2f} m"
