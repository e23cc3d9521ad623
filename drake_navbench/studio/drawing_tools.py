"""The tools of the page Scenario: a drag or click becomes another content of the scenario."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from drake_navbench.studio import drawing
from drake_navbench.studio.drawing import (
    Place,
    Point,
    entry_at,
    list_at,
    with_added,
    with_entry,
)

LOOK, MOVE, PERSON, MOVING = "View", "Move", "Person", "Cart"
HINTS = {
    MOVE: "Click a thing to edit or delete it, drag it to move it.",
    "Wall": "Drag from one end to the other.",
    "Box": "Drag from corner to corner.",
    "Cylinder": "Drag from the centre outwards.",
    "Door": "Drag along a wall, from jamb to jamb.",
    PERSON: "Click the start, then each goal; the last one once more ends the way.",
    MOVING: "Click the start, then each turn; the last one once more ends the way.",
    "Start": "Drag from the place towards the heading.",
    "Waypoint": "Drag from the place towards the heading. Passed before the goal, in order.",
    "Goal": "Drag from the place towards the heading.",
    "Keepout": "Drag from corner to corner: an area that plans must not enter.",
    "Speed zone": "Drag from corner to corner. In it the robot is limited to Zone % of its speed.",
    LOOK: "Drag to move the view, wheel to zoom.",
}
TOOLS = list(HINTS)
OF_POSES = ("Start", "Waypoint", "Goal")
OF_WAYS = (PERSON, MOVING)
SHAPES: Mapping[str, Callable[[Point, Point], dict[str, Any]]] = {
    "Wall": drawing.wall,
    "Box": drawing.box,
    "Cylinder": drawing.cylinder,
}


class Hold(NamedTuple):
    """The drawing tool that is selected, with its settings.

    name: a name of TOOLS. floor: see OpenScenario. percent: percentage of a speed zone. speed_mps:
    speed of a moving obstacle. picked: the thing that is moved.
    """

    name: str
    floor: Place
    percent: int
    speed_mps: float
    picked: Place | None = None


def dragged(content: Mapping[str, Any], hold: Hold, one: Point, other: Point) -> Mapping[str, Any]:
    """Returns the content after a drag between two points; raises InputError."""
    tool, floor = hold.name, hold.floor
    obstacles: Place = (*floor, "world", "obstacles")
    if tool in SHAPES:
        return with_added(content, obstacles, SHAPES[tool](one, other))
    if tool == "Door":
        walls = list_at(content, obstacles)
        return with_entry(content, obstacles, drawing.with_door(walls, one, other))
    if tool == "Keepout":
        return drawing.with_area(content, floor, "keepout", drawing.area(one, other))
    if tool == "Speed zone":
        zone = drawing.area(one, other, hold.percent)
        return drawing.with_area(content, floor, "speed_percent", zone)
    if tool == "Waypoint":
        at = drawing.pose(one, other, [0.0, 0.0, 0.0])
        return drawing.with_waypoint(content, (*floor, "waypoints"), at)
    if tool in OF_POSES:
        place = tool.lower()
        at = drawing.pose(one, other, entry_at(content, (place,)))
        return with_entry(content, (place,), at)
    if tool == MOVE and hold.picked is not None:
        by = (other[0] - one[0], other[1] - one[1])
        return with_entry(content, hold.picked, drawing.moved(entry_at(content, hold.picked), by))
    return content


def with_way(
    content: Mapping[str, Any], hold: Hold, point: Point, *, goes_on: bool
) -> Mapping[str, Any]:
    """Returns the content after a click on a way of a person or a moving obstacle.

    goes_on: whether the click continues the way drawn last; else it begins another one.
    """
    is_person = hold.name == PERSON
    parts = ("people", "persons") if is_person else ("moving_obstacles",)
    place: Place = (*hold.floor, "world", *parts)
    movers = list_at(content, place)
    if not goes_on or not movers:
        begun = {"start": list(point), "goals": []} if is_person else drawing.moving_box(point)
        return with_added(content, place, begun)
    last: Place = (*place, len(movers) - 1)
    if not is_person:
        return with_entry(content, last, drawing.moved_on(movers[-1], point, hold.speed_mps))
    goals = list_at(content, (*last, "goals"))
    if list(point) == (goals or [movers[-1]["start"]])[-1]:
        return content
    return with_added(content, (*last, "goals"), list(point))
