"""The things in a scenario's content as outlines to draw, and the thing at a point."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
import shapely
from pydantic import TypeAdapter

from drake_navbench.inputs.moving_obstacles import MovingObstacle, circle
from drake_navbench.inputs.world import Obstacle
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.poses import place_outline
from drake_navbench.studio.drawing import Place, entry_at

OBSTACLE, MOVING = TypeAdapter[Any](Obstacle), TypeAdapter[Any](MovingObstacle)
# A click picks a thing within this distance, m; of several the smallest.
REACH_M = 0.15
PERSON_RADIUS_M = 0.3
ARROW_M = 0.6


class Item(NamedTuple):
    """A thing of a scenario.

    place: its place in the content. kind: 'wall', 'start', 'goal', 'person', 'moving', 'keepout' or
    'zone'. outline: (K, 2) m. way: (N, 2) m, for moving things; else empty.
    """

    place: Place
    kind: str
    outline: Array
    way: Array


NOWAY = np.empty((0, 2))


def items_of(content: Mapping[str, Any], floor: Place = ()) -> list[Item]:
    """Returns the things of a scenario, of one floor of a mission; areas first.

    content: one that the loader accepts.
    """
    things = (_areas(content, floor), _obstacles(content, floor), _movers(content, floor))
    return [*chain(*things), *_poses(content)]


def item_at(items: Sequence[Item], point: tuple[float, float]) -> Item | None:
    """Returns the thing at a point, or None; poses come before all others."""
    here = shapely.Point(point)
    near = []
    for item in items:
        if item.kind in ("start", "goal"):
            distance_m = math.dist(item.outline[0], point)
            size = 0.0
        else:
            region = shapely.Polygon(item.outline)
            distance_m, size = region.distance(here), region.area
        if distance_m <= REACH_M + (0.15 if item.kind in ("start", "goal") else 0.0):
            near.append((distance_m > 0.0 and item.kind not in ("start", "goal"), size, item))
    return min(near, key=lambda entry: entry[:2])[2] if near else None


def bounds_of(items: Sequence[Item]) -> tuple[float, float, float, float]:
    """Returns min_x, min_y, max_x, max_y of all things, m."""
    corners = [item.outline for item in items] + [item.way for item in items]
    stacked = np.vstack([*corners, [[-1.0, -1.0], [1.0, 1.0]]] if not items else corners)
    low, high = stacked.min(axis=0), stacked.max(axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _found(content: Mapping[str, Any], place: Place) -> Any:
    try:
        return entry_at(content, place) or []
    except (KeyError, IndexError, TypeError):
        return []


def _obstacles(content: Mapping[str, Any], floor: Place) -> Iterator[Item]:
    place: Place = (*floor, "world", "obstacles")
    for index, entry in enumerate(_found(content, place)):
        yield Item((*place, index), "wall", OBSTACLE.validate_python(entry).outline, NOWAY)


def _areas(content: Mapping[str, Any], floor: Place) -> Iterator[Item]:
    for number, entry in enumerate(_found(content, (*floor, "filters"))):
        kind = "keepout" if entry.get("type") == "keepout" else "zone"
        for index, drawn in enumerate(entry.get("areas") or ()):
            place: Place = (*floor, "filters", number, "areas", index)
            yield Item(place, kind, np.array(drawn["polygon"], dtype=float), NOWAY)


def _movers(content: Mapping[str, Any], floor: Place) -> Iterator[Item]:
    people = _found(content, (*floor, "world", "people")) or {}
    for index, person in enumerate(people.get("persons") or ()):
        way = np.array([person["start"], *person.get("goals", ())], dtype=float)
        place: Place = (*floor, "world", "people", "persons", index)
        radius_m = person.get("radius_m", PERSON_RADIUS_M)
        yield Item(place, "person", way[0] + circle(radius_m), way)
    for index, thing in enumerate(_found(content, (*floor, "world", "moving_obstacles"))):
        knots = (moving := MOVING.validate_python(thing)).knots
        place = (*floor, "world", "moving_obstacles", index)
        yield Item(place, "moving", place_outline(moving.outline, knots[0, 1:]), knots[:, 1:3])


def _poses(content: Mapping[str, Any]) -> Iterator[Item]:
    yield Item(("start",), "start", _arrow(entry_at(content, ("start",))), NOWAY)
    for index, pose in enumerate(content.get("waypoints") or ()):
        yield Item(("waypoints", index), "goal", _arrow(pose), NOWAY)
    if "goal" in content:
        yield Item(("goal",), "goal", _arrow(content["goal"]), NOWAY)


def _arrow(pose: Sequence[float]) -> Array:
    """Returns a pose's place and the tip of its heading, (2, 2) m."""
    x, y, yaw = map(float, pose)
    return np.array([[x, y], [x + ARROW_M * math.cos(yaw), y + ARROW_M * math.sin(yaw)]])
