"""Random still worlds in closed loop, for the statement that the gatekeeper makes.

The map is known within its size, the estimate of the pose is wrong by all of the error bound, to
where obstacles seem farther away than they are, the base brakes as it is said to, and every cycle
is on time. Nothing of Drake is needed for that, so that thousands of worlds can be driven:

    python tests/controllers/harmony/harmony_worlds.py --count 10000 --out worlds.csv

goes on where the file ends; with --first other machines drive other worlds of them.
"""

from __future__ import annotations

import argparse
import hashlib
import math
import multiprocessing
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_navbench.controller import ControllerError, ControllerSetup, Observation
from drake_navbench.controllers.harmony import Harmony, HarmonyParameters
from drake_navbench.controllers.harmony.base_response import Response, follow, response_of
from drake_navbench.kernels.footprint import footprint_radii
from drake_navbench.kernels.grid import LETHAL, Costmap
from drake_navbench.kernels.outline_distance import outline_to_edges
from drake_navbench.kernels.poses import place_point

PERIOD_S, STEP_S = 0.05, 0.01
RESOLUTION_M, CELLS = 0.05, 120
GOAL_M, LONGEST_S = 4.0, 14.0
GOAL_TOLERANCE_M = 0.25
FOOTPRINT = np.array([[0.86, 0.31], [0.86, -0.31], [-0.26, -0.31], [-0.26, 0.31]])
# The base strays nowhere from its prediction: all of the default bound, 5 mm and 25 mm, is the
# estimate's.
ERROR_M = HarmonyParameters().error_bound_m
BOXES, ROUNDING = 5, 1e-6
# The robot turns in place where it starts.
FREE_START_M = 1.05
# As bold as it can be made: nothing but the hard limits keeps it from obstacles, and it does not
# give up in front of them.
BOLD = {"give_up_distance": 0.0, "weights": {"costmap_cost": 0.0, "path_alignment": 2.0}}
# Of what errors are made: the rest is a turn that moves the farthest corner by as much.
SHIFT_SHARE, SHIFTS = 0.6, 8
REACH_M = float(np.hypot(*FOOTPRINT.T).max())
INSCRIBED_M, CIRCUMSCRIBED_M = footprint_radii(FOOTPRINT)
SETUP = ControllerSetup(
    control_period_s=PERIOD_S,
    footprint=FOOTPRINT,
    inscribed_radius_m=INSCRIBED_M,
    circumscribed_radius_m=CIRCUMSCRIBED_M,
)
# It answers commands as the controller takes it to.
BASE = response_of(SETUP)


class Drive(NamedTuple):
    """What became of a drive: least gap of the true outline, m, how it ended and when, s."""

    least_gap_m: float
    end: str
    time_s: float


def random_boxes(seed: int) -> np.ndarray:
    """Returns (B, 4) x0, y0, x1, y1 m: boxes between start and goal, none on the start.

    Their sides lie on the sides of cells, so that the map makes none of them larger.
    """
    random = np.random.default_rng(seed)
    boxes = []
    while len(boxes) < BOXES:
        low = RESOLUTION_M * random.integers([-10, -32], [90, 26])
        high = low + RESOLUTION_M * random.integers(2, 12, 2)
        nearest = np.maximum(np.maximum(low, -high), 0.0)
        if math.hypot(*nearest) > FREE_START_M:
            boxes.append((*low, *high))
    return np.array(boxes)


def edges_of(boxes: np.ndarray) -> np.ndarray:
    """Returns (4 B, 4) the sides of boxes."""
    x0, y0, x1, y1 = boxes.T
    sides = ((x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0))
    return np.concatenate([np.column_stack(side) for side in sides])


def costmap_around(boxes: np.ndarray, x: float, y: float) -> Costmap:
    """Returns the map about a point: lethal is every cell that a box reaches into."""
    half = 0.5 * CELLS * RESOLUTION_M
    origin_x = math.floor((x - half) / RESOLUTION_M) * RESOLUTION_M
    origin_y = math.floor((y - half) / RESOLUTION_M) * RESOLUTION_M
    costs = np.zeros((CELLS, CELLS), dtype=np.uint8)
    _mark(costs, boxes, origin_x, origin_y)
    return Costmap(costs, origin_x, origin_y, RESOLUTION_M)


