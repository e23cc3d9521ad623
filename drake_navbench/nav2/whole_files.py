"""Whole Nav2 files beside each other: each makes columns that drive with all of its settings.

A column of `--params` takes a controller and drives the run's robot. A column from here has its
file's own costmaps, planner, smoother, monitor and checkers in `Preset.stack`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from drake_navbench.errors import InputError
from drake_navbench.inputs.check import Check, CheckRow
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot, is_model, load_robot
from drake_navbench.nav2.known_base import known_base_of
from drake_navbench.nav2.nav2_setup import Nav2Setup
from drake_navbench.nav2.read_files import read_sections
from drake_navbench.nav2.robot import setup_of
from drake_navbench.nav2.substitutions import Substitutions


class WholeFile(NamedTuple):
    """A Nav2 file, or several that are merged, later ones overriding.

    name: beginning of its columns' names; '' for names as of a single file,
    `nav2_params/FollowPath`. texts: replace the contents of some of the paths, such as by patched
    ones.
    """

    name: str
    paths: tuple[Path, ...]
    texts: Mapping[Path, str] = MappingProxyType({})

    @property
    def told(self) -> str:
        """The name of the file in messages: 'a.yaml', or 'a.yaml + b.yaml' for merged ones."""
        return " + ".join(map(str, self.paths))


@dataclass(frozen=True)
class FileColumns:
    """The columns of a whole Nav2 file.

    setup: its columns, by their final names, its robot and the check of every parameter.
    """

    file: WholeFile
    setup: Nav2Setup

    @property
    def name(self) -> str:
        """The alias of the file."""
        return self.file.name or self.file.paths[-1].stem

    @property
    def presets(self) -> tuple[Preset, ...]:
        """The columns."""
        return self.setup.presets

    @property
    def plugins(self) -> dict[str, Preset]:
        """The columns by the name of their plugin in the file, 'FollowPath'."""
        return self.setup.controllers

    @property
    def drives_as(self) -> dict[str, Any]:
        """The resolved inputs of the file's trials; files with equal inputs drive alike."""
        controllers = {
            plugin: [
                preset.controller,
                preset.parameters.model_dump(mode="json"),
                dict(preset.path_handler),
            ]
            for plugin, preset in self.plugins.items()
        }
        robot = self.setup.robot.model_dump(mode="json", exclude={"description"})
        return {"robot": robot, "controllers": controllers}

    def with_rows(self, rows: Sequence[CheckRow]) -> FileColumns:
        """Returns these columns with more rows in the check."""
        check = Check((*self.setup.check.rows, *rows))
        return replace(self, setup=replace(self.setup, check=check))


def robot_of_files(
    robot: str,
    paths: Sequence[Path],
    values: Mapping[str, str] | None = None,
    packages: Sequence[Path] = (),
) -> tuple[Robot, Collection[str]]:
    """Returns a robot by name or file, and the names of its xacro arguments.

    A model's base link and outline may be in Nav2 files. values: values of xacro arguments.
    packages: folders searched for the packages that a model names.
    """
    if not is_model(robot):
        return load_robot(robot), ()
    # Imported here, as Drake and the model's readers are only needed for a model.
    from drake_navbench.inputs.described_robot import describe_robot

    known = known_base_of(paths)
    described = describe_robot(Path(robot), values, packages, known)
    loaded = load_robot(robot, arguments=values, packages=packages, known=known)
    return loaded, described.source.arguments


def columns_of_files(
    files: Sequence[WholeFile],
    robot: str,
    values: Mapping[str, str] | None = None,
    *,
    release: str | None = None,
    base: Robot | None = None,
    other_names: Collection[str] = (),
) -> tuple[FileColumns, ...]:
    """Returns the columns of whole Nav2 files, to drive beside each other.

    robot: name or file of the robot that supplies all that no Nav2 file contains. values: for the
    files' substitutions. release: Nav2's; by default the one that each file's own marks tell. base:
    the robot, if it is loaded already; then other_names are the names in `values` that others use,
    such as the arguments of the robot's model.

    All drive the same base, whose speeds are those that the controllers of all files ask for. One
    file alone drives as by `--nav2`. To drive a patched file against the original:

        text = patched(path.read_text(), {"local_costmap.inflation_layer.inflation_radius": 0.7},
                       path)
        files = [WholeFile("before", (path,)), WholeFile("after", (path,), {path: text})]
        columns = columns_of_files(files, "turtlebot4")
        presets = [preset for column in columns for preset in column.presets]
        campaign = plan_campaign(scenarios, presets, trials=8)

    A file of whose controllers none exists here has no columns; `require_columns` refuses it.
    Raises InputError where a file is wrong, or two have one name.
    """
    if base is None:
        paths = [path for file in files for path in file.paths]
        base, other_names = robot_of_files(robot, paths, values)
    _require_different_names(files)
    substitutions = Substitutions(values or {})

    read = [read_sections(file.paths, substitutions, file.texts) for file in files]
    substitutions.require_all_used(other_names)
    make = partial(setup_of, base=base, base_name=robot, release=release)
    alone = [make(entry) for entry in read]
    columns = []
    for file, entry, setup in zip(files, read, alone, strict=True):
        others = [other for other in alone if other is not setup]
        if any(other.robot.drive != setup.robot.drive for other in others):
            setup = make(entry, beside=others)
        columns.append(FileColumns(file, _named(setup, file)))
    return tuple(columns)


def require_columns(files: tuple[FileColumns, ...]) -> tuple[FileColumns, ...]:
    """Returns the files; raises InputError for one of whose controllers none exists here."""
    for entry in files:
        entry.setup.require_columns()
    return files


def _require_different_names(files: Sequence[WholeFile]) -> None:
    names = [file.name for file in files]
    for file in files:
        if names.count(file.name) > 1:
            twice = " and ".join(other.told for other in files if other.name == file.name)
            raise InputError(f"--name {file.name}: given to {twice}; expected a name for each file")


def _named(setup: Nav2Setup, file: WholeFile) -> Nav2Setup:
    """Returns a setup whose columns have the file's name and drive its robot.

    A file with one controller makes the column 'name', one with several 'name/FollowPath'.
    """
    if not file.name:
        return setup
    is_alone = len(setup.presets) == 1
    names = {
        preset.name: file.name if is_alone else f"{file.name}/{preset.name.partition('/')[2]}"
        for preset in setup.presets
    }
    return replace(
        setup,
        presets=tuple(
            replace(preset, name=names[preset.name], stack=setup.robot) for preset in setup.presets
        ),
        places={names[name]: place for name, place in setup.places.items()},
    )


def names_of(paths: Sequence[Path]) -> list[str]:
    """Returns a short name for each file: the parts of their paths that differ, nearest to the end.

    'a.yaml' and 'b.yaml' are a and b; 'old/nav2.yaml' and 'new/nav2.yaml' are old and new.
    """
    whole = [path.absolute() for path in paths]
    for level in range(min(len(path.parts) for path in whole)):
        names = [path.stem if not level else path.parts[-1 - level] for path in whole]
        if len(set(names)) == len(names):
            return names
    return [f"{path.stem}_{number}" for number, path in enumerate(paths, start=1)]
