"""A world of Gazebo as plain data: its models, its actors, and the parts left out."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

from drake_navbench.errors import InputError
from drake_navbench.inputs.descriptions.gazebo_drive import has_drive
from drake_navbench.inputs.descriptions.model import Model
from drake_navbench.inputs.descriptions.number_texts import is_far, number_remarks
from drake_navbench.inputs.descriptions.poses import FARTHEST_M, number, numbers
from drake_navbench.inputs.descriptions.ros_packages import Packages
from drake_navbench.inputs.descriptions.sdf import SdfReader, placement
from drake_navbench.inputs.descriptions.sdf_frames import Frames, pose_element
from drake_navbench.inputs.descriptions.xacro_file import XACRO, expand_xacro
from drake_navbench.inputs.descriptions.xml_file import read_xml, text_of
from drake_navbench.kernels.arrays import Array
from drake_navbench.typed_files.input_file import MEGABYTE, read_head, read_input, require_utf_8

MAX_FILE_BYTES = 64 * MEGABYTE
WORLD_SUFFIXES = (".world", ".sdf")
WEBOTS = ".wbt"
WORLD_TAG = re.compile(rb"<world\b")
# The bytes of a file that are searched for a world.
HEAD_BYTES = MEGABYTE
# Models that every world includes and nobody touches.
NOTHING_STANDS = ("sun", "ground_plane", "ground")
TEMPLATE = re.compile(rb"<%|\{%|@\[|@\(")


@dataclass(frozen=True)
class Actor:
    """A person on a trajectory; knots: (K, 3) time s, x m, y m."""

    name: str
    knots: tuple[tuple[float, float, float], ...]
    repeats: bool


@dataclass
class WorldSource:
    """The content of a world; remarks: each part that was left out, with the reason."""

    path: Path
    models: list[Model] = field(default_factory=list)
    actors: list[Actor] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)


def is_world(path: Path) -> bool:
    """Tells whether a file is a world: by its name or, for SDF, by its content."""
    name = path.name.removesuffix(XACRO)
    if name.endswith((".world", WEBOTS)):
        return True
    if not name.endswith(".sdf"):
        return False
    # In UTF-16 each other byte is 0.
    return WORLD_TAG.search(read_head(path, HEAD_BYTES).replace(b"\0", b"")) is not None


def read_world(path: Path, folders: Sequence[Path] = ()) -> WorldSource:
    """Returns the models of a world's file and of its includes; raises InputError.

    folders: searched for models and packages, besides the repository around the file.
    """
    world = _world_element(path, folders)
    source = WorldSource(path)
    reader = SdfReader(Packages(path, folders))
    source.remarks = reader.remarks
    source.remarks += [*_remove_lost(world), *number_remarks(world)]
    frames, moved = Frames(world), _state_poses(world)
    folder = path.parent.absolute()
    for element in world:
        if element.tag == "model":
            name = element.get("name", "")
            pose = moved.get(name, frames.of(name))
            _add(source, reader.read(element, folder, placement(element, pose)))
        elif element.tag == "include":
            _include(source, element, reader, frames, moved)
        elif element.tag == "actor":
            _add_actor(source, element)
        elif element.tag in ("population", "road"):
            source.remarks.append(f"left out <{element.tag}>: it is not read")
    return source


def origin_on_earth(path: Path, folders: Sequence[Path] = ()) -> tuple[float, float] | None:
    """Returns the latitude and longitude of a world's origin, degrees; None if it tells none.

    Raises InputError for a heading: at 0, and in classic Gazebo at 180 degrees, x points east.
    """
    given = _world_element(path, folders).find("spherical_coordinates")
    if given is None:
        return None
    latitude, longitude, heading = (
        number(given.findtext(f"{name}_deg")) for name in ("latitude", "longitude", "heading")
    )
    if latitude is None or longitude is None:
        return None
    turn = heading or 0.0
    if turn % 180.0 != 0.0:
        raise InputError(
            f"{path}: spherical_coordinates: heading_deg {turn:g}; expected 0 or 180, by which x "
            "points east"
        )
    return latitude, longitude


def _world_element(path: Path, folders: Sequence[Path]) -> ElementTree.Element:
    if path.suffix == WEBOTS:
        raise InputError(
            f"{path}: is a world of Webots; expected one of Gazebo (.world, .sdf), a map of "
            "Nav2's map server, or a scenario"
        )
    content = read_input(path, max_bytes=MAX_FILE_BYTES)
    require_utf_8(path, content)
    if path.suffix == XACRO or b"<xacro:" in content:
        content = expand_xacro(path, None, folders).text.encode()
    if TEMPLATE.search(content):
        raise InputError(f"{path}: is a template; expected the world that is made of it")
    root = read_xml(content, str(path))
    world = root.find("world")
    if root.tag not in ("sdf", "gazebo") or world is None:
        raise InputError(f"{path}: expected <sdf> with a <world>, found <{root.tag}>")
    return world


def _state_poses(world: ElementTree.Element) -> dict[str, Array]:
    """Returns the poses of models in a saved <state>, by the model's name."""
    return {
        model.get("name", ""): pose_element(pose)
        for model in world.findall("state/model")
        if (pose := model.find("pose")) is not None
    }


def _remove_lost(world: ElementTree.Element) -> list[str]:
    """Removes the models that lie beyond all bounds, and returns a remark on each.

    Gazebo saves such poses of models that fall without end; nothing of them is in the world.
    """
    remarks = []
    saved = {model.get("name"): text_of(model, "pose") for model in world.findall("state/model")}
    for parent in list(world.iter()):
        for child in [c for c in parent if c.tag in ("model", "include")]:
            name = child.get("name") or text_of(child, "name") or text_of(child, "uri")
            pose = text_of(child, "pose")
            pose = saved.get(name, pose) if parent is world else pose
            if is_far(pose):
                parent.remove(child)
                if parent.tag != "state":
                    remarks.append(f"left out {name}: its pose, {pose}, is beyond {FARTHEST_M:g} m")
    return remarks


def _include(
    source: WorldSource,
    include: ElementTree.Element,
    reader: SdfReader,
    frames: Frames,
    moved: Mapping[str, Array],
) -> None:
    uri = (text_of(include, "uri") or "").strip().rstrip("/")
    if uri.rpartition("/")[2].lower().replace(" ", "_") in NOTHING_STANDS:
        return
    found = reader.included(include)
    if found is None:
        return
    element, folder = found
    name = text_of(include, "name") or element.get("name") or ""
    own = Frames(element).pose_of(element)
    pose = frames.pose_of(include) if include.find("pose") is not None else own
    _add(source, reader.read(element, folder, placement(element, moved.get(name, pose))))


def _add(source: WorldSource, model: Model) -> None:
    if not model.is_static and has_drive(model):
        source.remarks.append(f"left out the robot {model.name}: --robot drives")
        return
    source.models.append(model)


def _add_actor(source: WorldSource, actor: ElementTree.Element) -> None:
    name = actor.get("name", "")
    knots = []
    for waypoint in actor.findall("script/trajectory/waypoint"):
        time_s = number(text_of(waypoint, "time"))
        x, y = numbers(text_of(waypoint, "pose"), 2)
        if time_s is not None:
            knots.append((time_s, x, y))
    if len(knots) < 2:
        source.remarks.append(f"left out the actor {name}: it has no trajectory")
        return
    repeats = text_of(actor, "script/loop") not in ("0", "false")
    source.actors.append(Actor(name, tuple(knots), repeats))
