"""The command `show`: a picture of a scenario, a robot or a Nav2 file before anything drives."""

from __future__ import annotations

import argparse
import sys
import tempfile
import warnings
import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_navbench.commands.command_line import (
    CommandParser,
    Options,
    exit_status_of,
    print_text,
    whole_number,
)
from drake_navbench.commands.run import arguments_of, with_package
from drake_navbench.commands.run_options import add_nav2_files, add_what_drives, add_where
from drake_navbench.commands.run_options import build_parser as run_parser
from drake_navbench.errors import InputError, InputWarning, printable, writing

if TYPE_CHECKING:
    from drake_navbench.campaign.request import Request

SUFFIXES = (".html", ".svg", ".png")
EPILOG = """\
what is drawn:
  a scenario, map or world   walls, costmap, start, goal, plan, people's ways
  --robot alone              outline, fields of lidar, depth and range sensors
  --nav2, --params,          for each controller, around the robot: lookahead,
  --controllers              horizon, inflation, local costmap, sensors' ranges

examples:
  drake-navbench show doorway
  drake-navbench show --map map.yaml --goals 10 --out tasks.svg
  drake-navbench show --robot my_robot.urdf.xacro
  drake-navbench show --nav2 old.yaml --against new.yaml

exit status: 0 done, 2 wrong input
"""


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench show",
        usage="%(prog)s [SCENARIO ...] [OPTIONS]",
        description="Draws what `run` would drive, with the same arguments: look before you drive.",
        epilog=EPILOG,
    )
    add_what_drives(parser, has_defaults=False)
    add_where(parser, has_defaults=False)
    add_nav2_files(parser, checks=False)
    # None: no robot is named. A named robot is drawn where no scene is asked for.
    parser.set_defaults(robot=None)
    option = Options(parser.add_argument_group("output"))
    option("--seed SEED", "seed of the tasks that --goals draws (0)", whole_number, 0)
    option("--quiet", "print errors only")
    option(
        "--out FILE",
        "picture to write, .html, .svg or .png; several are p.svg, p-2.svg ... (opens a page in "
        "the browser)",
        Path,
    )
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit status."""
    return exit_status_of(lambda: _main(argv))


def _main(argv: Sequence[str] | None) -> None:
    arguments = arguments_of(build_parser(), argv)
    if arguments.quiet:
        warnings.simplefilter("ignore", InputWarning)
    _show(arguments)


def _show(arguments: argparse.Namespace) -> None:
    out = arguments.out
    if out is not None and out.suffix not in SUFFIXES:
        raise InputError(f"--out {out}: expected a name that ends in {', '.join(SUFFIXES)}")
    if arguments.check:
        raise InputError("--check: show prints no table; expected drake-navbench run --check")
    defaults = run_parser().parse_args([])
    run_arguments = argparse.Namespace(**vars(defaults) | vars(arguments))
    run_arguments.out, run_arguments.robot = None, arguments.robot or defaults.robot
    if run_arguments.package:
        run_arguments = with_package(run_parser(), run_arguments)

    from drake_navbench.campaign.package_arguments import advising_on_found_files
    from drake_navbench.campaign.request_arguments import request_from_arguments

    has_robot = arguments.robot is not None or run_arguments.robot != defaults.robot
    with advising_on_found_files(run_arguments):
        request = request_from_arguments(run_arguments)
        views, told = _views(request, has_robot=has_robot, has_columns=arguments.controllers)
    for line in told:
        print(printable(line), file=sys.stderr)
    with writing(out or tempfile.gettempdir()):
        paths = _written(views, out)
    if not arguments.quiet:
        print_text("".join(f"{path}\n" for path in paths))
    if out is None:
        webbrowser.open(paths[0].as_uri())


def _views(request: Request, *, has_robot: bool, has_columns: bool) -> tuple[list[Any], list[str]]:
    """Returns the views to draw, scenes first, and the lines to print."""
    from drake_navbench.campaign.robot_views import column_view, robot_view
    from drake_navbench.campaign.scene_views import scene_view, scenes_of

    shown = request.shown()
    views: list[Any] = []
    told: list[str] = []
    for scenarios in scenes_of(shown.scenarios):
        view, lines = scene_view(scenarios, scenarios[0].load_robot(shown.robot))
        views.append(view)
        told += lines
    if not (views or shown.presets):
        if not has_robot:
            raise InputError(
                "expected what to show: a scenario, --map, --robot, --nav2 or --controllers"
            )
        views.append(robot_view(shown.robot, Path(request.robot).stem))
    if has_columns or request.nav2_files or request.parameter_files:
        views += [column_view(p, p.stack or shown.robot) for p in shown.presets]
    return views, told


def _written(views: Sequence[Any], out: Path | None) -> list[Path]:
    """Draws views; returns the files, one page or one picture each."""
    from drake_navbench.analysis.figures.choice import SVG
    from drake_navbench.analysis.figures.style import figure_style, write_figure
    from drake_navbench.analysis.figures.views import SceneView, around_figure, scene_figure

    with figure_style():
        figures = [
            scene_figure(view) if isinstance(view, SceneView) else around_figure(view)
            for view in views
        ]
        if out is not None and out.suffix != ".html":
            names = [out.stem, *(f"{out.stem}-{n}" for n in range(2, len(figures) + 1))]
            return [
                write_figure(figure, out.with_name(name), (out.suffix,))[0]
                for figure, name in zip(figures, names, strict=True)
            ]
        from drake_navbench.analysis.html import write_show_page
        from drake_navbench.processes.cache_folder import own_temporary_folder

        if out is None:
            # The browser may read it at any time, so it stays, until the next one takes its place.
            out = Path(own_temporary_folder()) / "show.html"
        with tempfile.TemporaryDirectory() as scratch:
            files = [
                write_figure(figure, Path(scratch) / str(number), (SVG,))[0]
                for number, figure in enumerate(figures)
            ]
            write_show_page(out, [view.title for view in views], files)
    return [out.absolute()]
