"""Resting positions of an arm's joints: those of ros2_control's start, or of an SRDF's state.

A URDF tells no position: an arm at its joints' zeros may stretch a metre ahead of its robot.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from drake_navbench.errors import InputError
from drake_navbench.inputs.descriptions.poses import number
from drake_navbench.inputs.descriptions.ros_packages import Packages
from drake_navbench.inputs.descriptions.xml_file import read_xml
from drake_navbench.typed_files.input_file import MEGABYTE, read_input

# The kinds of joints of an arm.
MOVING = ("revolute", "continuous", "prismatic")
# Words in the name of a joint, or of its link, that is no arm's.
NO_ARM = re.compile(r"(?i)wheel|cast[eo]r|steer")
SRDF = re.compile(r"\.srdf(\.xacro)?$")
MAX_SRDF_BYTES = 4 * MEGABYTE
# Names of an SRDF's states in which an arm rests; those for a drive first.
RESTING = (
    re.compile(r"(?i)stow|tuck|fold|dock|transport|travel|driv|carry|park"),
    re.compile(r"(?i)home|rest|init|default"),
)
SUBSTITUTION = re.compile(r"\$\{[^}]*\}")
# So many joints without a told position are an arm.
LEAST_JOINTS = 3


class Resting(NamedTuple):
    """Positions by joint, rad or m; remark: where they are from, '' without an arm.

    is_told: whether a file tells them.
    """

    positions: Mapping[str, float]
    remark: str = ""
    is_told: bool = False


WITHOUT_ARM = Resting({})


class _State(NamedTuple):
    name: str
    group: str
    positions: dict[str, float]


def resting_joints(robot: ElementTree.Element, packages: Packages) -> Resting:
    """Returns the resting positions of the joints of a <robot> but those of wheels.

    The positions with which ros2_control starts count, else those of a state called `stowed`,
    `home` or the like in an SRDF with this robot's joints; where these are all 0, none is told.
    """
    driven = _driven(robot)
    joints = [
        joint
        for joint in robot.findall("joint")
        if _is_of_arm(joint) and joint.get("name") not in driven
    ]
    names = [joint.get("name", "") for joint in joints]
    positions, source = _by_control(robot, names), "as ros2_control starts them"
    if not any(positions.values()) and names:
        positions, source = _by_srdf(names, packages)
    if not any(positions.values()):
        free = [joint.get("name", "") for joint in joints if joint.find("mimic") is None]
        if len(free) < LEAST_JOINTS:
            return WITHOUT_ARM
        return Resting({}, f"{_listed(free)} at 0: no file tells where they rest")
    moved = [f"{name} {value:.3g}" for name, value in positions.items() if value]
    return Resting(positions | _mimicked(joints, positions), f"{_listed(moved)}, {source}", True)


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - 2} more" if len(names) > 2 else ""
    return ", ".join(names[:2]) + more


def _is_of_arm(joint: ElementTree.Element) -> bool:
    child = joint.find("child")
    words = f"{joint.get('name')} {'' if child is None else child.get('link')}"
    return joint.get("type") in MOVING and NO_ARM.search(words) is None


def _driven(robot: ElementTree.Element) -> set[str]:
    """Returns the joints that a plugin of the base names: those of wheels, whatever their names."""
    return {
        (part.text or "").strip()
        for plugin in robot.iter("plugin")
        if "drive" in f"{plugin.get('name')} {plugin.get('filename')}".lower()
        for part in plugin.iter()
        if part.tag.endswith("_joint")
    }


def _by_control(robot: ElementTree.Element, names: Collection[str]) -> dict[str, float]:
    """Returns the positions with which the blocks of ros2_control start."""
    found = {}
    for joint in robot.findall("ros2_control/joint"):
        for state in joint.findall("state_interface"):
            if state.get("name") != "position" or joint.get("name") not in names:
                continue
            told = [p.text for p in state.findall("param") if p.get("name") == "initial_value"]
            value = number(told[0]) if told else None
            if value is not None:
                found[str(joint.get("name"))] = value
    return found


def _by_srdf(names: Collection[str], packages: Packages) -> tuple[dict[str, float], str]:
    """Returns the positions in the nearest SRDF of this robot, and which states they are."""
    for file in packages.files(lambda file: SRDF.search(file.name) is not None):
        taken: dict[str, _State] = {}
        states = [state for state in _states(file) if state.positions.keys() <= set(names)]
        for words in RESTING:
            for state in states:
                if words.search(state.name):
                    taken.setdefault(state.group, state)
        positions = {
            name: value for state in taken.values() for name, value in state.positions.items()
        }
        if any(positions.values()):
            called = dict.fromkeys(state.name for state in taken.values())
            return positions, f"in the state {', '.join(called)} of {file.name}"
    return {}, ""


def _states(file: Path) -> Iterator[_State]:
    """Yields the states of an SRDF, their names without a prefix that xacro would put before."""
    try:
        root = read_xml(read_input(file, max_bytes=MAX_SRDF_BYTES), str(file))
    except InputError:
        return
    for state in root.iter("group_state"):
        values = {
            SUBSTITUTION.sub("", joint.get("name", "")): number(joint.get("value"))
            for joint in state.findall("joint")
        }
        positions = {name: value for name, value in values.items() if value is not None}
        if positions and len(positions) == len(values):
            name, group = (SUBSTITUTION.sub("", state.get(key, "")) for key in ("name", "group"))
            yield _State(name, group, positions)


def _mimicked(
    joints: Sequence[ElementTree.Element], positions: Mapping[str, float]
) -> dict[str, float]:
    """Returns the positions of joints that follow one of these."""
    found = {}
    for joint in joints:
        mimic = joint.find("mimic")
        value = None if mimic is None else positions.get(mimic.get("joint", ""))
        if mimic is not None and value is not None:
            factor, offset = number(mimic.get("multiplier")), number(mimic.get("offset"))
            factor = 1.0 if factor is None else factor
            found[joint.get("name", "")] = factor * value + (offset or 0.0)
    return found
