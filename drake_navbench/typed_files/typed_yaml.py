"""Reads YAML files into pydantic models; everything wrong becomes one line that names the place."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import UnionType
from typing import Any, ClassVar, TypeVar, Union, get_args, get_origin

import yaml
from pydantic import (
    BaseModel,
    ConfigDict,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from drake_navbench.errors import InputError, nearest_name_hint, one_line, printable
from drake_navbench.typed_files.input_file import MEGABYTE, read_input_text
from drake_navbench.typed_files.yaml_loader import line_of, load_yaml

Model = TypeVar("Model", bound=BaseModel)

MAX_FILE_BYTES = 16 * MEGABYTE
# The most faults of one file that are shown.
MAX_FAULTS_SHOWN = 20
# The types of the fault "unknown field": pydantic's, and ours for a model that finds it by itself.
EXTRA_FIELD = "extra_forbidden"
UNKNOWN_FIELD = "unknown_field"

Location = tuple[int | str, ...]
# A line that git writes into a file with a conflict.
MERGE_MARK = re.compile(r"(?:<{7}|={7}|>{7}|\|{7})(?:\s|$)")
# What YAML says of a line without a key, at the next line; a line with a key, or of a list or text.
NO_KEY = ("mapping values are not allowed", "could not find expected ':'")
NO_SLIP = re.compile(r":(?:\s|$)|^\s*[-\[\]{}'\"]|[,\]}'\"]\s*$")
MOST_SHOWN = 60
# The beginnings of XML: a declaration, a comment, or an element with an attribute or a child; not
# the `<name>:` of a template.
XML_START = re.compile(r"\s*<(\?xml|!--|[\w:.-]+\s+[\w:.-]+\s*=|[\w:.-]+>\s*<)")


class FrozenModel(BaseModel):
    """Base of every model read from a file: unknown fields refused, finite numbers, frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class QuietModel(FrozenModel):
    """A model whose dump contains fields of later versions only where they differ from the default.

    So files that were saved before such fields existed keep their content and their digests.
    """

    quiet: ClassVar[frozenset[str]] = frozenset()

    @model_serializer(mode="wrap")
    def _without_quiet_defaults(self, plain: SerializerFunctionWrapHandler) -> dict[str, Any]:
        values: dict[str, Any] = plain(self)
        for name in self.quiet & values.keys():
            field = type(self).model_fields[name]
            if getattr(self, name) == field.get_default(call_default_factory=True):
                del values[name]
        return values


def read_text(path: Path) -> str:
    """Returns the text of a YAML file; raises InputError where it cannot be read or is no YAML.

    The error names XML and Python files as such, since YAML's own messages about them do not help.
    """
    text = read_input_text(path, max_bytes=MAX_FILE_BYTES)
    if path.suffix == ".py" or XML_START.match(text):
        kind = "Python" if path.suffix == ".py" else "XML"
        raise InputError(f"{path}: is {kind}; expected a YAML file")
    return text


def read_yaml(path: Path) -> dict[str, Any]:
    """Returns the mapping in a YAML file; raises InputError if it is unreadable or no mapping."""
    return parse_yaml(read_text(path), str(path))


def parse_yaml(text: str, source: str) -> dict[str, Any]:
    """Returns the mapping in a YAML text; `source` is the text's name in errors."""
    try:
        data = load_yaml(text)
    except yaml.YAMLError as error:
        raise yaml_fault(error, source, text) from error
    except UnicodeEncodeError as error:
        raise InputError(f"{source}: {error.reason}") from error
    if not isinstance(data, dict):
        got = "nothing" if data is None else type(data).__name__
        raise InputError(f"{source}: expected a mapping of fields to values, got {got}")
    return data


def yaml_fault(error: yaml.YAMLError, source: str, text: str) -> InputError:
    """Returns the fault of a YAML text as one line."""
    mark = getattr(error, "problem_mark", None)
    line = f", line {mark.line + 1}" if mark else ""
    if isinstance(error, yaml.reader.ReaderError):
        line = f", line {text.count(chr(10), 0, error.position) + 1}"
    problem = str(getattr(error, "problem", None) or getattr(error, "reason", "not YAML"))
    if problem.startswith("but "):
        problem = f"{getattr(error, 'context', '')}, {problem}".lstrip(", ")
    rows = text.split("\n")[: mark.line + 1] if mark else []
    faulty = rows[-1:]
    if any(row.lstrip(" ").startswith("\t") for row in faulty):
        problem = "is indented by a tab; expected spaces"
    elif slip := _slip(problem, rows):
        return InputError(f"{source}, {slip}")
    return InputError(f"{source}{line}: {problem}")


