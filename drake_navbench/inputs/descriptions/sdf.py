"""SDF as models: a file's own model, or those of a world, with what they include."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from drake_navbench.errors import InputError
from drake_navbench.inputs.descriptions.model import Link, Model, Plugin, Sensor, Shape
from drake_navbench.inputs.descriptions.number_texts import number_remarks
from drake_navbench.inputs.descriptions.poses import inverse, number, numbers
from drake_navbench.inputs.descriptions.ros_packages import MODEL_FILE, Packages
from drake_navbench.inputs.descriptions.sdf_frames import Frames, inertia_of, joint_of
from drake_navbench.inputs.descriptions.xml_file import read_xml, text_of
from drake_navbench.kernels.arrays import Array
from drake_navbench.typed_files.input_file import MEGABYTE, read_input

MAX_FILE_BYTES = 64 * MEGABYTE
# The depth of models in models; a deeper file includes itself.
MAX_NESTED = 16
# The most links and models, so that models which include each other several times come to an end.
MAX_PARTS = 20_000
FUEL = ("http://", "https://")
UNSHAPED = ("heightmap", "image")


class SdfReader:
    """Reads models of SDF; remarks: the parts left out, and why."""

    def __init__(self, packages: Packages) -> None:
        self._packages = packages
        self._files: dict[Path, ElementTree.Element] = {}
        self._part_count = 0
        self.remarks: list[str] = []

    def read(self, element: ElementTree.Element, folder: Path, pose: Array | None = None) -> Model:
        """Returns a <model> at a pose; folder: the folder of its relative files."""
        model = Model(element.get("name") or "model", remarks=self.remarks)
        model.is_static = _is_true(text_of(element, "static"))
        self._add(model, element, folder, np.eye(4) if pose is None else pose, "", 0)
        return model

    def included(self, include: ElementTree.Element) -> tuple[ElementTree.Element, Path] | None:
        """Returns the <model> that an <include> names, and its folder; else None and a remark."""
        uri = (text_of(include, "uri") or "").strip().rstrip("/")
        if not uri:
            self._tell("left out an <include>: expected a <uri> in it")
            return None
        place = self._place(uri)
        if place is None:
            why = "is on the net; expected its folder by --packages" if uri.startswith(FUEL) else ""
            self._tell(f"left out {uri}: {why or 'no such model in the repository or --packages'}")
            return None
        file = _model_file(place) if place.is_dir() else place
        if file is None or not file.is_file():
            self._tell(f"left out {uri}: no SDF file in {place}")
            return None
        try:
            root = self._root(file)
        except InputError as error:
            self._tell(f"left out {uri}: {error}")
            return None
        model = root if root.tag == "model" else root.find("model")
        if model is None:
            what = "a light" if root.find("light") is not None else "no model"
            self._tell(f"left out {uri}: it holds {what}")
            return None
        for remark in number_remarks(model):
            self._tell(f"{uri}: {remark}")
        return model, file.parent

    def _place(self, uri: str) -> Path | None:
        if uri.startswith(FUEL):
            name = uri.rpartition("/")[2]
            if name.isdecimal():
                name = uri.rsplit("/", 2)[1]
            return self._packages.model(name)
        if "://" not in uri and uri and self._packages.place(uri) is None:
            # Newer Gazebo takes the bare name of a model, too.
            return self._packages.model(uri)
        return self._packages.place(uri)

    def _root(self, file: Path) -> ElementTree.Element:
        if file not in self._files:
            content = read_input(file, max_bytes=MAX_FILE_BYTES)
            self._files[file] = read_xml(content, str(file))
        return self._files[file]

    def _add(
        self,
        model: Model,
        element: ElementTree.Element,
        folder: Path,
        pose: Array,
        prefix: str,
        depth: int,
    ) -> None:
        """Adds the parts of a <model> at a pose; prefix: begins the names in it."""
        if depth > MAX_NESTED:
            raise InputError(
                f"{folder}: the model {model.name} nests deeper than {MAX_NESTED} models; "
                "expected one that does not include itself"
            )
        self._count_part()
        frames = Frames(element)
        for nested in element.findall("model"):
            self._add(
                model,
                nested,
                folder,
                pose @ frames.of(nested.get("name", "")),
                f"{prefix}{nested.get('name', '')}::",
                depth + 1,
            )
        for include in element.findall("include"):
            self._include(model, include, frames, pose, prefix, depth)
        for link in element.findall("link"):
            self._add_link(model, link, frames, folder, pose, prefix)
        for joint in element.findall("joint"):
            model.joints.append(joint_of(joint, frames, pose, prefix))
        for plugin in element.findall("plugin"):
            name = f"{plugin.get('filename', '')} {plugin.get('name', '')}"
            model.plugins.append(Plugin(name, plugin))
        unknown = sorted(name for name in frames.unknown if "::" not in name)
        if unknown:
            self._tell(f"model {model.name}: poses relative to {unknown[0]!r}, which it has not")

    def _include(
        self,
        model: Model,
        include: ElementTree.Element,
        frames: Frames,
        pose: Array,
        prefix: str,
        depth: int,
    ) -> None:
        found = self.included(include)
        if found is None:
            return
        element, folder = found
        name = text_of(include, "name") or element.get("name") or ""
        if include.find("pose") is not None:
            own = frames.pose_of(include)
        else:
            own = Frames(element).pose_of(element)
        frames.add(name, own)
        self._add(model, element, folder, pose @ own, f"{prefix}{name}::", depth + 1)

    def _add_link(
        self,
        model: Model,
        element: ElementTree.Element,
        frames: Frames,
        folder: Path,
        pose: Array,
        prefix: str,
    ) -> None:
        self._count_part()
        name = element.get("name", "")
        place = pose @ frames.of(name)
        mass = number(text_of(element, "inertial/mass"))

        def placed(part: ElementTree.Element) -> Array:
            own = part.find("pose")
            said = None if own is None else own.get("relative_to")
            return pose @ frames.pose_of(part) if said else place @ frames_of_part(part)

        def frames_of_part(part: ElementTree.Element) -> Array:
            return Frames(part).pose_of(part)

        center, inertia = inertia_of(element)
        model.links[prefix + name] = Link(
            prefix + name,
            place,
            mass or 0.0,
            self._shapes(element, "collision", placed, folder),
            self._shapes(element, "visual", placed, folder),
            center,
            inertia,
        )
        for sensor in element.findall("sensor"):
            kind = sensor.get("type", "")
            model.sensors.append(Sensor(sensor.get("name", ""), kind, placed(sensor), sensor))

    def _shapes(
        self,
        link: ElementTree.Element,
        role: str,
        placed: Callable[[ElementTree.Element], Array],
        folder: Path,
    ) -> tuple[Shape, ...]:
        found = []
        for element in link.findall(role):
            geometry = element.find("geometry")
            for shape in geometry if geometry is not None else ():
                read = self._shape(shape, placed(element), folder)
                if read is not None:
                    colour = text_of(element, "material/diffuse")
                    said = None if colour is None else tuple(numbers(colour, 4, 1.0))
                    found.append(replace(read, name=element.get("name", ""), colour=said))
                elif shape.tag in UNSHAPED and role == "collision":
                    self._tell(f"left out a {shape.tag}: only flat floors are driven on")
        return tuple(found)

    def _shape(self, element: ElementTree.Element, pose: Array, folder: Path) -> Shape | None:
        def given(name: str) -> float:
            return number(text_of(element, name)) or 0.0

        if element.tag == "box":
            return Shape("box", pose, tuple(numbers(text_of(element, "size"), 3)))
        if element.tag in ("cylinder", "capsule", "cone"):
            return Shape(element.tag, pose, (given("radius"), given("length")))
        if element.tag == "sphere":
            return Shape("sphere", pose, (given("radius"),))
        if element.tag == "drake.ellipsoid":
            return Shape("ellipsoid", pose, (given("a"), given("b"), given("c")))
        if element.tag == "ellipsoid":
            return Shape("ellipsoid", pose, tuple(numbers(text_of(element, "radii"), 3)))
        if element.tag == "plane":
            return Shape("plane", pose)
        if element.tag == "polyline":
            corners = [numbers(point.text, 2) for point in element.findall("point")]
            return Shape("polyline", pose, (given("height"),), corners=np.array(corners))
        if element.tag == "mesh":
            return self._mesh(element, pose, folder)
        return None

    def _mesh(self, element: ElementTree.Element, pose: Array, folder: Path) -> Shape:
        uri = text_of(element, "uri") or text_of(element, "filename") or ""
        scale = text_of(element, "scale")
        place = self._packages.place(uri, folder) if uri else None
        if place is None and uri.startswith(FUEL):
            # A URI such as https://.../models/NAME/VERSION/files/meshes/part.dae.
            name, _, rest = uri.partition("/models/")[2].partition("/")
            model = self._packages.model(name)
            file = None if model is None else model / rest.partition("files/")[2]
            place = file if file is not None and file.is_file() else None
        return Shape(
            "mesh",
            pose,
            tuple(numbers(scale, 3, 1.0)) if scale else (1.0, 1.0, 1.0),
            mesh=place if place is not None and place.is_file() else None,
            uri=uri,
            submesh=text_of(element, "submesh/name") or "",
            is_centred=_is_true(text_of(element, "submesh/center")),
        )

    def _count_part(self) -> None:
        """Counts a link or a model; raises InputError where they are too many."""
        self._part_count += 1
        if self._part_count > MAX_PARTS:
            raise InputError(f"more than {MAX_PARTS} links and models; expected a smaller world")

    def _tell(self, remark: str) -> None:
        if remark not in self.remarks:
            self.remarks.append(remark)


def _model_file(folder: Path) -> Path | None:
    """Returns the SDF file in a model's folder: that of the highest version in its model.config."""
    config = folder / MODEL_FILE
    if config.is_file():
        try:
            root = read_xml(read_input(config, max_bytes=MEGABYTE), str(config))
        except InputError:
            # Everything else in it, authors above all, is of no use here.
            root = ElementTree.Element("model")
        named = [
            (number(entry.get("version")) or 0.0, (entry.text or "").strip())
            for entry in root.iter("sdf")
        ]
        there = [entry for entry in named if entry[1] and (folder / entry[1]).is_file()]
        if there:
            return folder / max(there)[1]
    others = sorted(folder.glob("*.sdf"))
    return others[0] if others else None


def placement(element: ElementTree.Element, pose: Array) -> Array:
    """Returns the pose of a model's frame, given that of its `placement_frame` if it has one."""
    name = element.get("placement_frame", "")
    return pose @ inverse(Frames(element).of(name)) if name else pose


def _is_true(text: str | None) -> bool:
    return text in ("1", "true", "True")
