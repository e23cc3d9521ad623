"""Joints and inertias of SDF, in the frame of their model."""

from __future__ import annotations

import math
from xml.etree import ElementTree

import numpy as np

from drake_navbench.descriptions.model import Array, Joint
from drake_navbench.descriptions.poses import moved_inertia, number, numbers
from drake_navbench.descriptions.sdf_frames import Frames
from drake_navbench.descriptions.xml_file import text_of

MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
TRUE = ("1", "true", "True")


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
