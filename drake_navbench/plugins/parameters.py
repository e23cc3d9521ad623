"""Fields of settings that name plugins and hold each plugin's parameters as its own typed model.

There are two forms, both Nav2's. `chosen_plugin`: a block names its one plugin. `PluginBlocks`:
several blocks, under names that the file chooses, each name their plugin.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import (
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    ValidationError,
    model_validator,
)
from pydantic_core import CoreSchema, InitErrorDetails, PydanticCustomError

from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.typed_files.typed_yaml import (
    EXTRA_FIELD,
    FrozenModel,
    unknown_field,
)

Location = tuple[int | str, ...]


class PluginParameters(FrozenModel):
    """Base of the parameters of a plugin that is not built in: unknown names refused, frozen.

    plugin: under which name it is registered, as the file gives it.
    """

    plugin: str = Field("", description="Name under which the plugin is registered.")


def normalized(plugin: Any) -> Any:
    """Returns a plugin's name as Nav2 writes it from jazzy on, `package::Class` for a slash."""
    return plugin.replace("/", "::") if isinstance(plugin, str) else plugin


def chosen_plugin(kind: PluginKind, block: Mapping[str, Any]) -> Any:
    """Returns the parameters of the plugin that a block names, as its own model.

    Raises ValidationError, with the place within the block, where the plugin is broken or a value
    is wrong.
    """
    name = block["plugin"]
    try:
        if not isinstance(name, str):
            raise InputError(f"got {name!r}, expected the name of a {kind.noun}")
        chosen = kind.load(name)
        if kind.origin(name) is None and not kind.has_own_blocks:
            raise InputError(f"got {name!r}, expected a {kind.noun} of another package")
        model = chosen.Parameters
    except InputError as error:
        raise _as_validation_error([_fault(str(error), ("plugin",), name)]) from error
    try:
        # Through JSON, because strictness there takes a list for a tuple.
        return model.model_validate_json(json.dumps({**block}, default=str), strict=True)
    except ValidationError as error:
        who = f"{kind.noun} {name}"
        raise _as_validation_error([_retold(fault, who, model) for fault in error.errors()]) from (
            error
        )


class PluginBlocks(FrozenModel):
    """Base of settings in which further blocks, under free names, hold the parameters of plugins.

    PLUGINS: of which kind these are. Fields of a subclass count as given in Python, where
    strictness takes no list for a tuple.
    """

    PLUGINS: ClassVar[PluginKind]

    model_config = ConfigDict(extra="allow")

    @property
    def plugin_blocks(self) -> Mapping[str, Any]:
        """The parameters of the plugins by the names of their blocks."""
        return self.model_extra or {}

    @model_validator(mode="before")
    @classmethod
    def _read_blocks(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        fields: dict[str, Any] = {}
        faults: list[InitErrorDetails] = []
        for name, value in data.items():
            if name in cls.model_fields or isinstance(value, PluginParameters):
                fields[name] = value
            elif not isinstance(value, Mapping) or "plugin" not in value:
                hint = nearest_name_hint(name, cls.model_fields)
                text = f"unknown field{hint}; the block of a {cls.PLUGINS.noun} has `plugin`"
                faults.append(unknown_field(text, (name,), value))
            else:
                block = {**value, "plugin": normalized(value["plugin"])}
                try:
                    fields[name] = chosen_plugin(cls.PLUGINS, block)
                except ValidationError as error:
                    faults += [_moved(fault, (name,)) for fault in error.errors()]
        if faults:
            raise ValidationError.from_exception_data(cls.__name__, faults)
        return fields

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        schema = handler.resolve_ref_schema(handler(core_schema))
        schema["additionalProperties"] = {
            "type": "object",
            "description": f"Parameters of a {cls.PLUGINS.noun} of another package.",
            "properties": {"plugin": {"type": "string"}},
            "required": ["plugin"],
        }
        return schema


def _as_validation_error(faults: list[InitErrorDetails]) -> ValidationError:
    return ValidationError.from_exception_data("plugin", faults)


def _retold(fault: Any, who: str, model: Any) -> InitErrorDetails:
    """Returns a fault of a plugin's parameters; an unknown one with the nearest of its own."""
    if fault["type"] != EXTRA_FIELD:
        return _fault(fault["msg"].removeprefix("Value error, "), fault["loc"], fault["input"])
    hint = nearest_name_hint(str(fault["loc"][-1]), model.model_fields)
    return unknown_field(f"{who} has no such parameter{hint}", fault["loc"], fault["input"])


def _moved(fault: Any, place: Location) -> InitErrorDetails:
    """Returns a fault with a place put before its own."""
    kind = PydanticCustomError(fault["type"], fault["msg"])
    return InitErrorDetails(type=kind, loc=(*place, *fault["loc"]), input=fault["input"])


def _fault(text: str, location: Location, found: Any) -> InitErrorDetails:
    return InitErrorDetails(type=PydanticCustomError("plugin", text), loc=location, input=found)
