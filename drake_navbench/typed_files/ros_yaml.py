"""Turns the YAML of ROS's parameter files into the values that rcl_yaml_param_parser makes of them.

It takes a plain scalar for true or false, then for C's strtol, then for strtod, then for text. So
`y` is true, `1e-3`, `+.5`, `5.`, `08`, `.inf` and `inf` are numbers, `1:30`, `2024-01-01` and
`null` are text.

Source: rcl_yaml_param_parser (parse.c).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import partial
from typing import Any, ClassVar

import yaml

from drake_navbench.typed_files.yaml_loader import (
    DECIMAL,
    TAG_PREFIX,
    MergesByDefinition,
    made,
)

# Without a point, as strtod reads them, in upper or lower case.
_NO_POINT = r"[-+]?(?i:inf|infinity|nan)"
_HEXADECIMAL = r"[-+]?0[xX](?:[0-9a-fA-F]+\.?[0-9a-fA-F]*|\.[0-9a-fA-F]+)(?:[pP][-+]?[0-9]+)?"
_SCALARS: Mapping[str, str] = {
    "merge": "<<",
    "null": "",
    "bool": "[yYnN]|yes|Yes|YES|no|No|NO|true|True|TRUE|false|False|FALSE|on|On|ON|off|Off|OFF",
    "int": "[-+]?(0|[1-9][0-9]*|0[0-7]+|0[xX][0-9a-fA-F]+)",
    "float": rf"{DECIMAL}|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)|{_NO_POINT}|{_HEXADECIMAL}",
}


class RosLoader(MergesByDefinition, yaml.SafeLoader):
    """PyYAML's loader with the scalars of rcl_yaml_param_parser."""

    bool_values: ClassVar[dict[str, bool]] = {**yaml.SafeLoader.bool_values, "y": True, "n": False}
    # PyYAML's own table belongs to the class, too; its stubs say otherwise.
    yaml_implicit_resolvers: ClassVar[dict[str | None, list[Any]]] = {}  # type: ignore[misc]

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        return made(partial(super().construct_object, node, deep), node)

    def construct_mapping(self, node: yaml.Node, deep: bool = False) -> dict[Any, Any]:
        """Returns a mapping; its keys are text, so that the key `y` is not true."""
        if isinstance(node, yaml.MappingNode):
            self.flatten_mapping(node)
            for key, _ in node.value:
                if isinstance(key, yaml.ScalarNode):
                    key.tag = f"{TAG_PREFIX}str"
        # PyYAML refuses a node of another kind; its stubs take none.
        return super().construct_mapping(node, deep)  # type: ignore[arg-type]

    def construct_yaml_int(self, node: yaml.ScalarNode) -> int:
        """Returns a whole number, also of an upper-case 0X."""
        return int(super().construct_yaml_int(_lowered(node)))

    def construct_yaml_float(self, node: yaml.ScalarNode) -> float:
        """Returns a number, also of base 16 and without the point of .inf and .nan."""
        text = node.value.lower().lstrip("+-")
        if text.startswith("0x"):
            return float.fromhex(node.value)
        if text.isalpha():
            return float(node.value)
        return float(super().construct_yaml_float(node))


def _lowered(node: yaml.ScalarNode) -> yaml.ScalarNode:
    return yaml.ScalarNode(node.tag, node.value.lower(), node.start_mark, node.end_mark)


for _tag, _pattern in _SCALARS.items():
    RosLoader.add_implicit_resolver(f"{TAG_PREFIX}{_tag}", re.compile(f"(?:{_pattern})$"), [None])
for _tag in ("int", "float"):
    RosLoader.add_constructor(f"{TAG_PREFIX}{_tag}", getattr(RosLoader, f"construct_yaml_{_tag}"))
