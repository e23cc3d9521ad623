"""The drive of a model: by its Gazebo plugin, else its ros2_control file, else its wheels."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from xml.etree import ElementTree

from drake_navbench.inputs.descriptions.body import Wheel
from drake_navbench.inputs.descriptions.control_files import (
    by_controllers,
    by_wheel_names,
    command_limits,
    controller_files,
)
from drake_navbench.inputs.descriptions.drive_kinds import (
    ACKERMANN,
    BODY_MOVERS,
    STEERING,
    FoundDrive,
    kind_of,
)
from drake_navbench.inputs.descriptions.model import Model
from drake_navbench.inputs.descriptions.poses import number
from drake_navbench.inputs.descriptions.ros_packages import Packages
from drake_navbench.inputs.descriptions.wheel_layout import (
    LEAST,
    add_turning,
    drive_by_wheels,
    roll_along_y,
)
from drake_navbench.inputs.descriptions.xml_file import text_of

CONTROL = re.compile(r"ros2?_control")
PLUGIN_FILE = re.compile(r"<plugin\b[^>]*\bfilename\s*=\s*[\"']([^\"']+)")
# Larger limits in a model are bounds of the simulator, not of the robot.
FASTEST_MPS, FASTEST_RADPS, LARGEST_MPS2 = 20.0, 50.0, 200.0
# Values that may be negative.
SIGNED = ("min_linear_velocity_mps", "rear_axle_x_m")
# The share by which wheels may differ from those of the model's links.
WHEEL_TOLERANCE = 0.1
# The bound of every joint in ros2_control's examples, rad/s. Robots copy it for their wheels, which
# it would hold to 3 to 10 cm/s; they drive faster.
EXAMPLE_RADPS = 1.0


def drive_of(
    model: Model, wheels: Sequence[Wheel], packages: Packages, arguments: Sequence[str] = ()
) -> FoundDrive:
    """Returns a model's drive, by its plugin, else its ros2_control file, else its wheels.

    That file is named by the model or, where it names none, names joints of the model alone, and
    wheels among them.

    arguments: arguments of its xacro files; one of them may be the ros2_control file.
    """
    radius_m = next((w.radius_m for w in wheels if w.radius_m is not None), None)
    files = [*controller_files(model), *(a for a in arguments if a.endswith((".yaml", ".yml")))]
    found = _by_plugin(model) or by_controllers(files, packages)
    found = found or by_wheel_names(model, wheels, packages) or drive_by_wheels(model, wheels)
    values = dict(found.values)
    side = 0 if roll_along_y(wheels) else 1
    sides = [float(w.position[side]) for w in wheels]
    separation_m = max(sides) - min(sides) if len(sides) >= 2 else 0.0
    modelled = {"wheel_radius_m": radius_m or 0.0, "wheel_separation_m": separation_m}
    modelled = {name: value for name, value in modelled.items() if value > LEAST}
    is_plain = len(wheels) == 2 or found.kind == ACKERMANN
    # Bases that skid are often given another separation on purpose.
    told = {n: value for n, value in modelled.items() if is_plain or n == "wheel_radius_m"}
    differs = _differing(values, told)
    values = modelled | values
    if found.kind == ACKERMANN:
        add_turning(values, model, wheels, found.steering)
    remark = _add_wheel_limits(values, model, wheels)
    return found._replace(values=_sensible(values), remark=remark, differs=differs)


def has_drive(model: Model) -> bool:
    """Tells whether a plugin drives a model."""
    return any(_kind_of_plugin(plugin.name) for plugin in model.plugins)


def is_controlled(model: Model) -> bool:
    """Tells whether ros2_control, or ROS 1's ros_control, moves joints of a model in Gazebo."""
    return any(CONTROL.search(plugin.name) for plugin in model.plugins)


def names_drive(text: str) -> bool:
    """Tells whether a plugin in an XML text drives a model."""
    return any(kind_of(file) for file in PLUGIN_FILE.findall(text))


def _kind_of_plugin(name: str) -> str:
    """Returns the kind of drive by a plugin's file and class; a mere label tells nothing."""
    first, *others = name.split() or [""]
    return kind_of(" ".join([first, *(word for word in others if "::" in word)]))


