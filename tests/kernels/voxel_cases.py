"""Random cycles of a voxel layer, the same for ever, and a digest of what they left.

The digest in the tests was made from what Nav2's own code left after these cycles.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from drake_navbench.kernels.observation import Observation

ROWS, COLUMNS, RESOLUTION_M = 40, 50, 0.1
FIRST_ORIGIN = (-2.0, -1.5)
FOOTPRINT = np.array([[0.25, 0.2], [-0.25, 0.2], [-0.25, -0.2], [0.25, -0.2]])
CYCLES = 8


class Run(NamedTuple):
    """Parameters of a layer, its default cost, whether it rolls, and its cycles."""

    parameters: dict[str, Any]
    default_cost: int
    rolling_window: bool
    cycles: list[tuple[np.ndarray, list[Observation]]]


def random_runs(count: int) -> Iterator[Run]:
    """Yields runs; each cycle is a pose (3,) of the robot and what its sensors saw."""
    rng = np.random.default_rng(7)
    for _ in range(count):
        parameters = {
            "footprint_clearing_enabled": bool(rng.integers(2)),
            "min_obstacle_height": float(rng.choice([0.0, 0.0, 0.125])),
            "max_obstacle_height": float(rng.choice([2.0, 1.0, 0.5])),
            "z_voxels": int(rng.integers(1, 17)),
            "origin_z": float(rng.choice([0.0, 0.0, -0.25])),
            "z_resolution": float(rng.choice([0.0625, 0.2])),
            "unknown_threshold": int(rng.choice([15, 15, 8, 2])),
            "mark_threshold": int(rng.choice([0, 0, 1, 3])),
        }
        pose = np.array([0.5, 0.5, 0.0])
        cycles = []
        for _ in range(CYCLES):
            pose = pose + rng.uniform(-0.3, 0.3, size=3)
            cycles.append((pose, [_observation(rng, pose) for _ in range(rng.integers(1, 4))]))
        yield Run(parameters, int(rng.choice([0, 255])), bool(rng.integers(2)), cycles)


def _observation(rng: np.random.Generator, pose: np.ndarray) -> Observation:
    """Returns a planar scan or a cloud, some of it off the grid, above or below it."""
    origin = np.array([*(pose[:2] + rng.uniform(-0.2, 0.2, size=2)), rng.uniform(-0.1, 1.2)])
    spread = (2.5, 2.5, 0.0 if rng.integers(2) else 0.8)
    points = (origin + rng.uniform(-1.0, 1.0, size=(60, 3)) * spread).astype(np.float32)
    points = points.astype(np.float64)
    shortest, longest = rng.choice([0.0, 0.0, 0.4], size=2), rng.uniform(0.8, 4.0, size=2)
    return Observation(
        origin,
        points,
        marking=bool(rng.random() < 0.8),
        clearing=bool(rng.random() < 0.8),
        obstacle_min_range=float(shortest[0]),
        obstacle_max_range=float(longest[0]),
        raytrace_min_range=float(shortest[1]),
        raytrace_max_range=float(longest[1]),
    )


class Digest:
    """A hash of what cycles leave, to the last bit."""

    def __init__(self) -> None:
        self._hash = hashlib.sha256()

    def add(self, costs: np.ndarray, voxels: np.ndarray, origin: tuple[float, float]) -> None:
        """Takes costs uint8, columns of voxels uint32 and the lower left corner m of a cycle."""
        self._hash.update(np.ascontiguousarray(costs).tobytes())
        self._hash.update(np.ascontiguousarray(voxels).tobytes())
        self._hash.update(np.array(origin, dtype=np.float64).tobytes())

    def __str__(self) -> str:
        return self._hash.hexdigest()
