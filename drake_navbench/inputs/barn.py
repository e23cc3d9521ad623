"""BARN worlds: fields of cylinders with a reference path each, as scenarios of one suite.

A folder holds `world_N.world`, SDF in which every cylinder stands twice (in the world and in its
`<state>`), and `path_files/path_N.npy`, the rows and columns of a path on the lattice of cylinders.
The task is the one of the challenge: 10 m along y, through a corridor without a map, in 100 s. The
score takes the reference path with start and goal added, and an arrival within 1 m.

Source: D. Perille et al., "Benchmarking Metric Ground Navigation", SSRR 2020; The BARN Challenge.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_navbench.errors import InputError
from drake_navbench.inputs.scenario import Scenario, Suite
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.typed_files.array_file import NoArray, array_of
from drake_navbench.typed_files.input_file import MEGABYTE, read_input, read_input_text
from drake_navbench.typed_files.quantities import Pose
from drake_navbench.typed_files.typed_yaml import validate

SUITE = "BARN"
START: Pose = (-2.25, 3.0, math.pi / 2)
GOAL: Pose = (-2.25, 13.0, math.pi / 2)
TIMEOUT_S = 100.0
ARRIVAL_RADIUS_M = 1.0
# The 300 worlds come in four groups, by the share of the field that is filled before smoothing.
WORLDS_PER_DENSITY = 75
DENSITIES = ("15%", "20%", "25%", "30%")
# The place of the lattice of cylinders: its row 0 and column 0, and its pitch, m. With it every
# reference path keeps the distance from cylinders that the worlds' generator promises.
LATTICE_X_M, LATTICE_Y_M, PITCH_M = -4.425, 5.175, 0.15
# The size of the global costmap, which has no map: it must hold the whole field.
MARGIN_M = 4.5

MAX_WORLD_BYTES = 16 * MEGABYTE
MAX_PATH_BYTES = MEGABYTE
# The lattice of the benchmark has 30 rows and 30 columns.
MAX_CELL = 1000
WORLD_NAME = re.compile(r"world_(\d+)\.world")
# Worlds that another program has saved again have double quotes.
MODEL = re.compile(r"<model name=['\"](unit_cylinder[^'\"]*)['\"]>(.*?)</model>", re.DOTALL)
POSE = re.compile(r"<pose[^>]*>([^<]*)</pose>")
RADIUS = re.compile(r"<cylinder>.*?<radius>([^<]*)</radius>", re.DOTALL)


def barn_scenarios(folder: Path, numbers: Collection[int] = ()) -> list[Scenario]:
    """Returns the worlds of a folder in the order of their numbers, or only those of `numbers`.

    Raises InputError where there is none, or a world or its path cannot be read.
    """
    found = {
        int(match[1]): path
        for path in (folder.iterdir() if folder.is_dir() else ())
        if (match := WORLD_NAME.fullmatch(path.name))
    }
    if not found:
        raise InputError(f"--barn {folder}: expected a folder with world_N.world, found none")
    for number in numbers:
        if number not in found:
            raise InputError(
                f"--worlds: there is no world_{number}.world in {folder}; "
                f"expected numbers from {min(found)} to {max(found)}"
            )
    return [_scenario(number, found[number]) for number in sorted(numbers or found)]


def _scenario(number: int, world: Path) -> Scenario:
    group = number // WORLDS_PER_DENSITY
    suite = Suite(
        name=SUITE,
        density=DENSITIES[group] if group < len(DENSITIES) else "",
        reference_length_m=_reference_length_m(world.parent / "path_files" / f"path_{number}.npy"),
        arrival_radius_m=ARRIVAL_RADIUS_M,
    )
    data = {
        "description": f"BARN world {number}: 10 m through cylinders that no map shows",
        "world": {"obstacles": _cylinders(world)},
        "start": START,
        "goal": GOAL,
        "navigation_mode": "navigate_to_pose",
        "timeout_s": TIMEOUT_S,
        "robot_overrides": {"navigation": {"global_costmap": {"margin_m": MARGIN_M}}},
        "suite": suite.model_dump(),
        "name": f"barn_{number:03}",
    }
    return validate(Scenario, data, str(world))


def _cylinders(world: Path) -> list[dict[str, Any]]:
    """Returns the cylinders of a world as obstacles that only the lidar knows."""
    text = read_input_text(world, max_bytes=MAX_WORLD_BYTES)
    models = text.partition("<state")[0]
    cylinders = []
    for name, body in MODEL.findall(models):
        try:
            x, y = map(float, _only(POSE, body).split()[:2])
            radius = float(_only(RADIUS, body))
        except ValueError as error:
            raise InputError(f"{world}: model {name}: expected a pose and a radius") from error
        cylinders.append(
            {
                "type": "cylinder",
                "centre": [x, y],
                "radius_m": radius,
                "known_to_planner": False,
            }
        )
    if not cylinders:
        raise InputError(f"{world}: expected models named unit_cylinder, found none")
    return cylinders


def _only(pattern: re.Pattern[str], text: str) -> str:
    found = pattern.search(text)
    return found[1] if found else ""


def _reference_length_m(path: Path) -> float:
    """Returns the length from start to goal along a reference path."""
    content = read_input(path, max_bytes=MAX_PATH_BYTES)
    try:
        cells = array_of(content)
    except NoArray as error:
        raise InputError(f"{path}: {error}; expected an array of NumPy of shape (n, 2)") from error
    if cells.ndim != 2 or cells.shape[1] != 2 or not len(cells):
        raise InputError(f"{path}: expected rows and columns as an array of shape (n, 2)")
    if np.iscomplexobj(cells) or not (np.abs(cells.astype(float)) <= MAX_CELL).all():
        raise InputError(f"{path}: expected rows and columns of at most {MAX_CELL}")
    return path_length(reference_path(cells))


def reference_path(cells: NDArray[np.int64]) -> NDArray[np.float64]:
    """Returns (n + 2, 2) m: the start, the cells (n, 2) [row, column] of a path, and the goal."""
    corner = np.array([LATTICE_X_M, LATTICE_Y_M])
    return np.vstack([START[:2], corner + PITCH_M * cells, GOAL[:2]])
