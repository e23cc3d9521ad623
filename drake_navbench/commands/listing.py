"""Lists scenarios, controllers and robots: `drake-navbench list`, `run --list`."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from drake_navbench.campaign.console import terminal
from drake_navbench.commands.command_line import CommandParser, exit_status_of
from drake_navbench.errors import InputError, printable
from drake_navbench.inputs.floor_scenario import SCENARIO_FILES
from drake_navbench.inputs.presets import load_preset, preset_files
from drake_navbench.inputs.robot import ROBOT_FILES
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS, load_scenario
from drake_navbench.native.builds import build_names, find_build
from drake_navbench.plugins.kinds import GROUP_PREFIX, foreign_plugins
from drake_navbench.typed_files.typed_yaml import read_yaml


def print_listing(console: Console) -> None:
    """Prints scenarios, controllers, robots and other packages' plugins, one line each."""
    others = [name for name in SCENARIO_FILES.names if name not in PUBLISHED_SCENARIOS]
    scenarios = {n: load_scenario(n).description for n in (*PUBLISHED_SCENARIOS, *others)}
    presets = {n: _description(n) for n in preset_files()}
    robots = {n: _robot_description(n) for n in ROBOT_FILES.names}
    titles = {"scenarios": scenarios, "controllers": presets, "robots": robots}
    for title, rows in (titles | _builds() | _plugins_of_others()).items():
        table = Table(title=title, title_justify="left", title_style="bold", box=None)
        table.add_column(no_wrap=True)
        table.add_column()
        table.show_header = False
        for name, description in rows.items():
            table.add_row(f"  {printable(name)}", printable(description))
        console.print(table)
        console.print()


def _robot_description(name: str) -> str:
    """Returns the description of a built-in robot, without checking it against its model."""
    return str(read_yaml(ROBOT_FILES.find(name))["description"])


def _builds() -> dict[str, dict[str, str]]:
    """Returns the builds of Nav2, if there are any, by name."""
    builds = {name: _origin_of_build(name) for name in build_names()}
    return {"builds of Nav2 (for rpp@NAME)": builds} if builds else {}


def _origin_of_build(name: str) -> str:
    """Returns the origin of a build, or the reason why it cannot be used."""
    try:
        return f"Nav2 {find_build(name).where_from}"
    except InputError as error:
        return str(error)


def _plugins_of_others() -> dict[str, dict[str, str]]:
    """Returns the installed plugins that are not ours, by kind and name; imports none of them."""
    kinds: dict[str, dict[str, str]] = {}
    for group, name, origin in foreign_plugins():
        title = f"{group.removeprefix(GROUP_PREFIX).replace('_', ' ')} of other packages"
        kinds.setdefault(title, {})[name] = str(origin)
    return kinds


def _description(preset: str) -> str:
    """Returns a preset's description, or why it cannot be used; a broken one hides no others."""
    try:
        return load_preset(preset).description
    except InputError as error:
        return str(error)


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit status."""
    CommandParser(
        prog="drake-navbench list",
        description="Lists scenarios, controllers, robots, and plugins of other packages.",
    ).parse_args(argv)
    return exit_status_of(lambda: print_listing(terminal()))
