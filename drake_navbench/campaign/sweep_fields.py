"""Finds the owner of a swept field: a column, the robot or the scenario; suggests likely names."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from typing import Any, Literal, get_args

from pydantic import BaseModel

from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario

# Fields of robot and scenario without effect on a trial, or set by other options.
WITHOUT_EFFECT = {"description", "directory", "model", "name", "robot_overrides"}
ROBOT: Literal["robot"] = "robot"
SCENARIO: Literal["scenario"] = "scenario"
MODELS: Mapping[str, type[BaseModel]] = {ROBOT: Robot, SCENARIO: Scenario}
# The least likeness of a name to a known one of which it may be a slip.
LIKE_A_SLIP = 0.6
MAX_HINTS = 3
# The depth to which nested fields are listed, as a plugin's settings may hold others of their kind.
MAX_DEPTH = 6


def owner_of(field: str, columns: Mapping[str, Preset]) -> str:
    """Returns the column that a field belongs to, or ROBOT or SCENARIO.

    Raises InputError, with the fields that may be meant, where nothing has such a field.
    """
    before, dot, rest = field.partition(".")
    if dot and before in columns:
        return before
    is_told = dot and before in MODELS
    first = rest.partition(".")[0] if is_told else before
    for owner in [before] if is_told else MODELS:
        if first in MODELS[owner].model_fields.keys() - WITHOUT_EFFECT:
            return owner
    raise InputError(
        f"--sweep {field}: expected COLUMN.PARAMETER, or a field of the robot or the scenario, "
        f"got {first!r}{_hint(rest if is_told else field, columns)}"
    )


def _hint(field: str, columns: Mapping[str, Preset]) -> str:
    """Returns '; did you mean A or B?' for the known fields that are most like one, '' for none.

    A user may know a field by its last name, without the blocks around it.
    """
    known = sorted(_known_fields(columns))
    last = field.rpartition(".")[2]
    of_last_name = [name for name in known if name.rpartition(".")[2] == last]
    likeness = {
        name: max(_likeness(field, name), _likeness(last, name.rpartition(".")[2]))
        for name in known
    }
    likely = sorted(known, key=lambda name: (-likeness[name], name.count("."), name))
    found = of_last_name or [name for name in likely if likeness[name] >= LIKE_A_SLIP]
    if not found:
        return ""
    shown = sorted(found, key=likely.index)[:MAX_HINTS]
    return f"; did you mean {' or '.join(map(repr, shown))}?"


def _likeness(name: str, other: str) -> float:
    matcher = difflib.SequenceMatcher(None, name, other)
    # `quick_ratio` is an upper bound of `ratio`.
    return matcher.ratio() if matcher.quick_ratio() >= LIKE_A_SLIP else 0.0


def _known_fields(columns: Mapping[str, Preset]) -> set[str]:
    own = {
        f"{name}.{field}"
        for name, preset in columns.items()
        for field in _fields_of(preset.controller_class.Parameters)
    }
    shared = {
        field
        for model in MODELS.values()
        for field in _fields_of(model)
        if field.partition(".")[0] not in WITHOUT_EFFECT
    }
    return own | shared


def _fields_of(model: type[BaseModel], depth: int = 1) -> Iterator[str]:
    """Yields the dotted names of a model's fields, blocks before what they hold."""
    for name, field in model.model_fields.items():
        yield name
        if depth < MAX_DEPTH:
            for block in _models_in(field.annotation):
                yield from (f"{name}.{inner}" for inner in _fields_of(block, depth + 1))


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yields the models that a field may be: one, or those of a union; not those of a list."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    elif getattr(annotation, "__origin__", None) not in (list, tuple, dict):
        for part in get_args(annotation):
            yield from _models_in(part)
