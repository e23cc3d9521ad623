"""The library that reads and writes bags, which not every installation has."""

from __future__ import annotations

import sys
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import IO, TYPE_CHECKING, cast

from drake_navbench.errors import InputError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

HOW_TO_INSTALL = "pip install 'drake-navbench[bags]'"


def require_rosbags() -> None:
    """Raises InputError where the library is not installed."""
    if find_spec("rosbags") is None:
        raise InputError(f"bags need the library rosbags, which is not installed: {HOW_TO_INSTALL}")


@lru_cache(maxsize=1)
def ros2_types() -> Typestore:
    """Returns ROS 2's message types; those used here are the same from Humble to Lyrical."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_JAZZY)


def open_zstd(path: Path) -> IO[bytes]:
    """Returns a file that zstd has packed, opened to be read unpacked."""
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd
    return cast("IO[bytes]", zstd.open(path, "rb"))
