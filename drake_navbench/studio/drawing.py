"""A scenario being drawn: its content, changed step by step, undone and done again."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import deepcopy
from itertools import pairwise
from typing import Any

from drake_navbench.errors import InputError

Point = tuple[float, float]
# The place of an entry in a scenario's content, such as ("world", "obstacles", 3).
Place = tuple[str | int, ...]
MAX_UNDO = 500
# The number of decimals: millimetres are finer than anybody draws.
DIGITS = 3
# A door is drawn on a wall if it is at most this far from the wall's centre line.
DOOR_REACH_M = 0.3
# A box up to this thickness is treated as a wall when a door is drawn.
THICKEST_WALL_M = 0.5
SHORTEST_M = 0.01
# Length and width of a drawn moving obstacle.
CART_M = (1.0, 0.6)
ALONG_M = 0.05
# The fields of points, and of lists of points, that move with a thing.
POINTS = ("min", "max", "start", "end", "centre")
RINGS = ("vertices", "polygon", "goals")

EMPTY_FLOOR: Mapping[str, Any] = {
    "description": "A floor drawn in the studio",
    "world": {"obstacles": []},
    "start": [0.0, 0.0, 0.0],
    "goal": [5.0, 0.0, 0.0],
}


def snapped(value: float, step_m: float) -> float:
    """Returns a coordinate on the grid of a step, m; a step of 0 keeps it."""
    return round(round(value / step_m) * step_m if step_m else value, DIGITS) + 0.0


class Drawing:
    """A scenario's content with all of its steps.

    content: as YAML gives it; it is replaced, never changed in place.
    """

    def __init__(self, content: Mapping[str, Any]) -> None:
        self.content: dict[str, Any] = deepcopy(dict(content))
        self._saved = self.content
        self._before: list[dict[str, Any]] = []
        self._after: list[dict[str, Any]] = []
        self.version = 0

    @property
    def is_changed(self) -> bool:
        """Whether the content differs from what was opened or saved last."""
        return self.content != self._saved

    def change(self, content: dict[str, Any]) -> None:
        """Makes a step: the content is now another one."""
        if content == self.content:
            return
        self._before = [*self._before[-MAX_UNDO + 1 :], self.content]
        self._after = []
        self._set(content)

    def undo(self) -> bool:
        """Takes a step back; returns whether there was one."""
        if not self._before:
            return False
        self._after.append(self.content)
        self._set(self._before.pop())
        return True

    def redo(self) -> bool:
        """Repeats the step that was undone last; returns whether there was one."""
        if not self._after:
            return False
        self._before.append(self.content)
        self._set(self._after.pop())
        return True

    def note_saved(self) -> None:
        """Notes that the present content is saved."""
        self._saved = self.content

    def _set(self, content: dict[str, Any]) -> None:
        self.content = content
        self.version += 1


def entry_at(content: Mapping[str, Any], place: Place) -> Any:
    """Returns the entry at a place of a content, or the loader's default if it is missing."""
    if place == ("start",):
        return content.get("start", [0.0, 0.0, 0.0])
    found: Any = content
    for part in place:
        found = found[part]
    return found


def list_at(content: Mapping[str, Any], place: Place) -> list[Any]:
    """Returns the list at a place of a scenario's content; an empty list where it has none."""
    try:
        return entry_at(content, place) or []
    except (KeyError, IndexError):
        return []


def with_entry(content: Mapping[str, Any], place: Place, value: Any) -> dict[str, Any]:
    """Returns a content with another value at a place; a missing place is created."""
    changed = deepcopy(dict(content))
    inner: Any = changed
    for part, following in pairwise(place):
        if isinstance(part, str) and inner.get(part) is None:
            inner[part] = [] if isinstance(following, int) else {}
        inner = inner[part]
    last = place[-1]
    if isinstance(last, int) and last == len(inner):
        inner.append(value)
    else:
        inner[last] = value
    return changed


def with_added(content: Mapping[str, Any], place: Place, value: Any) -> dict[str, Any]:
    """Returns a content with a value appended to the list at a place."""
    return with_entry(content, (*place, len(list_at(content, place))), value)


