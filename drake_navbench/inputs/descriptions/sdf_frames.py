"""The frames of one SDF model, and its joints and inertias in them."""

from __future__ import annotations

import math
from xml.etree import ElementTree

import numpy as np

from drake_navbench.inputs.descriptions.model import Joint
from drake_navbench.inputs.descriptions.poses import moved_inertia, number, numbers, pose_of
from drake_navbench.inputs.descriptions.xml_file import text_of
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.quaternions import rotation_of

MODEL_FRAMES = ("", "__model__", "world")
PLACED = ("link", "frame", "model", "joint")
MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
TRUE = ("1", "true", "True")


class Frames:
    """The poses of a model's named parts in the model's frame.

    unknown: names that the model lacks although poses are relative to them; such poses count as
    relative to the model.
    """

    def __init__(self, model: ElementTree.Element) -> None:
        self._elements: dict[str, ElementTree.Element] = {}
        for element in model:
            if element.tag in PLACED and element.get("name"):
                self._elements.setdefault(str(element.get("name")), element)
        self._poses: dict[str, Array] = {}
        self._pending: set[str] = set()
        self.unknown: set[str] = set()

    def add(self, name: str, pose: Array) -> None:
        """Adds a frame at a pose in the model's frame."""
        self._poses[name] = pose

    def pose_of(self, element: ElementTree.Element, default: str = "") -> Array:
        """Returns the pose of an element in the model's frame.

        default: the frame to which its pose is relative if it names none.
        """
        pose = element.find("pose")
        own = np.eye(4) if pose is None else pose_element(pose)
        said = None if pose is None else pose.get("relative_to") or pose.get("frame")
        return self.of(said or default) @ own

    def of(self, name: str) -> Array:
        """Returns the pose of a named part in the model's frame."""
        if name in MODEL_FRAMES:
            return np.eye(4)
        if name in self._poses:
            return self._poses[name]
        element = self._elements.get(name)
        if element is None or name in self._pending:
            self.unknown.add(name)
            return np.eye(4)
        self._pending.add(name)
        default = ""
        if element.tag == "joint":
            default = text_of(element, "child") or ""
        elif element.tag == "frame":
            default = element.get("attached_to", "")
        pose = self.pose_of(element, default)
        self._pending.discard(name)
        self._poses[name] = pose
        return pose


def pose_element(element: ElementTree.Element) -> Array:
    """Returns the pose in the text of a <pose>."""
    values = numbers(element.text, 6)
    if element.get("degrees") in ("true", "1"):
        values[3:] = [float(np.radians(value)) for value in values[3:]]
    if element.get("rotation_format") == "quat_xyzw":
        return _pose_of_quaternion(numbers(element.text, 7))
    return pose_of(values)


def _pose_of_quaternion(values: list[float]) -> Array:
    pose = np.eye(4)
    pose[:3, :3] = rotation_of(*values[3:7])
    pose[:3, 3] = values[:3]
    return pose


def joint_of(element: ElementTree.Element, frames: Frames, pose: Array, prefix: str) -> Joint:
    """Returns a <joint>; pose: (4, 4) of the <model> around it. prefix: begins the names in it."""
    child = text_of(element, "child") or ""
    place = pose @ frames.pose_of(element, child)
    low, high = (number(text_of(element, f"axis/limit/{end}")) for end in ("lower", "upper"))
    return Joint(
        prefix + element.get("name", ""),
        element.get("type", "fixed"),
        prefix + (text_of(element, "parent") or ""),
        prefix + child,
        place,
        _axis(element, frames, pose, place),
        number(text_of(element, "axis/limit/velocity")),
        (-math.inf if low is None else low, math.inf if high is None else high),
        max(number(text_of(element, "axis/dynamics/damping")) or 0.0, 0.0),
    )


def _axis(element: ElementTree.Element, frames: Frames, pose: Array, place: Array) -> Array:
    """Returns a joint's axis (3,); place: (4, 4) of the joint, the axis' default frame."""
    direction = element.find("axis/xyz")
    said = None if direction is None else direction.get("expressed_in")
    if said is None and text_of(element, "axis/use_parent_model_frame") in TRUE:
        said = "__model__"
    turned = place if said is None else pose @ frames.of(said)
    axis: Array = turned[:3, :3] @ np.array(numbers(text_of(element, "axis/xyz") or "0 0 1", 3))
    return axis


def inertia_of(link: ElementTree.Element) -> tuple[Array, Array]:
    """Returns a <link>'s centre of mass (3,) and the inertia (3, 3) about it, in its own frame."""
    inertial = link.find("inertial")
    pose = np.eye(4) if inertial is None else Frames(inertial).pose_of(inertial)
    moments = [number(text_of(inertial, f"inertia/{name}")) or 0.0 for name in MOMENTS]
    return pose[:3, 3], moved_inertia(pose, moments)
