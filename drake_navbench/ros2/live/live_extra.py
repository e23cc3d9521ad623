"""The libraries that speak to a ROS 2 system, which not every installation has."""

from __future__ import annotations

from importlib.util import find_spec

from drake_navbench.errors import InputError

HOW_TO_INSTALL = "pip install 'drake-navbench[live]'"
# The versions of Python for which cyclonedds has wheels; the extra leaves it out for others.
OLDEST_PYTHON, NEWEST_PYTHON = "3.11", "3.13"


def require_live_libraries() -> None:
    """Raises InputError where cyclonedds or rosbags is not installed."""
    for name in ("cyclonedds", "rosbags"):
        if find_spec(name) is None:
            raise InputError(
                f"live: a ROS 2 system is reached by the library {name}, which is not installed: "
                f"{HOW_TO_INSTALL} with Python {OLDEST_PYTHON} to {NEWEST_PYTHON}"
            )
