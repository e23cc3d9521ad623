"""The body of a model: its outline over the floor, its height, its wheels."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence, Set
from typing import Any, NamedTuple

import numpy as np
import shapely

from drake_navbench.inputs.descriptions.meshes import mesh_outlines
from drake_navbench.inputs.descriptions.model import Joint, Link, Model, Shape
from drake_navbench.inputs.descriptions.poses import inverse
from drake_navbench.kernels.arrays import Array

BASE_LINKS = ("base_link", "base_footprint")
# A round shape becomes a polygon with this many corners.
CIRCLE_CORNERS = 32
# Corners that lie within this of a straight edge are left out of the outline, m.
TOLERANCE_M = 1e-3
# Wheels at the same place along the robot and in height are on one axle, m; how many times larger
# the pair beside a wheel is that stands for it.
SAME_AXLE_M, LARGER = 0.01, 1.5
ENDLESS = "continuous"
TURNING = (ENDLESS, "revolute")
# Words in a joint's or link's name by which it is a wheel's or a caster's.
CASTERS = ("caster", "castor")
ROLLING = ("wheel", *CASTERS)
# Tags by which a driving plugin names its joints: left_joint, leftJoint, rear_right_joint.
DRIVEN = re.compile(r"(?i)(left|right)\w*joint$")
# A wheel's mesh is round where its length and its height differ by less than this share.
ROUND_SHARE = 0.05
# The largest upright part of an axle's unit vector.
LEVEL_AXIS = math.sqrt(0.5)


class Body(NamedTuple):
    """A robot's extent in the frame of its base link.

    base: name of the base link. outline: (K, 2) m, counter-clockwise; None where no shape tells it.
    low_m, high_m: the lowest and the highest point. role: the shapes that give the outline,
    'collisions' or 'visuals'; '' without one. left_out: remarks on shapes that could not be read.
    """

    base: str
    outline: Array | None
    low_m: float
    high_m: float
    role: str
    left_out: tuple[str, ...]


class Wheel(NamedTuple):
    """A wheel; position: centre of its tyre (3,) m in the base frame; radius_m: None: unknown.

    axle: (3,) the axis about which it turns, in the base frame.
    """

    joint: Joint
    position: Array
    radius_m: float | None
    axle: Array


def plain_name(link: str) -> str:
    """Returns a link's name without a model's name, as in SDF, or a robot's prefix before it.

    'chair::base_link' and 'robot1/base_link' are 'base_link'.
    """
    return re.split("::|/", link)[-1]


def base_of(model: Model, wanted: str | None = None) -> str:
    """Returns the name of the base link: `wanted`, base_link, base_footprint, or else the root."""
    for name in (wanted, *BASE_LINKS):
        if name is None:
            continue
        found = [link for link in model.links if plain_name(link) == name]
        if found:
            return found[0]
    children = {joint.child for joint in model.joints}
    return next((link for link in model.links if link not in children), next(iter(model.links)))


def to_base_of(model: Model, base: str) -> Array:
    """Returns the transform (4, 4) from the model's frame to that of the base link."""
    return inverse(model.links[base].pose)


def read_body(model: Model, base: str) -> Body:
    """Returns the body; shapes that cannot be read are left out and listed in it.

    The outline is the hull of the collision shapes, if the base link lies in it: else wheels alone
    may have such shapes, and it is the hull of the visual ones, if the base link lies in that.
    """
    to_base = to_base_of(model, base)
    remarks: list[str] = []
    found: Body | None = None
    for role in ("collisions", "visuals"):
        shapes: list[Shape] = [s for link in model.links.values() for s in getattr(link, role)]
        points, lows, highs, left_out = _extents(shapes, to_base)
        remarks += left_out
        hull = shapely.MultiPoint(np.vstack(points)).convex_hull if points else None
        if not isinstance(hull, shapely.Polygon):
            continue
        hull = hull.simplify(TOLERANCE_M)
        is_around = hull.contains(shapely.Point(0.0, 0.0))
        if is_around or found is None:
            outline = np.round(shapely.get_coordinates(hull.normalize())[:-1], 4)[::-1]
            found = Body(base, outline, min(lows), max(highs), role, tuple(remarks))
        if is_around:
            break
    return found or Body(base, None, 0.0, 0.0, "", tuple(remarks))


