"""Which folder may import which: arrows run one way, so that each part can be read by itself."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
PACKAGE = "drake_navbench"

# Modules and folders at the root of the package that any folder may use: they use kernels at most.
CONTRACTS = {
    "controller",
    "errors",
    "explanation",
    "logs",
    "plugins",
    "processes",
    "typed_files",
}
COMMANDS = {"__main__", "run", "commands"}
# Folders inside another that are a layer of their own.
INNER = {
    "inputs.descriptions": "descriptions",
    "navigation.costmaps": "costmaps",
    "ros2.live": "live",
    "ros2.recordings": "recordings",
    "trial.systems": "systems",
}

# Layer -> layers it may import besides itself and what stands below them all.
BELOW_ALL = {"contracts", "kernels"}
MAY_IMPORT: dict[str, set[str]] = {
    "contracts": {"kernels"},
    "kernels": {"contracts"},
    "controllers": BELOW_ALL,
    "costmaps": BELOW_ALL,
    "navigation": BELOW_ALL | {"costmaps"},
    "scenarios": set(),
    "models": set(),
    "native": BELOW_ALL,
    "descriptions": BELOW_ALL,
    "inputs": BELOW_ALL | {"costmaps", "navigation", "native", "descriptions"},
    "nav2": BELOW_ALL | {"costmaps", "navigation", "inputs"},
    "systems": BELOW_ALL | {"costmaps", "navigation", "inputs"},
    "trial": BELOW_ALL | {"costmaps", "navigation", "inputs", "systems"},
    "analysis": BELOW_ALL | {"descriptions"},
    "ros2": set(),
    "live": BELOW_ALL | {"costmaps", "inputs", "navigation", "recordings", "systems"},
    "recordings": BELOW_ALL | {"costmaps", "inputs", "trial", "analysis"},
    "campaign": BELOW_ALL | {"descriptions", "inputs", "nav2", "trial", "analysis"},
    "studies": BELOW_ALL
    | {
        "controllers",
        "costmaps",
        "native",
        "navigation",
        "inputs",
        "nav2",
        "systems",
        "trial",
        "analysis",
        "recordings",
        "campaign",
    },
    "studio": BELOW_ALL | {"costmaps", "inputs", "nav2", "trial", "analysis", "campaign"},
    "commands": BELOW_ALL
    | {
        "studio",
        "inputs",
        "nav2",
        "trial",
        "analysis",
        "campaign",
        "live",
        "recordings",
        "native",
        "studies",
        "descriptions",
    },
}
# What analysis may use of the engine: the shapes that were in the world, which every log has.
SHAPES = {
    "drake_navbench.inputs.moving_obstacles",
    "drake_navbench.inputs.people",
    "drake_navbench.inputs.recorded_people",
    "drake_navbench.inputs.world",
    "drake_navbench.inputs.world_geometry",
}
# The contract that a kernel may use; the others use kernels themselves.
FOR_KERNELS = {"drake_navbench.processes.kernel_cache"}


def layer_of(module: str) -> str:
    """Returns the layer of a module such as `drake_navbench.kernels.grid`."""
    parts = module.split(".")
    if len(parts) == 1 or parts[1].startswith("__version"):
        return "contracts"
    if parts[1] in CONTRACTS:
        return "contracts"
    if parts[1] in COMMANDS:
        return "commands"
    return INNER.get(".".join(parts[1:3]), parts[1])


def modules() -> Iterator[tuple[str, Path]]:
    """Yields every module of the package with its file, by the name it is imported by."""
    for folder in (PACKAGE, "controllers", "analysis", "scenarios", "models"):
        for path in sorted((REPOSITORY / folder).rglob("*.py")):
            parts = path.relative_to(REPOSITORY).with_suffix("").parts
            parts = parts if parts[0] == PACKAGE else (PACKAGE, *parts)
            yield ".".join(part for part in parts if part != "__init__"), path


MODULES = {module for module, _ in modules()}


# A line that imports of the package or beside itself; a whole file parses ten times as long.
IMPORT = re.compile(
    rf"^[ \t]*(from[ \t]+(?:{PACKAGE}|\.)[^\n(]*(?:\([^)]*\)[^\n]*)?"
    rf"|import[ \t][^\n]*{PACKAGE}[^\n]*)",
    re.MULTILINE,
)


@cache
def imports(path: Path) -> tuple[tuple[int, str], ...]:
    """Returns the line and the name of everything of the package that a file imports."""
    return tuple(_imports(path))


def _imports(path: Path) -> Iterator[tuple[int, str]]:
    text = path.read_text(encoding="utf-8")
    for found in IMPORT.finditer(text):
        for node in _statements(found[0].strip(), text):
            yield from _imported(node, text.count("\n", 0, found.start(1)))


def _statements(line: str, text: str) -> list[ast.stmt]:
    """Returns a line parsed; where it is no whole statement, all statements of the text."""
    try:
        return ast.parse(line).body
    except SyntaxError:
        return [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.stmt)]


def _imported(node: ast.stmt, lines_above: int) -> Iterator[tuple[int, str]]:
    line = lines_above + 1
    if isinstance(node, ast.ImportFrom) and node.level:
        yield line, "a relative import"
    elif isinstance(node, ast.ImportFrom) and node.module.split(".")[0] == PACKAGE:
        for alias in node.names:
            name = f"{node.module}.{alias.name}"
            yield line, name if name in MODULES else node.module
    elif isinstance(node, ast.Import):
        for alias in node.names:
            if alias.name.split(".")[0] == PACKAGE:
                yield line, alias.name


def broken_rules(module: str, path: Path) -> list[str]:
    """Returns a line for every import of a file that its layer may not have."""
    layer = layer_of(module)
    faults = []
    for line, imported in imports(path):
        other = layer_of(imported) if imported.startswith(PACKAGE) else ""
        allowed = other == layer or other in MAY_IMPORT[layer]
        if layer == "kernels" and other == "contracts":
            allowed = imported in FOR_KERNELS
        if layer == "analysis" and not allowed:
            allowed = imported in SHAPES
        if not allowed:
            faults.append(f"{path}:{line}: {layer} may not import {imported}")
    return faults


def test_every_import_runs_down_the_layers():
    found = [
        fault
        for module, path in modules()
        if module != PACKAGE
        for fault in broken_rules(module, path)
    ]
    assert not found, "\n".join(found)


def test_every_folder_has_its_layer():
    assert {layer_of(module) for module, _ in modules()} <= set(MAY_IMPORT)


def test_the_layers_have_no_cycle():
    below: dict[str, set[str]] = {}
    for layer, direct in MAY_IMPORT.items():
        if layer not in BELOW_ALL:
            below[layer] = direct - BELOW_ALL
    while below:
        free = {layer for layer, direct in below.items() if not direct & set(below)}
        assert free, f"a cycle among {sorted(below)}"
        below = {layer: direct for layer, direct in below.items() if layer not in free}


@pytest.mark.parametrize(
    ("module", "line"),
    [
        ("kernels.planted", "from drake_navbench.trial.systems.lidar import Lidar"),
        ("kernels.planted", "from drake_navbench.controller import Controller"),
        ("controllers.planted", "import drake_navbench.trial.trial"),
        ("navigation.costmaps.planted", "from drake_navbench.inputs.robot import Robot"),
        ("trial.systems.planted", "from drake_navbench.trial import diagram"),
        ("analysis.planted", "from drake_navbench.trial.systems.lidar import Lidar"),
        ("analysis.planted", "from drake_navbench.inputs.presets import load_preset"),
        (
            "analysis.planted",
            "from drake_navbench.navigation.costmaps.layered_costmap import local_layers",
        ),
        ("analysis.replay.planted", "from drake_navbench.inputs.robot import Robot"),
        ("campaign.planted", "from drake_navbench import run"),
        ("trial.planted", "from . import spec"),
        ("trial.planted", "import drake_navbench.studies.gymnasium.tasks"),
    ],
)
def test_an_import_against_the_layers_is_found_with_its_line(module, line, tmp_path):
    path = tmp_path / "planted.py"
    path.write_text(f'"""Planted."""\n\n{line}\n')
    (fault,) = broken_rules(f"{PACKAGE}.{module}", path)
    assert fault.startswith(f"{path}:3: {layer_of(f'{PACKAGE}.{module}')} may not import ")


def circles(graph: dict[str, set[str]]) -> set[str]:
    """Returns the nodes that are on a circle of arrows, or on a way between two circles."""
    left = {node: to & set(graph) - {node} for node, to in graph.items()}
    while True:
        entered = {other for to in left.values() for other in to}
        idle = {node for node, to in left.items() if not to or node not in entered}
        if not idle:
            return set(left)
        left = {node: to - idle for node, to in left.items() if node not in idle}


def test_no_files_import_each_other_not_even_for_types_or_late():
    graph = {module: {name for _, name in imports(path)} for module, path in modules()}
    # The face of the package hands names of everywhere on, and has the version.
    del graph[PACKAGE]
    assert circles(graph) == set()


def test_files_that_import_each_other_are_found():
    graph = {"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"a"}, "e": set()}
    assert circles(graph) == {"b", "c"}
