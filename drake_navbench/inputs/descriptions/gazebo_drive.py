"""The drive of a model, read from its Gazebo plugins and its ros2_control blocks and files."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from drake_navbench.errors import InputError
from drake_navbench.inputs.descriptions.body import TURNING, Wheel, carrier_of, turning_centre
from drake_navbench.inputs.descriptions.model import Joint, Model
from drake_navbench.inputs.descriptions.poses import number
from drake_navbench.inputs.descriptions.ros_packages import Packages
from drake_navbench.inputs.descriptions.xml_file import text_of
from drake_navbench.kernels.arrays import Array
from drake_navbench.typed_files.typed_yaml import read_yaml

DIFFERENTIAL, OMNIDIRECTIONAL, ACKERMANN = "differential", "omnidirectional", "ackermann"
# Words in a plugin's file or name, or a controller's type -> kind of drive; the first fit counts.
KINDS = (
    ("ackermann", ACKERMANN),
    ("tricycle", ACKERMANN),
    ("bicycle_steering", ACKERMANN),
    ("mecanum", OMNIDIRECTIONAL),
    ("planar_move", OMNIDIRECTIONAL),
    ("planar-move", OMNIDIRECTIONAL),
    # "omni" alone would not do: there are omnidirectional receivers and cameras.
    ("omni_wheel", OMNIDIRECTIONAL),
    ("omni_drive", OMNIDIRECTIONAL),
    ("omnidirectional", OMNIDIRECTIONAL),
    ("velocity-control", OMNIDIRECTIONAL),
    ("diff_drive", DIFFERENTIAL),
    ("diff-drive", DIFFERENTIAL),
    ("diffdrive", DIFFERENTIAL),
    ("skid_steer", DIFFERENTIAL),
    ("skid-steer", DIFFERENTIAL),
)
# Plugins that move the body itself, and read nothing of its wheels.
BODY_MOVERS = ("planar_move", "planar-move", "velocity-control")
PLUGIN_FILE = re.compile(r"<plugin\b[^>]*\bfilename\s*=\s*[\"']([^\"']+)")
CONTROL = ("ros2_control", "ros_control")
CONTROLLERS_FILE = re.compile(r"control.*\.ya?ml$")
# left_wheel_names, front_left_wheel_command_joint_name, traction_joints_names, rear_wheels_names.
JOINTS_KEY = re.compile(r"(?:wheel|joint)s?_names?$")
# Larger limits in a model are bounds of the simulator, not of the robot.
FASTEST_MPS, FASTEST_RADPS, LARGEST_MPS2 = 20.0, 50.0, 200.0
LEAST = 1e-3
# The largest angle of the steering, rad, on the way to the turning radius.
STEERING = "steering_limit_rad"
# Values that may be negative.
SIGNED = ("min_linear_velocity_mps", "rear_axle_x_m")
# The least vertical part of the axis of a joint that steers.
UPRIGHT = 0.9
# The largest distance, across its axle, of a steered wheel from its steering axis, m.
TRAIL_M = 0.01
# The share by which wheels may differ from those of the model's links.
WHEEL_TOLERANCE = 0.1
# The cosine of the angle, 15 degrees, below which two axles count as parallel.
SAME_AXLE = math.cos(math.radians(15.0))
# The bound of every joint in ros2_control's examples, rad/s. Robots copy it for their wheels, which
# it would hold to 3 to 10 cm/s; they drive faster.
EXAMPLE_RADPS = 1.0


class FoundDrive(NamedTuple):
    """A drive as a robot's model describes it.

    kind: '' for unknown. source: the part of the model that tells it. values: by our own names, SI
    units.

    remark: a limit in the files that is not used, and why; '' without one. differs: how its wheels
    differ from those of the model's links; '' without a difference. steering: joints that the
    plugin or controller steers, by its own words.
    """

    kind: str
    source: str
    values: dict[str, float]
    remark: str = ""
    differs: str = ""
    steering: frozenset[str] = frozenset()


def drive_of(
    model: Model, wheels: Sequence[Wheel], packages: Packages, arguments: Sequence[str] = ()
) -> FoundDrive:
    """Returns a model's drive, by its plugin, else its ros2_control file, else its wheels.

    That file is named by the model or, where it names none, names joints of the model alone, and
    wheels among them.

    arguments: arguments of its xacro files; one of them may be the ros2_control file.
    """
    radius_m = next((w.radius_m for w in wheels if w.radius_m is not None), None)
    files = [*_controller_files(model), *(a for a in arguments if a.endswith((".yaml", ".yml")))]
    found = _by_plugin(model) or _by_controllers(files, packages)
    found = found or _by_wheel_names(model, wheels, packages)
    if found is None:
        names = [f"{model.name} {w.joint.child}".lower() for w in wheels]
        # Two driven wheels with an omni wheel as their caster are a differential base.
        is_mecanum = len(names) >= 3 and all("mecanum" in n or "omni" in n for n in names)
        steered = {joint.child for joint in _steering(model, wheels)}
        is_omni = (
            is_mecanum or (not steered and _rolls_sideways(wheels)) or _all_turn(model, wheels)
        )
        kind = OMNIDIRECTIONAL if is_omni else DIFFERENTIAL if len(wheels) >= 2 else ""
        if steered and any(carrier_of(model, w) not in steered for w in wheels):
            kind = ACKERMANN
        found = FoundDrive(kind, f"{len(wheels)} wheels" if wheels else "", {})
    values = dict(found.values)
    sides = [float(w.position[1]) for w in wheels]
    separation_m = max(sides) - min(sides) if len(sides) >= 2 else 0.0
    modelled = {"wheel_radius_m": radius_m or 0.0, "wheel_separation_m": separation_m}
    modelled = {name: value for name, value in modelled.items() if value > LEAST}
    is_plain = len(wheels) == 2 or found.kind == ACKERMANN
    # Bases that skid are often given another separation on purpose.
    told = {n: value for n, value in modelled.items() if is_plain or n == "wheel_radius_m"}
    differs = _differing(values, told)
    values = modelled | values
    if found.kind == ACKERMANN:
        _add_turning(values, model, wheels, found.steering)
    remark = _add_wheel_limits(values, model, wheels)
    return found._replace(values=_sensible(values), remark=remark, differs=differs)


def has_drive(model: Model) -> bool:
    """Tells whether a plugin drives a model."""
    return any(_kind_of_plugin(plugin.name) for plugin in model.plugins)


def names_drive(text: str) -> bool:
    """Tells whether a plugin in an XML text drives a model."""
    return any(_kind_of(file) for file in PLUGIN_FILE.findall(text))


def _kind_of_plugin(name: str) -> str:
    """Returns the kind of drive by a plugin's file and class; a mere label tells nothing."""
    first, *others = name.split() or [""]
    return _kind_of(" ".join([first, *(word for word in others if "::" in word)]))


