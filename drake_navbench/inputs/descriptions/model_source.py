"""A file with one model, URDF, SDF, xacro or Clearpath's robot.yaml, as plain data."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

from drake_navbench.errors import InputError
from drake_navbench.inputs.descriptions.clearpath_robot import clearpath_xacro, is_clearpath
from drake_navbench.inputs.descriptions.drawing import is_drawing
from drake_navbench.inputs.descriptions.gazebo_drive import names_drive
from drake_navbench.inputs.descriptions.model import Model
from drake_navbench.inputs.descriptions.number_texts import number_remarks
from drake_navbench.inputs.descriptions.ros_packages import Packages
from drake_navbench.inputs.descriptions.sdf import SdfReader
from drake_navbench.inputs.descriptions.urdf import read_urdf
from drake_navbench.inputs.descriptions.xacro_file import XACRO, Expanded, expand_xacro
from drake_navbench.inputs.descriptions.xml_file import read_xml, text_of
from drake_navbench.typed_files.input_file import MEGABYTE, read_input, require_utf_8

MAX_FILE_BYTES = 64 * MEGABYTE
# A world is the robot that stands in it. A .model is URDF or SDF, by its root element. A .gazebo is
# xacro: some robots' whole files are called so.
MODEL_SUFFIXES = (".urdf", ".sdf", ".world", ".model", ".gazebo", XACRO)
# Text that only xacro gives a meaning, also in files called .urdf.
XACRO_MARKS = re.compile(r"<xacro:|=\s*[\"'][^\"']*\$[{(]")
# The link with which a robot's own file begins, or that of the file which it includes.
BASES = {"base_link", "base_footprint"}
# The root elements of other simulators' files; see docs/robots.md.
OTHERS = {"mujoco": "MuJoCo", "mujocoinclude": "MuJoCo"}


@dataclass(frozen=True)
class Source:
    """A model with the file it comes from.

    root: the XML, expanded where it was xacro. arguments: arguments of its xacro files, with their
    values. is_expanded: whether the file was xacro. files: those that were read of it.
    """

    path: Path
    model: Model
    root: ElementTree.Element
    packages: Packages
    arguments: Mapping[str, str] = field(default_factory=dict)
    is_expanded: bool = False
    files: tuple[Path, ...] = ()


def read_source(
    path: Path, arguments: Mapping[str, str] | None = None, folders: Sequence[Path] = ()
) -> Source:
    """Returns the model in a file; raises InputError, one line, where there is none.

    arguments: for xacro. folders: further folders in which packages are searched.
    """
    packages = Packages(path, folders, is_own=is_drawing(path))
    content = read_input(path, max_bytes=MAX_FILE_BYTES)
    require_utf_8(path, content)
    text = content.decode(errors="replace")
    written, unmounted = clearpath_xacro(path, packages) if is_clearpath(path) else (None, [])
    is_xacro = path.suffix == XACRO or XACRO_MARKS.search(text) is not None
    is_expanded = written is not None or is_xacro
    expanded = (
        expand_xacro(path, arguments, folders, text=written) if is_expanded else Expanded(text)
    )
    root = read_xml(expanded.text.encode(), str(path))
    model = read_urdf(root, packages) if root.tag == "robot" else _sdf_model(root, path, packages)
    absent = BASES & {joint.parent for joint in model.joints} - model.links.keys()
    left_out = [remark for remark in expanded.remarks if remark.startswith("left out")]
    if not model.links or (absent and left_out):
        where = "".join(f"; {remark}" for remark in left_out)
        found = f"no link {min(absent)}" if model.links else "none"
        what = "cannot be read as a robot's model: expected links"
        raise InputError(f"{path}: {what}, found {found}{where}")
    model.remarks += [*expanded.remarks, *unmounted, *number_remarks(root)]
    files = (path, *expanded.files)
    return Source(path, model, root, packages, expanded.arguments, is_expanded, files)


def is_model_file(path: Path) -> bool:
    """Tells whether a file is a model by itself, by its name or as a robot.yaml of Clearpath's."""
    return path.suffix in MODEL_SUFFIXES or is_clearpath(path)


def _sdf_model(root: ElementTree.Element, path: Path, packages: Packages) -> Model:
    """Returns the first model of an SDF text, which may be included.

    Of a world it is the first one that drives, else that moves, else that stands.
    """
    if root.tag in OTHERS:
        raise InputError(
            f"{path}: is a model of {OTHERS[root.tag]}; expected URDF, SDF or xacro, "
            f"which {OTHERS[root.tag]}'s tools write"
        )
    if root.tag not in ("sdf", "model", "gazebo"):
        raise InputError(
            f"{path}: cannot be read as a robot's model: expected <robot> or <sdf>, found "
            f"<{root.tag}>"
        )
    reader = SdfReader(packages)
    element = root if root.tag == "model" else root.find("model")
    if element is None:
        standing = root.findall("world/model")
        driven = [e for e in standing if names_drive(ElementTree.tostring(e, "unicode"))]
        free = [e for e in standing if text_of(e, "static") not in ("1", "true")]
        element = next(iter((*driven, *free, *standing)), None)
    folder = path.parent.absolute()
    if element is None:
        include = root.find("include")
        found = None if include is None else reader.included(include)
        if found is None:
            raise InputError(f"{path}: cannot be read as a robot's model: expected a <model>")
        element, folder = found
    return reader.read(element, folder)
