"""The scenario that is open on a desk: its file, its drawing, and saving it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drake_navbench.errors import InputError
from drake_navbench.inputs.floor_scenario import SCENARIO_FILES
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studio.drawing import EMPTY_FLOOR, Drawing, Place
from drake_navbench.studio.open_folder import OpenFolder
from drake_navbench.studio.yaml_text import updated_text
from drake_navbench.typed_files.typed_yaml import parse_yaml, validate

YAML_SUFFIXES = (".yaml", ".yml")
WORLD_SUFFIXES = (".world", ".sdf")
NEW_NAME = "drawn.yaml"
# The kind of a file is recognized by a line at the left margin, without reading the file as YAML.
SIGNS = {
    "scenario": re.compile(r"^(goal|mission|waypoints)\s*:", re.M),
    "map": re.compile(r"^image\s*:", re.M),
    "robot": re.compile(r"^(footprint|robot_radius|drive|like)\s*:", re.M),
    "nav2": re.compile(r"^\s*[\"']?ros__parameters[\"']?\s*:", re.M),
}


def files_of(folder: OpenFolder, kind: str) -> list[str]:
    """Returns the names of the YAML files of a kind: 'scenario', 'map', 'robot' or 'nav2'."""
    found = []
    for name in folder.names(YAML_SUFFIXES):
        try:
            text = folder.read(name).text
        except InputError:
            continue
        if next((sign for sign, mark in SIGNS.items() if mark.search(text)), "") == kind:
            found.append(name)
    return found


class OpenScenario:
    """A scenario with its file.

    name: the file's, below the folder. stamp: stamp of the file as it was read, '' for a new file.
    text: as it was read. floor: the place of the drawn floor, () without floors.
    """

    def __init__(self, folder: OpenFolder) -> None:
        self._folder = folder
        self.name, self.stamp, self.text = NEW_NAME, "", ""
        self.drawing = Drawing(EMPTY_FLOOR)
        self.opened = 0
        self._warned = ("", "")

    @property
    def path(self) -> str:
        """The path of the file, which need not exist yet."""
        return str(self._folder.inside(self.name))

    @property
    def floor(self) -> Place:
        """The place of the drawn part: the first floor of a mission, else the scenario itself."""
        return ("floors", 0) if self.drawing.content.get("floors") else ()

    def open(self, kind: str, name: str) -> None:
        """Opens a scenario: a 'file', a copy of a 'built-in' one, a 'new' floor or one on a 'map'.

        Raises InputError with the loader's message; and, once for each choice, if there are unsaved
        steps.
        """
        self.require_saved(kind, name)
        if kind == "file":
            found = self._folder.read(name)
            self._begin(name, found.stamp, found.text)
        elif kind == "built-in":
            self._begin(f"{name}.yaml", "", SCENARIO_FILES.find(name).read_text(encoding="utf-8"))
        elif kind == "map":
            content = {**EMPTY_FLOOR, "world": {"map": name, "obstacles": []}}
            self.open_new(content, f"on_{name.rpartition('/')[2]}")
        else:
            self.open_new(EMPTY_FLOOR)

    def require_saved(self, kind: str, name: str) -> None:
        """Raises InputError, once for each choice, if there are unsaved steps."""
        if self.drawing.is_changed and self._warned != (kind, name):
            self._warned = (kind, name)
            raise InputError(
                f"{self.name}: has steps that are not saved; save it, or choose once more to drop "
                "them"
            )

    def open_new(self, content: Mapping[str, Any], name: str = NEW_NAME) -> None:
        """Begins a new file."""
        self._require_valid(content, name)
        self._set(name, "", "", content)

    def change(self, content: dict[str, Any]) -> None:
        """Makes a step; if the loader refuses the content, raises InputError and makes no step."""
        self._require_valid(content, self.name)
        self.drawing.change(content)

    def saved_text(self) -> str:
        """Returns the text that saving would write."""
        return updated_text(self.text, self.drawing.content, self.name)

    def save(self, name: str) -> None:
        """Writes the file; raises ChangedOnDisk, InputError or CannotBeWritten."""
        if Path(name).suffix not in YAML_SUFFIXES:
            raise InputError(f"{name}: expected a name that ends in .yaml")
        self._require_valid(self.drawing.content, name)
        text = self.saved_text()
        stamp = self.stamp if name == self.name else ""
        self.stamp = self._folder.write(name, text, stamp)
        self.name, self.text = name, text
        self.drawing.note_saved()

    @property
    def is_changed_on_disk(self) -> bool:
        """Whether the file has changed since it was read or saved last."""
        return bool(self.stamp) and self._folder.is_changed(self.name, self.stamp)

    def _begin(self, name: str, stamp: str, text: str) -> None:
        content = parse_yaml(text, name)
        self._require_valid(content, name)
        self._set(name, stamp, text, content)

    def _set(self, name: str, stamp: str, text: str, content: Mapping[str, Any]) -> None:
        self.name, self.stamp, self.text = name, stamp, text
        self.drawing = Drawing(content)
        self.opened += 1
        self._warned = ("", "")

    def _require_valid(self, content: Mapping[str, Any], name: str) -> None:
        path = self._folder.inside(name)
        self._folder.require_inside(dict(content), path.parent)
        validate(Scenario, dict(content) | {"name": path.stem}, name)