def _slip(problem: str, rows: Sequence[str]) -> str:
    """Returns the line and text of a slip above the place where YAML noticed it; '' for another.

    rows: the lines up to that place.
    """
    for number, row in enumerate(rows, start=1):
        if MERGE_MARK.match(row):
            return f"line {number}: a mark of a merge conflict, got {row[:MOST_SHOWN]!r}"
    above = [(number, row) for number, row in enumerate(rows[:-1], start=1) if row.strip()]
    if not above or not problem.startswith(NO_KEY):
        return ""
    number, row = above[-1]
    got = f"got {row.strip(' ')[:MOST_SHOWN]!r}"
    if row.lstrip(" ").startswith("\u00a0"):
        return f"line {number}: is indented by a no-break space; expected spaces, {got}"
    return "" if NO_SLIP.search(row) else f"line {number}: expected 'name: value', {got}"


def place_in(text: str, source: str, location: Sequence[int | str]) -> str:
    """Returns `source` with the line of a field in a YAML text, where it has one.

    location: the names and indices that lead to the field.
    """
    line = line_of(text, location)
    return source if line is None else f"{source}, line {line}"


def validate(
    model: type[Model], data: Mapping[str, Any], source: str, text: str | None = None
) -> Model:
    """Returns `data` as an instance of `model`; raises InputError, one line a fault.

    Types are strict: neither a text nor `true` is taken for a number. text: the YAML text of
    `data`, from which faults take the line.
    """
    try:
        plain = json.dumps(data, default=str)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{source}: {error}; expected plain values") from error
    try:
        return model.model_validate_json(plain, strict=True)
    except ValidationError as error:
        faults = error.errors(include_url=False)
        lines = [
            _describe(fault, model, place_in(text, source, fault["loc"]) if text else source)
            for fault in faults[:MAX_FAULTS_SHOWN]
        ]
        if len(faults) > MAX_FAULTS_SHOWN:
            lines.append(f"{source}: and {len(faults) - MAX_FAULTS_SHOWN} faults more")
        raise InputError("\n".join(dict.fromkeys(lines))) from error
    except Exception as error:
        # The model may be a plugin's, whose checks may raise anything.
        raise InputError(f"{source}: {one_line(error)}") from error


def unknown_fields(model: type[BaseModel], data: Mapping[str, Any]) -> list[Location]:
    """Returns the places in `data` of fields that the model does not have, as far as it can tell.

    Where something else is wrong, a model may stop before it has noticed all of them.
    """
    try:
        model.model_validate_json(json.dumps(data, default=str), strict=True)
    except ValidationError as error:
        kinds = (EXTRA_FIELD, UNKNOWN_FIELD)
        return [fault["loc"] for fault in error.errors() if fault["type"] in kinds]
    return []


def unknown_field(text: str, location: Location, found: Any) -> InitErrorDetails:
    """Returns the fault of an unknown field that a model's own validator found; text: its words."""
    kind = PydanticCustomError(UNKNOWN_FIELD, text)
    return InitErrorDetails(type=kind, loc=location, input=found)


def found_fault(text: str, location: Location, found: Any) -> InitErrorDetails:
    """Returns the fault of a wrong value that a model's own validator found; text: its words."""
    return InitErrorDetails(type=PydanticCustomError("fault", text), loc=location, input=found)


def read_block(model: type[Model], values: Mapping[str, Any]) -> Model:
    """Returns the values of a block as an instance of its own model; raises ValidationError.

    The values go through JSON, in which a strict model accepts a list for a tuple.
    """
    return model.model_validate_json(json.dumps(values, default=str), strict=True)


