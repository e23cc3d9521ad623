"""Lists scenarios, controllers and robots: `python -m drake_navbench list`, `run --list`."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from drake_navbench.campaign.console import terminal
from drake_navbench.errors import InputError, printable
from drake_navbench.inputs.presets import load_preset, preset_files
from drake_navbench.inputs.robot import ROBOT_FILES, load_robot
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS, SCENARIO_FILES, load_scenario


def print_listing(console: Console) -> None:
    """Prints scenarios, controllers and robots with one line each."""
    others = [name for name in SCENARIO_FILES.names if name not in PUBLISHED_SCENARIOS]
    scenarios = {n: load_scenario(n).description for n in (*PUBLISHED_SCENARIOS, *others)}
    presets = {n: _description(n) for n in preset_files()}
    robots = {n: load_robot(n).description for n in ROBOT_FILES.names}
    for title, rows in (("scenarios", scenarios), ("controllers", presets), ("robots", robots)):
        table = Table(title=title, title_justify="left", title_style="bold", box=None)
        table.add_column(no_wrap=True)
        table.add_column()
        table.show_header = False
        for name, description in rows.items():
            table.add_row(f"  {printable(name)}", printable(description))
        console.print(table)
        console.print()


def _description(preset: str) -> str:
    """Returns a preset's line, or why it cannot be used: one that is broken hides no others."""
    try:
        return load_preset(preset).description
    except InputError as error:
        return str(error)


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit status."""
    argparse.ArgumentParser(
        prog="python -m drake_navbench list",
        description="Lists scenarios, controllers and robots.",
    ).parse_args(argv)
    print_listing(terminal())
    return 0
