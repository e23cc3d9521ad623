"""Clearpath's robot.yaml as the xacro file that Clearpath's generator would write of it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from drake_navbench.errors import InputError, as_line
from drake_navbench.inputs.descriptions.ros_packages import Packages
from drake_navbench.inputs.descriptions.xacro_macro import parameters_of
from drake_navbench.typed_files.input_file import read_head
from drake_navbench.typed_files.typed_yaml import read_yaml

SERIAL = re.compile(r"([a-z]+[0-9]+)-[\w-]+")
MARKS = rb"^(?:platform|sensors|system|version)\s*:"
PLATFORM, SENSORS = "clearpath_platform_description", "clearpath_sensors_description"
MOUNTS = "clearpath_mounts_description"
FILE_NAME = re.compile(r"[\w/.-]{1,200}")
HEAD_BYTES = 100_000
# A driver's parameter -> the parameter of the lidar's macro.
ANGLES = {"angle_min": "min_ang", "angle_max": "max_ang"}


def is_clearpath(path: Path) -> bool:
    """Tells whether a YAML file is a robot.yaml of Clearpath's."""
    if path.suffix not in (".yaml", ".yml"):
        return False
    head = read_head(path, HEAD_BYTES)
    return all(re.search(mark, head, re.MULTILINE) for mark in (rb"^serial_number\s*:", MARKS))


def platform_of(path: Path) -> str:
    """Returns the platform in a robot.yaml, such as a200; '' where it has none."""
    serial = SERIAL.fullmatch(str(read_yaml(path).get("serial_number", "")))
    return "" if serial is None else serial[1]


def clearpath_xacro(path: Path, packages: Packages) -> tuple[str, list[str]]:
    """Returns the xacro text of a robot.yaml, and a remark on each part that was left out.

    Platform, attachments, links, mounts and sensors are read. Raises InputError where the platform
    is missing in the file, or its package does not exist.
    """
    data, platform = read_yaml(path), platform_of(path)
    if not platform:
        raise InputError(
            f"{path}: serial_number: expected one such as a200-0000, got "
            f"{data.get('serial_number')!r}"
        )
    package = packages.folder(PLATFORM)
    if package is None:
        raise InputError(
            f"{path}: needs the package {PLATFORM!r}; expected it in the repository around the "
            "file or below a folder of --packages"
        )
    remarks = ["left out the manipulators"] if data.get("manipulators") else []
    files = [f"urdf/{platform}/{platform}"]
    if not (package / f"{files[0]}.urdf.xacro").is_file():
        raise InputError(f"{path}: serial_number: {package} has no platform {platform}")
    if (package / "urdf/common.urdf.xacro").is_file():
        files.insert(0, "urdf/common")
    lines = [f'<xacro:include filename="{package}/{file}.urdf.xacro"/>' for file in files]
    lines.append(f"<xacro:{platform}/>")
    for name, place, macro, item in _parts(data, platform):
        file = _file_of(packages.folder(place), macro)
        if file is not None:
            lines += _call(file, name, item)
        else:
            remarks.append(as_line(f"left out {name[:80]}: {place} has no {macro[:80]}"))
    body = "\n".join(lines)
    text = f'<robot name="{platform}" xmlns:xacro="http://ros.org/wiki/xacro">{body}</robot>'
    return text, remarks


def _file_of(package: Path | None, macro: str) -> Path | None:
    """Returns the xacro file of a part; None where the package has none. Risers are in pacs/."""
    # A name longer than names of files cannot be looked up.
    if package is None or not FILE_NAME.fullmatch(macro):
        return None
    files = (package / "urdf" / folder / f"{macro}.urdf.xacro" for folder in ("", "pacs"))
    return next((file for file in files if file.is_file()), None)


def _parts(data: Mapping[str, Any], platform: str) -> Iterator[tuple[str, str, str, Any]]:
    """Yields name, package, file below its urdf folder, and entry of each part."""
    own = data.get("platform")
    attachments = own.get("attachments") if isinstance(own, Mapping) else None
    for item in _listed(attachments):
        kind = str(item.get("type", "")).rpartition(".")[2]
        yield str(item.get("name", kind)), PLATFORM, f"{platform}/attachments/{kind}", item
    blocks = (("links", PLATFORM, "links/"), ("mounts", MOUNTS, ""), ("sensors", SENSORS, ""))
    for block, package, folder in blocks:
        kinds = data.get(block)
        for kind, items in kinds.items() if isinstance(kinds, Mapping) else ():
            for index, item in enumerate(_listed(items)):
                model = item.get("model", kind) if block == "sensors" else kind
                name = item.get("name", f"{kind}_{index}")
                if item.get("urdf_enabled", item.get("enabled", True)):
                    yield str(name), package, f"{folder}{model}", item


def _listed(items: Any) -> list[Mapping[str, Any]]:
    return [item for item in items if isinstance(item, Mapping)] if isinstance(items, list) else []


def _call(file: Path, name: str, item: Mapping[str, Any]) -> list[str]:
    """Returns the lines that include a file and call its macro with the parameters that it has."""
    macro = file.name.partition(".")[0]
    takes = parameters_of(file.read_text(encoding="utf-8", errors="replace"), macro)
    given = {"model": "default"} | dict(_plain(item))
    # A sensor's `model` names its macro; its driver's `model` names the sensor's type.
    given |= {key: value for key, value in _nested(item) if key == "model"}
    given |= {"name": name, "parent_link": item.get("parent")}
    given |= {ANGLES[key]: value for key, value in _nested(item) if key in ANGLES}
    values = [
        f"{key}={quoteattr(str(value))}"
        for key, value in given.items()
        if key in takes and value is not None
    ]
    if "parent_link" in takes and given["parent_link"] is None and takes["parent_link"]:
        values.append('parent_link="base_link"')
    origin = f'<origin xyz="{_triple(item.get("xyz"))}" rpy="{_triple(item.get("rpy"))}"/>'
    call = f"<xacro:{macro} {' '.join(values)}>{origin}</xacro:{macro}>"
    return [f'<xacro:include filename="{file}"/>', call]


def _plain(item: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yields a part's entries that are numbers and words; lists of numbers as text for xacro."""
    for key, value in item.items():
        if isinstance(value, list):
            yield str(key), _triple(value)
        elif isinstance(value, str | int | float) and key not in ("name", "parent"):
            yield str(key), value


def _nested(item: Mapping[str, Any], level: int = 0) -> Iterator[tuple[str, Any]]:
    """Yields the numbers and words in the blocks of a part, such as its driver's parameters."""
    for key, value in item.items():
        if isinstance(value, Mapping):
            yield from _nested(value, level + 1)
        elif isinstance(value, str | int | float) and level:
            yield str(key), value


def _triple(values: Any) -> str:
    """Returns the numbers of a list as text; zeros where there are none."""
    numbers = [v for v in values if isinstance(v, int | float)] if isinstance(values, list) else []
    return " ".join(f"{value:g}" for value in numbers) if numbers else "0 0 0"
