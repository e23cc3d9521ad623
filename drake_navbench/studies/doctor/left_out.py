"""Reads a Nav2 file without the parameters, critics and controllers that are refused.

A drive needs the whole file. A finding about a costmap does not need the robot's own controller.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.nav2.controllers import PLUGINS, NoCounterpart
from drake_navbench.nav2.nav2_setup import Nav2Setup
from drake_navbench.nav2.parameters import Parameter, Section
from drake_navbench.nav2.read_files import ReadFiles, read_sections
from drake_navbench.nav2.robot import setup_of
from drake_navbench.nav2.substitutions import Substitutions
from drake_navbench.nav2.whole_files import robot_of_files
from drake_navbench.studies.doctor.facts import Facts, facts_of, raw_name

# At most so many things are left out; a file that has more is hardly one of Nav2.
MOST = 40
# How an error about a parameter begins: file, line, node and parameter, and perhaps a field of it.
REFUSED = re.compile(
    r"(?:, line \d+)?: (?P<node>[\w/]+)\.ros__parameters\.(?P<name>[\w.]+)(?:: (?P<field>[\w.]+))?"
)
# A critic that is not known here, by its class and, where that differs, by the name in the list.
CRITIC = re.compile(r"critic '(?P<type>[^']+)' is not registered.*?(?:, got '(?P<name>[^']+)')?$")
CRITICS = "critics"


class Readable(NamedTuple):
    """The setup of what can be read.

    left_out: a line for each thing that was left out. refused: its values as the file has them.
    """

    setup: Nav2Setup
    left_out: tuple[str, ...]
    refused: Mapping[str, Any]

    def facts(self, preset: Preset | None) -> Facts:
        """Returns the facts of a column; their raw values are those of the whole file."""
        facts = facts_of(self.setup, preset)
        return replace(facts, left_out=self.left_out, raw={**facts.raw, **self.refused})


def readable_setup(
    paths: Sequence[Path],
    robot: str,
    values: Mapping[str, str] | None = None,
    release: str | None = None,
    base: Robot | None = None,
) -> Readable:
    """Returns the setup of Nav2 files without the parameters that are refused.

    base: the robot, if it is loaded already. Raises InputError where a file is no Nav2 file, or
    where no parameter is to blame.
    """
    base = base or robot_of_files(robot, paths, values)[0]
    whole = read = read_sections(paths, Substitutions(values or {}))
    told: list[str] = []
    while True:
        try:
            setup = setup_of(read, base, robot, release=release)
            setup.require_columns()
            return Readable(setup, tuple(told), _refused(whole, read))
        except InputError as error:
            lines = str(error).split("\n")
            is_controller = isinstance(error, NoCounterpart) or f"listed in {PLUGINS}" in lines[0]
            less = _without(read, lines, is_controller)
            if less is None or len(told) >= MOST:
                raise
            read = less
            told += lines


def _without(read: ReadFiles, lines: Sequence[str], is_controller: bool) -> ReadFiles | None:
    """Returns the files without the parameters that an error names; None if it names none."""
    sections = list(read.sections)
    for line in lines:
        found = REFUSED.search(line)
        if found is None:
            continue
        name, field = found["name"], found["field"] or ""
        critic = CRITIC.search(line)
        for number, section in enumerate(sections):
            if not section.is_for(f"/{found['node']}"):
                continue
            if is_controller or _lacks(section, name, field):
                own = name.partition(".")[0]
                parameters = _unlisted(section, PLUGINS, {own}, [own])
            elif critic is not None:
                refused = {critic["type"], critic["name"] or critic["type"]}
                parameters = _unlisted(section, f"{name}.{CRITICS}", refused, [])
            else:
                parameters = _removed(section, name, field)
            sections[number] = replace(section, parameters=parameters)
    is_less = any(
        a.parameters != b.parameters for a, b in zip(sections, read.sections, strict=True)
    )
    return read._replace(sections=tuple(sections)) if is_less else None


def _lacks(section: Section, controller: str, field: str) -> bool:
    """Tells whether a controller that is listed has no such field: it is left out as a whole."""
    listed = section.parameters.get(PLUGINS)
    is_listed = listed is not None and isinstance(listed.value, list) and controller in listed.value
    place = f"{controller}.{field}"
    given = any(name == place or name.startswith(f"{place}.") for name in section.parameters)
    return bool(field) and is_listed and not given


def _refused(whole: ReadFiles, read: ReadFiles) -> dict[str, Any]:
    """Returns the values of the files that were left out or changed, with the nodes' names."""
    return {
        raw_name(before.name, name): parameter.value
        for before, after in zip(whole.sections, read.sections, strict=True)
        for name, parameter in before.parameters.items()
        if after.parameters.get(name) != parameter
    }


def _unlisted(
    section: Section, name: str, refused: set[str], default: list[str]
) -> dict[str, Parameter]:
    """Returns a section's parameters with a list that lacks some names.

    default: the list that counts where the section has a block of one of these names alone.
    """
    parameters = dict(section.parameters)
    if name not in parameters:
        blocks = {given.partition(".")[0] for given in parameters}
        if not default or not blocks & refused:
            return parameters
        parameters[name] = Parameter(default, 0, section.file)
    listed = parameters[name]
    names = listed.value if isinstance(listed.value, list) else []
    parameters[name] = listed._replace(value=[n for n in names if n not in refused])
    return parameters


def _removed(section: Section, name: str, field: str) -> dict[str, Parameter]:
    """Returns a section's parameters without one, the field of one, or all below its name."""
    for refused in (f"{name}.{field}", name):
        kept = {
            given: parameter
            for given, parameter in section.parameters.items()
            if given != refused and not given.startswith(f"{refused}.")
        }
        if len(kept) < len(section.parameters):
            return kept
    return dict(section.parameters)
