"""Requests to planners on random maps, the same for ever, and a digest of what was answered.

The digests in the tests were made from the answers of Nav2's own code to these requests.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from drake_navbench.kernels.grid import Costmap
from drake_navbench.navigation.planner import Planner, PlanningError

RESOLUTION_M = 0.05
Pose = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Request:
    """A map, and a start and a goal (3,) on it; a number to choose parameters by."""

    number: int
    costmap: Costmap
    start: np.ndarray
    goal: np.ndarray


def random_requests(count: int) -> Iterator[Request]:
    """Yields requests on maps of boxes, of random costs, and with unknown parts."""
    rng = np.random.default_rng(20)
    for number in range(count):
        rows, columns = rng.integers(8, 70, size=2)
        costs = rng.choice(np.array([0, 0, 0, 60, 200], dtype=np.uint8)) + np.zeros(
            (rows, columns), dtype=np.uint8
        )
        for _ in range(rng.integers(0, 14)):
            row, column = rng.integers(0, rows), rng.integers(0, columns)
            height, width = (
                rng.integers(1, max(2, rows // 3)),
                rng.integers(1, max(2, columns // 3)),
            )
            cost = rng.choice(np.array([254, 254, 254, 253, 252, 128, 255]))
            costs[row : row + height, column : column + width] = cost
        if number % 3 == 0:
            noise = rng.integers(0, 256, size=costs.shape).astype(np.uint8)
            costs = np.where(rng.random(costs.shape) < 0.3, noise, costs)
        origin = rng.integers(-40, 40, size=2) / 16.0
        # A few lie off the map, or in its rightmost half cell; none in the uppermost one, where
        # Nav2's NavFn leaves its memory.
        cells = rng.uniform(-0.02, 1.0, size=(2, 2)) * (columns + 0.5, rows - 1.6)
        poses = np.column_stack([origin + cells * RESOLUTION_M, rng.uniform(-3.0, 3.0, size=2)])
        yield Request(number, Costmap(costs, *origin, RESOLUTION_M), *poses)


def free(rows: int = 40, columns: int = 60) -> np.ndarray:
    """Returns the costs (rows, columns) of a free map."""
    return np.zeros((rows, columns), dtype=np.uint8)


def plan_on(planner: Planner, costs: np.ndarray, start: Pose, goal: Pose) -> np.ndarray:
    """Returns the path on a map with its lower left corner at (0, 0), cells of 0.1 m."""
    return planner.plan(Costmap(costs, 0.0, 0.0, 0.1), start, goal)


def answer(planner: Planner, request: Request) -> tuple[int, np.ndarray]:
    """Returns Nav2's error code, 0 for none, and the path (N, 3), empty where there is none."""
    try:
        return 0, planner.plan(request.costmap, request.start, request.goal)
    except PlanningError as error:
        return error.code, np.empty((0, 3))


def digest(answers: Iterable[tuple[int, np.ndarray]]) -> str:
    """Returns a hash of codes and of all positions, to the last bit."""
    total = hashlib.sha256()
    for code, path in answers:
        total.update(f"{code} {len(path)} ".encode())
        total.update(np.ascontiguousarray(path[:, :2], dtype=np.float64).tobytes())
    return total.hexdigest()
