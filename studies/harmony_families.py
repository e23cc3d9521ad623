"""The worlds that harmony's comparison drives besides named scenarios: bends, traps, clutter.

A world is a function of its family and number. `docs/harmony_comparison.md` fixes the numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import shapely
import yaml

Fields = dict[str, Any]

TIMEOUT_S = 90.0
# S-curves: bends in turn to either side, and boxes beside the path, never nearer to it than this.
LEAST_TO_PATH_M = 0.75
# U-traps and clutter lie between two walls, y m.
WALL_M = 0.1
# Clutter: a way with so much room to either side of the base's point leads through it, m.
CLUTTER_ROOM_M = 0.5
MOST_DRAWS = 1000


def s_curve(random: np.random.Generator) -> Fields:
    """Three to six bends of 30 to 90 degrees, radius 0.6 to 1.5 m, with boxes beside them."""
    elements: list[Fields] = [{"straight_m": 1.5}]
    points, yaw, side = [np.zeros(2), np.array([1.5, 0.0])], 0.0, random.choice([-1.0, 1.0])
    for _ in range(random.integers(3, 7)):
        degrees = float(side) * round(float(random.uniform(30.0, 90.0)), 1)
        radius, straight = (
            round(float(random.uniform(*span)), 2) for span in ((0.6, 1.5), (0.4, 1.5))
        )
        elements += [{"arc_deg": degrees, "radius_m": radius}, {"straight_m": straight}]
        centre = points[-1] + side * radius * np.array([-np.sin(yaw), np.cos(yaw)])
        for angle in yaw + np.radians(degrees) * np.linspace(0.0, 1.0, 13)[1:]:
            points.append(centre + side * radius * np.array([np.sin(angle), -np.cos(angle)]))
        yaw += float(np.radians(degrees))
        points.append(points[-1] + straight * np.array([np.cos(yaw), np.sin(yaw)]))
        side = -side
    path, boxes = shapely.LineString(points), []
    for _ in range(8):
        middle = random.choice(points) + random.uniform(-1.6, 1.6, 2)
        size = random.uniform(0.2, 0.6, 2)
        low, high = middle - 0.5 * size, middle + 0.5 * size
        if path.distance(shapely.box(*low, *high)) > LEAST_TO_PATH_M and np.hypot(*middle) > 1.5:
            boxes.append(_box(low, high))
    return {
        "world": {"obstacles": boxes},
        "goal": [*_rounded(points[-1]), round(yaw, 4)],
        "plan": {"type": "elements", "elements": elements},
    }


def u_trap(random: np.random.Generator) -> Fields:
    """A U across the path, open towards the robot, that the planner does not know."""
    front = random.uniform(3.0, 4.2)
    depth, inside = random.uniform(0.4, 1.6), random.uniform(0.9, 1.6)
    middle = random.uniform(-0.25, 0.25)
    back, low, high = front + depth, middle - 0.5 * inside, middle + 0.5 * inside
    wall = max(high, -low) + WALL_M + random.uniform(1.3, 2.0)
    shapes = [
        _box((front, high), (back, high + WALL_M), known=False),
        _box((front, low - WALL_M), (back, low), known=False),
        _box((back, low - WALL_M), (back + WALL_M, high + WALL_M), known=False),
    ]
    return {
        "world": {"obstacles": [*shapes, *_two_walls(wall)]},
        "goal": [8.0, 0.0, 0.0],
    }


def clutter(random: np.random.Generator) -> Fields:
    """Six to ten boxes between two walls, all known, through which there is a way."""
    for _ in range(MOST_DRAWS):
        lows = random.uniform([1.3, -2.4], [6.4, 1.9], (random.integers(6, 11), 2))
        highs = lows + random.uniform(0.15, 0.6, lows.shape)
        goal = np.array([8.0, random.uniform(-1.2, 1.2)])
        if _has_way(lows, highs, goal):
            boxes = [_box(low, high) for low, high in zip(lows, highs, strict=True)]
            return {
                "world": {"obstacles": [*boxes, *_two_walls(2.5)]},
                "goal": [*_rounded(goal), 0.0],
            }
    raise RuntimeError(f"clutter: got no world with a way in {MOST_DRAWS} draws")


FAMILIES: Mapping[str, Callable[[np.random.Generator], Fields]] = {
    "s_curve": s_curve,
    "u_trap": u_trap,
    "clutter": clutter,
}


def write_world(folder: Path, family: str, number: int) -> Path:
    """Writes a world as a scenario file and returns its path."""
    fields = FAMILIES[family](np.random.default_rng([list(FAMILIES).index(family), number]))
    name = f"{family}_{number}"
    data = {"description": f"Generated {family} {number}", **fields, "timeout_s": TIMEOUT_S}
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump(data, sort_keys=False), encoding="utf-8")
    return path


def _has_way(lows: np.ndarray, highs: np.ndarray, goal: np.ndarray) -> bool:
    """Returns whether a disc of CLUTTER_ROOM_M gets from the start to the goal."""
    boxes = [shapely.box(*low, *high) for low, high in zip(lows, highs, strict=True)]
    grown = shapely.union_all(boxes).buffer(CLUTTER_ROOM_M)
    free = shapely.box(-1.0, -2.5 + CLUTTER_ROOM_M, 9.0, 2.5 - CLUTTER_ROOM_M).difference(grown)
    start, end = shapely.Point(0.0, 0.0), shapely.Point(*goal)
    return any(part.covers(start) and part.covers(end) for part in shapely.get_parts(free))


def _two_walls(y: float) -> list[Fields]:
    return [_box((-1.5, y), (9.5, y + WALL_M)), _box((-1.5, -y - WALL_M), (9.5, -y))]


def _box(low: Any, high: Any, *, known: bool = True) -> Fields:
    shape = {"type": "box", "min": _rounded(low), "max": _rounded(high)}
    return shape if known else shape | {"known_to_planner": False}


def _rounded(numbers: Any) -> list[float]:
    return [round(float(number), 3) for number in numbers]
