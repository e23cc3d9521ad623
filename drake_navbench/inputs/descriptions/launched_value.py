"""The value that launch files give a xacro argument."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from drake_navbench.inputs.descriptions.launch_text import (
    argument_of,
    launch_text,
    without_remarks,
)
from drake_navbench.inputs.descriptions.ros_packages import Packages

LAUNCH_FILE = re.compile(r"launch.*\.(?:py|xml|launch|ya?ml)$|\.launch$")
# A folder of which every Python file is a launch file.
LAUNCH_FOLDER = "launch"
# Words alone: an expression of a launch file is no value.
VALUE = r"([\w.+-]+)"
# How launch files give a value: to xacro, as the default of their own argument in Python and XML,
# and in a mapping.
FORMS = (
    r"\b{name}:={value}",
    r"\b{name}:=\s*[\"'],\s*[\"']{value}[\"']",
    r"DeclareLaunchArgument\(\s*(?:name\s*=\s*)?[\"']{name}[\"'],\s*default_value\s*=\s*[\"']{value}[\"']",
    r"<arg\s+name=\"{name}\"\s+default=\"{value}\"",
    r"[\"']{name}[\"']\s*:\s*[\"']{value}[\"']",
)
# How a launch file passes a value to one that it includes, in Python and XML.
PASSING = (
    r"[\"']{name}[\"']\s*:\s*[\"']{value}[\"']",
    r"<arg\s+name=\"{name}\"\s+value=\"{value}\"",
)
# Flags tell simulation from robot: a repository's launch files give both.
FLAGS = frozenset({"true", "false", "0", "1", "yes", "no"})
SET = frozenset({"true", "1", "yes"})
# Words in names of flags that tell a simulation from the robot.
SIMULATES = re.compile(r"sim|gazebo|(?<![a-z])(?:gz|ign)")


# How launch files set an environment variable, or say what it is where nobody has set it.
VARIABLE_FORMS = (
    re.compile(
        r"(?:SetEnvironmentVariable|EnvironmentVariable|environ\.(?:get|setdefault)|getenv)\(\s*"
        r"(?:name\s*=\s*)?[\"'](\w+)[\"']\s*,\s*(?:(?:default_)?value\s*=\s*)?"
        rf"[\"']{VALUE}[\"']"
    ),
    re.compile(rf"environ\[[\"'](\w+)[\"']\]\s*=\s*[\"']{VALUE}[\"']"),
    re.compile(rf"<(?:set_)?env\s+name=\"(\w+)\"\s+value=\"{VALUE}\""),
)


def is_launch_file(file: Path) -> bool:
    """Tells whether a file is a launch file, by its name or its folder's."""
    named = LAUNCH_FILE.search(file.name) is not None
    return named or (file.suffix == ".py" and file.parent.name == LAUNCH_FOLDER)


def launched_value(name: str, file: Path, packages: Packages) -> tuple[str, Path] | None:
    """Returns an argument's value in a launch file that names a xacro file, and the launch file.

    The launch files are those of the file's robot, the nearest first. None where none gives it.
    """
    return next(_launched_values(name, file, packages), None)


def set_variables(files: Iterable[Path]) -> Iterator[tuple[str, str, Path]]:
    """Yields each environment variable that launch files set, with its value and the file."""
    for file in files:
        text = launch_text(file)
        for form in VARIABLE_FORMS:
            yield from ((name, value, file) for name, value in form.findall(text))


def launched_variable(name: str, packages: Packages) -> tuple[str, Path] | None:
    """Returns an environment variable's value that a robot's launch files set, and one that does.

    None where none sets it, or they do not agree.
    """
    files = packages.files(is_launch_file)
    found = [(value, file) for set_name, value, file in set_variables(files) if set_name == name]
    return found[0] if len({value for value, _ in found}) == 1 else None


def chosen_value(name: str, file: Path, packages: Packages) -> tuple[str, Path] | None:
    """Returns a choice, such as a chassis, that launch files make for an argument with a default.

    None for a flag, and where the launch files that give a value do not agree.
    """
    found = list(_launched_values(name, file, packages))
    values = {value for value, _ in found}
    return found[0] if len(values) == 1 and not FLAGS & {v.lower() for v in values} else None


def launched_flags(names: Iterable[str], file: Path, packages: Packages) -> dict[str, str]:
    """Returns the flags that a launch file sets to true, each with a remark that names the file.

    After them come flags of a simulation for which a launch file has an argument, off by default.
    """
    found: dict[str, str] = {}
    simulating: dict[str, str] = {}
    for name in sorted(names):
        values = (
            *_launched_values(name, file, packages),
            *_passed_values(name, file, packages),
        )
        launch = next((launch for value, launch in values if value.lower() in SET), None)
        if launch is not None:
            found[name] = f"as in {launch.name}"
            continue
        launch = _passing(name, file, packages) if SIMULATES.search(name.lower()) else None
        if launch is not None:
            simulating[name] = f"with which {launch.name} simulates (else --set {name}=false)"
    return found | simulating


def _passing(name: str, file: Path, packages: Packages) -> Path | None:
    """Returns a launch file that passes an argument of its own to a xacro file's argument."""
    for launch in packages.files(is_launch_file):
        text = without_remarks(launch)
        if file.name in text and argument_of(name, text) is not None:
            return launch
    return None


def _launched_values(name: str, file: Path, packages: Packages) -> Iterator[tuple[str, Path]]:
    """Yields the value in each launch file that names a xacro file and gives one."""
    forms = [re.compile(form.format(name=re.escape(name), value=VALUE)) for form in FORMS]
    for launch in packages.files(is_launch_file):
        text = launch_text(launch)
        if file.name not in text:
            continue
        found = next((said for form in forms if (said := form.search(text))), None)
        if found is not None:
            yield found[1], launch


def _passed_values(name: str, file: Path, packages: Packages) -> Iterator[tuple[str, Path]]:
    """Yields the values that launch files pass to one that gives its own argument to a xacro file.

    Such as 'use_sim': `' sim_mode:=', LaunchConfiguration('use_sim')`, included with
    `{'use_sim': 'true'}`.
    """
    texts = {launch: without_remarks(launch) for launch in packages.files(is_launch_file)}
    for launch, text in texts.items():
        argument = argument_of(name, text) if file.name in text else None
        if argument is None:
            continue
        forms = [re.compile(form.format(name=argument, value=VALUE)) for form in PASSING]
        for user, other in texts.items():
            if user != launch and launch.name in other:
                yield from ((value, user) for form in forms for value in form.findall(other))
