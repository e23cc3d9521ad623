"""Reads a robot's SDF or URDF file as its owners have it: with ROS packages, without some meshes.

A mesh of `package://name/...` or `model://name/...` is looked for in folders called `name`, or with
a package.xml of that name, beside and above the file; then below AMENT_PREFIX_PATH (share/name) and
ROS_PACKAGE_PATH. What is seen but cannot be found is left out; what touches must be there. STL
meshes become OBJ ones.
"""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from pydrake.multibody.parsing import PackageMap, Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from drake_navbench.errors import InputError
from drake_navbench.typed_files.drake_warnings import few_warnings
from drake_navbench.typed_files.input_file import MEGABYTE, read_input
from drake_navbench.typed_files.stl_mesh import as_obj, read_stl

PACKAGE_URI = re.compile(r"(?:package|model)://([^/]+)/?(.*)")
XACRO_SPACE = re.compile(r"\{[^}]*xacro[^}]*\}")
XACRO_VALUE = re.compile(r"\$[{(].*")
PACKAGE_FILE = "package.xml"
STL = ".stl"
# Of SDF, what is nothing that touches, is seen or weighs. Gazebo takes elements in them that SDF
# does not define, at which Drake stops; Drake itself passes over the rest.
WITHOUT_BODY = ("sensor", "plugin")
# Folders above the file that are looked through: more than any workspace has.
MAX_DEPTH = 8


MAX_FILE_BYTES = 16 * MEGABYTE
MAX_SHAPES = 500


class ModelText(NamedTuple):
    """A model's file.

    text: in which something was changed; None where nothing was. packages: their folders, by name.
    left_out: the meshes, only seen, that are not there.
    """

    text: str | None
    packages: Mapping[str, Path]
    left_out: tuple[str, ...]


class AddedModels(NamedTuple):
    """The models that a file added to a plant, and the visual meshes that were left out."""

    instances: tuple[ModelInstanceIndex, ...]
    left_out: tuple[str, ...]


def add_models(
    plant: MultibodyPlant, path: Path, scratch: Path, *, is_drawn: bool = False
) -> AddedModels:
    """Adds the models of a file to a plant.

    scratch: a folder for meshes in another format, there as long as the plant. is_drawn: whether
    the STL meshes of what is only seen are to be had, too, where they can be read. Raises
    InputError where it is a xacro file, or a collision mesh is not there or no mesh, and what Drake
    raises where it cannot be parsed.
    """
    file = read_model_text(path, scratch, is_drawn=is_drawn)
    parser = Parser(plant)
    for name, folder in file.packages.items():
        parser.package_map().Add(name, str(folder))
    with few_warnings(path):
        if file.text is None:
            instances = parser.AddModels(str(path))
        else:
            instances = parser.AddModelsFromString(file.text, path.suffix.lstrip(".").lower())
    return AddedModels(tuple(instances), file.left_out)


def read_model_text(path: Path, scratch: Path, *, is_drawn: bool = False) -> ModelText:
    """Returns the text of a file that is parsed; scratch, is_drawn: as for `add_models`.

    Raises InputError where it is a xacro file, or a collision mesh is not there or no mesh.
    """
    content = read_input(path, max_bytes=MAX_FILE_BYTES)
    try:
        root = ElementTree.fromstring(content)
    except (ElementTree.ParseError, OSError, ValueError):
        # Drake says what is wrong, or takes what it can.
        return ModelText(None, {}, ())
    _require_expanded(root, path)
    _require_few_shapes(root, path)
    finder = _Meshes(path)
    _require_collisions(root, finder, path)
    left_out = [uri for link in root.iter() for uri in _remove_missing(link, finder)]
    is_renamed = root.tag == "robot" and _remove_empty_names(root)
    is_thinned = root.tag == "sdf" and _remove_without_body(root)
    is_rewritten = _rewrite_stl(root, finder, scratch, is_drawn=is_drawn)
    if not (left_out or is_renamed or is_thinned or is_rewritten):
        return ModelText(None, finder.packages, ())
    for holder, key, uri in _uris(root):
        if ":" not in uri:
            # A text has no folder that they could be relative to.
            _set(holder, key, f"file://{path.parent.absolute() / uri}")
    _keep_prefixes(path)
    text = ElementTree.tostring(root, encoding="unicode")
    return ModelText(text, finder.packages, tuple(dict.fromkeys(left_out)))


def _require_few_shapes(root: ElementTree.Element, path: Path) -> None:
    """Raises InputError where there are so many shapes that Drake takes long: with their square."""
    count = sum(element.tag in ("visual", "collision") for element in root.iter())
    if count > MAX_SHAPES:
        raise InputError(
            f"{path}: {count} visual and collision shapes, expected at most {MAX_SHAPES}"
        )


def _keep_prefixes(path: Path) -> None:
    """Has elements written with the prefixes of a file: Drake knows its own by `drake:` alone."""
    for _, (prefix, uri) in ElementTree.iterparse(path, ["start-ns"]):
        # Prefixes of ElementTree's own, ns0 and so on, it does not take.
        with contextlib.suppress(ValueError):
            ElementTree.register_namespace(prefix, uri)


