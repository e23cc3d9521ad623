"""A robot's or a thing's model as plain data: links, shapes, joints, sensors, plugins."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shape:
    """A shape; pose: (4, 4) in its model's frame.

    kind and size: box, its size along x, y, z m; cylinder, cone, capsule, radius and length m;
    sphere, radius m; ellipsoid, half axes m; polyline, height m; mesh, scale along x, y, z; plane,
    the endless floor, none. corners: (K, 2) m, of a polyline. mesh: the file, None where it is not
    there; uri: its name. submesh: of which only this part counts, '' for all.
    """

    kind: str
    pose: Array
    size: tuple[float, ...] = ()
    corners: Array | None = None
    mesh: Path | None = None
    uri: str = ""
    submesh: str = ""
    is_centred: bool = False


@dataclass(frozen=True)
class Link:
    """A rigid body; pose: (4, 4) in the model's frame."""

    name: str
    pose: Array
    mass_kg: float
    collisions: tuple[Shape, ...]
    visuals: tuple[Shape, ...]


@dataclass(frozen=True)
class Joint:
    """A joint; axis: (3,) in the model's frame. velocity_radps: its limit; None: not given."""

    name: str
    kind: str
    parent: str
    child: str
    axis: Array
    velocity_radps: float | None = None


@dataclass(frozen=True)
class Sensor:
    """A sensor; pose: (4, 4) in the model's frame. element: its XML."""

    name: str
    kind: str
    pose: Array
    element: ElementTree.Element


@dataclass(frozen=True)
class Plugin:
    """A plugin of Gazebo, or a block of ros2_control; name: its file or class. element: its XML."""

    name: str
    element: ElementTree.Element


@dataclass
class Model:
    """The links, shapes and plugins of one model, its joints at zero.

    remarks: what was left out, and why. frames: (4, 4) of further frames by name.
    """

    name: str
    links: dict[str, Link] = field(default_factory=dict)
    joints: list[Joint] = field(default_factory=list)
    sensors: list[Sensor] = field(default_factory=list)
    plugins: list[Plugin] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    is_static: bool = False

    @property
    def mass_kg(self) -> float:
        """Of all links together, kg."""
        return sum(link.mass_kg for link in self.links.values())
