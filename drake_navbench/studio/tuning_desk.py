"""The column that is tuned: its changed parameters, its trials, and the patch of its file."""

from __future__ import annotations

from concurrent.futures import Future
from pathlib import Path
from typing import Any

from drake_navbench.errors import InputError
from drake_navbench.nav2.patch import difference
from drake_navbench.studio.messages import Column, Driven
from drake_navbench.studio.open_folder import OpenFolder
from drake_navbench.studio.parameter_fields import ParameterField
from drake_navbench.typed_files.typed_yaml import parse_yaml

DEFAULT_COLUMN = "rpp"


class TuningDesk:
    """A column that is changed and driven again.

    file: path of the Nav2 file below the folder, '' for a preset. changes: as in Column. now,
    before, reference: the trial driven last, the one before it, and the locked one.
    """

    def __init__(self, folder: OpenFolder) -> None:
        self._folder = folder
        self.name, self.file, self.text, self.stamp = DEFAULT_COLUMN, "", "", ""
        self.changes: dict[str, Any] = {}
        self.now: Driven | None = None
        self.before: Driven | None = None
        self.reference: Driven | None = None

    def choose(self, file: str, name: str) -> None:
        """Takes another column; raises InputError where its file cannot be read."""
        if file:
            found = self._folder.read(file)
            path = self._folder.inside(file)
            self._folder.require_inside(parse_yaml(found.text, file), path.parent)
            self.text, self.stamp = found
        else:
            self.text, self.stamp = "", ""
        self.file, self.name, self.changes = file, name, {}

    def change(self, field: ParameterField, value: Any) -> None:
        """Sets a parameter; with the value that the file has, it is no longer a change."""
        if value == field.value:
            self.changes.pop(field.key, None)
        else:
            self.changes[field.key] = value

    def column(self, *, is_changed: bool = True) -> Column:
        """Returns the column with its changes, or without them."""
        path = str(self._folder.inside(self.file)) if self.file else ""
        changes = tuple(self.changes.items()) if is_changed else ()
        return Column(self.name, path, self.text, changes)

    def note(self, ended: Future[Driven]) -> None:
        """Notes an ended trial as the one driven last, even if its page was closed meanwhile."""
        if not ended.cancelled() and ended.exception() is None:
            self.before, self.now = self.now, ended.result()

    def lock(self) -> None:
        """Makes the trial driven last the reference."""
        self.reference = self.now

    def patch(self) -> str:
        """Returns the changes as a patch of the file, or as the argument of `run`; '' for none."""
        if not self.changes:
            return ""
        column = self.column()
        if not self.file:
            return f"drake-navbench run ... --controllers '{column.argument}'"
        return difference(self.file, self.text, column.patched_text, around=1)

    def save(self, name: str) -> None:
        """Writes the changed Nav2 file; raises ChangedOnDisk, InputError or CannotBeWritten."""
        if not self.file:
            raise InputError("a preset has no file to save; use the --controllers line below")
        if Path(name).suffix not in (".yaml", ".yml"):
            raise InputError(f"{name}: expected a name that ends in .yaml")
        text = self.column().patched_text
        self.stamp = self._folder.write(name, text, self.stamp if name == self.file else "")
        self.file, self.text, self.changes = name, text, {}
