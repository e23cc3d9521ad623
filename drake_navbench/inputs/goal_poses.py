"""Poses in the many forms in which users write them: x, y and a heading from mappings and lists.

A mapping has x and y, or a position and an orientation; a list has 2 numbers (x, y), 3 (x, y, yaw),
4 (x, y, z, yaw, or x, y and z, w of a quaternion), 6 (x, y, z, roll, pitch, yaw) or 7 (x, y, z and
a quaternion x, y, z, w, as in geometry_msgs). Lengths in m; headings in rad, but in degrees where
their name says so.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeGuard

from drake_navbench.errors import InputError
from drake_navbench.typed_files.quantities import MAX_LENGTH_M, Pose
from drake_navbench.typed_files.yaml_loader import DECIMAL

# The beginnings of the names of a position's numbers.
OF_POSITION = ("", "pos_", "position_", "pose_position_", "pose_", "goal_", "target_", "p")
# Names of a quaternion's z, such as qz, orientation_z, z_orient; the other three are alike.
OF_QUATERNION = re.compile(
    r"((?:\w+_)?(?:q|o|ori|orient|orientation|rot|rotation|quat|quaternion)_?)z"
    r"|z(_(?:q|ori|orient|orientation|rot|rotation|quat|quaternion))"
)
POSITIONS = ("position", "point", "translation", "location", "coordinates", "coords", "xy", "pos")
ORIENTATIONS = ("orientation", "quaternion", "rotation", "quat", "orientation_rpy", "rpy")
POSES = ("pose", "goal", "target", "waypoint", "goal_pose", "target_pose", "pose_stamped", "center")
# A heading by one of the first four names is a number; other names may stand for something else.
YAWS = ("yaw", "theta", "heading", "psi", "th", "angle", "phi", "direction", "h", "a", "rz", "rot")
DEGREES = re.compile(r"[_\s]*[\[(]?(deg|degrees?)[\])]?$")
UNITS = re.compile(r"(?:_(?:m|rad))?(?:\s*[\[(](?:m|met(?:er|re)s?|rad|radians?)[\])])?$")
LATITUDES, LONGITUDES = ("latitude", "lat"), ("longitude", "lon", "lng", "long")
LENGTHS = (2, 3, 4, 6, 7)
# The largest x or y of a quaternion that turns about the vertical; localization has some tilt.
MAX_TILT = 0.1
UNIT_TOLERANCE = 0.02


class FoundPose(NamedTuple):
    """A place, x and y in m, and its heading in rad; None where the file has none.

    is_on_earth: x is a longitude and y a latitude, in degrees; `goal_on_earth.py` makes them m.
    is_unit_open: whether the file does not tell the unit of the heading, which is in rad only if
    the headings of other places do not show degrees.
    """

    x: float
    y: float
    yaw: float | None = None
    is_on_earth: bool = False
    is_unit_open: bool = False

    @property
    def standing(self) -> Pose:
        """The pose, at a yaw of 0 if the file has none."""
        return self.x, self.y, self.yaw or 0.0

    def facing(self, turn: Turn | None) -> FoundPose:
        """Returns the pose with a heading, itself where it is None."""
        return self if turn is None else self._replace(yaw=turn.yaw, is_unit_open=turn.is_unit_open)


class Turn(NamedTuple):
    """A heading, as in `FoundPose`."""

    yaw: float
    is_unit_open: bool = False


def number_of(value: Any) -> float | None:
    """Returns a number, also one in quotes; None for anything else, true and NaN among it."""
    if isinstance(value, str) and re.fullmatch(DECIMAL, value.strip()):
        value = float(value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if math.isfinite(value) else None


def is_numbers(value: Any) -> TypeGuard[Sequence[Any]]:
    """Tells whether a value is a list of as many numbers as a pose may have."""
    is_list = isinstance(value, Sequence) and not isinstance(value, str)
    return is_list and len(value) in LENGTHS and all(number_of(one) is not None for one in value)


def pose_of(value: Any, where: str) -> FoundPose | None:
    """Returns the pose that a mapping, or a list of a position and an orientation, stands for.

    where: the value's place in errors, file and field. Returns None for a value that is no pose.
    Raises InputError where x or y is no number, or where the orientation is not level.
    """
    if isinstance(value, Mapping):
        return _pose_of_mapping(_renamed(value), where)
    if isinstance(value, list) and len(value) == 2 and all(map(is_numbers, value)):
        position, turn = value
        if len(position) in (2, 3) and len(turn) == 4:
            x, y = (float(number_of(one) or 0.0) for one in position[:2])
            return checked(FoundPose(x, y).facing(_turn_of(turn, where)), where)
    return None


def pose_of_numbers(numbers: Sequence[Any], where: str, *, has_quaternions: bool) -> FoundPose:
    """Returns the pose of a plain list of 2, 3, 4, 6 or 7 numbers; raises InputError.

    has_quaternions: whether the last two of 4 numbers are z and w of a quaternion.
    """
    x, y, *rest = (float(number_of(one) or 0.0) for one in numbers)
    if len(rest) == 2 and has_quaternions:
        turn = _turn_of([0.0, 0.0, *rest], where)
    elif len(rest) == 5:
        turn = _turn_of(rest[1:], where)
    else:
        turn = Turn(rest[-1], is_unit_open=True) if rest else None
    return checked(FoundPose(x, y).facing(turn), where)


def ends_in_quaternion(numbers: Sequence[Any]) -> bool:
    """Tells whether the last two of four numbers are z and w of a level quaternion: length 1."""
    z, w = (number_of(one) or 0.0 for one in numbers[-2:])
    return len(numbers) == 4 and abs(math.hypot(z, w) - 1.0) <= UNIT_TOLERANCE


def below(where: str, name: object) -> str:
    """Returns the place of a field in errors; where: its mapping's, a file's one ends in ': '."""
    return f"{where}{name}" if where.endswith(": ") else f"{where}.{name}"


def shown(where: str) -> str:
    """Returns a place as errors begin with it."""
    return where.removesuffix(": ")


def checked(pose: FoundPose, where: str) -> FoundPose:
    """Returns a pose; raises InputError where it is farther away than any map reaches."""
    if pose.is_on_earth and not (abs(pose.y) <= 90.0 and abs(pose.x) <= 360.0):
        raise InputError(
            f"{shown(where)}: latitude {pose.y:g}, longitude {pose.x:g}; expected -90 to 90 and "
            "-360 to 360 degrees"
        )
    if max(abs(pose.x), abs(pose.y)) > MAX_LENGTH_M:
        raise InputError(
            f"{shown(where)}: x {pose.x:.10g}, y {pose.y:.10g}; expected m in the map's frame, "
            f"{-MAX_LENGTH_M:g} to {MAX_LENGTH_M:g}"
        )
    return pose


def _renamed(value: Mapping[Any, Any]) -> dict[str, Any]:
    """Returns a mapping with small names without units; x, y, Y has its yaw as `yaw`."""
    names = {str(key).strip(): one for key, one in value.items()}
    if {"x", "y", "Y"} <= names.keys():
        names["yaw"] = names.pop("Y")
    small: dict[str, Any] = {}
    for key, one in names.items():
        small.setdefault(UNITS.sub("", key.lower().replace(".", "_")), one)
    return small


def _pose_of_mapping(value: Mapping[str, Any], where: str) -> FoundPose | None:
    turn = _turn_in(value, where)
    named = {DEGREES.sub("", name): name for name in value}
    latitude = next((named[name] for name in LATITUDES if name in named), None)
    longitude = next((named[name] for name in LONGITUDES if name in named), None)
    if latitude and longitude and "x" not in value:
        y, x = (_required(value, name, where, "degrees") for name in (latitude, longitude))
        return checked(FoundPose(x, y, is_on_earth=True).facing(turn), where)
    for begin in OF_POSITION:
        if f"{begin}x" in value and f"{begin}y" in value:
            x, y = (_required(value, f"{begin}{axis}", where) for axis in "xy")
            return checked(FoundPose(x, y).facing(turn), where)
    for name in POSITIONS:
        inner = value.get(name)
        if is_numbers(inner):
            x, y = (float(number_of(one) or 0.0) for one in inner[:2])
            return checked(FoundPose(x, y).facing(turn), where)
        if isinstance(inner, Mapping):
            found = _pose_of_mapping(_renamed(inner), below(where, name))
            if found is not None:
                return found.facing(turn)
    for name in POSES:
        inner = value.get(name)
        if is_numbers(inner):
            quaternions = ends_in_quaternion(inner)
            found = pose_of_numbers(inner, below(where, name), has_quaternions=quaternions)
        else:
            found = pose_of(inner, below(where, name))
        if found is not None:
            return found.facing(turn)
    return None


def _required(value: Mapping[str, Any], name: str, where: str, unit: str = "m") -> float:
    found = number_of(value[name])
    if found is None:
        raise InputError(f"{below(where, name)}: got {value[name]!r}; expected a number, in {unit}")
    return found


def _turn_in(value: Mapping[str, Any], where: str) -> Turn | None:
    """Returns the heading that a mapping has beside its position; None without one."""
    for name in ORIENTATIONS:
        turn = value.get(name)
        if isinstance(turn, list) and len(turn) == 4 and isinstance(value.get("pose"), list):
            # The form of Nav2's panel in RViz, which writes w first.
            turn = [*turn[1:], turn[0]]
        if isinstance(turn, Mapping | list | int | float):
            return _turn_of(turn, below(where, name))
    for name in value:
        found = OF_QUATERNION.fullmatch(name)
        if found is not None:
            begin, end = found[1] or "", found[2] or ""
            return _turn_of({a: value.get(f"{begin}{a}{end}", 0.0) for a in "xyzw"}, where)
    for name, one in value.items():
        plain = DEGREES.sub("", name)
        if plain in YAWS and (yaw := number_of(one)) is not None:
            return Turn(yaw, is_unit_open=True) if plain == name else Turn(math.radians(yaw))
        if plain in YAWS[:4] and one not in (None, ""):
            unit = "rad" if plain == name else "degrees"
            raise InputError(f"{below(where, name)}: got {one!r}; expected a number, in {unit}")
    if {"z", "w"} <= value.keys() and ends_in_quaternion([0.0, 0.0, value["z"], value["w"]]):
        return _turn_of({"z": value["z"], "w": value["w"]}, where)
    return None


def _turn_of(turn: Any, where: str) -> Turn | None:
    """Returns the yaw of an orientation: a number, roll, pitch and yaw, or a quaternion.

    Returns None for a quaternion of zeros, which is none. Raises InputError where it tilts, or has
    a part that is no number.
    """
    if isinstance(turn, Mapping):
        if "w" not in turn:
            return _turn_in(_renamed(turn), where)
        turn = [turn.get(axis, 0.0) for axis in "xyzw"]
    parts = [number_of(one) for one in (turn if isinstance(turn, list) else [turn])]
    numbers = [one for one in parts if one is not None]
    if len(numbers) < len(parts):
        raise InputError(f"{shown(where)}: got {turn}; expected numbers")
    if len(numbers) != 4:
        return Turn(numbers[-1], is_unit_open=True) if numbers else None
    length = math.hypot(*numbers)
    if length == 0.0:
        return None
    x, y, z, w = (one / length for one in numbers)
    if max(abs(x), abs(y)) > MAX_TILT:
        raise InputError(
            f"{shown(where)}: a quaternion x {x:.3g}, y {y:.3g}, z {z:.3g}, w {w:.3g} tilts; "
            "expected that of a robot on the floor, in this order, with x and y of 0"
        )
    return Turn(math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))
