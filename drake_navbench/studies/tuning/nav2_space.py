"""The search around a whole Nav2 file: parameters of any node, and patches of the file.

Each candidate is the file's text with other values in it, read as `--against` reads a file, so that
costmaps, planner and all other nodes can be searched as controllers can.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.inputs.presets import Preset
from drake_navbench.nav2.controllers import SERVER
from drake_navbench.nav2.differences import resolved_settings, why_without_effect
from drake_navbench.nav2.patch import SHORT_NODES, Place, difference, patched, place_of
from drake_navbench.nav2.whole_files import (
    FileColumns,
    WholeFile,
    columns_of_files,
    require_columns,
)
from drake_navbench.studies.tuning.search_space import (
    Dimension,
    SearchSpace,
    own_texts,
    parse_dimension,
    require_each_once,
)
from drake_navbench.typed_files.output_file import write_text
from drake_navbench.typed_files.typed_yaml import read_text


@dataclass(frozen=True)
class FileSpace(SearchSpace):
    """The searched parameters of a Nav2 file; all others, comments and order stay.

    path, text: the file's path and content. plugin: the controller that drives. robot: the name of
    the base robot.
    """

    path: Path
    text: str
    plugin: str
    robot: str

    def candidate(self, values: Mapping[str, Any]) -> Preset:
        """Returns the column of the file with these values; raises InputError."""
        assigned = ":".join(f"{name}={value}" for name, value in values.items())
        name = f"{self.baseline.name}:{assigned}" if values else self.baseline.name
        file = WholeFile(name, (self.path,), {self.path: self.patched(values)})
        (columns,) = require_columns(columns_of_files([file], self.robot))
        return columns.plugins[self.plugin]

    def patched(self, values: Mapping[str, Any]) -> str:
        """Returns the file's text with these values."""
        places: dict[Place | str, Any] = {
            _place(name, self.plugin): value for name, value in values.items()
        }
        return patched(self.text, places, self.path)

    def write(
        self, column: Preset, values: Mapping[str, Any], stem: Path, remarks: Sequence[str]
    ) -> None:
        """Writes the patched file, and the patch itself after the remarks."""
        after = self.patched(values)
        write_text(stem.with_name(f"{stem.name}.yaml"), after)
        comments = "".join(f"# {line}\n" for line in remarks)
        patch = difference(self.path.name, self.text, after)
        write_text(stem.with_name(f"{stem.name}.patch"), comments + patch)


def file_space(path: Path, plugin: str | None, robot: str, axes: Sequence[str]) -> FileSpace:
    """Returns the search space of a Nav2 file; raises InputError.

    plugin: the name of one of the file's controllers; may be left out if there is only one. axes:
    NAME=VALUES as in `search_space`, where NAME is a parameter of the controller or of another
    node, such as `local_costmap.PARAMETER`. If it is empty, the space is the one in the
    controller's own tuning.yaml.
    """
    text = read_text(path)
    (columns,) = require_columns(
        columns_of_files([WholeFile(path.stem, (path,), {path: text})], robot)
    )
    plugin = _chosen(columns, plugin)
    baseline = columns.plugins[plugin]
    settings = resolved_settings(columns)
    texts = list(axes) or own_texts(baseline)
    names = [entry.partition("=")[0] for entry in texts]
    now = {name: settings.get(_place(name, plugin)) for name in names}
    require_each_once(names)
    for name in names:
        _require_known(_place(name, plugin), settings, columns)
    dimensions = tuple(parse_dimension(entry, now) for entry in texts)
    space = FileSpace(baseline, dimensions, path, text, plugin, robot)
    for entry in dimensions:
        _require_effect(space, entry)
    return space


def current_values(space: FileSpace) -> dict[str, Any]:
    """Returns the values that hold with the file, by the searched names."""
    (columns,) = columns_of_files([WholeFile(space.baseline.name, (space.path,))], space.robot)
    settings = resolved_settings(columns)
    return {
        entry.name: settings.get(_place(entry.name, space.plugin)) for entry in space.dimensions
    }


def _chosen(columns: FileColumns, plugin: str | None) -> str:
    names = list(columns.plugins)
    if plugin is None and len(names) == 1:
        return names[0]
    if plugin not in names:
        raise InputError(
            f"--controller {plugin or ''}: expected a controller of {columns.file.told}: "
            f"{', '.join(names) or 'the file has none'}"
        )
    return plugin


def _place(name: str, plugin: str) -> Place:
    """Returns the place of a searched name: below the node it begins with, else the plugin."""
    node = name.partition(".")[0]
    nodes = {key.partition("/")[0] for key in (*SHORT_NODES, *SHORT_NODES.values())}
    if node in nodes or node.endswith(("_server", "_smoother", "_monitor", "_follower")):
        return place_of(name)
    own = name.removeprefix(f"{plugin}.")
    return Place(SERVER, f"{plugin}.{own}")


def _require_known(
    place: Place, settings: Mapping[tuple[str, str], Any], columns: FileColumns
) -> None:
    if place in settings or place in columns.setup.given:
        return
    known = [name for node, name in settings if node == place.node]
    hint = nearest_name_hint(place.name, known)
    raise InputError(f"--parameter {place}: {columns.file.told} has no such parameter{hint}")


def _require_effect(space: FileSpace, entry: Dimension) -> None:
    """Raises InputError where a searched value is refused, or has no effect here."""
    place = _place(entry.name, space.plugin)
    for value in entry.ends:
        name = space.baseline.name
        file = WholeFile(name, (space.path,), {space.path: space.patched({entry.name: value})})
        (columns,) = columns_of_files([file], space.robot)
        if reason := why_without_effect(place, columns):
            raise InputError(f"--parameter {entry.name}: has no effect here: {reason}")