def _kind_of(text: str) -> str:
    return next((kind for word, kind in KINDS if word in text.lower()), "")


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
            "max_wheel_acceleration",
        ),
        "max_angular_acceleration_radps2": told("max_angular_acceleration", "max_acceleration"),
    }
    if kind == ACKERMANN:
        values["wheelbase_m"] = told("wheel_base", "wheelbase")
        values[STEERING] = told("steering_limit", "max_steer")
    return {name: value for name, value in values.items() if value is not None}


def _controller_files(model: Model) -> list[str]:
    """Returns the names of the parameter files of ros2_control's plugin."""
    plugins = [p for p in model.plugins if any(word in p.name for word in CONTROL)]
    return [
        (element.text or "").strip()
        for plugin in plugins
        for element in plugin.element.iter("parameters")
    ]


def _by_controllers(files: Sequence[str], packages: Packages) -> FoundDrive | None:
    """Returns the drive in the first parameter file of ros2_control that has one."""
    for file in files:
        place = packages.place(file) if file else None
        found = None if place is None or not place.is_file() else _controllers_in(place)
        if found is not None:
            return found
    return None


def _may_have_controllers(file: Path) -> bool:
    return CONTROLLERS_FILE.search(file.name) is not None


def _by_wheel_names(model: Model, wheels: Sequence[Wheel], packages: Packages) -> FoundDrive | None:
    """Returns the drive in the nearest controllers file of this model.

    Launch files name the controllers file where a model does not.
    """
    driven = {wheel.joint.name for wheel in wheels}
    joints = {joint.name for joint in model.joints}
    for file in packages.files(_may_have_controllers) if driven else ():
        found = _controllers_in(file, lambda named: named <= joints and bool(named & driven))
        if found is not None:
            return found
    return None


