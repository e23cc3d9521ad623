"""Reads a robot's SDF or URDF file as its owners have it: with ROS packages, without some meshes.

Where a mesh of `package://name/...` or `model://name/...` is looked for, `ros_packages` says. What
is seen but cannot be found is left out; what touches must be there. Meshes in formats that Drake
does not read become OBJ ones.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from pydrake.multibody.parsing import PackageMap, Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from drake_navbench.errors import InputError
from drake_navbench.processes.limited_call import call_limited
from drake_navbench.typed_files.drake_warnings import few_warnings
from drake_navbench.typed_files.input_file import MEGABYTE, read_input
from drake_navbench.typed_files.ros_packages import PACKAGE_URI, Packages

XACRO_SPACE = re.compile(r"\{[^}]*xacro[^}]*\}")
XACRO_VALUE = re.compile(r"\$[{(].*")
# Meshes that Drake does not read, and the function that writes them as OBJ.
CONVERTED = (".stl", ".dae", ".glb", ".ply")
WRITE_OBJS = "drake_navbench.typed_files.mesh_child:write_objs"
# Elements of SDF without shape or mass. Gazebo accepts elements in them that SDF does not define,
# at which Drake stops; Drake itself ignores these two.
WITHOUT_BODY = ("sensor", "plugin")
MAX_FILE_BYTES = 16 * MEGABYTE
MAX_SHAPES = 500


class ModelText(NamedTuple):
    """A model's file.

    text: the changed text; None where nothing was changed. packages: the folders of the ROS
    packages by name. left_out: the missing meshes; they are visual ones only.
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

    scratch: a folder for converted meshes; it must exist as long as the plant. is_drawn: whether
    visual meshes are converted, too, where they can be read. Raises InputError where the file is
    xacro, or where a collision mesh is missing or invalid. Raises Drake's own exception where Drake
    cannot parse the file.
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
    """Returns the text of a model's file for the parser; scratch, is_drawn: as for `add_models`.

    Raises InputError where the file is xacro, or where a collision mesh is missing or invalid.
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
    is_rewritten = _rewrite_meshes(root, finder, scratch, path, is_drawn=is_drawn)
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
    """Raises InputError where the shapes are too many: Drake's time grows with their square."""
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
    """Removes sensors and plugins; returns whether there were any."""
    pairs = [(parent, e) for parent in root.iter() for e in parent if e.tag in WITHOUT_BODY]
    for parent, element in pairs:
        parent.remove(element)
    return bool(pairs)


def _remove_missing(link: ElementTree.Element, finder: _Meshes) -> list[str]:
    """Removes an element's own visuals whose mesh is missing; returns the URIs of these meshes."""
    removed = []
    for visual in link.findall("visual"):
        missing = [uri for _, _, uri in _uris(visual) if not finder.has(uri)]
        if missing:
            link.remove(visual)
            removed += missing
    return removed


def _rewrite_meshes(
    root: ElementTree.Element, finder: _Meshes, scratch: Path, path: Path, *, is_drawn: bool
) -> bool:
    """Replaces meshes in formats that Drake does not read by OBJ; returns whether there were any.

    Collision meshes must be readable; so must visual ones where there are no collision meshes.
    Other visual meshes are converted only where they are drawn.
    """
    collisions, visuals = list(root.iter("collision")), list(root.iter("visual"))
    needed = collisions or visuals
    wanted = [*needed, *(visuals if is_drawn and collisions else ())]
    places = {
        (holder, key): place
        for shape in wanted
        for holder, key, uri in _uris(shape)
        if (place := finder.place(uri)) is not None and place.suffix.lower() in CONVERTED
    }
    files = list(dict.fromkeys(places.values()))
    if not files:
        return False
    asked = [
        {"file": str(file), "obj": str(scratch.absolute() / f"{index}.obj")}
        for index, file in enumerate(files)
    ]
    written = dict(zip(files, call_limited(WRITE_OBJS, asked, str(path)), strict=True))
    required = {holder for shape in needed for holder, _, _ in _uris(shape)}
    for (holder, key), place in places.items():
        answer = written[place]
        if "obj" in answer:
            _set(holder, key, f"file://{answer['obj']}")
        elif holder in required:
            raise InputError(f"{place}: cannot be read as a mesh: {answer['fault']}")
    return True


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
    """Finds the files of URIs; packages: the folders of the packages that URIs named."""

    def __init__(self, path: Path) -> None:
        self._drakes = PackageMap()
        self._around = Packages(path)

    @property
    def packages(self) -> Mapping[str, Path]:
        """The folders of the packages that were named and found."""
        return self._around.found

    def has(self, uri: str) -> bool:
        """Returns whether the file of a URI exists; True for Drake's own packages."""
        return self._is_drakes(uri) or self.place(uri) is not None

    def place(self, uri: str) -> Path | None:
        """Returns the file of a URI; None where it is missing, or in Drake's own packages."""
        if self._is_drakes(uri):
            return None
        file = self._around.place(uri)
        return file if file is not None and file.is_file() else None

    def _is_drakes(self, uri: str) -> bool:
        named = PACKAGE_URI.fullmatch(uri)
        return named is not None and self._drakes.Contains(named[1])
