"""Makes the generated parts of docs/: `make docs`.

The wiring of a trial as Drake draws it, the JSON schemas for editors, the columns of a log, the
catalogue of metrics, the fields of a robot file, the tables of presets and scenarios. The same tree
gives the same bytes; a test makes them again and compares.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.resources import files
from pathlib import Path

import numpy as np
from catalogue import catalogue
from field_table import robots_page
from plugin_page import DATA_FILE, plugin_page, read_plugins

from drake_navbench.commands.command_line import CommandParser, exit_status_of
from drake_navbench.errors import InputError
from drake_navbench.inputs.floor_scenario import SCENARIO_FILES
from drake_navbench.inputs.presets import PresetFile, default_presets, load_preset, preset_files
from drake_navbench.inputs.robot import Robot, load_robot
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS, Scenario, load_scenario
from drake_navbench.inputs.world import World
from drake_navbench.logs.costmaps import COSTMAP_COLUMNS
from drake_navbench.logs.header import SCHEMA_VERSION
from drake_navbench.logs.log_columns import (
    COLUMNS,
    LATERAL_COLUMNS,
    MISSION_COLUMNS,
    ODOMETRY_COLUMNS,
)
from drake_navbench.logs.people import PEOPLE_COLUMNS
from drake_navbench.logs.plans import PLAN_COLUMNS
from drake_navbench.logs.text_tables import markdown_table
from drake_navbench.trial.column_controller import controller_setup
from drake_navbench.trial.diagram import build_trial_diagram
from drake_navbench.trial.spec import FollowPlan
from drake_navbench.trial.trial import DEFAULT_ROBOT
from drake_navbench.typed_files.typed_yaml import FrozenModel

CONTACT_TEXT = """\
## Touch

A trial ends as `collided` at the instant at which the outline first touches an obstacle or a wall
of a map: `end_time_s` and the last row are that instant, with the pose and velocity then and a
clearance of 0. It is found between samples, too, on the cubic through the poses and velocities at
both ends of each step of the integrator, by conservative advancement: less than 0.01 mm apart is
touching, and no overlap of that motion is missed. A task that ends before a touch keeps its
outcome. The clearance in the rows before is sampled every 0.05 s and held."""
SCHEMAS: Mapping[str, type[FrozenModel]] = {
    "scenario": Scenario,
    "robot": Robot,
    "preset": PresetFile,
}
# The lines of a page between which a generated table stands.
TABLE_BEGIN = "<!-- {}: made by `make docs` -->"
TABLE_END = "<!-- end of {} -->"


def documents(folder: Path) -> Iterator[tuple[str, str]]:
    """Yields the name within docs/ and the text of everything that is generated.

    folder: the present docs/. In controllers.md and scenarios.md only the table of presets or
    scenarios is made anew. Raises InputError where such a page has no place for its table.
    """
    yield "wiring.dot", wiring()
    for name, model in SCHEMAS.items():
        yield f"schemas/{name}.json", json.dumps(model.model_json_schema(), indent=2) + "\n"
    yield "log_format.md", log_format()
    yield "metrics.md", catalogue()
    yield "robots.md", robots_page()
    data = folder / DATA_FILE
    if data.is_file():
        yield "plugins_of_nav2.md", plugin_page(read_plugins(data))
    for name, (what, table) in TABLES.items():
        page = folder / name
        if page.is_file():
            yield name, _with_table(page, what, table())


def wiring() -> str:
    """Returns the wiring of a trial in Graphviz's language, always in the same order."""
    robot = load_robot(DEFAULT_ROBOT)
    preset = load_preset(default_presets()[0])
    controller = preset.controller_class(preset.parameters, controller_setup(robot))
    trial = build_trial_diagram(
        robot,
        World(tuple(load_scenario("one_obstacle").world.obstacles)),
        controller,
        task=FollowPlan(lambda start: np.array([start])),
    )
    return _in_fixed_order(trial.diagram.GetGraphvizString(max_depth=1))


def _in_fixed_order(source: str) -> str:
    """Returns Drake's picture with ids counted from 1 and the edges sorted.

    Drake numbers systems by how many the process has made, and lists the edges by their addresses.
    """
    numbers = list(dict.fromkeys(re.findall(r"^s(\d+) \[", source, re.M)))
    numbering = {number: str(index) for index, number in enumerate(numbers, start=1)}
    (own,) = re.findall(r"^digraph _(\d+)", source)
    source = re.sub(rf"\b(_|cluster){own}(?=\b|[a-z])", r"\g<1>0", source)
    source = re.sub(
        r"\bs(\d+)(?= \[|:)", lambda found: f"s{numbering.get(found[1], found[1])}", source
    )
    lines = source.splitlines()
    places = [index for index, line in enumerate(lines) if " -> " in line]
    for index, edge in zip(places, sorted(lines[index] for index in places), strict=True):
        lines[index] = edge
    return "\n".join(lines) + "\n"