def _controllers_in(
    path: Path, is_ours: Callable[[Set[str]], bool] = lambda _: True
) -> FoundDrive | None:
    """Returns the first drive in a controllers file.

    is_ours: tells by the joints that a controller drives and steers whether it counts.
    """
    try:
        nodes = dict(_nodes(read_yaml(path)))
    except InputError:
        return None
    parameters = [pair for block in nodes.values() for pair in block.items()]
    types = {
        name: str(block.get("type", "")) for name, block in parameters if isinstance(block, Mapping)
    }
    # Names may be written with points, too.
    types |= {
        str(name).removesuffix(".type"): kind
        for name, kind in parameters
        if str(name).endswith(".type") and isinstance(kind, str)
    }
    for name, kind_name in types.items():
        kind, own = _kind_of(kind_name), nodes.get(name, {})
        if kind and is_ours(_named_joints(own)):
            steers = _named_joints({key: own[key] for key in own if "steer" in str(key)})
            return FoundDrive(kind, path.name, _controller_values(own), steering=frozenset(steers))
    return None


def _named_joints(parameters: Mapping[str, Any]) -> set[str]:
    """Returns the joints that a controller of ros2_control drives and steers."""
    named = [value for key, value in parameters.items() if JOINTS_KEY.search(str(key))]
    return {
        str(name) for value in named for name in (value if isinstance(value, list) else [value])
    }


