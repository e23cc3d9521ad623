"""The command `studio`: pages to draw scenarios, change parameters, drive, and look."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from drake_navbench.commands.command_line import (
    CommandParser,
    Options,
    command,
    print_text,
    whole_number,
)
from drake_navbench.errors import InputError

EPILOG = """\
examples:
  drake-navbench studio                 the current folder
  drake-navbench studio my_robot --port 5010 --no-browser
  drake-navbench studio --map map.yaml --goals waypoints.yaml

The pages are served on this machine alone, at an address with a secret in it.
Nothing outside FOLDER is read or written. Ctrl-C ends it.

exit status: 0 done, 2 wrong input
"""


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench studio",
        usage="%(prog)s [FOLDER] [OPTIONS]",
        description="Opens pages to draw scenarios, change parameters, drive and look.",
        epilog=EPILOG,
    )
    option = Options(parser)
    option(
        "folder",
        "folder with scenarios, Nav2 files and results (the current one)",
        Path,
        Path(),
        metavar="FOLDER",
        nargs="?",
    )
    option("--map FILE", "map in FOLDER, for --goals", Path)
    option("--goals FILE", "file of places; the ways between them on the map can be opened", Path)
    option("--port N", "port of the pages (any free one)", whole_number, 0)
    option("--no-browser", "print the address, open no browser")
    return parser


def _studio(arguments: argparse.Namespace) -> None:
    from drake_navbench.studio.yaml_text import require_studio_libraries

    if (arguments.map is None) != (arguments.goals is None):
        raise InputError("--map and --goals FILE: expected both or none")
    require_studio_libraries()
    from drake_navbench.studio.engine import load_workers

    # On another core, while this process loads Bokeh.
    load_workers()
    from drake_navbench.studio.open_folder import OpenFolder
    from drake_navbench.studio.server import serve

    def told(address: str) -> None:
        print_text(f"Open {address}\nCtrl-C ends it.\n")
        sys.stdout.flush()
        if not arguments.no_browser:
            import webbrowser

            webbrowser.open(address)

    folder = OpenFolder.at(arguments.folder)
    ways = {}
    if arguments.goals is not None:
        from drake_navbench.studio.desk import DEFAULT_ROBOT
        from drake_navbench.studio.goal_ways import ways_between

        ways = ways_between(folder, arguments.map, arguments.goals, DEFAULT_ROBOT)
    serve(folder, arguments.port, told, ways)


main = command(build_parser, _studio)
