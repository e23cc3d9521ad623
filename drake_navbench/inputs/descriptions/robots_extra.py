"""The libraries that expand xacro and read COLLADA meshes, which not every installation has."""

from __future__ import annotations

from importlib.util import find_spec

from drake_navbench.errors import InputError

HOW_TO_INSTALL = "pip install 'drake-navbench[robots]'"


def require_library(name: str, file: str) -> None:
    """Raises InputError where a library is not installed; file: the file that needs it."""
    if find_spec(name) is None:
        raise InputError(
            f"{file}: needs the library {name}, which is not installed: {HOW_TO_INSTALL}"
        )
