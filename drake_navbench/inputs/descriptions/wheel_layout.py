"""A model's wheels: how they stand, which of them steer, and how the base turns with them."""

from __future__ import annotations

import math
from collections.abc import Sequence, Set

import numpy as np

from drake_navbench.inputs.descriptions.body import TURNING, Wheel, carrier_of, turning_centre
from drake_navbench.inputs.descriptions.control_files import command_limits
from drake_navbench.inputs.descriptions.drive_kinds import (
    ACKERMANN,
    DIFFERENTIAL,
    OMNIDIRECTIONAL,
    STEERING,
    FoundDrive,
)
from drake_navbench.inputs.descriptions.model import Joint, Model
from drake_navbench.kernels.arrays import Array

LEAST = 1e-3
# The least vertical part of the unit vector along the axis of a joint that steers.
UPRIGHT = 0.9
# The largest distance, across its axle, of a steered wheel from its steering axis, m.
TRAIL_M = 0.01
# The cosine of the angle, 15 degrees, below which two axles count as parallel.
SAME_AXLE = math.cos(math.radians(15.0))


def drive_by_wheels(model: Model, wheels: Sequence[Wheel]) -> FoundDrive:
    """Returns the kind of drive that a model's wheels suggest; '' for fewer than two."""
    names = [f"{model.name} {w.joint.child}".lower() for w in wheels]
    # Two driven wheels with an omni wheel as their caster are a differential base.
    is_mecanum = len(names) >= 3 and all("mecanum" in n or "omni" in n for n in names)
    steered = {joint.child for joint in _steering_joints(model, wheels)}
    is_omni = is_mecanum or (not steered and _roll_sideways(wheels)) or _all_turn(model, wheels)
    kind = OMNIDIRECTIONAL if is_omni else DIFFERENTIAL if len(wheels) >= 2 else ""
    if steered and any(carrier_of(model, w) not in steered for w in wheels):
        kind = ACKERMANN
    source = f"{len(wheels)} wheels" if wheels else ""
    may_roll_sideways = kind == DIFFERENTIAL and len(wheels) > 2
    return FoundDrive(kind, source, {}, is_guess=True, may_roll_sideways=may_roll_sideways)


def _steering_joints(model: Model, wheels: Sequence[Wheel]) -> list[Joint]:
    """Returns the joints that steer a wheel: upright, by less than a quarter of a turn."""
    carried = {carrier_of(model, w) for w in wheels}
    return [
        joint
        for joint in model.joints
        if joint.kind in TURNING
        and joint.child in carried
        and _is_upright(joint)
        and max(-joint.range_rad[0], joint.range_rad[1]) < 0.5 * math.pi
    ]


def _is_upright(joint: Joint) -> bool:
    return bool(abs(joint.axis[2]) > UPRIGHT * np.linalg.norm(joint.axis))


def _all_turn(model: Model, wheels: Sequence[Wheel]) -> bool:
    """Tells whether three or more wheels each turn by half a turn or more, as in a swerve drive.

    Such a wheel stands under its upright joint; a caster's wheel trails behind it.
    """
    uprights = {
        joint.child: joint
        for joint in model.joints
        if joint.kind in TURNING
        and _is_upright(joint)
        and joint.range_rad[1] - joint.range_rad[0] >= math.pi
    }
    for wheel in wheels:
        upright = uprights.get(carrier_of(model, wheel))
        if upright is None:
            return False
        axle = wheel.joint.axis / float(np.linalg.norm(wheel.joint.axis))
        offset = model.links[wheel.joint.child].pose[:3, 3] - upright.pose[:3, 3]
        if np.hypot(*(offset - (offset @ axle) * axle)[:2]) > TRAIL_M:
            return False
    return len(wheels) >= 3


def _roll_sideways(wheels: Sequence[Wheel]) -> bool:
    """Tells whether wheels that do not steer point as only omni wheels can.

    Their axles have three directions, or two with two wheels each.
    """
    counts: list[tuple[Array, int]] = []
    for wheel in wheels:
        axle = wheel.joint.axis / float(np.linalg.norm(wheel.joint.axis))
        place = next((n for n, (o, _) in enumerate(counts) if abs(axle @ o) > SAME_AXLE), None)
        if place is None:
            counts.append((axle, 1))
        else:
            counts[place] = (counts[place][0], counts[place][1] + 1)
    return len(counts) >= 3 or (len(counts) == 2 and min(count for _, count in counts) >= 2)


def roll_along_y(wheels: Sequence[Wheel]) -> bool:
    """Tells whether all wheels roll along y of the base frame, whose x is forward in ROS.

    Programs for drawing leave a robot's axes as they were drawn.
    """
    return bool(wheels) and all(abs(wheel.axle[0]) > abs(wheel.axle[1]) for wheel in wheels)


def add_turning(
    values: dict[str, float], model: Model, wheels: Sequence[Wheel], named: Set[str]
) -> None:
    """Adds wheelbase, least turning radius and rear axle, by the wheels and their steering joints.

    The base turns about a point on the axle of the wheels that are not steered or, where no joint
    steers, on the rearmost axle. named: joints that a plugin steers, whatever their range.
    """
    along = [float(w.position[0]) for w in wheels]
    if along and max(along) - min(along) > LEAST:
        values.setdefault("wheelbase_m", max(along) - min(along))
    steering = _steering_joints(model, wheels) or [j for j in model.joints if j.name in named]
    steered = {joint.child for joint in steering}
    fixed = [w for w in wheels if steered.isdisjoint((carrier_of(model, w), w.joint.child))]
    centre = turning_centre(model, fixed)
    if steering and centre is not None:
        values["rear_axle_x_m"] = float(centre[0])
    elif "wheelbase_m" in values and len(along) >= 3:
        values["rear_axle_x_m"] = min(along)
    bounds = [min(-j.range_rad[0], j.range_rad[1]) for j in steering]
    bounds += command_limits(model, steering, "position")
    limit, wheelbase = values.pop(STEERING, min(bounds, default=0.0)), values.get("wheelbase_m")
    if wheelbase and 0.0 < limit < 0.5 * math.pi:
        values["min_turning_radius_m"] = wheelbase / math.tan(limit)