@njit(cache=True)
def _mark(costs, boxes, origin_x, origin_y):
    """Makes every cell lethal that a box (x0, y0, x1, y1) reaches into."""
    for k in range(boxes.shape[0]):
        west, south = boxes[k, 0] - origin_x, boxes[k, 1] - origin_y
        east, north = boxes[k, 2] - origin_x, boxes[k, 3] - origin_y
        first_row = max(math.floor(south / RESOLUTION_M + ROUNDING), 0)
        first_column = max(math.floor(west / RESOLUTION_M + ROUNDING), 0)
        for row in range(first_row, min(math.ceil(north / RESOLUTION_M - ROUNDING), CELLS)):
            for column in range(
                first_column, min(math.ceil(east / RESOLUTION_M - ROUNDING), CELLS)
            ):
                costs[row, column] = LETHAL


@njit(cache=True)
def gap_of(edges, state):
    """Returns the distance from the outline to the boxes, m; 0 in contact."""
    cosine, sine = math.cos(state[2]), math.sin(state[2])
    placed = np.empty_like(FOOTPRINT)
    for k in range(FOOTPRINT.shape[0]):
        placed[k, 0], placed[k, 1] = place_point(
            FOOTPRINT[k, 0], FOOTPRINT[k, 1], state[0], state[1], cosine, sine
        )
    return outline_to_edges(placed, edges, 10.0)


@njit(cache=True)
def deceived(edges, state, error_m, turn):
    """Returns (3,) a pose at which the outline seems farther from the boxes than it is.

    No point of it seems farther than `error_m` from where it is. turn: -1 or 1, to which side.
    """
    best, pose = -1.0, state[:3].copy()
    shift, yaw = SHIFT_SHARE * error_m, turn * (1.0 - SHIFT_SHARE) * error_m / REACH_M
    for k in range(SHIFTS):
        angle = 2.0 * math.pi * k / SHIFTS
        tried = np.array(
            [
                state[0] + shift * math.cos(angle),
                state[1] + shift * math.sin(angle),
                state[2] + yaw,
            ]
        )
        gap = gap_of(edges, tried)
        if gap > best:
            best, pose = gap, tried
    return pose


@njit(cache=True)
def least_gap_on(edges, base, state, v, w):
    """Moves `state` (5,) in place by a cycle under a command; returns the least gap of it, m."""
    least = math.inf
    for _ in range(round(PERIOD_S / STEP_S)):
        follow(base, state, v, w, STEP_S)
        least = min(least, gap_of(edges, state))
    return least


def controller_with(settings: HarmonyParameters) -> Harmony:
    """Returns the controller of the robot of these worlds."""
    return Harmony(settings, SETUP)


def drive(
    seed: int,
    *,
    error_m: float = ERROR_M,
    slowness: float = 1.0,
    strength: float = 1.0,
    **parameters,
) -> Drive:
    """Drives harmony, as bold as it can be made, through a random world to a goal ahead.

    slowness, strength: the base's time constant and its accelerations, in parts of those that the
    controller is told.
    """
    settings = HarmonyParameters(**BOLD, **parameters)
    base = BASE._replace(
        time_constant_s=slowness * BASE.time_constant_s,
        acceleration=strength * BASE.acceleration,
        angular_acceleration=strength * BASE.angular_acceleration,
    )
    return drive_among(
        random_boxes(seed), settings, seed, error_m=error_m, longest_s=LONGEST_S, base=base
    )


