"""The commands by name, and the command line `drake-navbench COMMAND`.

Only the standard library is imported before the command is known, so that --help is quick.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from types import ModuleType

from drake_navbench.commands.command_line import EXIT_DONE, EXIT_WRONG_INPUT, print_text
from drake_navbench.errors import nearest_name_hint

# Command -> the line that --help prints. Its module, see `module_of`, has `main(argv)`.
COMMANDS = {
    "run": "drive controllers through scenarios and compare them",
    "live": "simulate a robot for a running ROS 2 stack",
    "show": "draw what run would drive, before anything does",
    "studio": "draw scenarios, change parameters, drive and look, in a browser",
    "report": "make tables, figures and report.html of a results folder again",
    "compare": "compare results folders: what became better, what became worse",
    "runs": "list results folders; rename, tag, delete them",
    "replay": "render the replay of one trial from its log",
    "why": "tell why a controller decided as it did at a time of a trial",
    "tune": "search for parameters that beat a preset or a Nav2 file",
    "doctor": "find the parameter of a Nav2 file that causes a symptom",
    "leaderboard": "rank the controllers of many results folders of one suite",
    "export": "write trials as bags, tables or trajectories",
    "import-bag": "convert recordings of real robots into trials",
    "import-world": "convert a Gazebo world into a scenario",
    "nav2-build": "compile the controllers of a Nav2 checkout as columns",
    "nav2-parity": "measure how closely the ports drive like a build's originals",
    "nav2-gate": "test whether a change to Nav2's code makes its controllers worse",
    "list": "list scenarios, controllers and robots",
    "completion": "print the completion script for a shell",
}


def module_of(name: str) -> ModuleType:
    """Returns the module of a command, imported."""
    module = "listing" if name == "list" else name.replace("-", "_")
    return import_module(f"drake_navbench.commands.{module}")


def usage() -> str:
    """Returns the text of --help."""
    width = max(map(len, COMMANDS))
    lines = [f"  {name:<{width}}  {about}" for name, about in COMMANDS.items()]
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
    """Returns the line of --version: our version, and those that the motion depends on."""
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
    return int(module_of(name).main(rest))
