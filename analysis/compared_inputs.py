"""Inputs that differ between two results folders, so that equal seeds are no equal trials."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from drake_navbench.analysis.numbers import counted
from drake_navbench.errors import InputError, one_line
from drake_navbench.typed_files.input_file import read_input_text
from drake_navbench.typed_files.typed_yaml import MAX_FILE_BYTES
from drake_navbench.typed_files.yaml_loader import load_yaml

# The navigation of a robot file is a column's own where a whole Nav2 file drives.
NOT_OF_THE_BODY = ("description", "navigation")
MOST_NAMED = 4


def lines_on_inputs(first: Path, second: Path) -> list[str]:
    """Returns a line on scenarios that differ between two results folders, and one on the robot.

    Raises InputError where a file of the inputs is no YAML.
    """
    lines = []
    changed = [pair[0].stem for pair in _in_both(first, second, "scenarios") if _differ(*pair)]
    if changed:
        places = list(dict.fromkeys(name.removesuffix(".maps") for name in changed))
        more = f" and {len(places) - MOST_NAMED} more" if len(places) > MOST_NAMED else ""
        lines.append(
            f"{counted(len(places), 'scenario')} changed: {', '.join(places[:MOST_NAMED])}{more}; "
            "equal seeds there are no equal trials"
        )
    # The robot is the same in all scenarios, but for fields that scenarios change.
    for pair in _in_both(first, second, "robots"):
        if _differ(*pair) and (fields := _changed_fields(*map(_body, pair))):
            lines.append(f"the robot changed: {', '.join(fields)}")
        break
    return lines


def _in_both(first: Path, second: Path, kind: str) -> Iterator[tuple[Path, Path]]:
    """Yields the files of a kind of inputs that both folders have."""
    for path in sorted((first / "inputs" / kind).glob("*.yaml")):
        other = second / "inputs" / kind / path.name
        if other.is_file():
            yield path, other


def _differ(first: Path, second: Path) -> bool:
    texts = (read_input_text(path, max_bytes=MAX_FILE_BYTES) for path in (first, second))
    return next(texts) != next(texts)


def _body(path: Path) -> dict[str, Any]:
    try:
        data = load_yaml(read_input_text(path, max_bytes=MAX_FILE_BYTES))
    except yaml.YAMLError as error:
        raise InputError(f"{path}: cannot be read: {one_line(error)}") from error
    known = data if isinstance(data, Mapping) else {}
    return {name: value for name, value in known.items() if name not in NOT_OF_THE_BODY}


def _changed_fields(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    return [name for name in dict.fromkeys((*old, *new)) if old.get(name) != new.get(name)]