def without(content: Mapping[str, Any], place: Place) -> dict[str, Any]:
    """Returns a content without an entry of a list.

    With its last area a filter is removed, with the last person the people: the loader accepts no
    empty ones. Raises InputError if the entry is required.
    """
    if not isinstance(place[-1], int):
        raise InputError(f"{place[-1]}: a scenario needs it; move it instead")
    changed = deepcopy(dict(content))
    entries = entry_at(changed, place[:-1])
    del entries[place[-1]]
    if not entries and place[-2] == "areas":
        return without(changed, place[:-2])
    if not entries and place[-2] in ("persons", "waypoints", "filters"):
        owner = place[:-2] if place[-2] != "persons" else place[:-3]
        del entry_at(changed, owner)["people" if place[-2] == "persons" else place[-2]]
    return changed


def moved(value: Any, by: Point) -> Any:
    """Returns a thing of a scenario, or a pose, moved by x and y, m."""
    if isinstance(value, list | tuple):
        return _shifted(value, by)
    changed = deepcopy(dict(value))
    for name in POINTS:
        if name in changed:
            changed[name] = _shifted(changed[name], by)
    for name in RINGS:
        if name in changed:
            changed[name] = [_shifted(point, by) for point in changed[name]]
    for entry in changed.get("waypoints", ()):
        entry["position"] = _shifted(entry["position"], by)
    return changed


def _shifted(point: Sequence[float], by: Point) -> list[float]:
    x, y, *others = point
    return [round(x + by[0], DIGITS) + 0.0, round(y + by[1], DIGITS) + 0.0, *others]


def wall(start: Point, end: Point) -> dict[str, Any]:
    """Returns a wall between two points."""
    return {"type": "wall", "start": list(start), "end": list(end)}


def box(one: Point, other: Point) -> dict[str, Any]:
    """Returns a box between two opposite corners."""
    low, high = _ordered(one, other)
    return {"type": "box", "min": low, "max": high}


def cylinder(centre: Point, edge: Point) -> dict[str, Any]:
    """Returns a round pillar by its centre and a point of its edge."""
    radius_m = round(math.dist(centre, edge), DIGITS)
    return {"type": "cylinder", "centre": list(centre), "radius_m": radius_m}


def area(one: Point, other: Point, value: int | None = None) -> dict[str, Any]:
    """Returns an area of a filter, a rectangle; value: of its mask, %; None for the default."""
    (x0, y0), (x1, y1) = _ordered(one, other)
    if x1 - x0 < SHORTEST_M or y1 - y0 < SHORTEST_M:
        raise InputError("an area needs two corners; drag from one to the other")
    corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
    return {"polygon": corners} | ({} if value is None else {"value": value})


def moving_box(at: Point) -> dict[str, Any]:
    """Returns a moving obstacle of a cart's size with its first waypoint only."""
    return {
        "type": "box",
        "size_m": list(CART_M),
        "waypoints": [{"time_s": 0.0, "position": list(at), "yaw_rad": 0.0}],
    }


def moved_on(thing: Mapping[str, Any], to: Point, speed_mps: float) -> dict[str, Any]:
    """Returns a moving obstacle with one more waypoint, driven to at `speed_mps`, facing it."""
    *_, last = way = thing["waypoints"]
    length_m = math.dist(last["position"], to)
    if length_m < ALONG_M:
        return dict(thing)
    x, y = last["position"]
    # Unwrapped, so that the obstacle turns the shorter way.
    before_rad = last.get("yaw_rad", 0.0)
    turn_rad = math.remainder(math.atan2(to[1] - y, to[0] - x) - before_rad, math.tau)
    yaw_rad = round(before_rad + turn_rad, DIGITS)
    start = {**last, "yaw_rad": yaw_rad} if len(way) == 1 else last
    time_s = round(last["time_s"] + length_m / speed_mps, DIGITS)
    end = {"time_s": time_s, "position": list(to), "yaw_rad": yaw_rad}
    return {**thing, "waypoints": [*way[:-1], start, end]}


def with_waypoint(content: Mapping[str, Any], place: Place, at: Sequence[float]) -> dict[str, Any]:
    """Adds a waypoint, and a navigation mode in which Nav2's tree drives through waypoints."""
    changed = with_added(content, place, list(at))
    if content.get("navigation_mode") == "navigate_through_poses":
        return changed
    return with_entry(changed, ("navigation_mode",), "navigate_to_pose")


def pose(at: Point, ahead: Point, before: Sequence[float]) -> list[float]:
    """Returns a pose at `at` that faces `ahead`; if both are equal, it keeps the heading before."""
    dx, dy = ahead[0] - at[0], ahead[1] - at[1]
    yaw_rad = before[2] if math.hypot(dx, dy) < ALONG_M else round(math.atan2(dy, dx), DIGITS)
    return [*at, yaw_rad]


