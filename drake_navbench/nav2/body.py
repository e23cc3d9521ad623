"""The body of the robot that a Nav2 file drives: the costmaps' outline, and the true one.

The outline in a Nav2 file is the one that its costmaps use. If the user gives a robot file or a
model, its outline stays the true one, which decides about touches.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely

from drake_navbench.controller import AskedSpeeds
from drake_navbench.inputs.check import Status
from drake_navbench.inputs.drive import AckermannDrive, OmnidirectionalDrive, as_omnidirectional
from drake_navbench.inputs.robot import ROBOT_FILES, Robot
from drake_navbench.nav2.node_reader import NodeReader
from drake_navbench.nav2.outline import Outline

Outlines = Sequence[tuple[NodeReader, Outline]]
# The body may reach this far beyond the costmaps' outline without a note, m: models are rounded.
TOLERANCE_M = 0.005
Fields = dict[str, Any]
# The part of a note on a body that is larger than the costmaps' outline.
REACHES = "which reaches"


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
            remark = "differs; here plans use the local costmap's outline and padding"
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
    given = next((entry for entry in outlines if entry[1].is_given), None)
    if robot.collision_outline is None or given is None:
        return
    reader, outline = given
    outside = reach_beyond_m(robot)
    remark = (
        f"used by the costmaps; what touches obstacles is the body of {base_name}, {_size(robot)}"
    )
    status = Status.OTHER_FORM
    if outside > TOLERANCE_M:
        remark += f", {REACHES} {outside:.2f} m beyond it"
        status = Status.DOUBTFUL
    if outline.remark:
        status, remark = Status.STAND_IN, f"{outline.remark}; {remark}"
    reader.note(status, _parameter(outline), remark)


def reach_beyond_m(robot: Robot) -> float:
    """Returns the reach of a robot's true outline beyond its costmaps' padded one, m."""
    padded = shapely.Polygon(robot.padded_outline)
    return float(max(padded.distance(shapely.Point(corner)) for corner in robot.outline))


def _parameter(outline: Outline) -> str:
    return "footprint" if outline.footprint is not None else "robot_radius"


def _size(robot: Robot) -> str:
    length, width = np.ptp(robot.outline, axis=0)
    return f"{length:.2f} x {width:.2f} m"


def drive_for(
    data: Fields,
    needed: Sequence[AskedSpeeds],
    base: Robot,
    base_name: str,
    *,
    spin_radps: float = 0.0,
) -> tuple[Fields, dict[str, str]]:
    """Returns the fields of a drive with the needed speeds, and a remark for each changed field.

    data: the fields of the base robot. needed: the speeds that each controller needs. spin_radps:
    the yaw rate that the spin needs. The drive becomes omnidirectional where a controller moves
    sideways. Remarks have the field's name as key.
    """
    drive = base.drive
    remarks = {}
    speeds = _speeds(needed, spin_radps, base)
    if "max_lateral_velocity_mps" in speeds and not isinstance(drive, OmnidirectionalDrive):
        data = as_omnidirectional(drive)
        remarks["type"] = f"omnidirectional, as a controller drives sideways; {base_name} is not"
    for name, value in speeds.items():
        own = getattr(drive, name, None)
        if value != own:
            has = f"{base_name} has {'none' if own is None else f'{own:g}'}"
            if name not in drive.model_fields_set:
                has = f"{base_name} gives none"
            remarks[name] = f"{value:g}, the most that the controllers ask for; {has}"
    for name, most in _accelerations(needed).items():
        own = getattr(drive, name, None)
        if own is not None and most > own:
            of = f"that of {base_name}" if name in drive.model_fields_set else "the default"
            remarks[name] = f"{own:g}, {of}, although a controller expects {most:g}"
    return {**data, **speeds}, remarks


def _speeds(needed: Sequence[AskedSpeeds], spin_radps: float, base: Robot) -> dict[str, float]:
    """Returns the largest needed limits by the drive's names.

    For a controller that needs no limit, that of the base counts.
    """
    drive = base.drive
    needed = needed or [AskedSpeeds()]
    forward = [s.max_linear_mps or drive.max_linear_velocity_mps for s in needed]
    backward = [s.min_linear_mps or 0.0 for s in needed]
    turning = [s.max_angular_radps or drive.max_angular_velocity_radps for s in needed]
    sideways = max(s.max_lateral_mps or 0.0 for s in needed)
    speeds = {
        "max_linear_velocity_mps": max(forward),
        "min_linear_velocity_mps": min(drive.min_linear_velocity_mps, *backward),
        "max_angular_velocity_radps": max(*turning, spin_radps),
    }
    if sideways > 0.0:
        speeds["max_lateral_velocity_mps"] = sideways
    elif isinstance(drive, AckermannDrive):
        del speeds["max_angular_velocity_radps"]
    return speeds


def _accelerations(needed: Sequence[AskedSpeeds]) -> dict[str, float]:
    linear = [s.linear_acceleration_mps2 or 0.0 for s in needed]
    angular = [s.angular_acceleration_radps2 or 0.0 for s in needed]
    return {
        "max_linear_acceleration_mps2": max(linear, default=0.0),
        "max_angular_acceleration_radps2": max(angular, default=0.0),
    }