def faults_within(
    place: Location,
    error: ValidationError,
    model: type[BaseModel],
    unknown: str = "unknown field",
) -> list[InitErrorDetails]:
    """Returns the faults of a block with their places in the file around it.

    place: where the block lies in that file. model: the block's model; for an unknown field the
    fault suggests the model's field of the most alike name. unknown: the words for such a fault.
    """
    faults = []
    for fault in error.errors():
        location, found = (*place, *fault["loc"]), fault["input"]
        text = fault["msg"].removeprefix("Value error, ")
        if fault["type"] == EXTRA_FIELD:
            hint = nearest_name_hint(str(fault["loc"][-1]), model.model_fields)
            faults.append(unknown_field(f"{unknown}{hint}", location, found))
        elif fault["type"] == UNKNOWN_FIELD:
            faults.append(unknown_field(text, location, found))
        elif fault["type"] == "missing":
            faults.append(found_fault("missing, but required", location, found))
        elif kind := _fault_of_kind(fault):
            faults.append(found_fault(kind[1], (*location, kind[0]), found))
        else:
            faults.append(found_fault(text, location, found))
    return faults


def tuples_for_lists(value: Any) -> Any:
    """Returns a value with all lists in it as tuples.

    It is for validators that run before a strict model's own: their result counts as Python data,
    in which a strict model accepts no list for a tuple.
    """
    if isinstance(value, Mapping):
        return {key: tuples_for_lists(item) for key, item in value.items()}
    if isinstance(value, list):
        return tuple(tuples_for_lists(item) for item in value)
    return value


def _describe(fault: Mapping[str, Any], model: type[BaseModel], source: str) -> str:
    location = fault["loc"]
    field = _dotted(location)
    if fault["type"] == EXTRA_FIELD:
        known = _field_names(model, location[:-1])
        hint = nearest_name_hint(str(location[-1]), known)
        return f"{source}: {field}: unknown field{hint}"
    if fault["type"] == "missing":
        return f"{source}: {field}: missing, but required"
    if kind := _fault_of_kind(fault):
        return f"{source}: {_dotted((*location, kind[0]))}: {kind[1]}"
    message = fault["msg"].removeprefix("Value error, ")
    message = message[:1].lower() + message[1:]
    if not location:
        return f"{source}: {message}"
    if _tells(message, fault["input"]):
        return f"{source}: {field}: {message}"
    return f"{source}: {field}: {message}, got {printable(repr(fault['input']), MOST_SHOWN)}"


def _fault_of_kind(fault: Mapping[str, Any]) -> tuple[str, str] | None:
    """Returns field and text of a fault in the field that tells the type of a value."""
    context = fault.get("ctx", {})
    name = str(context.get("discriminator", "")).strip("'")
    if fault["type"] == "union_tag_not_found":
        return name, "missing, but required"
    if fault["type"] == "union_tag_invalid":
        return name, f"got {context['tag']!r}, expected one of {context['expected_tags']}"
    return None


def _tells(message: str, found: Any) -> bool:
    """Whether a message names a wrong value: the 0 of "greater than 0" is a limit, no value."""
    shown = repr(found)
    return shown in message if isinstance(found, str) else f"got {shown}" in message


def _dotted(location: Location) -> str:
    text = ""
    for part in location:
        text += f"[{part}]" if isinstance(part, int) else f".{part}"
    return text.lstrip(".")


def _field_names(model: type[BaseModel], location: Location) -> list[str]:
    """Returns the fields known at a place inside a model, for the hint of a misspelt one."""
    models = [model]
    for part in location:
        if isinstance(part, str):
            models = _step_into(models, part)
    return sorted({name for m in models for name in m.model_fields})


def _step_into(models: list[type[BaseModel]], part: str) -> list[type[BaseModel]]:
    found = [
        nested
        for m in models
        if part in m.model_fields
        for nested in _nested_models(m.model_fields[part].annotation)
    ]
    # In a discriminated union pydantic puts the tag (such as "box") into the location.
    tagged = [
        m
        for m in models
        if any(part in get_args(field.annotation) for field in m.model_fields.values())
    ]
    return found or tagged or models


def _nested_models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    if get_origin(annotation) in (Union, UnionType, list, tuple, dict) or get_args(annotation):
        return [m for argument in get_args(annotation) for m in _nested_models(argument)]
    return []
