"""A robot's or a thing's model as plain data: links, shapes, joints, sensors, plugins."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

from drake_navbench.inputs.descriptions.resting_joints import WITHOUT_ARM, Resting
from drake_navbench.kernels.arrays import Array


@dataclass(frozen=True)
class Shape:
    """A shape; pose: (4, 4) in its model's frame.

    kind and size: box, its size along x, y, z m; cylinder, cone, capsule, radius and length m;
    sphere, radius m; ellipsoid, half axes m; polyline, height m; mesh, scale along x, y, z; plane,
    the endless floor, none. corners: (K, 2) m, of a polyline. mesh: the file, None where it does
    not exist; uri: its name. submesh: the only part of the mesh that counts, '' for all.
    is_centred: whether its middle is moved to the origin. name: as in the file. colour: red, green,
    blue, alpha from 0 to 1; None: not given.
    """

    kind: str
    pose: Array
    size: tuple[float, ...] = ()
    corners: Array | None = None
    mesh: Path | None = None
    uri: str = ""
    submesh: str = ""
    is_centred: bool = False
    name: str = ""
    colour: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Link:
    """A rigid body; pose: (4, 4) in the model's frame.

    center_m: (3,) centre of mass; inertia_kgm2: (3, 3) about it; both in the link's frame.
    """

    name: str
    pose: Array
    mass_kg: float
    collisions: tuple[Shape, ...]
    visuals: tuple[Shape, ...]
    center_m: Array
    inertia_kgm2: Array

    @property
    def shown(self) -> tuple[Shape, ...]:
        """The shapes by which the link is drawn: its existing visuals, else its collisions."""
        seen = tuple(s for s in self.visuals if s.kind != "mesh" or s.mesh is not None)
        return seen or self.collisions


@dataclass(frozen=True)
class Joint:
    """A joint; pose: (4, 4) and axis: (3,) in the model's frame.

    velocity_radps: its limit; None: not given. range_rad: its least and its largest angle.
    damping_nms: torque per rate, N m s/rad.
    """

    name: str
    kind: str
    parent: str
    child: str
    pose: Array
    axis: Array
    velocity_radps: float | None = None
    range_rad: tuple[float, float] = (-math.inf, math.inf)
    damping_nms: float = 0.0


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
    """The links, shapes and plugins of one model.

    remarks: the parts left out, and why. is_static: the file says that the model never moves.
    resting: the joints that are not at zero.
    """

    name: str
    links: dict[str, Link] = field(default_factory=dict)
    joints: list[Joint] = field(default_factory=list)
    sensors: list[Sensor] = field(default_factory=list)
    plugins: list[Plugin] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    is_static: bool = False
    resting: Resting = WITHOUT_ARM

    @property
    def mass_kg(self) -> float:
        """The mass of all links together, kg."""
        return sum(link.mass_kg for link in self.links.values())
