"""URDF as a model: every link placed by the joints above it, arms where a file lets them rest."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np

from drake_navbench.inputs.descriptions.model import Joint, Link, Model, Plugin, Sensor, Shape
from drake_navbench.inputs.descriptions.poses import (
    moved_inertia,
    number,
    numbers,
    pose_of,
    turned_about,
)
from drake_navbench.inputs.descriptions.resting_joints import resting_joints
from drake_navbench.inputs.descriptions.ros_packages import Packages
from drake_navbench.inputs.descriptions.xml_file import text_of
from drake_navbench.kernels.arrays import Array

FIXED = "fixed"
# The kinds of joints without limits of their angle.
ENDLESS = "continuous"
KINDS = (FIXED, ENDLESS, "revolute", "prismatic", "floating", "planar")
MOST_TOLD = 5
MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def read_urdf(root: ElementTree.Element, packages: Packages) -> Model:
    """Returns the model of a <robot>."""
    model = Model(root.get("name") or "robot", resting=resting_joints(root, packages))
    joints = [joint for joint in root.findall("joint") if joint.get("type")]
    above = {_link_of(joint, "child"): joint for joint in joints}
    poses: dict[str, Array] = {}
    elements = {str(link.get("name")): link for link in root.findall("link")}
    colours = {
        str(material.get("name")): colour
        for material in root.iter("material")
        if (colour := _colour(material)) is not None
    }
    for name, element in elements.items():
        pose = _pose_of_link(name, above, poses, model)
        model.links[name] = _link(name, element, pose, packages, colours)
    model.joints += [_joint(joint, poses) for joint in joints]
    model.remarks += [*_repeated(root), *_loose(joints, elements)]
    _read_gazebo(root, model, poses)
    return model


def _repeated(root: ElementTree.Element) -> list[str]:
    """Returns a remark on the names that several links or joints have; none without such."""
    counts = Counter(
        (kind, part.get("name")) for kind in ("link", "joint") for part in root.findall(kind)
    )
    named = [f"{kind} {name}" for (kind, name), count in counts.items() if count > 1]
    if not named:
        return []
    return [f"{', '.join(named)}: described more than once, which ROS refuses; the last one counts"]


def _loose(joints: Sequence[ElementTree.Element], links: Collection[str]) -> list[str]:
    """Returns a remark on each joint of an unknown type, or between links that are not there."""
    told = []
    for joint in joints:
        name, kind = joint.get("name", ""), joint.get("type", "")
        if kind not in KINDS:
            told.append(f"joint {name}: type {kind!r} is none of URDF's; taken as fixed")
        for end in ("parent", "child"):
            if _link_of(joint, end) not in links:
                told.append(f"joint {name}: its {end} link {_link_of(joint, end)!r} is not there")
    return told[:MOST_TOLD]


def _joint(joint: ElementTree.Element, poses: Mapping[str, Array]) -> Joint:
    child = _link_of(joint, "child")
    pose = poses.get(child, np.eye(4))
    limit, dynamics = joint.find("limit"), joint.find("dynamics")
    kind = joint.get("type", FIXED)
    low, high = (
        None if limit is None or kind == ENDLESS else number(limit.get(end))
        for end in ("lower", "upper")
    )
    damping = None if dynamics is None else number(dynamics.get("damping"))
    return Joint(
        joint.get("name", ""),
        kind,
        _link_of(joint, "parent"),
        child,
        pose,
        pose[:3, :3] @ _axis(joint),
        None if limit is None else number(limit.get("velocity")),
        (-math.inf if low is None else low, math.inf if high is None else high),
        max(damping or 0.0, 0.0),
    )


def _colour(material: ElementTree.Element) -> tuple[float, ...] | None:
    colour = material.find("color")
    return None if colour is None else tuple(numbers(colour.get("rgba"), 4, 1.0))


def _link_of(joint: ElementTree.Element, end: str) -> str:
    found = joint.find(end)
    return "" if found is None else found.get("link", "")


def _pose_of_link(
    name: str, above: dict[str, ElementTree.Element], poses: dict[str, Array], model: Model
) -> Array:
    """Returns a link's pose below the root; in a loop of joints, that of the loop's start."""
    chain: list[str] = []
    while name in above and name not in poses:
        if name in chain:
            model.remarks.append(f"link {name}: hangs on itself; where it is is not known")
            break
        chain.append(name)
        name = _link_of(above[name], "parent")
    pose = poses.setdefault(name, np.eye(4))
    for link in reversed(chain):
        joint = above[link]
        value = model.resting.positions.get(joint.get("name", ""), 0.0)
        pose = pose @ _origin(joint)
        if value:
            pose = pose @ _motion(joint, value)
        poses[link] = pose
    return pose


def _motion(joint: ElementTree.Element, value: float) -> Array:
    """Returns the pose (4, 4) of a joint's child at a position, rad or m, from that at zero."""
    axis = _axis(joint)
    if joint.get("type") == "prismatic":
        moved = np.eye(4)
        moved[:3, 3] = value * axis
        return moved
    return turned_about(axis, value)


