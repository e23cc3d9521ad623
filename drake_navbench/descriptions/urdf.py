"""URDF as a model: every link placed by the joints above it, all joints at zero."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from drake_navbench.descriptions.model import Joint, Link, Model, Plugin, Sensor, Shape
from drake_navbench.descriptions.poses import number, numbers, pose_of
from drake_navbench.descriptions.xml_file import text_of
from drake_navbench.typed_files.ros_packages import Packages

Array = NDArray[np.float64]

FIXED = "fixed"


def read_urdf(root: ElementTree.Element, packages: Packages) -> Model:
    """Returns the model of a <robot>."""
    model = Model(root.get("name") or "robot")
    joints = [joint for joint in root.findall("joint") if joint.get("type")]
    above = {_link_of(joint, "child"): joint for joint in joints}
    poses: dict[str, Array] = {}
    elements = {str(link.get("name")): link for link in root.findall("link")}
    for name, element in elements.items():
        pose = _pose_of_link(name, above, poses, model)
        model.links[name] = _link(name, element, pose, packages)
    for joint in joints:
        child = _link_of(joint, "child")
        axis = joint.find("axis")
        turned = poses.get(child, np.eye(4))[:3, :3]
        limit = joint.find("limit")
        model.joints.append(
            Joint(
                joint.get("name", ""),
                joint.get("type", FIXED),
                _link_of(joint, "parent"),
                child,
                turned @ np.array(numbers("1 0 0" if axis is None else axis.get("xyz"), 3)),
                None if limit is None else number(limit.get("velocity")),
            )
        )
    _read_gazebo(root, model, poses)
    return model


def _link_of(joint: ElementTree.Element, end: str) -> str:
    found = joint.find(end)
    return "" if found is None else found.get("link", "")


def _pose_of_link(
    name: str, above: dict[str, ElementTree.Element], poses: dict[str, Array], model: Model
) -> Array:
    """Returns the pose of a link below the root; that of a loop of joints is where it begins."""
    chain: list[str] = []
    while name in above and name not in poses:
        if name in chain:
            model.remarks.append(f"link {name}: hangs on itself; where it is is not known")
            break
        chain.append(name)
        name = _link_of(above[name], "parent")
    pose = poses.setdefault(name, np.eye(4))
    for link in reversed(chain):
        pose = pose @ _origin(above[link])
        poses[link] = pose
    return pose


def _origin(element: ElementTree.Element) -> Array:
    found = element.find("origin")
    if found is None:
        return np.eye(4)
    return pose_of(numbers(found.get("xyz"), 3) + numbers(found.get("rpy"), 3))


def _link(name: str, element: ElementTree.Element, pose: Array, packages: Packages) -> Link:
    mass = element.find("inertial/mass")
    return Link(
        name,
        pose,
        (None if mass is None else number(mass.get("value"))) or 0.0,
        _shapes(element, "collision", pose, packages),
        _shapes(element, "visual", pose, packages),
    )


def _shapes(
    link: ElementTree.Element, role: str, pose: Array, packages: Packages
) -> tuple[Shape, ...]:
    found = []
    for element in link.findall(role):
        geometry = element.find("geometry")
        shape = None if geometry is None or not len(geometry) else geometry[0]
        if shape is not None:
            read = _shape(shape, pose @ _origin(element), packages)
            found += [] if read is None else [read]
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
    """Reads what stands in <gazebo> and <ros2_control>: sensors and plugins."""
    for gazebo in root.findall("gazebo"):
        place = poses.get(gazebo.get("reference", ""), np.eye(4))
        for sensor in gazebo.findall("sensor"):
            own = pose_of(numbers(text_of(sensor, "pose"), 6))
            kind = sensor.get("type", "")
            model.sensors.append(Sensor(sensor.get("name", ""), kind, place @ own, sensor))
        for plugin in gazebo.findall("plugin"):
            name = f"{plugin.get('filename', '')} {plugin.get('name', '')}"
            model.plugins.append(Plugin(name, plugin))
    for control in root.findall("ros2_control"):
        model.plugins.append(Plugin("ros2_control", control))
