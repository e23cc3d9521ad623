"""Fields of settings that name plugins and hold each plugin's parameters as its own typed model.

There are two forms, both Nav2's. `chosen_plugin`: a block names its one plugin. `PluginBlocks`:
several blocks, under names that the file chooses, each name their plugin.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import (
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    ValidationError,
    model_validator,
)
from pydantic_core import CoreSchema, InitErrorDetails

from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.typed_files.typed_yaml import (
    FrozenModel,
    faults_within,
    found_fault,
    read_block,
    unknown_field,
)


class PluginParameters(FrozenModel):
    """Base of the parameters of a plugin that is not built in: unknown names refused, frozen.

    plugin: the name under which the plugin is registered, as the file gives it.
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
        fault = found_fault(str(error), ("plugin",), name)
        raise ValidationError.from_exception_data("plugin", [fault]) from error
    try:
        return read_block(model, block)
    except ValidationError as error:
        faults = faults_within((), error, model, f"{kind.noun} {name} has no such parameter")
        raise ValidationError.from_exception_data("plugin", faults) from error


class PluginBlocks(FrozenModel):
    """Base of settings in which further blocks, under free names, hold the parameters of plugins.

    PLUGINS: the kind of these plugins. A field of a subclass has to be a list where a file gives
    one: after this class has read a block, pydantic takes no list for a tuple.
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
                    faults += faults_within((name,), error, cls)
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