def _axis(joint: ElementTree.Element) -> Array:
    """Returns a joint's axis (3,) in its own frame."""
    axis = joint.find("axis")
    return np.array(numbers("1 0 0" if axis is None else axis.get("xyz"), 3))


def _origin(element: ElementTree.Element) -> Array:
    found = element.find("origin")
    if found is None:
        return np.eye(4)
    return pose_of(numbers(found.get("xyz"), 3) + numbers(found.get("rpy"), 3))


def _link(
    name: str,
    element: ElementTree.Element,
    pose: Array,
    packages: Packages,
    colours: Mapping[str, tuple[float, ...]],
) -> Link:
    inertial = element.find("inertial")
    mass = element.find("inertial/mass")
    inertia = element.find("inertial/inertia")
    center = np.eye(4) if inertial is None else _origin(inertial)
    moments = [0.0 if inertia is None else number(inertia.get(m)) or 0.0 for m in MOMENTS]
    return Link(
        name,
        pose,
        (None if mass is None else number(mass.get("value"))) or 0.0,
        _shapes(element, "collision", pose, packages, colours),
        _shapes(element, "visual", pose, packages, colours),
        center[:3, 3],
        moved_inertia(center, moments),
    )


def _shapes(
    link: ElementTree.Element,
    role: str,
    pose: Array,
    packages: Packages,
    colours: Mapping[str, tuple[float, ...]],
) -> tuple[Shape, ...]:
    found = []
    for element in link.findall(role):
        geometry = element.find("geometry")
        shape = None if geometry is None or not len(geometry) else geometry[0]
        if shape is not None:
            read = _shape(shape, pose @ _origin(element), packages)
            material = element.find("material")
            colour = None if material is None else colours.get(str(material.get("name")))
            if material is not None:
                colour = _colour(material) or colour
            if read is not None:
                found.append(replace(read, name=element.get("name", ""), colour=colour))
    return tuple(found)


def _shape(element: ElementTree.Element, pose: Array, packages: Packages) -> Shape | None:
    def given(name: str) -> float:
        return number(element.get(name)) or 0.0

    if element.tag == "box":
        return Shape("box", pose, tuple(numbers(element.get("size"), 3)))
    if element.tag in ("cylinder", "capsule", "cone"):
        return Shape(element.tag, pose, (given("radius"), given("length")))
    if element.tag == "sphere":
        return Shape("sphere", pose, (given("radius"),))
    if element.tag == "mesh":
        uri = element.get("filename", "").strip()
        scale = element.get("scale")
        size = tuple(numbers(scale, 3, 1.0)) if scale else (1.0, 1.0, 1.0)
        return Shape("mesh", pose, size, mesh=packages.place(uri) if uri else None, uri=uri)
    return None


def _read_gazebo(root: ElementTree.Element, model: Model, poses: dict[str, Array]) -> None:
    """Reads the sensors and plugins in <gazebo> and <ros2_control>."""
    for gazebo in root.findall("gazebo"):
        link = gazebo.get("reference", "")
        place = poses.get(link, np.eye(4))
        for sensor in gazebo.findall("sensor"):
            if link and link not in poses:
                name = sensor.get("name", "")
                model.remarks.append(f"left out the sensor {name}: the model has no link {link}")
                continue
            own = pose_of(numbers(text_of(sensor, "pose"), 6))
            kind = sensor.get("type", "")
            model.sensors.append(Sensor(sensor.get("name", ""), kind, place @ own, sensor))
        for plugin in gazebo.findall("plugin"):
            name = f"{plugin.get('filename', '')} {plugin.get('name', '')}"
            model.plugins.append(Plugin(name, plugin))
    for control in root.findall("ros2_control"):
        model.plugins.append(Plugin("ros2_control", control))
