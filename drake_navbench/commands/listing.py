"""Lists scenarios, controllers and robots: `drake-navbench list`, `run --list`."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING

from drake_navbench.commands.command_line import CommandParser, command
from drake_navbench.errors import InputError, printable

if TYPE_CHECKING:
    from rich.console import Console


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    return CommandParser(
        prog="drake-navbench list",
        description="Lists scenarios, controllers, robots, and plugins of other packages.",
    )


def print_listing(console: Console) -> None:
    """Prints scenarios, controllers, robots and other packages' plugins, one line each."""
    from rich.table import Table

    for title, rows in _described().items():
        table = Table(title=title, title_justify="left", title_style="bold", box=None)
        table.add_column(no_wrap=True)
        table.add_column()
        table.show_header = False
        for name, description in rows.items():
            table.add_row(f"  {printable(name)}", printable(description))
        console.print(table)
        console.print()


def _described() -> dict[str, dict[str, str]]:
    """Returns the descriptions by title of their table and by name."""
    from drake_navbench.inputs.floor_scenario import SCENARIO_FILES
    from drake_navbench.inputs.presets import load_preset, preset_files
    from drake_navbench.inputs.robot import ROBOT_FILES
    from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS, load_scenario
    from drake_navbench.native.builds import build_names, find_build
    from drake_navbench.plugins.kinds import GROUP_PREFIX, foreign_plugins
    from drake_navbench.typed_files.typed_yaml import read_yaml

    scenarios = dict.fromkeys((*PUBLISHED_SCENARIOS, *SCENARIO_FILES.names))
    tables = {
        "scenarios": {n: load_scenario(n).description for n in scenarios},
        "controllers": {
            n: _or_fault(lambda p: load_preset(p).description, n) for n in preset_files()
        },
        # A robot is not checked against its model here.
        "robots": {
            n: str(read_yaml(ROBOT_FILES.find(n))["description"]) for n in ROBOT_FILES.names
        },
    }
    if builds := build_names():
        tables["builds of Nav2 (for rpp@NAME)"] = {
            n: _or_fault(lambda b: f"Nav2 {find_build(b).where_from}", n) for n in builds
        }
    for group, name, origin in foreign_plugins():
        title = f"{group.removeprefix(GROUP_PREFIX).replace('_', ' ')} of other packages"
        tables.setdefault(title, {})[name] = str(origin)
    return tables


def _or_fault(describe: Callable[[str], str], name: str) -> str:
    """Returns the description of a name, or why there is none: a broken one hides no others."""
    try:
        return describe(name)
    except InputError as error:
        return str(error)


def _list(arguments: argparse.Namespace) -> None:
    from drake_navbench.campaign.console import terminal

    print_listing(terminal())


main = command(build_parser, _list)