def drive_among(
    boxes: np.ndarray,
    settings: HarmonyParameters,
    seed: int,
    *,
    error_m: float,
    longest_s: float,
    base: Response = BASE,
    yaw: float = 0.0,
) -> Drive:
    """Drives harmony among boxes (B, 4) to a goal on the x axis; stops at a contact.

    yaw: of the start, rad; 0 faces the goal.
    """
    edges = edges_of(boxes)
    controller = controller_with(settings)
    x = np.arange(0.0, GOAL_M + 1e-9, 0.05)
    plan = np.column_stack([x, np.zeros_like(x), np.zeros_like(x)])
    state, memory = np.array([0.0, 0.0, yaw, 0.0, 0.0]), controller.initial_memory()
    random = np.random.default_rng(seed)
    least, end, command, cycle = math.inf, "timed out", np.zeros(2), 0
    while cycle * PERIOD_S < longest_s:
        time_s = cycle * PERIOD_S
        if math.hypot(state[0] - GOAL_M, state[1]) < GOAL_TOLERANCE_M:
            end = "arrived"
            break
        pose = deceived(edges, state, error_m, random.choice([-1.0, 1.0]))
        nearest = int(np.argmin(np.hypot(*(plan[:, :2] - pose[:2]).T)))
        seen = Observation(
            time_s=time_s,
            pose=pose,
            twist=state[3:].copy(),
            plan=plan[min(nearest, len(plan) - 2) : nearest + 41],
            plan_id=1,
            costmap=costmap_around(boxes, pose[0], pose[1]),
            goal=plan[-1],
            global_plan=plan,
        )
        if end != "aborted":
            try:
                command, memory, _ = controller.step(seen, memory)
            except ControllerError:
                # What the controller server does from then on: it commands 0.
                end, command = "aborted", np.zeros(2)
        v, w = float(command[0]), float(command[1])
        least = min(least, least_gap_on(edges, base, state, v, w))
        if least == 0.0:
            return Drive(least, "contact", time_s)
        if end == "aborted" and abs(state[3]) < 1e-3 and abs(state[4]) < 1e-3:
            break
        cycle += 1
    return Drive(least, end, cycle * PERIOD_S)


def drive_worlds(path: Path, count: int, *, jobs: int, hours: float, first: int = 0) -> list[str]:
    """Drives what a file does not hold yet of so many worlds; returns how each of them ended.

    One line a world: seed, end, time s, least gap m. Ends early where the hours are over. first:
    seed of the file's first world, so that several machines can share the worlds.
    """
    done = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    until_s = time.monotonic() + 3600.0 * hours
    with path.open("a", encoding="utf-8") as file, multiprocessing.Pool(jobs) as pool:
        seeds = range(first + len(done), first + count)
        for seed, found in zip(seeds, pool.imap(drive, seeds), strict=True):
            file.write(f"{seed},{found.end},{found.time_s:.2f},{found.least_gap_m:.4f}\n")
            file.flush()
            if time.monotonic() > until_s:
                break
    return [line.split(",")[1] for line in path.read_text(encoding="utf-8").splitlines()]


def digest_of_code() -> str:
    """Returns a name of the code that a drive is a function of: what it drove counts no longer."""
    root = Path(__file__).parents[3]
    found = hashlib.sha256(Path(__file__).read_bytes())
    for folder in (
        *("controllers/harmony", "controllers/rpp"),
        *("drake_navbench", "drake_navbench/kernels"),
    ):
        for path in sorted((root / folder).glob("*.py")):
            found.update(path.read_bytes())
    return found.hexdigest()[:16]


def main() -> None:
    """Drives many worlds, a line each in a file, and says what came out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0, help="seed of the first of them")
    parser.add_argument("--out", type=Path, default=Path("harmony_worlds.csv"))
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--hours", type=float, default=6.0, help="at most")
    arguments = parser.parse_args()
    ends = drive_worlds(
        arguments.out,
        arguments.count,
        jobs=arguments.jobs,
        hours=arguments.hours,
        first=arguments.first,
    )
    contacts = ends.count("contact")
    # With no contact in n worlds the share is below 3 / n at 95% (the rule of three).
    print(f"{len(ends)} worlds, {contacts} contacts", end="")
    print(f", below {3.0 / len(ends):.1e} at 95%" if not contacts else "")


if __name__ == "__main__":
    main()
