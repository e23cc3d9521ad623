"""Storage of builds: objects and hosts by the digest of their content, builds by name."""

from __future__ import annotations

import json
import re
from enum import StrEnum
from pathlib import Path
from typing import Any

from pydantic import Field

from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.processes.cache_folder import user_cache_folder
from drake_navbench.typed_files.input_file import read_input
from drake_navbench.typed_files.output_file import write_text
from drake_navbench.typed_files.typed_yaml import FrozenModel, validate

MAX_MANIFEST_BYTES = 2**20
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")


class NoiseSource(StrEnum):
    """The source of the random numbers with which a controller samples: Nav2's own, or ours."""

    OWN = "own"
    BENCHMARK = "benchmark"


class FlagSet(StrEnum):
    """The choice of compiler flags: the portable ones, or each package's own."""

    PORTABLE = "portable"
    PACKAGE = "package"


class Build(FrozenModel):
    """The record of a named build."""

    name: str = Field(description="Name of the build, as in the column rpp@NAME.")
    host: Path = Field(description="Program that runs the compiled controllers.")
    release: str = Field(description="Nav2 release of the checkout.")
    version: str = Field(description="Version of the checkout's nav2_core.")
    commit: str = Field(description="Git commit; a plus: files differed from it; empty: unknown.")
    checkout: Path = Field(description="Folder of the checkout.")
    compiler: str = Field(description="Name and version of the compiler.")
    controllers: tuple[str, ...] = Field(description="Plugin types of the controllers.")
    planners: tuple[str, ...] = Field((), description="Plugin types of the planners.")
    left_out: dict[str, str] = Field(description="Plugins that are not in the build -> reason.")
    seconds: float = Field(description="Duration of the build [s].")
    noise: NoiseSource = Field(NoiseSource.OWN, description="Source of the random numbers.")
    flags: FlagSet = Field(FlagSet.PORTABLE, description="Compiler options.")
    more_flags: str = Field("", description="Options that packages and CXXFLAGS add, in one line.")

    @property
    def where_from(self) -> str:
        """The release, the commit, and how the build differs from the checkout, in a few words."""
        commit = f" at {self.commit}" if self.commit else ""
        noise = ", with the benchmark's noise" if self.noise is NoiseSource.BENCHMARK else ""
        flags = ", with its packages' flags" if self.flags is FlagSet.PACKAGE else ""
        return f"{self.release} {self.version}{commit}{noise}{flags}"


def builds_folder() -> Path:
    """Returns the folder of all builds, in the user's cache or else among the temporary files."""
    return user_cache_folder() / "native"


def require_name(name: str) -> str:
    """Returns the name of a build; raises InputError for one that `@` could not name."""
    if _NAME.fullmatch(name) is None:
        raise InputError(
            f"name of a build: got {name!r}, expected letters, digits, dots, dashes, underscores"
        )
    return name


def save_build(build: Build) -> None:
    """Keeps a build under its name, replacing an earlier one; raises CannotBeWritten."""
    path = _manifest(build.name)
    write_text(path, build.model_dump_json(indent=2))


def find_build(name: str) -> Build:
    """Returns the build of a name; raises InputError where there is no such build."""
    path = _manifest(require_name(name))
    if not path.is_file():
        hint = nearest_name_hint(name, build_names())
        raise InputError(
            f"build {name!r} is not known{hint}; "
            "drake-navbench nav2-build CHECKOUT --as NAME makes one"
        )
    try:
        data: Any = json.loads(read_input(path, max_bytes=MAX_MANIFEST_BYTES))
    except ValueError as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
    build = validate(Build, data, str(path))
    if not build.host.is_file():
        raise InputError(f"build {name!r}: {build.host} is gone; build it again")
    return build


def build_names() -> list[str]:
    """Returns the names of all builds, sorted."""
    return sorted(path.stem for path in (builds_folder() / "names").glob("*.json"))


def _manifest(name: str) -> Path:
    return builds_folder() / "names" / f"{name}.json"
