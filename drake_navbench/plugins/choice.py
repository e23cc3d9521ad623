"""A field of a file that chooses one of several plugins by name, with its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Union

from pydantic import (
    Discriminator,
    GetJsonSchemaHandler,
    SerializerFunctionWrapHandler,
    Tag,
    ValidatorFunctionWrapHandler,
    WrapSerializer,
    WrapValidator,
)
from pydantic_core import CoreSchema

from drake_navbench.errors import nearest_name_hint
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.plugins.parameters import chosen_plugin, normalized


class _AnyOfThem:
    """A schema by which editors accept parameters of several plugins without a plugin's name.

    It also accepts parameters of plugins that the editors cannot know.
    """

    def __init__(self, built_in: Mapping[str, Any]) -> None:
        self._built_in = built_in

    def __get_pydantic_json_schema__(
        self, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        schema = handler(core_schema)
        schema["anyOf"] = [
            *schema.pop("oneOf"),
            {
                "type": "object",
                "description": "Parameters of a plugin of another package.",
                "properties": {"plugin": {"type": "string", "not": {"enum": [*self._built_in]}}},
                "required": ["plugin"],
            },
        ]
        return schema


def plugin_choice(kind: PluginKind, default: str | None = None) -> Any:
    """Returns the type of a field that holds one plugin's parameters, told apart by `plugin`.

    default: the plugin of a block that names none; None where a block must name one. Nav2's
    releases up to Jazzy write some types with a slash, as in nav2_navfn_planner/NavfnPlanner; both
    forms are accepted.
    """

    def plugin_of(data: Any) -> Any:
        if isinstance(data, Mapping):
            return data.get("plugin", default)
        return getattr(data, "plugin", default)

    def check_plugin(data: Any, validate_built_in: ValidatorFunctionWrapHandler) -> Any:
        plugin = normalized(plugin_of(data))
        if not isinstance(plugin, str) or plugin not in kind:
            raise ValueError(f"unknown plugin {plugin!r}{nearest_name_hint(plugin, kind.names)}")
        if kind.origin(plugin) is not None:
            is_checked = kind.parameters is not None and isinstance(data, kind.parameters)
            return data if is_checked else chosen_plugin(kind, {**data, "plugin": plugin})
        if isinstance(data, Mapping) and "plugin" in data:
            data = {**data, "plugin": plugin}
        return validate_built_in(data)

    def as_itself(value: Any, serialize_built_in: SerializerFunctionWrapHandler, info: Any) -> Any:
        if kind.parameters is None or not isinstance(value, kind.parameters):
            return serialize_built_in(value)
        return value.model_dump(mode=info.mode, exclude_unset=info.exclude_unset)

    tagged = [Annotated[chosen.Parameters, Tag(name)] for name, chosen in kind.built_in.items()]
    union: Any = Union[tuple(tagged)]  # noqa: UP007
    return Annotated[
        union,
        Discriminator(plugin_of),
        _AnyOfThem(kind.built_in),
        WrapValidator(check_plugin),
        WrapSerializer(as_itself),
    ]
