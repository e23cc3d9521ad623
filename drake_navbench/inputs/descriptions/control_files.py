"""A drive by ros2_control or ROS 1's ros_control: parameter files, limits in a model's blocks."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from pathlib import Path
from typing import Any

import yaml

from drake_navbench.errors import InputError
from drake_navbench.inputs.descriptions.body import Wheel
from drake_navbench.inputs.descriptions.drive_kinds import (
    FoundDrive,
    kind_of,
)
from drake_navbench.inputs.descriptions.model import Joint, Model
from drake_navbench.inputs.descriptions.poses import number
from drake_navbench.inputs.descriptions.ros_packages import Packages
from drake_navbench.typed_files.input_file import read_head_text
from drake_navbench.typed_files.ros_yaml import RosLoader
from drake_navbench.typed_files.typed_yaml import read_text
from drake_navbench.typed_files.yaml_loader import require_limits

CONTROL = ("ros2_control", "ros_control")
CONTROLLER_TYPE = re.compile(r"\btype[\"']?\s*:\s*[\"']?([\w/:]+)")
# left_wheel_names, front_left_wheel_command_joint_name, traction_joints_names, rear_wheels_names;
# left_wheel of ROS 1.
JOINTS_KEY = re.compile(r"(?:wheel|joint)s?_names?$|^(?:left|right)_wheel$")


def controller_files(model: Model) -> list[str]:
    """Returns the names of the parameter files of ros2_control's plugin."""
    plugins = [p for p in model.plugins if any(word in p.name for word in CONTROL)]
    return [
        (element.text or "").strip()
        for plugin in plugins
        for element in plugin.element.iter("parameters")
    ]


def by_controllers(files: Sequence[str], packages: Packages) -> FoundDrive | None:
    """Returns the drive in the first parameter file of ros2_control that has one."""
    for file in files:
        place = packages.place(file) if file else None
        found = None if place is None or not place.is_file() else _controllers_in(place)
        if found is not None:
            return found
    return None


def _may_have_controllers(file: Path) -> bool:
    if file.suffix not in (".yaml", ".yml"):
        return False
    return any(kind_of(kind) for kind in CONTROLLER_TYPE.findall(read_head_text(file)))


def by_wheel_names(model: Model, wheels: Sequence[Wheel], packages: Packages) -> FoundDrive | None:
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
    block = _read(path)
    nodes = dict(_nodes(block)) or dict(_nodes_of_ros1(block))
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
    types |= {name: str(own["type"]) for name, own in nodes.items() if "type" in own}
    for name, kind_name in types.items():
        kind, own = kind_of(kind_name), nodes.get(name, {})
        if kind and is_ours(_named_joints(own)):
            steers = _named_joints({key: own[key] for key in own if "steer" in str(key)})
            return FoundDrive(kind, path.name, _controller_values(own), steering=frozenset(steers))
    return None


def _read(path: Path) -> Mapping[str, Any]:
    """Returns a file's content, {} for no YAML; of equal keys the later counts, as in ROS."""
    try:
        text = read_text(path)
        require_limits(text)
        block = yaml.load(text, Loader=RosLoader)
    except (InputError, yaml.YAMLError, ValueError):
        return {}
    return block if isinstance(block, Mapping) else {}


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


def _nodes_of_ros1(
    block: Mapping[str, Any], name: str = ""
) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yields ROS 1's controllers, in any namespace: name and parameters.

    name: that of the block; '' for a whole file, whose name a launch file gives.
    """
    if isinstance(block.get("type"), str):
        yield name, block
        return
    for key, inner in block.items():
        if isinstance(inner, Mapping):
            yield from _nodes_of_ros1(inner, str(key))


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
        "wheel_separation_multiplier": "wheel_separation_multiplier",
        "wheel_radius_m": "wheel_radius",
        "max_linear_velocity_mps": "linear.x.max_velocity",
        "min_linear_velocity_mps": "linear.x.min_velocity",
        "max_linear_acceleration_mps2": "linear.x.max_acceleration",
        "max_lateral_velocity_mps": "linear.y.max_velocity",
        "max_lateral_acceleration_mps2": "linear.y.max_acceleration",
        "max_angular_velocity_radps": "angular.z.max_velocity",
        "max_angular_acceleration_radps2": "angular.z.max_acceleration",
        "wheelbase_m": "wheelbase",
    }
    values = {ours: told(theirs) for ours, theirs in names.items() if is_on(theirs)}
    return {name: value for name, value in values.items() if value is not None}


def command_limits(model: Model, joints: Sequence[Joint], interface: str) -> list[float]:
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
