"""The suspects: the frequent causes of each symptom, read from `knowledge/`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import Field

from drake_navbench.errors import InputError
from drake_navbench.studies.doctor.causes import OUTSIDE, RELEASE, Cause, Direction
from drake_navbench.studies.doctor.facts import CONTROLLER
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.typed_files.typed_yaml import FrozenModel, read_yaml, validate

FOLDER = Path(__file__).parent / "knowledge"
RANGES = FOLDER / "ranges.yaml"
ANY = "any"
# The first parts of places that do not belong to the controller.
ELSEWHERE = frozenset(
    {
        "amcl",
        "behavior_server",
        "behavior_tree",
        "bt_navigator",
        "collision_monitor",
        "controller_server",
        "docking_server",
        "global_costmap",
        "goal_checker",
        "local_costmap",
        "path_handler",
        "planner",
        "progress_checker",
        "smoother",
        "velocity_smoother",
        "waypoint_follower",
        "map_server",
        OUTSIDE,
        RELEASE,
    }
)
CURE = re.compile(r"(?P<place>[\w.*]+) (?P<cure>up|down|set|add|upgrade|=\S+)")
WEIGHT = re.compile(r"[\d.]+")


class Suspect(NamedTuple):
    """A cause that a symptom of a kind of controller often has. weight: how often, 0 to 1."""

    kinds: tuple[str, ...]
    symptom: Symptom
    cause: Cause
    weight: float


class _SuspectFile(FrozenModel):
    """The contents of a file of suspects."""

    controllers: tuple[str, ...] = Field(min_length=1, description="Kinds of controllers, or any.")
    source: str = Field(min_length=1, description="Where the entries come from.")
    suspects: dict[str, dict[str, str]] = Field(
        description="By symptom: `place direction weight`, and why."
    )


class _RangeFile(FrozenModel):
    """The contents of the file of ranges."""

    source: str
    ranges: dict[str, tuple[float | None, float | None]]


@cache
def all_suspects() -> tuple[Suspect, ...]:
    """Returns the suspects of all files; raises InputError where one is wrong."""
    found: list[Suspect] = []
    for path in sorted(FOLDER.glob("*.yaml")):
        if path == RANGES:
            continue
        content = validate(_SuspectFile, read_yaml(path), str(path))
        for name, entries in content.suspects.items():
            for text, why in entries.items():
                named, _, weight = text.rpartition(" ")
                if not WEIGHT.fullmatch(weight):
                    raise InputError(f"{path}: got {text!r}, expected `place direction weight`")
                cause = parsed_cause(named, why, content.source, path)
                found.append(Suspect(content.controllers, Symptom(name), cause, float(weight)))
    return tuple(found)


@cache
def ranges() -> Mapping[str, tuple[float | None, float | None]]:
    """Returns the usual least and most value of parameters, by place."""
    return validate(_RangeFile, read_yaml(RANGES), str(RANGES)).ranges


def suspects_of(symptom: Symptom, kinds: tuple[str, ...]) -> list[Suspect]:
    """Returns the suspects of a symptom for a controller."""
    wanted = {ANY, *kinds}
    return [s for s in all_suspects() if s.symptom is symptom and wanted & {*s.kinds}]


def parsed_cause(text: str, why: str, source: str, path: Path) -> Cause:
    """Returns the cause that a text `place direction` names; raises InputError.

    path: the file of the text.
    """
    found = CURE.fullmatch(text)
    if found is None:
        raise InputError(f"{path}: got {text!r}, expected `place direction`")
    place, cure = found["place"], found["cure"]
    if place.partition(".")[0] not in ELSEWHERE:
        place = f"{CONTROLLER}.{place}"
    is_value = cure.startswith("=")
    direction = Direction.SET if is_value else Direction(cure)
    return Cause(place, direction, _value(cure[1:]) if is_value else None, why, source)


def _value(text: str) -> Any:
    return {"true": True, "false": False}.get(text, text)
