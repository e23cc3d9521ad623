"""Lists of names that come with a package as YAML."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files

from drake_navbench.typed_files.yaml_loader import load_yaml


def name_lists(package: str, file: str) -> Mapping[str, tuple[str, ...]]:
    """Returns the lists in a YAML file of a package, by their own names."""
    text = files(package).joinpath(file).read_text(encoding="utf-8")
    return {name: tuple(names) for name, names in load_yaml(text).items()}
