"""A robot by its model: the robot file's fields, and a remark on each part of the model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drake_navbench.inputs.check import Check
from drake_navbench.inputs.described_table import ModelTable
from drake_navbench.inputs.descriptions.body import (
    base_of,
    floor_of,
    held_wheels,
    read_body,
    to_base_of,
    turning_centre,
    wheels_of,
)
from drake_navbench.inputs.descriptions.drive_kinds import (
    OMNIDIRECTIONAL,
)
from drake_navbench.inputs.descriptions.gazebo_drive import drive_of
from drake_navbench.inputs.descriptions.gazebo_sensors import (
    lidar_link,
    sensors_of,
)
from drake_navbench.inputs.descriptions.model_source import Source, read_source
from drake_navbench.inputs.descriptions.ros_packages import forget_folders
from drake_navbench.inputs.descriptions.wheel_layout import roll_along_y
from drake_navbench.inputs.known_base import NOTHING_KNOWN, KnownBase

# Robots that are kept, so that a model is read once in a process.
MOST_KEPT = 8
# The least height of a robot over the floor, m.
LEAST_HEIGHT_M = 0.05


@dataclass(frozen=True)
class DescribedRobot:
    """A robot's model, read: fields of a robot file; rows of a table, as of `--check`.

    base: the link that is the base frame. height_m: height of its highest point over the floor.
    floor_m: height of the floor in the base frame. source: the model itself. tells_outline: whether
    the outline is from the model's shapes.
    """

    fields: Mapping[str, Any]
    check: Check
    base: str
    height_m: float
    floor_m: float
    source: Source
    tells_outline: bool = True


def describe_robot(
    path: Path,
    arguments: Mapping[str, str] | None = None,
    folders: Sequence[Path] = (),
    known: KnownBase = NOTHING_KNOWN,
) -> DescribedRobot:
    """Reads a robot's URDF, SDF or xacro file; raises InputError.

    arguments: for xacro. folders: searched for packages, besides the repository around the file.
    known: the base's link, if the model has it, and the outline of a model without shapes. While no
    file that was read has changed, the result for the same arguments is the same object.
    """
    given = tuple(sorted((arguments or {}).items()))
    asked = (path.absolute(), str(path), given, tuple(folders), known)
    kept = _KEPT.get(asked)
    if kept is not None and kept[0] == _changes(kept[0]):
        return kept[1]
    forget_folders()
    source = read_source(path.absolute(), arguments, folders)
    found = _described(source, str(path), known)
    _KEPT.pop(asked, None)
    if len(_KEPT) == MOST_KEPT:
        del _KEPT[next(iter(_KEPT))]
    _KEPT[asked] = _changes(source.files), found
    return found


# The robots described last, by what was asked, each with the files that were read.
_KEPT: dict[tuple[Any, ...], tuple[dict[Path, int], DescribedRobot]] = {}


def _changes(files: Iterable[Path]) -> dict[Path, int]:
    """Returns when each file was changed last, ns; none for a file that is not there."""
    changes = {}
    for file in files:
        with suppress(OSError, ValueError):
            changes[file] = file.stat().st_mtime_ns
    return changes


def _described(source: Source, shown: str, known: KnownBase) -> DescribedRobot:
    path, model = source.path, source.model
    base = base_of(model, known.link)
    body = read_body(model, base)
    wheels = wheels_of(model, base)
    floor_m = floor_of(model, body, wheels)
    table = ModelTable(f"model {path.name}")
    table.note_base(base, known.link, source)
    table.note_resting(model.resting)
    fields: dict[str, Any] = {"description": f"robot of {path.name}"}
    fields |= table.body(body, source, known, shown)
    fields |= table.mass(model.mass_kg)
    found = sensors_of(model, to_base_of(model, base), floor_m)
    found = found._replace(scanners=table.heard(found.scanners, known.scans))
    fields |= table.sensors(found)
    if "lidar" not in fields:
        link = lidar_link(model, base, floor_m)
        fields |= table.lidar_by_link(link, found.clouds, source.arguments)
    fields |= table.layers(fields.get("lidar", {}))
    drive = drive_of(model, wheels, source.packages, [*source.arguments.values()])
    fields |= table.drive(drive, is_omni=known.is_omni)
    table.note_held(held_wheels(model))
    if drive.kind != OMNIDIRECTIONAL and roll_along_y(wheels):
        table.note_rolling(base)
    if len(wheels) >= 2:
        table.note_turning(turning_centre(model, wheels), fields)
    for remark in dict.fromkeys((*body.left_out, *model.remarks)):
        table.note_remark(remark)
    height_m = max(body.high_m - floor_m, LEAST_HEIGHT_M)
    check, tells_outline = Check(tuple(table.rows)), body.outline is not None
    return DescribedRobot(fields, check, base, height_m, floor_m, source, tells_outline)