def _extents(
    shapes: Sequence[Shape], to_base: Array
) -> tuple[list[Array], list[float], list[float], list[str]]:
    """Returns points (N, 2), lowest and highest of each shape in the base frame, and remarks."""
    points, lows, highs, remarks = [], [], [], []
    for shape in shapes:
        if shape.kind in ("mesh", "plane"):
            continue
        own = shape_points(shape)
        pose = to_base @ shape.pose
        placed = own @ pose[:3, :3].T + pose[:3, 3]
        points.append(placed[:, :2])
        lows.append(float(placed[:, 2].min()))
        highs.append(float(placed[:, 2].max()))
    meshes = [shape for shape in shapes if shape.kind == "mesh"]
    there = [shape for shape in meshes if shape.mesh is not None]
    missing = dict.fromkeys(shape.uri for shape in meshes if shape.mesh is None)
    if missing:
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        remarks.append(f"left out {next(iter(missing))}{more}, no such file or package")
    for shape, answer in zip(there, mesh_outlines(there, to_base), strict=True):
        if "fault" in answer:
            remarks.append(f"left out {shape.uri}: {answer['fault']}")
            continue
        points.append(np.array(answer["corners"]))
        lows.append(answer["low"])
        highs.append(answer["high"])
    return points, lows, highs, list(dict.fromkeys(remarks))


def shape_points(shape: Shape) -> Array:
    """Returns points (N, 3) m in a shape's own frame whose convex hull is the shape."""
    size: Any = shape.size
    if shape.kind == "box":
        signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
        return signs * (0.5 * np.array(size))
    if shape.kind == "cylinder":
        return np.vstack([_circle(size[0], end * size[1]) for end in (-0.5, 0.5)])
    if shape.kind == "cone":
        return np.vstack([_circle(size[0], -0.5 * size[1]), [[0.0, 0.0, 0.5 * size[1]]]])
    if shape.kind == "sphere":
        return _ball(np.full(3, size[0]))
    if shape.kind == "ellipsoid":
        return _ball(np.array(size))
    if shape.kind == "capsule":
        ends = [np.array([0.0, 0.0, end * size[1]]) for end in (-0.5, 0.5)]
        return np.vstack([_ball(np.full(3, size[0])) + end for end in ends])
    if shape.kind == "polyline" and shape.corners is not None and len(shape.corners):
        low = np.column_stack([shape.corners, np.zeros(len(shape.corners))])
        return np.vstack([low, low + np.array([0.0, 0.0, size[0]])])
    return np.zeros((1, 3))


def _circle(radius_m: float, height_m: float) -> Array:
    angles = 2.0 * np.pi * np.arange(CIRCLE_CORNERS) / CIRCLE_CORNERS
    height = np.full_like(angles, height_m)
    return np.column_stack([radius_m * np.cos(angles), radius_m * np.sin(angles), height])


def _ball(half_axes: Array) -> Array:
    around = _circle(1.0, 0.0)
    upright, across = around[:, [0, 2, 1]], around[:, [2, 0, 1]]
    return np.vstack([around, upright, across]) * half_axes


def rolls(joint: Joint) -> bool:
    """Tells whether a joint's name is that of a wheel or a caster."""
    words = f"{joint.name} {joint.child}".lower()
    return joint.kind in TURNING and any(word in words for word in ROLLING)


def wheel_joints(model: Model, base: str) -> list[Joint]:
    """Returns the joints about a level axis of links called wheels, casters left out.

    A joint that a plugin drives on the left or right is one, whatever its link is called; so is a
    joint without limits whose speed ros2_control commands.
    """
    turn = to_base_of(model, base)[:3, :3]
    driven, spun = _driven_joints(model), _spun_joints(model)
    joints = []
    for joint in model.joints:
        name = joint.child.lower()
        if joint.kind not in TURNING or joint.child not in model.links:
            continue
        axis = turn @ joint.axis
        is_level = abs(axis[2]) <= LEVEL_AXIS * float(np.linalg.norm(axis))
        is_driven = _is_named(joint, driven) or (joint.kind == ENDLESS and joint.name in spun)
        is_wheel = "wheel" in name and not any(word in name for word in CASTERS)
        if is_level and (is_driven or is_wheel):
            joints.append(joint)
    return joints


def held_wheels(model: Model) -> list[str]:
    """Returns the names of fixed joints that a plugin is to turn as wheels."""
    driven = _driven_joints(model)
    return [j.name for j in model.joints if j.kind == "fixed" and _is_named(j, driven)]


def _driven_joints(model: Model) -> set[str]:
    """Returns the names by which plugins call the joints that they drive on the left or right."""
    parts = [part for plugin in model.plugins for part in plugin.element.iter()]
    return {(part.text or "").strip() for part in parts if DRIVEN.search(part.tag)}


def _is_named(joint: Joint, names: Set[str]) -> bool:
    """Tells whether a joint is among names, which leave out the model's name before it."""
    return joint.name.rpartition("::")[2] in names


def _spun_joints(model: Model) -> set[str]:
    """Returns the names of the joints that ros2_control commands by their speed."""
    blocks = [plugin.element for plugin in model.plugins if plugin.name == "ros2_control"]
    return {
        joint.get("name", "")
        for block in blocks
        for joint in block.iter("joint")
        if any(command.get("name") == "velocity" for command in joint.iter("command_interface"))
    }


