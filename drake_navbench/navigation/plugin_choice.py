"""A field of a robot file that chooses one of several plugins by Nav2's name of its type."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Union

from pydantic import BeforeValidator, Discriminator, GetJsonSchemaHandler, Tag
from pydantic_core import CoreSchema

from drake_navbench.errors import nearest_name_hint


class _AnyOfThem:
    """Lets editors accept parameters that more than one of the plugins has, without a name."""

    def __get_pydantic_json_schema__(
        self, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        schema = handler(core_schema)
        schema["anyOf"] = schema.pop("oneOf")
        return schema


def plugin_choice(plugins: Mapping[str, Any], default: str) -> Any:
    """Returns the type of a field that holds one plugin's parameters, told apart by `plugin`.

    plugins: classes by Nav2's plugin type, each with its `Parameters`. Nav2's releases up to jazzy
    write some types with a slash, as in nav2_navfn_planner/NavfnPlanner; both are understood.
    """

    def plugin_of(data: Any) -> Any:
        if isinstance(data, Mapping):
            return data.get("plugin", default)
        return getattr(data, "plugin", default)

    def check_plugin(data: Any) -> Any:
        plugin = plugin_of(data)
        if isinstance(plugin, str) and "/" in plugin:
            plugin = plugin.replace("/", "::")
            data = {**data, "plugin": plugin}
        if not isinstance(plugin, str) or plugin not in plugins:
            raise ValueError(f"unknown plugin {plugin!r}{nearest_name_hint(plugin, plugins)}")
        return data

    tagged = [Annotated[chosen.Parameters, Tag(plugin)] for plugin, chosen in plugins.items()]
    union: Any = Union[tuple(tagged)]  # noqa: UP007
    return Annotated[union, Discriminator(plugin_of), BeforeValidator(check_plugin), _AnyOfThem()]