def _require_expanded(root: ElementTree.Element, path: Path) -> None:
    for element in root.iter():
        values = (XACRO_VALUE.search(value) for value in element.attrib.values())
        found = next((value[0] for value in values if value), None)
        if XACRO_SPACE.match(element.tag):
            found = f"<xacro:{element.tag.rpartition('}')[2]}>"
        if found is not None:
            raise InputError(
                f"{path}: expected a model, found xacro, {found}; expand it first: "
                f"xacro {path.name} > expanded.urdf"
            )


def _require_collisions(root: ElementTree.Element, finder: _Meshes, path: Path) -> None:
    for collision in root.iter("collision"):
        for _, _, uri in _uris(collision):
            if not finder.has(uri):
                raise InputError(
                    f"{path}: expected the collision mesh {uri}, found no such file or package"
                )


def _remove_empty_names(root: ElementTree.Element) -> bool:
    """Removes empty names of shapes: in URDF a name may be missing, but not be empty."""
    shapes = [element for element in root.iter() if element.tag in ("visual", "collision")]
    nameless = [element for element in shapes if not element.get("name", "-").strip()]
    for element in nameless:
        del element.attrib["name"]
    return bool(nameless)


def _remove_without_body(root: ElementTree.Element) -> bool:
    """Removes sensors and plugins; tells whether there were any."""
    pairs = [(parent, e) for parent in root.iter() for e in parent if e.tag in WITHOUT_BODY]
    for parent, element in pairs:
        parent.remove(element)
    return bool(pairs)


def _remove_missing(link: ElementTree.Element, finder: _Meshes) -> list[str]:
    """Removes the visuals right below an element whose meshes are not there; returns those."""
    removed = []
    for visual in link.findall("visual"):
        missing = [uri for _, _, uri in _uris(visual) if not finder.has(uri)]
        if missing:
            link.remove(visual)
            removed += missing
    return removed


def _rewrite_stl(
    root: ElementTree.Element, finder: _Meshes, scratch: Path, *, is_drawn: bool
) -> bool:
    """Has OBJ meshes in place of STL ones; tells whether there were any.

    Those that make the outline must be readable: of collision shapes, of visual ones where there
    are no others. The others are only wanted where they are drawn.
    """
    collisions, visuals = list(root.iter("collision")), list(root.iter("visual"))
    needed = collisions or visuals
    written: dict[Path, Path] = {}
    for shape in [*needed, *(visuals if is_drawn and collisions else ())]:
        for holder, key, uri in _uris(shape):
            place = finder.place(uri)
            if place is None or place.suffix.lower() != STL:
                continue
            try:
                points = None if place in written else read_stl(place)
            except InputError:
                if shape in needed:
                    raise
                continue
            if points is not None:
                written[place] = scratch.absolute() / f"{len(written)}.obj"
                written[place].write_text(as_obj(points))
            _set(holder, key, f"file://{written[place]}")
    return bool(written)


def _uris(element: ElementTree.Element) -> Iterator[tuple[ElementTree.Element, str, str]]:
    """Yields each mesh's URI with the element that has it and its attribute, '' for its text."""
    for mesh in element.iter("mesh"):
        if mesh.get("filename"):
            yield mesh, "filename", mesh.attrib["filename"].strip()
        for uri in mesh.findall("uri"):
            yield uri, "", (uri.text or "").strip()


def _set(element: ElementTree.Element, attribute: str, value: str) -> None:
    if attribute:
        element.set(attribute, value)
    else:
        element.text = value


class _Meshes:
    """Looks for the files of URIs; packages: the folders of those that were named and found."""

    def __init__(self, path: Path) -> None:
        self._folder = path.parent.absolute()
        self._drakes = PackageMap()
        self.packages: dict[str, Path] = {}

    def has(self, uri: str) -> bool:
        """Tells whether the file of a URI is there; those in Drake's own packages are."""
        named = PACKAGE_URI.fullmatch(uri)
        if named is not None and self._drakes.Contains(named[1]):
            return True
        return self.place(uri) is not None

    def place(self, uri: str) -> Path | None:
        """Returns the file of a URI; None where it is not there, or in Drake's own packages."""
        named = PACKAGE_URI.fullmatch(uri)
        if named is None:
            file = self._folder / uri.removeprefix("file://")
            return file if file.is_file() else None
        name, rest = named.groups()
        if self._drakes.Contains(name):
            return None
        folder = self.packages.get(name) or _package(name, self._folder)
        if folder is None:
            return None
        self.packages[name] = folder
        file = folder / rest
        return file if file.is_file() else None


def _package(name: str, start: Path) -> Path | None:
    """Returns the folder of a package; start: of the file that names it."""
    above = [start, *start.parents][:MAX_DEPTH]
    environment = {
        variable: [Path(entry) for entry in os.environ.get(variable, "").split(os.pathsep) if entry]
        for variable in ("AMENT_PREFIX_PATH", "ROS_PACKAGE_PATH")
    }
    places = [
        *above,
        *(folder / name for folder in above),
        *(prefix / "share" / name for prefix in environment["AMENT_PREFIX_PATH"]),
        *environment["ROS_PACKAGE_PATH"],
        *(entry / name for entry in environment["ROS_PACKAGE_PATH"]),
    ]
    return next((place for place in places if _is_package(place, name)), None)


def _is_package(folder: Path, name: str) -> bool:
    if not folder.is_dir():
        return False
    file = folder / PACKAGE_FILE
    if file.is_file():
        said = re.search(r"<name>\s*([^<\s]+)\s*</name>", file.read_text(errors="replace"))
        return said is not None and said[1] == name
    return folder.name == name
