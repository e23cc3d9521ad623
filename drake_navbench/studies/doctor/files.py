"""The file that is looked at, and its patched versions, as columns that drive one base."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from drake_navbench.errors import InputError
from drake_navbench.inputs.check import CheckRow, Status
from drake_navbench.inputs.drive import Drive
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot, is_model
from drake_navbench.nav2.known_base import known_base_of
from drake_navbench.nav2.nav2_setup import Nav2Setup
from drake_navbench.nav2.patch import Place, patched_files
from drake_navbench.nav2.whole_files import (
    FileColumns,
    WholeFile,
    columns_of_files,
    require_columns,
    robot_of_files,
)
from drake_navbench.studies.doctor.facts import Facts, facts_of
from drake_navbench.studies.doctor.left_out import readable_setup

# The limits of a drive that a Nav2 file may set.
SPEEDS = (
    "max_linear_velocity_mps",
    "min_linear_velocity_mps",
    "max_angular_velocity_radps",
    "max_lateral_velocity_mps",
)


@dataclass(frozen=True)
class Patient:
    """The Nav2 file that is looked at; it is read once, so that all changes are of one text.

    paths: of the file, or of several that are merged, later ones overriding. robot: name or file of
    the robot for what no Nav2 file tells. values: for the file's substitutions. release: of Nav2,
    by the file's own marks where None. plugin: the controller's name in the file, '' for the first.
    packages: folders searched for the packages that a robot's model names.
    """

    paths: tuple[Path, ...]
    robot: str
    values: Mapping[str, str]
    release: str | None = None
    plugin: str = ""
    packages: tuple[Path, ...] = ()

    @cached_property
    def texts(self) -> dict[Path, str]:
        """The text of each file, in their order."""
        return {path: path.read_text(encoding="utf-8") for path in self.paths}

    def columns(self) -> FileColumns:
        """Returns the columns of the file as it is; raises InputError where it is wrong."""
        return self._columns

    @cached_property
    def _columns(self) -> FileColumns:
        return self._read([WholeFile("before", self.paths)], self.release)[0]

    def _read(self, files: Sequence[WholeFile], release: str | None) -> tuple[FileColumns, ...]:
        base, other_names = self._robot
        found = columns_of_files(
            *(files, self.robot, self.values),
            release=release,
            base=base,
            other_names=other_names,
        )
        return require_columns(found)

    @cached_property
    def _robot(self) -> tuple[Robot, Collection[str]]:
        """The robot as its own file has it, and the names of its xacro arguments."""
        return robot_of_files(self.robot, self.paths, self.values, self.packages)

    def chosen(self, columns: FileColumns) -> Preset:
        """Returns the column of the controller that is looked at; raises InputError."""
        preset = self._chosen(columns.setup)
        if preset is None:
            raise InputError(
                f"{columns.file.told}: no controller_server with controller_plugins; expected one"
            )
        return preset

    def _chosen(self, setup: Nav2Setup) -> Preset | None:
        plugins = setup.controllers
        if not self.plugin:
            return next(iter(plugins.values()), None)
        if self.plugin not in plugins:
            raise InputError(f"--controller {self.plugin!r}: expected one of {', '.join(plugins)}")
        return plugins[self.plugin]

    def facts(self) -> Facts:
        """Returns the facts of what can be read of the file; raises InputError."""
        return self._facts

    def contradictions(self) -> list[CheckRow]:
        """Returns a row for each property in which file and robot's model differ.

        None without a model, or where the whole file cannot be read.
        """
        if not is_model(self.robot):
            return []
        # Imported here, as Drake and the model's readers are only needed for a model.
        from drake_navbench.inputs.described_robot import describe_robot
        from drake_navbench.nav2.model_check import contradictions

        known = known_base_of(self.paths)
        described = describe_robot(Path(self.robot), self.values, self.packages, known)
        try:
            setup = self.columns().setup
        except InputError:
            return []
        return contradictions(setup, described)

    @cached_property
    def _facts(self) -> Facts:
        drive = self._robot[0].drive
        is_known = "max_linear_velocity_mps" in drive.model_fields_set
        return replace(
            self._facts_of_file(), base_mps=drive.max_linear_velocity_mps if is_known else 0.0
        )

    def _facts_of_file(self) -> Facts:
        try:
            columns = self.columns()
        except InputError:
            base, _ = self._robot
            found = readable_setup(self.paths, self.robot, self.values, self.release, base)
            return found.facts(self._chosen(found.setup))
        return facts_of(columns.setup, self._chosen(columns.setup))

    def patched_texts(self, changes: Mapping[Place, Any]) -> dict[Path, str]:
        """Returns the texts of the files that change for these values; raises InputError."""
        return patched_files(self.texts, changes)

    def before_and_after(self, changes: Mapping[Place, Any]) -> tuple[Preset, Preset]:
        """Returns the columns of the file as it is and with a change, for one base.

        Raises InputError where the change is refused, or asks for more speed than the file does and
        the lent base can do.
        """
        before, after = self._with(changes)
        alone = self.columns()
        drive = before.setup.robot.drive
        if drive != alone.setup.robot.drive and not self._can(drive, alone.setup.robot.drive):
            raise InputError("asks for more speed than the file does and the robot can do")
        if not np.array_equal(after.setup.robot.outline, alone.setup.robot.outline):
            raise InputError("changes the outline, which is the robot's own body here")
        return self.chosen(before), self.chosen(after)

    def _can(self, drive: Drive, alone: Drive) -> bool:
        """Tells whether a drive exceeds the file's only in speeds, and the robot's own has these.

        A speed that the robot's file does not give is not its own.
        """
        own = self._robot[0].drive
        more = {name: value for name, value in drive if getattr(alone, name, None) != value}
        return type(drive) is type(alone) and all(
            name in SPEEDS
            and name in own.model_fields_set
            and abs(value) <= abs(getattr(own, name))
            for name, value in more.items()
        )

    def require_read(self, place: Place, value: Any) -> None:
        """Raises InputError if Nav2 does not read a parameter, or refuses its value."""
        _, after = self._with({place: value})
        for row in after.setup.check.rows:
            if (row.node, row.parameter, row.status) == (*place, Status.UNREAD):
                raise InputError(f"{place.node} does not read {place.name}: {row.remark}")

    def _with(self, changes: Mapping[Place, Any]) -> tuple[FileColumns, ...]:
        """Returns the columns of the file as it is and with a change, for one base."""
        texts = self.patched_texts(changes)
        release = self.release or str(self.facts().release)
        files = [WholeFile("before", self.paths), WholeFile("after", self.paths, texts)]
        return self._read(files, release)


def speed_asked(facts: Facts, robot: Robot) -> float:
    """Returns the speed that probes are made for, m/s: what is asked for and the base can do."""
    return min(facts.asked_mps or 0.3, robot.drive.max_linear_velocity_mps)


def told_files(paths: Sequence[Path]) -> str:
    """Returns the names of files for a sentence."""
    return " + ".join(path.name for path in paths)
