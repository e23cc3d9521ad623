"""Makes a request from the arguments of the command line; prints the check of Nav2 files."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from drake_navbench.campaign.request import Request
from drake_navbench.errors import InputError, printable
from drake_navbench.inputs.check import WIDTH, Check
from drake_navbench.inputs.controller_file import names_file
from drake_navbench.inputs.descriptions.world import is_world
from drake_navbench.inputs.floor_scenario import SCENARIO_FILES
from drake_navbench.inputs.presets import preset_files
from drake_navbench.inputs.robot import is_model
from drake_navbench.inputs.task_check import warn_of_column
from drake_navbench.nav2.controllers import SERVER
from drake_navbench.nav2.differences import difference_lines, differences
from drake_navbench.nav2.node_names import READ
from drake_navbench.nav2.parameters import read_parameter_file
from drake_navbench.nav2.substitutions import NAME
from drake_navbench.nav2.whole_files import FileColumns
from drake_navbench.trial.column_controller import check_controller
from drake_navbench.typed_files.assignments import assignments
from drake_navbench.typed_files.file_kinds import SCENARIO, require_kind
from drake_navbench.typed_files.typed_yaml import read_yaml, validate

COMMAND_LINE = "command line"
# Fields of the request that have the name of their option.
FIELD_OF_OPTION = re.compile(
    rf"(?m)^{COMMAND_LINE}: (?:map_task\.)?(goals|goal|start|trials|seed|samples)\b"
)


def listed_controllers(text: str) -> tuple[str, ...]:
    """Returns the columns of a comma-separated list, in its order."""
    return tuple(name.strip() for name in text.split(",") if name.strip())


def request_from_arguments(arguments: argparse.Namespace) -> Request:
    """Returns the request; raises InputError where arguments do not go together."""
    controllers = listed_controllers(arguments.controllers or "")
    if arguments.controllers is not None and not controllers:
        raise InputError(f"--controllers {arguments.controllers!r}: expected names, found none")
    if controllers:
        _require_no_controllers_among(arguments.scenarios, arguments.controllers)
    if arguments.set and not (arguments.nav2 or is_model(arguments.robot)):
        raise InputError(
            f"--set {arguments.set[0]!r}: expected a Nav2 file by --nav2 or a xacro file by "
            "--robot as well"
        )
    for folder in arguments.packages:
        if not folder.is_dir():
            raise InputError(f"--packages {folder}: expected a folder")
    worlds = [name for name in arguments.scenarios if is_world(Path(name))]
    values = {
        "scenarios": [name for name in arguments.scenarios if name not in worlds],
        "controllers": controllers,
        "parameter_files": [str(path) for path in arguments.params],
        "nav2_files": [str(path) for path in arguments.nav2],
        "against": [str(path) for path in arguments.against],
        "names": _aliases(arguments.name),
        "nav2_release": arguments.nav2_release,
        "original": arguments.original,
        "substitutions": read_assignments(arguments.set),
        "map_task": _map_task(arguments, worlds),
        "barn": _barn_task(arguments),
        "trials": arguments.trials,
        "seed": arguments.seed,
        "robot": arguments.robot,
        "packages": [str(path.absolute()) for path in arguments.packages],
        "replay": arguments.replay or ("none" if arguments.sweep else "race"),
        "figures": arguments.figures or ("none" if arguments.sweep else "key"),
        "keeps_costmaps": not arguments.no_costmaps,
        "sweeps": arguments.sweep,
        "samples": arguments.samples,
        "metrics": [_absolute(reference) for reference in arguments.metric],
        "columns": arguments.columns,
    }
    try:
        return validate(Request, values, COMMAND_LINE)
    except InputError as error:
        raise InputError(FIELD_OF_OPTION.sub(r"--\1", str(error))) from error


def read_assignments(texts: Sequence[str]) -> dict[str, str]:
    """Returns the values of --set name=value; raises InputError for other forms or repetition."""
    values = assignments(texts, "--set", "name=value", may_be_empty=True)
    for name, value in values.items():
        if not re.fullmatch(NAME, name):
            raise InputError(f"--set {f'{name}={value}'!r}: expected name=value")
    return values


def _absolute(reference: str) -> str:
    """Returns 'my.py:name' with the path from the root: a run may be resumed from elsewhere."""
    path, colon, name = reference.rpartition(":")
    return f"{Path(path).absolute()}{colon}{name}" if colon else reference


def _aliases(texts: Sequence[str]) -> dict[str, str]:
    """Returns the aliases of `--name ALIAS=FILE` by file; raises InputError for a repeated one."""
    aliases: dict[str, str] = {}
    for alias, given in assignments(texts, "--name", "ALIAS=FILE").items():
        file, option = str(Path(given)), f"--name {alias}={given}"
        if "/" in alias:
            raise InputError(f"{option}: the alias {alias!r} has a slash; expected none")
        if file in aliases:
            raise InputError(f"{option}: the file has the alias {aliases[file]!r} already")
        aliases[file] = alias
    return aliases


def _require_no_controllers_among(scenarios: Sequence[str], controllers: str) -> None:
    """Raises InputError for `--controllers rpp dwb`, where dwb would be taken for a scenario."""
    presets = preset_files()
    strays = [
        name
        for name in scenarios
        if names_file(name)
        or (name.partition(":")[0] in presets and name not in SCENARIO_FILES.names)
    ]
    if strays:
        names = [controllers.strip(","), *strays]
        raise InputError(
            "--controllers: expected names separated by commas, "
            f"--controllers {','.join(names)}; got {' '.join(names)}"
        )


def _map_task(arguments: argparse.Namespace, worlds: Sequence[str]) -> dict[str, object] | None:
    given = {
        f"--{name}": getattr(arguments, name) is not None
        for name in ("map", "start", "goal", "goals")
    }
    if not any(given.values()) and not worlds:
        return None
    if given["--goal"] and given["--goals"]:
        raise InputError("--goal: got one beside --goals; expected one of the two")
    others = [name for name in arguments.scenarios if name not in worlds]
    if others and not worlds and not given["--map"]:
        option = next(name for name, is_given in given.items() if is_given)
        raise InputError(
            f"{option}: expected a map by --map, or a Gazebo world; {others[0]} is no world"
        )
    place = worlds[0] if worlds else "--map"
    wanted = () if given["--goals"] else ("--start", "--goal")
    for name in wanted if worlds else ("--map", *wanted):
        if not given[name]:
            raise InputError(f"{name}: missing; {place} needs --start and --goal, or --goals")
    return {
        "map": None if arguments.map is None else str(arguments.map),
        "worlds": list(worlds),
        "start": arguments.start,
        "goal": arguments.goal,
        **asked_goals(arguments.goals),
    }


def asked_goals(goals: int | Path | str | None) -> dict[str, object]:
    """Returns the fields of `--goals`: a number of tasks to draw, or a file of places."""
    if goals is None or isinstance(goals, int):
        return {"goals": goals}
    return {"goal_file": str(goals)}


def _barn_task(arguments: argparse.Namespace) -> dict[str, object] | None:
    if arguments.barn is None:
        if arguments.worlds is not None:
            raise InputError("--worlds: expected a folder of BARN worlds by --barn as well")
        return None
    return {"folder": str(arguments.barn), "worlds": _numbers(arguments.worlds or "")}


def _numbers(text: str) -> list[int]:
    """Returns the numbers of a list such as '3,10-20,100-299:50', without repetition."""
    numbers: dict[int, None] = {}
    for part in filter(None, map(str.strip, text.split(","))):
        found = re.fullmatch(r"(\d{1,6})(?:-(\d{1,6})(?::([1-9]\d{0,5}))?)?", part)
        if found is None:
            raise InputError(
                f"--worlds {text}: expected numbers and ranges such as 3,10-20,100-299:50, "
                f"got {part!r}"
            )
        first = int(found[1])
        last = int(found[2] or first)
        if last < first:
            raise InputError(f"--worlds {text}: {part} ends before it begins; expected LOW-HIGH")
        numbers |= dict.fromkeys(range(first, last + 1, int(found[3] or 1)))
    return list(numbers)


def print_check(
    arguments: argparse.Namespace, remarks: Callable[[Sequence[FileColumns]], Iterable[str]]
) -> None:
    """Prints for each part of the Nav2 files and of the robot's model how it is used here.

    remarks: returns further lines about the Nav2 files, which follow their differences. Raises
    InputError where there is neither a Nav2 file nor a model, and, behind the tables, where a drive
    would refuse another input.
    """
    if not (arguments.nav2 or is_model(arguments.robot)):
        raise InputError("--check: expected a Nav2 file by --nav2, or a model by --robot")
    for path in map(Path, arguments.scenarios):
        if path.suffix in (".yaml", ".yml"):
            require_kind(read_yaml(path), SCENARIO, path)
    request = request_from_arguments(arguments)
    described = request.described_robot()
    if described is not None:
        print(printable(f"Robot: {arguments.robot}"))
        _print_table(described.check)
    columns = request.nav2_columns()
    for line in (*_differences(columns), *map(printable, remarks(columns))):
        print(line)
    for entry in columns:
        setup = entry.setup
        for preset in setup.presets:
            # Some parameters are wrong only for this robot.
            check_controller(preset, setup.robot)
            warn_of_column(preset, setup.robot)
        names = ", ".join(preset.name for preset in setup.presets) or NO_COLUMN
        print(printable(f"Columns: {names}"))
        _print_table(setup.check)
    request.require_readable()


NO_COLUMN = (
    "none, as the file has no controller that exists here; --controllers NAME drives the rest of it"
)


def _differences(columns: Sequence[FileColumns]) -> list[str]:
    if len(columns) < 2:
        return []
    return difference_lines(columns, differences(columns), is_whole=True)


def _print_table(check: Check) -> None:
    print("\n".join(map(printable, check.as_text(WIDTH).split("\n"))))


def file_lines(request: Request, nav2: Sequence[FileColumns]) -> list[str]:
    """Returns the lines that a run prints about its Nav2 files, their differences first."""
    told = []
    if len(nav2) > 1:
        told += difference_lines(nav2, differences(nav2))
    if len(request.nav2_files) > 1:
        told.append(
            f"--nav2 {' + '.join(request.nav2_files)}: merged into one, later values override; "
            "--against FILE drives a file beside it"
        )
    for columns in nav2:
        name = f"Nav2 file {columns.name}" if len(nav2) > 1 else "Nav2 file"
        told.append(f"{name}: {columns.setup.check.summary()} (--check lists all parameters)")
        told += [f"  replaced: {row.text}" for row in columns.setup.check.stand_ins]
    told += [line for path in request.parameter_files if (line := _not_taken(Path(path)))]
    return [printable(line) for line in told]


def _not_taken(path: Path) -> str:
    """Returns a line on the nodes of a Nav2 file that --params ignores; '' if it ignores none."""
    names = dict.fromkeys(s.name.lstrip("/") for s in read_parameter_file(path).sections)
    others = [n for n in names if (n in READ and n != SERVER) or n.partition("/")[2] in READ]
    if not others:
        return ""
    shown = ", ".join(name.partition("/")[0] for name in others)
    return (
        f"--params {path}: takes the controllers only; {shown} are not used "
        "(--nav2 takes the whole file, --against a second one)"
    )
