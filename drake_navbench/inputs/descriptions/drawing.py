"""A model as a small SDF that Drake reads, for replays: what is seen, and wheels that turn."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from hashlib import sha256
from pathlib import Path
from xml.etree import ElementTree

from drake_navbench.inputs.descriptions.body import rolls, to_base_of
from drake_navbench.inputs.descriptions.model import Joint, Link, Model, Shape
from drake_navbench.inputs.descriptions.poses import inverse
from drake_navbench.kernels.arrays import Array
from drake_navbench.processes.cache_folder import user_cache_folder
from drake_navbench.typed_files.output_file import write_text

BASE = "base_link"
# Shapes with this prefix take the controller's colour in a replay.
TINTED = "upholstery"
FOLDER = "drawn_models"
SIZES = {
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "sphere": ("radius",),
}


def write_drawing(model: Model, base: str, floor_m: float) -> Path:
    """Writes the drawing into the user's cache, named by its content; returns the file.

    base: the link of the base frame; the drawing's base_link is that frame, moved to the floor.
    floor_m: height of the floor in the base frame. Raises CannotBeWritten where the cache cannot
    be written.
    """
    text = drawing_of(model, base, floor_m)
    file = user_cache_folder() / FOLDER / f"{sha256(text.encode()).hexdigest()[:24]}.sdf"
    if not file.is_file():
        write_text(file, text)
    return file


def is_drawing(path: Path) -> bool:
    """Tells whether a file is a drawing in the user's cache."""
    return path.absolute().parent == (user_cache_folder() / FOLDER).absolute()


def drawing_of(model: Model, base: str, floor_m: float) -> str:
    """Returns the text of the drawing."""
    root = ElementTree.Element("sdf", version="1.8")
    drawn = ElementTree.SubElement(root, "model", name="robot")
    ElementTree.SubElement(drawn, "link", name=BASE)
    to_base = to_base_of(model, base)
    to_base[2, 3] -= floor_m
    rolling = {joint.child: joint for joint in model.joints if rolls(joint)}
    names = {name: f"link_{index}" for index, name in enumerate(model.links)}
    for name, link in model.links.items():
        element = ElementTree.SubElement(drawn, "link", name=names[name])
        ElementTree.SubElement(element, "pose").text = _pose_text(to_base @ link.pose)
        for visual in _visuals(link, is_tinted=name == base):
            element.append(visual)
        drawn.append(_joint(names, name, rolling, to_base))
    return ElementTree.tostring(root, encoding="unicode")


def _joint(
    names: Mapping[str, str], name: str, rolling: Mapping[str, Joint], to_base: Array
) -> ElementTree.Element:
    """Returns the joint of a link: on its caster's fork, or directly on the base."""
    joint = rolling.get(name)
    kind = "fixed" if joint is None else "continuous"
    element = ElementTree.Element("joint", name=f"joint_{names[name]}", type=kind)
    parent = joint.parent if joint is not None and joint.parent in rolling else None
    ElementTree.SubElement(element, "parent").text = names.get(parent or "", BASE)
    ElementTree.SubElement(element, "child").text = names[name]
    if joint is not None:
        axis = ElementTree.SubElement(element, "axis")
        direction = to_base[:3, :3] @ joint.axis
        xyz = ElementTree.SubElement(axis, "xyz", expressed_in="__model__")
        xyz.text = " ".join(f"{value:.9g}" for value in direction)
    return element


def _visuals(link: Link, *, is_tinted: bool) -> Iterator[ElementTree.Element]:
    for index, shape in enumerate(link.shown):
        geometry = _geometry(shape)
        if geometry is None:
            continue
        name = f"{TINTED if is_tinted else 'part'}_{index}"
        visual = ElementTree.Element("visual", name=name)
        pose = ElementTree.SubElement(visual, "pose")
        pose.text = _pose_text(inverse(link.pose) @ shape.pose)
        visual.append(geometry)
        if shape.colour is not None:
            material = ElementTree.SubElement(visual, "material")
            colour = " ".join(f"{value:g}" for value in shape.colour)
            ElementTree.SubElement(material, "diffuse").text = colour
        yield visual


def _geometry(shape: Shape) -> ElementTree.Element | None:
    """Returns a shape's geometry; None for a shape that cannot be drawn."""
    if shape.kind != "mesh" and (not shape.size or min(shape.size) <= 0.0):
        return None
    geometry = ElementTree.Element("geometry")
    element = ElementTree.SubElement(geometry, shape.kind)
    numbers = [f"{value:.9g}" for value in shape.size]
    if shape.kind == "box":
        ElementTree.SubElement(element, "size").text = " ".join(numbers)
    elif shape.kind == "ellipsoid":
        ElementTree.SubElement(element, "radii").text = " ".join(numbers)
    elif shape.kind in SIZES:
        for key, value in zip(SIZES[shape.kind], numbers, strict=True):
            ElementTree.SubElement(element, key).text = value
    elif shape.kind == "mesh" and shape.mesh is not None:
        ElementTree.SubElement(element, "uri").text = f"file://{shape.mesh.absolute()}"
        ElementTree.SubElement(element, "scale").text = " ".join(numbers)
        if shape.submesh:
            submesh = ElementTree.SubElement(element, "submesh")
            ElementTree.SubElement(submesh, "name").text = shape.submesh
            ElementTree.SubElement(submesh, "center").text = str(int(shape.is_centred))
    else:
        return None
    return geometry


def _pose_text(pose: Array) -> str:
    """Returns a pose as SDF's x y z roll pitch yaw."""
    roll = math.atan2(pose[2, 1], pose[2, 2])
    pitch = math.asin(max(-1.0, min(1.0, -float(pose[2, 0]))))
    yaw = math.atan2(pose[1, 0], pose[0, 0])
    return " ".join(f"{value:.9g}" for value in (*pose[:3, 3], roll, pitch, yaw))
