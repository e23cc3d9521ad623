"""ROS 2's message types as DDS carries them: names, type hashes and bytes.

The topic /scan is `rt/scan` in DDS, its type sensor_msgs/msg/LaserScan is
`sensor_msgs::msg::dds_::LaserScan_`. rosbags knows the fields, computes the hashes and makes the
bytes; Cyclone DDS gets a type with the same fields, by which it describes the topic to others.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from cyclonedds.idl import IdlStruct, make_idl_struct, types
from rosbags.interfaces import Nodetype

from drake_navbench.ros2.recordings.rosbags_extra import ros2_types

TOPIC_PREFIX = "rt"
BASE_TYPES: dict[str, Any] = {
    "bool": bool,
    "byte": types.byte,
    "char": types.uint8,
    "octet": types.byte,
    "string": str,
    **{
        name: getattr(types, name)
        for size in (8, 16, 32, 64)
        for name in (f"int{size}", f"uint{size}")
    },
    "float32": types.float32,
    "float64": types.float64,
}


def dds_topic(name: str) -> str:
    """Returns DDS's name for a topic such as /scan."""
    return TOPIC_PREFIX + name


def ros_topic(name: str) -> str | None:
    """Returns the topic for a name of DDS; None for services and for names that are not ROS's."""
    return name.removeprefix(TOPIC_PREFIX) if name.startswith(f"{TOPIC_PREFIX}/") else None


def dds_type(name: str) -> str:
    """Returns DDS's name for a type such as sensor_msgs/msg/LaserScan."""
    package, kind, last = name.split("/")
    return f"{package}::{kind}::dds_::{last}_"


def ros_type(name: str) -> str:
    """Returns the ROS type of a DDS type name; a name that is not a ROS type stays as it is."""
    parts = name.split("::")
    if len(parts) != 4 or parts[2] != "dds_":
        return name
    return f"{parts[0]}/{parts[1]}/{parts[3].removesuffix('_')}"


@cache
def type_hash(name: str) -> str:
    """Returns a type's hash, by which nodes since Iron tell whether they mean the same type."""
    return ros2_types().hash_rihs01(name)


class WireMessage:
    """A message as its bytes; `Wire` types of Cyclone DDS write and read it."""

    __slots__ = ("data", "sample_info", "type_name")

    def __init__(self, type_name: str, data: bytes) -> None:
        self.type_name = type_name
        self.data = data
        self.sample_info: Any = None

    def decoded(self) -> Any:
        """Returns the message; raises ValueError where the bytes are not of its type."""
        try:
            return ros2_types().deserialize_cdr(self.data, self.type_name)
        except Exception as error:
            # rosbags' generated code may raise any error here.
            raise ValueError(f"{self.type_name}: cannot be read: {error}") from error


@cache
def wire_type(name: str) -> type[Any]:
    """Returns Cyclone DDS's type for messages of a ROS type, whose objects are WireMessages."""
    described = _described(name)

    class Wire(WireMessage):
        """A message of one type."""

        __idl__ = described.__idl__
        __idl_typename__ = described.__idl_typename__

        def __init__(self, data: bytes) -> None:
            super().__init__(name, data)

        def serialize(self, use_version_2: bool | None = None) -> bytes:
            return self.data

        @classmethod
        def deserialize(cls, data: bytes) -> WireMessage:
            return cls(data)

        @classmethod
        def deserialize_key(cls, data: bytes) -> None:
            return None

    return Wire


def encoded(message: Any, type_name: str) -> Any:
    """Returns a message of rosbags as an object of its `wire_type`."""
    return wire_type(type_name)(bytes(ros2_types().serialize_cdr(message, type_name)))


@cache
def _described(name: str) -> type[IdlStruct]:
    """Returns the structure of a type, with all its fields."""
    _, fields = ros2_types().fielddefs[name]
    own_name = f"{name.rsplit('/', 1)[-1]}_"
    own_fields = {field: _field_type(description) for field, description in fields}
    return make_idl_struct(own_name, dds_type(name), own_fields)


def _field_type(description: Any) -> Any:
    array, sequence = vars(types)["array"], vars(types)["sequence"]
    kind, argument = description
    if kind == Nodetype.BASE:
        return BASE_TYPES[argument[0]]
    if kind == Nodetype.NAME:
        return _described(argument)
    element, count = argument
    if kind == Nodetype.ARRAY:
        return array[_field_type(element), count]
    if count:
        return sequence[_field_type(element), count]
    return sequence[_field_type(element)]
