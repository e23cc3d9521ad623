"""The library that reads and writes bags, which not every installation has."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import IO, TYPE_CHECKING, cast

from drake_navbench.errors import InputError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

# Messages of cars, which the library does not know; recordings in sqlite3 bring no definitions.
CARS: Mapping[str, str] = {
    "ackermann_msgs/msg/AckermannDrive": (
        "float32 steering_angle\nfloat32 steering_angle_velocity\n"
        "float32 speed\nfloat32 acceleration\nfloat32 jerk\n"
    ),
    "ackermann_msgs/msg/AckermannDriveStamped": (
        "std_msgs/Header header\nackermann_msgs/AckermannDrive drive\n"
    ),
}

HOW_TO_INSTALL = "pip install 'drake-navbench[bags]'"


def require_rosbags() -> None:
    """Raises InputError where the library is not installed."""
    if find_spec("rosbags") is None:
        raise InputError(f"bags need the library rosbags, which is not installed: {HOW_TO_INSTALL}")


@lru_cache(maxsize=1)
def ros2_types() -> Typestore:
    """Returns ROS 2's message types; those used here are the same from Humble to Lyrical."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    types = get_typestore(Stores.ROS2_JAZZY)
    for name, text in CARS.items():
        types.register(get_types_from_msg(text, name))
    return types


def open_zstd(path: Path) -> IO[bytes]:
    """Returns a file that zstd has packed, opened to be read unpacked."""
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd
    return cast("IO[bytes]", zstd.open(path, "rb"))
