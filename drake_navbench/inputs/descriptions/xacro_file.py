"""A xacro file expanded without ROS, in a process with bounds on memory and time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.inputs.descriptions.robots_extra import require_library
from drake_navbench.processes.limited_call import call_limited
from drake_navbench.typed_files.input_file import MEGABYTE, read_input

XACRO = ".xacro"
MAX_FILE_BYTES = 16 * MEGABYTE


@dataclass(frozen=True)
class Expanded:
    """A model's text; arguments: those of its xacro files, with their values.

    remarks: the parts left out, and why. files: those that it includes.
    """

    text: str
    arguments: Mapping[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()


def expand_xacro(
    path: Path,
    arguments: Mapping[str, str] | None = None,
    folders: Sequence[Path] = (),
    *,
    text: str | None = None,
) -> Expanded:
    """Returns a xacro file expanded with arguments; those it does not declare are left out.

    text: replaces the file's own. folders: searched for packages, besides the repository around the
    file. Raises InputError, one line, where a package is missing, or the file cannot be expanded in
    1 GB and 30 s.
    """
    read_input(path, max_bytes=MAX_FILE_BYTES)
    require_library("xacrodoc", str(path))
    request = {
        "file": str(path.absolute()),
        "text": text,
        "folders": [str(folder.absolute()) for folder in folders],
        "arguments": dict(arguments or {}),
    }
    answer = call_limited(
        "drake_navbench.inputs.descriptions.xacro_child:expand",
        request,
        str(path),
        folder=path.absolute().parent,
    )
    files = tuple(map(Path, answer["files"]))
    return Expanded(answer["text"], answer["arguments"], tuple(answer["remarks"]), files)


def require_declared(path: Path, given: Sequence[str], declared: Mapping[str, str]) -> None:
    """Raises InputError for a --set that a xacro file does not declare."""
    for name in given:
        if name not in declared:
            hint = nearest_name_hint(name, declared) or "; it declares none"
            raise InputError(f"--set {name}: {path} has no such xacro argument{hint}")