def wheels_of(model: Model, base: str) -> list[Wheel]:
    """Returns the wheels near the floor: each at its tyre or, without a shape, at its link."""
    to_base = to_base_of(model, base)
    wheels = []
    for joint in wheel_joints(model, base):
        link = model.links[joint.child]
        tyre = _round_tyre(link, to_base) or _mesh_tyre(link, to_base)
        position, radius_m = tyre or ((to_base @ link.pose)[:3, 3], None)
        wheels.append(Wheel(joint, position, radius_m, to_base[:3, :3] @ joint.axis))
    wheels = _near_the_floor(wheels)
    return [wheel for wheel in wheels if not _is_virtual(wheel, wheels)]


def _is_virtual(wheel: Wheel, wheels: Sequence[Wheel]) -> bool:
    """Tells whether a wheel hangs over the floor in the middle between two larger ones.

    Controllers of cars drive and steer such a wheel in place of the pair beside it.
    """
    larger = [
        other
        for other in wheels
        if other.radius_m is not None
        and wheel.radius_m is not None
        and other.radius_m > LARGER * wheel.radius_m
        and np.allclose(other.position[[0, 2]], wheel.position[[0, 2]], atol=SAME_AXLE_M)
    ]
    across = [other.position[1] - wheel.position[1] for other in larger]
    return len(across) == 2 and abs(sum(across)) < SAME_AXLE_M


def _near_the_floor(wheels: Sequence[Wheel]) -> list[Wheel]:
    """Returns the wheels but those above all of the lowest axle, such as a driver's wheel.

    A wheel of unknown radius counts as large as the largest known one.
    """
    lowest_m = min((wheel.position[2] for wheel in wheels), default=0.0)
    radii = [wheel.radius_m for wheel in wheels if wheel.radius_m is not None]
    most = max(radii, default=np.inf)
    return [
        wheel
        for wheel in wheels
        if wheel.position[2] - (most if wheel.radius_m is None else wheel.radius_m) <= lowest_m
    ]


def turning_centre(model: Model, wheels: Sequence[Wheel]) -> Array | None:
    """Returns the middle of the wheels that neither steer nor swivel, (2,) m; None without any."""
    turned = {joint.child for joint in model.joints if joint.kind in TURNING}
    places = [wheel.position[:2] for wheel in wheels if carrier_of(model, wheel) not in turned]
    return np.mean(places, axis=0) if places else None


def carrier_of(model: Model, wheel: Wheel) -> str:
    """Returns the link that carries a wheel: the first one above that is fixed to no other."""
    above = {joint.child: joint.parent for joint in model.joints if joint.kind == "fixed"}
    link = wheel.joint.parent
    for _ in above:
        link = above.get(link, link)
    return link


def _round_tyre(link: Link, to_base: Array) -> tuple[Array, float] | None:
    """Returns centre (3,) and radius of a wheel's largest cylinder, sphere or box; None without.

    A box is a tyre if its two longest sides are equal.
    """
    for shapes in (link.collisions, link.visuals):
        tyres = [(radius_m, s) for s in shapes if (radius_m := _tyre_radius(s)) > 0.0]
        if tyres:
            radius_m, tyre = max(tyres, key=lambda pair: pair[0])
            return (to_base @ tyre.pose)[:3, 3], radius_m
    return None


def _tyre_radius(shape: Shape) -> float:
    if shape.kind in ("cylinder", "sphere"):
        return float(shape.size[0])
    middle, longest = sorted(shape.size)[1:] if shape.kind == "box" else (0.0, 1.0)
    return 0.5 * float(longest) if longest - middle < ROUND_SHARE * longest else 0.0


def _mesh_tyre(link: Link, to_base: Array) -> tuple[Array, float] | None:
    """Returns centre (3,) and radius of a wheel's mesh, if it is as high as long; else None."""
    for shape in (*link.collisions, *link.visuals):
        if shape.kind != "mesh" or shape.mesh is None:
            continue
        answer = mesh_outlines([shape], to_base)[0]
        if "fault" in answer:
            continue
        corners = np.array(answer["corners"])
        height_m = answer["high"] - answer["low"]
        long_m, wide_m = sorted(np.ptp(corners, axis=0), reverse=True)
        # A wheel is as long as high; in a turned box neither side is its length.
        if abs(height_m - long_m) < ROUND_SHARE * height_m and wide_m <= height_m:
            middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
            centre = np.array([*middle, 0.5 * (answer["low"] + answer["high"])])
            return centre, 0.5 * float(height_m)
    return None


def floor_of(model: Model, body: Body, wheels: Sequence[Wheel]) -> float:
    """Returns the height of the floor in the base frame, m.

    That is the lowest point of the wheels, else the base_footprint, else the body's lowest point.
    """
    ends = [w.position[2] - w.radius_m for w in wheels if w.radius_m is not None]
    if ends:
        return float(min(ends))
    footprint = [n for n in model.links if plain_name(n) == "base_footprint"]
    if footprint:
        pose = to_base_of(model, body.base) @ model.links[footprint[0]].pose
        return float(pose[2, 3])
    return body.low_m
