"""The commands by name, and the command line `drake-navbench COMMAND`.

Only the standard library is imported before the command is known, so that --help is quick.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module

from drake_navbench.commands.command_line import EXIT_DONE, EXIT_WRONG_INPUT, print_text
from drake_navbench.errors import nearest_name_hint

# Command -> module with `main(argv)`, and the line that --help prints.
COMMANDS = {
    "run": ("drake_navbench.commands.run", "drive controllers through scenarios and compare them"),
    "live": ("drake_navbench.commands.live", "simulate a robot for a running ROS 2 stack"),
    "show": ("drake_navbench.commands.show", "draw what run would drive, before anything does"),
    "studio": (
        "drake_navbench.commands.studio",
        "draw scenarios, change parameters, drive and look, in a browser",
    ),
    "report": (
        "drake_navbench.commands.report",
        "make tables, figures and report.html of a results folder again",
    ),
    "compare": (
        "drake_navbench.commands.compare",
        "compare results folders: what became better, what became worse",
    ),
    "runs": ("drake_navbench.commands.runs", "list results folders; rename, tag, delete them"),
    "replay": ("drake_navbench.commands.replay", "render the replay of one trial from its log"),
    "why": (
        "drake_navbench.commands.why",
        "tell why a controller decided as it did at a time of a trial",
    ),
    "tune": (
        "drake_navbench.commands.tune",
        "search for parameters that beat a preset or a Nav2 file",
    ),
    "doctor": (
        "drake_navbench.commands.doctor",
        "find the parameter of a Nav2 file that causes a symptom",
    ),
    "leaderboard": (
        "drake_navbench.commands.leaderboard",
        "rank the controllers of many results folders of one suite",
    ),
    "export": ("drake_navbench.commands.export", "write trials as bags, tables or trajectories"),
    "import-bag": (
        "drake_navbench.commands.import_bag",
        "convert recordings of real robots into trials",
    ),
    "import-world": (
        "drake_navbench.commands.import_world",
        "convert a Gazebo world into a scenario",
    ),
    "nav2-build": (
        "drake_navbench.commands.nav2_build",
        "compile the controllers of a Nav2 checkout as columns",
    ),
    "nav2-parity": (
        "drake_navbench.commands.nav2_parity",
        "measure how closely the ports drive like a build's originals",
    ),
    "nav2-gate": (
        "drake_navbench.commands.nav2_gate",
        "test whether a change to Nav2's code makes its controllers worse",
    ),
    "list": ("drake_navbench.commands.listing", "list scenarios, controllers and robots"),
    "completion": (
        "drake_navbench.commands.completion",
        "print the completion script for a shell",
    ),
}


def usage() -> str:
    """Returns the text of --help."""
    width = max(map(len, COMMANDS))
    lines = [f"  {name:<{width}}  {about}" for name, (_, about) in COMMANDS.items()]
    return "\n".join(
        [
            "usage: drake-navbench COMMAND [ARGUMENTS]",
            "",
            "commands:",
            *lines,
            "",
            "drake-navbench COMMAND --help describes a command, --version prints the version.",
            "",
        ]
    )


def versions() -> str:
    """Returns the line of --version: ours, and what the motion depends on."""
    from importlib.metadata import version
    from platform import python_version

    from drake_navbench.processes.version import __version__

    drake, numba = version("drake"), version("numba")
    return f"drake_navbench {__version__} (Drake {drake}, numba {numba}, Python {python_version()})"


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command that the first argument names; returns the exit status."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if not arguments or arguments[0] in ("-h", "--help"):
        print_text(usage())
        return EXIT_DONE if arguments else EXIT_WRONG_INPUT
    if arguments[0] == "--version":
        print_text(f"{versions()}\n")
        return EXIT_DONE
    name, *rest = arguments
    if name not in COMMANDS:
        print(
            f"command {name!r} is not known{nearest_name_hint(name, COMMANDS)}",
            file=sys.stderr,
        )
        return EXIT_WRONG_INPUT
    module, _ = COMMANDS[name]
    return import_module(module).main(rest)