def _by_plugin(model: Model) -> FoundDrive | None:
    for plugin in model.plugins:
        kind = _kind_of_plugin(plugin.name)
        if kind:
            name = plugin.name.split()[0]
            steering = frozenset(
                (part.text or "").strip() for part in plugin.element.iter() if "steer" in part.tag
            )
            values = _plugin_values(plugin.element, kind)
            if any(word in name.lower() for word in BODY_MOVERS):
                values = {n: value for n, value in values.items() if not n.startswith("wheel_")}
            return FoundDrive(kind, name, values, steering=steering)
    return None


def _plugin_values(plugin: ElementTree.Element, kind: str) -> dict[str, float]:
    def told(*names: str) -> float | None:
        return next((v for v in (number(text_of(plugin, n)) for n in names) if v is not None), None)

    diameter = told("wheel_diameter", "wheelDiameter")
    radius = told("wheel_radius", "wheelRadius") or (0.5 * diameter if diameter else None)
    values = {
        "wheel_radius_m": radius,
        "wheel_separation_m": told("wheel_separation", "wheelSeparation", "kingpin_width"),
        "max_linear_velocity_mps": told("max_linear_velocity", "max_velocity", "max_speed"),
        "min_linear_velocity_mps": told("min_linear_velocity", "min_velocity"),
        # Gazebo's max_velocity and max_acceleration bound driving and turning alike.
        "max_angular_velocity_radps": told("max_angular_velocity", "max_velocity"),
        "max_linear_acceleration_mps2": told(
            # The classic plugin's acceleration is that of a wheel's rim, m/s^2; 0 stands for none.
            "max_linear_acceleration",
            "max_acceleration",
            *("max_wheel_acceleration", "wheelAcceleration"),
        ),
        "max_angular_acceleration_radps2": told("max_angular_acceleration", "max_acceleration"),
    }
    if kind == ACKERMANN:
        values["wheelbase_m"] = told("wheel_base", "wheelbase")
        values[STEERING] = told("steering_limit", "max_steer")
    return {name: value for name, value in values.items() if value is not None}


def _differing(values: Mapping[str, float], modelled: Mapping[str, float]) -> str:
    """Returns in words how told wheels differ from the model's; '' where they do not."""
    names = {"wheel_radius_m": "radius", "wheel_separation_m": "separation"}
    told = [
        f"{names[name]} {values[name]:.3g} m, that of the model's wheels is {value:.3g} m"
        for name, value in modelled.items()
        if name in values and abs(values[name] - value) > WHEEL_TOLERANCE * value
    ]
    return "; ".join(told)


def _add_wheel_limits(values: dict[str, float], model: Model, wheels: Sequence[Wheel]) -> str:
    """Adds the speed at the wheels' limit; returns a remark on an unused limit."""
    limits = [w.joint.velocity_radps for w in wheels if w.joint.velocity_radps]
    commands = command_limits(model, [w.joint for w in wheels], "velocity")
    limits += [value for value in commands if value != EXAMPLE_RADPS]
    radius = values.get("wheel_radius_m")
    if limits and radius and "max_linear_velocity_mps" not in values:
        values["max_linear_velocity_mps"] = min(limits) * radius
    if EXAMPLE_RADPS not in commands:
        return ""
    return "ros2_control's bound of 1 rad/s on the wheels is its examples' and not used"


def _sensible(values: Mapping[str, float]) -> dict[str, float]:
    """Returns the values without bounds that bound nothing, such as 1e16 rad/s or 0."""
    most = {
        "max_linear_velocity_mps": FASTEST_MPS,
        "max_lateral_velocity_mps": FASTEST_MPS,
        "max_angular_velocity_radps": FASTEST_RADPS,
        "max_linear_acceleration_mps2": LARGEST_MPS2,
        "max_lateral_acceleration_mps2": LARGEST_MPS2,
        "max_angular_acceleration_radps2": LARGEST_MPS2,
    }
    kept = {
        name: value
        for name, value in values.items()
        if name in SIGNED or LEAST <= value <= most.get(name, math.inf)
    }
    back = kept.get("min_linear_velocity_mps")
    if back is not None and not -FASTEST_MPS <= back <= 0.0:
        del kept["min_linear_velocity_mps"]
    if "max_linear_velocity_mps" in kept and "min_linear_velocity_mps" not in kept:
        kept["min_linear_velocity_mps"] = -kept["max_linear_velocity_mps"]
    return kept