def log_format() -> str:
    """Returns the page about a log's columns."""
    lines = [
        "# Columns of a trial's log",
        "",
        f"Schema version {SCHEMA_VERSION}; one Parquet file a trial, generated by `make docs`.",
        "",
        *_columns_table(
            {
                **COLUMNS,
                **PLAN_COLUMNS,
                **COSTMAP_COLUMNS,
                "scan": "a new lidar scan: time, sensor pose in the world frame, ranges",
                "diagnostics": "JSON: what the controller left in a new control cycle",
            }
        ),
        "",
        "Logs of robots that move sideways, and no others, also have:",
        "",
        *_columns_table(LATERAL_COLUMNS),
        "",
        "Logs of worlds with people, and no others, also have:",
        "",
        *_columns_table(PEOPLE_COLUMNS),
        "",
        "Logs of robots whose odometry has a frame of its own, and no others, also have",
        "(see [stress.md](stress.md)):",
        "",
        *_columns_table(ODOMETRY_COLUMNS),
        "",
        "Logs of missions over several floors, and no others, also have",
        "(see [missions.md](missions.md)):",
        "",
        *_columns_table(MISSION_COLUMNS),
        "",
        *CONTACT_TEXT.splitlines(),
        "",
    ]
    return "\n".join(lines)


def _columns_table(columns: Mapping[str, str]) -> list[str]:
    rows = ((f"`{name}`", meaning) for name, meaning in columns.items())
    return markdown_table(("column", "meaning"), rows)


def presets_table() -> str:
    """Returns the table of the presets that come with the built-in controllers."""
    built_in = Path(str(files("drake_navbench.controllers"))).resolve()
    rows = [
        (f"`{name}`", f"`{load_preset(name).controller}`", load_preset(name).description)
        for name, path in sorted(preset_files().items())
        if built_in in path.resolve().parents
    ]
    return "\n".join(markdown_table(("preset", "controller", "what it is"), rows))


def scenarios_table() -> str:
    """Returns the table of the built-in scenarios, the published ones first."""
    others = [name for name in SCENARIO_FILES.names if name not in PUBLISHED_SCENARIOS]
    scenarios = [load_scenario(name) for name in (*PUBLISHED_SCENARIOS, *others)]
    rows = [(f"`{one.name}`", one.description, _family(one)) for one in scenarios]
    return "\n".join(markdown_table(("scenario", "what it is", "family"), rows))


def _family(scenario: Scenario) -> str:
    """Returns a link to the page about scenarios of this kind; '' without one."""
    world, overrides = scenario.world, scenario.robot_overrides or {}
    if scenario.name in PUBLISHED_SCENARIOS:
        return "[published](#the-published-five)"
    if scenario.floors:
        return "[missions](missions.md)"
    if world.people is not None or world.moving_obstacles:
        return "[living world](living_world.md)"
    if scenario.faults or "amcl" in overrides.get("localization", {}):
        return "[stress](stress.md)"
    return ""


TABLES: Mapping[str, tuple[str, Callable[[], str]]] = {
    "controllers.md": ("presets", presets_table),
    "scenarios.md": ("scenarios", scenarios_table),
}


def _with_table(page: Path, what: str, table: str) -> str:
    first, last = TABLE_BEGIN.format(what), TABLE_END.format(what)
    before, begin, rest = page.read_text(encoding="utf-8").partition(first)
    _, end, after = rest.partition(last)
    if not begin or not end:
        raise InputError(f"{page}: expected the lines {first!r} and {last!r}")
    return f"{before}{begin}\n{table}\n{end}{after}"


def main(argv: Sequence[str] | None = None) -> int:
    """Writes everything that is generated; returns the exit status."""
    parser = CommandParser(description="Makes the generated parts of docs/.")
    parser.add_argument("folder", nargs="?", type=Path, default=Path("docs"), metavar="DIR")
    folder = parser.parse_args(argv).folder
    return exit_status_of(lambda: _write_documents(folder))


def _write_documents(folder: Path) -> None:
    for name, text in documents(folder):
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    if shutil.which("dot") is None:
        print("Graphviz's dot is not installed: no picture was drawn anew", file=sys.stderr)
        return
    for source in sorted(folder.glob("*.dot")):
        subprocess.run(["dot", "-Tsvg", source, "-o", source.with_suffix(".svg")], check=True)


if __name__ == "__main__":
    sys.exit(main())
