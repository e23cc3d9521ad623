"""Makes a robot's URDF from the outline, the lidar and the mass in its trial's log."""

from __future__ import annotations

import math
from xml.etree import ElementTree as ET

from drake_navbench.inputs.robot import Robot
from drake_navbench.ros2.recordings.topics import BASE_FRAME, FOOTPRINT_FRAME, LIDAR_FRAME

# URDF has no prisms, so an outline is shown as thin walls, one an edge.
WALL_HEIGHT_M, WALL_THICKNESS_M = 0.3, 0.02
LIDAR_RADIUS_M, LIDAR_HEIGHT_M = 0.04, 0.05
BODY_RGBA, LIDAR_RGBA = "0 0.45 0.7 0.8", "0.15 0.16 0.2 1"


def urdf_of(robot: Robot, name: str) -> str:
    """Returns the URDF text. Only the outline is exact; the robot's looks are unknown."""
    root = ET.Element("robot", name=name)
    for material, rgba in (("body", BODY_RGBA), ("lidar", LIDAR_RGBA)):
        ET.SubElement(ET.SubElement(root, "material", name=material), "color", rgba=rgba)
    base = ET.SubElement(root, "link", name=BASE_FRAME)
    if robot.mass_kg is not None:
        _add_inertia(base, robot.mass_kg, robot.radii[1])
    if robot.robot_radius is not None:
        _add_cylinder(base, robot.robot_radius, WALL_HEIGHT_M, "body", 0.5 * WALL_HEIGHT_M)
    else:
        corners = robot.outline.tolist()
        for start, end in zip(corners, [*corners[1:], corners[0]], strict=True):
            _add_wall(base, start, end)
    ET.SubElement(root, "link", name=FOOTPRINT_FRAME)
    _add_fixed_joint(root, FOOTPRINT_FRAME, "0 0 0", 0.0)
    lidar = ET.SubElement(root, "link", name=LIDAR_FRAME)
    _add_cylinder(lidar, LIDAR_RADIUS_M, LIDAR_HEIGHT_M, "lidar", 0.0)
    x, y, yaw = robot.lidar.pose
    _add_fixed_joint(root, LIDAR_FRAME, f"{x!r} {y!r} {robot.lidar.height_m!r}", yaw)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True)


def _add_inertia(link: ET.Element, mass_kg: float, radius_m: float) -> None:
    """Adds the inertia of a disc as large as the outline, as the log has no other."""
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "mass", value=repr(mass_kg))
    about_z, across = 0.5 * mass_kg * radius_m**2, 0.25 * mass_kg * radius_m**2
    values = {"ixx": across, "iyy": across, "izz": about_z, "ixy": 0.0, "ixz": 0.0, "iyz": 0.0}
    ET.SubElement(inertial, "inertia", {key: repr(value) for key, value in values.items()})


def _add_wall(link: ET.Element, start: list[float], end: list[float]) -> None:
    """Adds a wall along an edge of the outline."""
    (x0, y0), (x1, y1) = start, end
    size = f"{math.hypot(x1 - x0, y1 - y0)!r} {WALL_THICKNESS_M!r} {WALL_HEIGHT_M!r}"
    middle = f"{0.5 * (x0 + x1)!r} {0.5 * (y0 + y1)!r} {0.5 * WALL_HEIGHT_M!r}"
    turn = f"0 0 {math.atan2(y1 - y0, x1 - x0)!r}"
    for kind in ("visual", "collision"):
        part = ET.SubElement(link, kind)
        ET.SubElement(part, "origin", xyz=middle, rpy=turn)
        ET.SubElement(ET.SubElement(part, "geometry"), "box", size=size)
        if kind == "visual":
            ET.SubElement(part, "material", name="body")


def _add_cylinder(
    link: ET.Element, radius_m: float, height_m: float, material: str, middle_m: float
) -> None:
    for kind in ("visual", "collision"):
        part = ET.SubElement(link, kind)
        ET.SubElement(part, "origin", xyz=f"0 0 {middle_m!r}", rpy="0 0 0")
        geometry = ET.SubElement(part, "geometry")
        ET.SubElement(geometry, "cylinder", radius=repr(radius_m), length=repr(height_m))
        if kind == "visual":
            ET.SubElement(part, "material", name=material)


def _add_fixed_joint(root: ET.Element, child: str, xyz: str, yaw: float) -> None:
    joint = ET.SubElement(root, "joint", name=f"{child}_joint", type="fixed")
    ET.SubElement(joint, "parent", link=BASE_FRAME)
    ET.SubElement(joint, "child", link=child)
    ET.SubElement(joint, "origin", xyz=xyz, rpy=f"0 0 {yaw!r}")
