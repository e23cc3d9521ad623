"""The parameters of a column as fields of a form: range, unit, description, defaults, values."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from typing import Any, Literal, NamedTuple, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from drake_navbench.inputs.presets import Preset
from drake_navbench.nav2.nav2_setup import Nav2Setup
from drake_navbench.nav2.node_reader import Offer
from drake_navbench.plugins.releases import RELEASE_FIELD, Release, read_by
from drake_navbench.typed_files.dotted_names import flattened
from drake_navbench.typed_files.quantities import Within
from drake_navbench.typed_files.usual_values import Usual

UNIT = re.compile(r"\s*\[([^\]]+)\]")
# A slider reaches this many times the larger of default and value, unless a bound is nearer.
REACH = 3.0
STEPS = 100
# Fields that list the plugins: changing one needs another file, not a slider.
NAMES_OF_PLUGINS = frozenset({"plugin", "plugins", "filters"})


class ParameterField(NamedTuple):
    """A parameter as a field of a form.

    name: dotted, as the model has it. given_name: as a file of the column's release writes it.
    node: node of the Nav2 file, such as 'local_costmap'; '' for the column's controller. kind: the
    kind of input. low, high, step: ends and step of its slider, for numbers. choices: for choices.
    default: the release's. given: the value in the file or preset, None without one. value: the
    value in force.
    """

    name: str
    given_name: str
    kind: Literal["number", "whole", "flag", "choice", "text"]
    unit: str
    description: str
    default: Any
    given: Any
    value: Any
    low: float = 0.0
    high: float = 0.0
    step: float = 0.0
    choices: tuple[str, ...] = ()
    node: str = ""

    @property
    def key(self) -> str:
        """The parameter's name in a column's changes: 'NODE/NAME', or 'NAME'."""
        return f"{self.node}/{self.given_name}" if self.node else self.given_name


def node_fields(setup: Nav2Setup) -> list[ParameterField]:
    """Returns the parameters of costmaps and servers in a Nav2 file, the given ones first."""
    found = [
        _typed_field(
            name, name, offer.model.model_fields[offer.field], offer.default, offer.given
        )._replace(node=node)
        for (node, name), offer in setup.offers.items()
        if offer.field not in NAMES_OF_PLUGINS and is_scalar(offer)
    ]
    return sorted(found, key=lambda entry: entry.given is None)


def fields_of(preset: Preset) -> list[ParameterField]:
    """Returns the parameters of a column that have an effect, the given ones first."""
    parameters = preset.parameters
    given = dict(flattened(preset.values))
    release = getattr(parameters, RELEASE_FIELD, None)
    model = type(parameters)
    found = [
        _field(place, info, value, preset, given, release)
        for place, info, value in _entries(parameters, "")
        if place != RELEASE_FIELD and not model.is_without_effect(place, preset.values)
    ]
    fields = [entry for entry in found if entry is not None]
    return sorted(fields, key=lambda entry: entry.given is None)


def _entries(model: BaseModel, prefix: str) -> Iterator[tuple[str, FieldInfo | None, Any]]:
    """Yields the dotted name, the field and the value of every parameter, blocks unfolded."""
    for name, value in {**model.__dict__, **(model.model_extra or {})}.items():
        info = type(model).model_fields.get(name)
        if isinstance(value, BaseModel):
            yield from _entries(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", info, value


def _field(
    name: str,
    info: FieldInfo | None,
    value: Any,
    preset: Preset,
    given: Mapping[str, Any],
    release: Release | None,
) -> ParameterField | None:
    if info is None:
        return None
    model = type(preset.parameters)
    default = info.get_default(call_default_factory=True)
    if release is not None:
        default = read_by(model, name).defaults.get(release, default)
    given_name = _given_name(name, info, value, preset, given, release)
    found = given.get(given_name, given.get(name))
    return _typed_field(name, given_name, info, default, found, value)


def _typed_field(
    name: str, given_name: str, info: FieldInfo, default: Any, given: Any, value: Any = None
) -> ParameterField:
    """Returns a field; value: that in force, if it is neither the given one nor the default."""
    if value is None:
        value = default if given is None else given
    text = " ".join((info.description or "").split())
    units = UNIT.findall(text)
    unit = units[0] if units and units[0] != "-" else ""
    kind, choices = _kind_of(info, value)
    low, high, step = 0.0, 0.0, 0.0
    if kind in ("number", "whole"):
        low, high, step = _range(info, value, default, is_whole=kind == "whole")
    return ParameterField(
        name,
        given_name,
        kind,
        unit,
        UNIT.sub("", text),
        _plain(default),
        _plain(given),
        _plain(value),
        low,
        high,
        step,
        choices,
    )


def is_scalar(offer: Offer) -> bool:
    """Returns whether a parameter is a single number, flag, choice or text."""
    value = offer.default if offer.given is None else offer.given
    return isinstance(value, bool | int | float | str)


def _given_name(
    name: str,
    info: FieldInfo,
    value: Any,
    preset: Preset,
    given: Mapping[str, Any],
    release: Release | None,
) -> str:
    """Returns the name of a parameter in a file: the one that the file uses, else the release's."""
    others = [str(c) for c in getattr(info.validation_alias, "choices", ())]
    for other in others:
        if other in given:
            return other
    if not others or release is None:
        return name
    written = type(preset.parameters).for_original({name: value}, release)
    return next((entry for entry in written if entry in others), name)


def _kind_of(info: FieldInfo, value: Any) -> tuple[Any, tuple[str, ...]]:
    annotation = info.annotation
    if get_origin(annotation) is Literal:
        return "choice", tuple(map(str, get_args(annotation)))
    if isinstance(value, bool):
        return "flag", ()
    if isinstance(value, int):
        return "whole", ()
    if isinstance(value, float) and math.isfinite(value):
        return "number", ()
    return "text", ()


def _range(
    info: FieldInfo, value: float, default: Any, *, is_whole: bool
) -> tuple[float, float, float]:
    """Returns a slider's ends and step: the bounds, or a range around value and default."""
    usual = default if isinstance(default, int | float) and not isinstance(default, bool) else value
    size = REACH * max(abs(value), abs(usual)) or 1.0
    low = -size if min(value, usual) < 0.0 else 0.0
    high = 0.0 if max(value, usual) <= 0.0 and low < 0.0 else size
    for bound in info.metadata:
        if isinstance(bound, Within | Usual):
            low, high = max(low, bound.low), min(high, bound.high)
            continue
        low = max(low, getattr(bound, "ge", None) or getattr(bound, "gt", None) or low)
        for name in ("le", "lt"):
            limit = getattr(bound, name, None)
            high = high if limit is None else min(high, limit)
    if high <= low:
        # A range without width, such as at a bound of 0, gets a width on the allowed side.
        low, high = (low - size, high) if high <= 0.0 else (low, low + size)
    if is_whole:
        return math.floor(low), math.ceil(max(high, value, low + 1)), 1.0
    step = 10.0 ** math.floor(math.log10((high - low) / STEPS)) if high > low else 0.01
    is_open = any(
        getattr(bound, "gt", None) is not None or getattr(bound, "is_open", False)
        for bound in info.metadata
    )
    low = low + step if is_open and low == 0.0 else low
    return min(low, value), float(f"{max(high, value):.9g}"), step


def _plain(value: Any) -> Any:
    if isinstance(value, tuple | list):
        return [_plain(entry) for entry in value]
    if value is None or isinstance(value, bool | int | float | str):
        return value
    return None if type(value).__name__ == "PydanticUndefinedType" else str(value)