def with_area(
    content: Mapping[str, Any], floor: Place, kind: str, drawn: Mapping[str, Any]
) -> dict[str, Any]:
    """Returns a content with one more area of a filter; a missing filter is created."""
    place = (*floor, "filters")
    for index, entry in enumerate(list_at(content, place)):
        if entry.get("type") == kind and "areas" in entry:
            return with_added(content, (*place, index, "areas"), dict(drawn))
    return with_added(content, place, {"type": kind, "areas": [dict(drawn)]})


def with_door(
    obstacles: Sequence[Mapping[str, Any]], one: Point, other: Point
) -> list[Mapping[str, Any]]:
    """Returns obstacles with a door from one jamb to the other in the wall that lies there.

    The wall becomes two walls with all other fields unchanged. Raises InputError if no wall is
    there.
    """
    middle = (0.5 * (one[0] + other[0]), 0.5 * (one[1] + other[1]))
    nearest = min(
        ((*_offset(line, middle), index) for index, line in _walls(obstacles)),
        default=(math.inf, 0.0, 0),
    )
    if nearest[0] > DOOR_REACH_M:
        raise InputError("a door needs a wall; drag along one, from jamb to jamb")
    index = nearest[2]
    start, end = dict(_walls(obstacles))[index]
    length_m = math.dist(start, end)
    ends = sorted(min(max(_offset((start, end), p)[1], 0.0), length_m) for p in (one, other))
    if ends[1] - ends[0] < SHORTEST_M:
        raise InputError("a door needs a width; drag along the wall, from jamb to jamb")
    parts = [
        _part(obstacles[index], (start, end), begin, stop)
        for begin, stop in ((0.0, ends[0]), (ends[1], length_m))
        if stop - begin >= SHORTEST_M
    ]
    return [*obstacles[:index], *parts, *obstacles[index + 1 :]]


Line = tuple[Point, Point]


def _walls(obstacles: Sequence[Mapping[str, Any]]) -> list[tuple[int, Line]]:
    """Returns the centre lines of walls, and of boxes that are as thin as walls, by index."""
    lines: list[tuple[int, Line]] = []
    for index, entry in enumerate(obstacles):
        if entry["type"] == "wall":
            lines.append((index, (_xy(entry["start"]), _xy(entry["end"]))))
        elif entry["type"] == "box":
            (x0, y0), (x1, y1) = entry["min"], entry["max"]
            if min(x1 - x0, y1 - y0) > THICKEST_WALL_M:
                continue
            x, y = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
            is_wide = x1 - x0 > y1 - y0
            lines.append((index, ((x0, y), (x1, y)) if is_wide else ((x, y0), (x, y1))))
    return lines


def _offset(line: Line, point: Point) -> tuple[float, float]:
    """Returns a point's distance from a line's segment, and its distance along the line, m."""
    (x0, y0), (x1, y1) = line
    length_m = math.dist(*line)
    ux, uy = (x1 - x0) / length_m, (y1 - y0) / length_m
    along_m = (point[0] - x0) * ux + (point[1] - y0) * uy
    held_m = min(max(along_m, 0.0), length_m)
    return math.dist(point, (x0 + held_m * ux, y0 + held_m * uy)), along_m


def _part(entry: Mapping[str, Any], line: Line, begin: float, stop: float) -> dict[str, Any]:
    """Returns the part of a wall or thin box between two distances along its centre line, m."""
    (x0, y0), (x1, y1) = line
    length_m = math.dist(*line)
    ends = [
        [round(a + s / length_m * (b - a), DIGITS) for a, b in ((x0, x1), (y0, y1))]
        for s in (begin, stop)
    ]
    if entry["type"] == "wall":
        return {**entry, "start": ends[0], "end": ends[1]}
    axis = 0 if x1 - x0 > y1 - y0 else 1
    low, high = list(entry["min"]), list(entry["max"])
    low[axis], high[axis] = ends[0][axis], ends[1][axis]
    return {**entry, "min": low, "max": high}


def _xy(point: Sequence[float]) -> Point:
    return float(point[0]), float(point[1])


def _ordered(one: Point, other: Point) -> tuple[list[float], list[float]]:
    return list(map(min, one, other)), list(map(max, one, other))
