"""Tables and lists of names that come with a package as YAML."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from drake_navbench.typed_files.yaml_loader import load_yaml


def packaged_table(package: str, file: str) -> dict[str, Any]:
    """Returns the content of a YAML file of a package."""
    table: dict[str, Any] = load_yaml(files(package).joinpath(file).read_text(encoding="utf-8"))
    return table


def name_lists(package: str, file: str) -> Mapping[str, tuple[str, ...]]:
    """Returns the lists in a YAML file of a package, by their own names."""
    return {name: tuple(names) for name, names in packaged_table(package, file).items()}