def _nodes(block: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yields the nodes of a parameter file, without namespaces: name and parameters."""
    for name, node in block.items():
        if isinstance(node, Mapping):
            parameters = node.get("ros__parameters")
            if isinstance(parameters, Mapping):
                yield str(name).rpartition("/")[2], parameters
            else:
                yield from _nodes(node)


def _controller_values(parameters: Mapping[str, Any]) -> dict[str, float]:
    def at(path: str) -> Any:
        value: Any = parameters.get(path)
        if value is None:
            value = parameters
            for part in path.split("."):
                value = value.get(part) if isinstance(value, Mapping) else None
        return value

    def is_on(path: str) -> bool:
        axis, _, limit = path.rpartition(".")
        kind = limit.rpartition("_")[2]
        return not axis or at(f"{axis}.has_{kind}_limits") is not False

    def told(path: str) -> float | None:
        value = at(path)
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return float(value) if is_number and math.isfinite(value) else None

    names = {
        "wheel_separation_m": "wheel_separation",
        "wheel_radius_m": "wheel_radius",
        "max_linear_velocity_mps": "linear.x.max_velocity",
        "min_linear_velocity_mps": "linear.x.min_velocity",
        "max_linear_acceleration_mps2": "linear.x.max_acceleration",
        "max_angular_velocity_radps": "angular.z.max_velocity",
        "max_angular_acceleration_radps2": "angular.z.max_acceleration",
        "wheelbase_m": "wheelbase",
    }
    values = {ours: told(theirs) for ours, theirs in names.items() if is_on(theirs)}
    return {name: value for name, value in values.items() if value is not None}


def _steering(model: Model, wheels: Sequence[Wheel]) -> list[Joint]:
    """Returns the joints that steer a wheel: upright, by less than a quarter of a turn."""
    carried = {carrier_of(model, w) for w in wheels}
    return [
        joint
        for joint in model.joints
        if joint.kind in TURNING
        and joint.child in carried
        and abs(joint.axis[2]) > UPRIGHT
        and max(-joint.range_rad[0], joint.range_rad[1]) < 0.5 * math.pi
    ]


def _all_turn(model: Model, wheels: Sequence[Wheel]) -> bool:
    """Tells whether three or more wheels each turn by half a turn or more, as in a swerve drive.

    Such a wheel stands under its upright joint; a caster's wheel trails behind it.
    """
    uprights = {
        joint.child: joint
        for joint in model.joints
        if joint.kind in TURNING
        and abs(joint.axis[2]) > UPRIGHT
        and joint.range_rad[1] - joint.range_rad[0] >= math.pi
    }
    for wheel in wheels:
        upright = uprights.get(carrier_of(model, wheel))
        if upright is None:
            return False
        axle = wheel.joint.axis / float(np.linalg.norm(wheel.joint.axis))
        offset = model.links[wheel.joint.child].pose[:3, 3] - upright.pose[:3, 3]
        if np.hypot(*(offset - (offset @ axle) * axle)[:2]) > TRAIL_M:
            return False
    return len(wheels) >= 3


def _differing(values: Mapping[str, float], modelled: Mapping[str, float]) -> str:
    """Returns in words how told wheels differ from the model's; '' where they do not."""
    names = {"wheel_radius_m": "radius", "wheel_separation_m": "separation"}
    told = [
        f"{names[name]} {values[name]:.3g} m, that of the model's wheels is {value:.3g} m"
        for name, value in modelled.items()
        if name in values and abs(values[name] - value) > WHEEL_TOLERANCE * value
    ]
    return "; ".join(told)


def _rolls_sideways(wheels: Sequence[Wheel]) -> bool:
    """Tells whether wheels that do not steer point as only omni wheels can.

    Their axles have three directions, or two with two wheels each.
    """
    counts: list[tuple[Array, int]] = []
    for wheel in wheels:
        axle = wheel.joint.axis / float(np.linalg.norm(wheel.joint.axis))
        place = next((n for n, (o, _) in enumerate(counts) if abs(axle @ o) > SAME_AXLE), None)
        if place is None:
            counts.append((axle, 1))
        else:
            counts[place] = (counts[place][0], counts[place][1] + 1)
    return len(counts) >= 3 or (len(counts) == 2 and min(count for _, count in counts) >= 2)


def _add_turning(
    values: dict[str, float], model: Model, wheels: Sequence[Wheel], named: Set[str]
) -> None:
    """Adds wheelbase, least turning radius and rear axle, by the wheels and their steering joints.

    The base turns about a point on the axle of the wheels that are not steered or, where no joint
    steers, on the rearmost axle. named: joints that a plugin steers, whatever their range.
    """
    along = [float(w.position[0]) for w in wheels]
    if along and max(along) - min(along) > LEAST:
        values.setdefault("wheelbase_m", max(along) - min(along))
    steering = _steering(model, wheels) or [j for j in model.joints if j.name in named]
    steered = {joint.child for joint in steering}
    fixed = [w for w in wheels if steered.isdisjoint((carrier_of(model, w), w.joint.child))]
    centre = turning_centre(model, fixed)
    if steering and centre is not None:
        values["rear_axle_x_m"] = float(centre[0])
    elif "wheelbase_m" in values and len(along) >= 3:
        values["rear_axle_x_m"] = min(along)
    bounds = [min(-j.range_rad[0], j.range_rad[1]) for j in steering]
    bounds += _command_limits(model, steering, "position")
    limit, wheelbase = values.pop(STEERING, min(bounds, default=0.0)), values.get("wheelbase_m")
    if wheelbase and 0.0 < limit < 0.5 * math.pi:
        values["min_turning_radius_m"] = wheelbase / math.tan(limit)


def _command_limits(model: Model, joints: Sequence[Joint], interface: str) -> list[float]:
    """Returns the largest commands, other than 0, that ros2_control takes for joints.

    interface: velocity, rad/s, or position, rad.
    """
    names = {joint.name for joint in joints}
    limits = []
    for plugin in model.plugins:
        for joint in plugin.element.iter("joint"):
            if plugin.name != "ros2_control" or joint.get("name") not in names:
                continue
            for command in joint.findall("command_interface"):
                if command.get("name") == interface:
                    most = [number(p.text) for p in command if p.get("name") == "max"]
                    limits += [value for value in most if value]
    return limits


def _add_wheel_limits(values: dict[str, float], model: Model, wheels: Sequence[Wheel]) -> str:
    """Adds the speed at the wheels' limit; returns a remark on an unused limit."""
    limits = [w.joint.velocity_radps for w in wheels if w.joint.velocity_radps]
    commands = _command_limits(model, [w.joint for w in wheels], "velocity")
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
        "max_angular_velocity_radps": FASTEST_RADPS,
        "max_linear_acceleration_mps2": LARGEST_MPS2,
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
