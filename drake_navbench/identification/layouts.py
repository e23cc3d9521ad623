"""The published scenarios with other dimensions: nobody knows those of the originals.

Each layout is a function of a few lengths and angles; at the shipped ones it gives the scenario as
it is shipped.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.typed_files.typed_yaml import validate

Values = Mapping[str, float]
Fields = dict[str, Any]

WALL_M = 0.125
# Of the boxes that the restricted scenarios are closed by: how far the walls are, and where behind
# them the goal lies, seen from the start.
SMALL_BOX = {"front_m": 1.605, "back_m": 0.805, "side_m": 1.225, "bearing_deg": 0.0}
LARGE_BOX = {"front_m": 4.755, "back_m": 3.175, "side_m": 3.175, "bearing_deg": 0.0}
GOAL_BEHIND_WALL_M = 8.8
CORNER = {"leg_m": 8.342, "clearance_m": 1.225, "bevel_m": 1.19}
# The edge of the keepout lies beside the plan that it makes by this much.
KEEPOUT_OFFSET_M = 0.032
# The axle's cell may not be in the keepout.
KEEPOUT_START_M = 0.04
SLALOM = {
    "bend_deg": 45.0,
    "radius_m": 0.7,
    "straight_ratio": 1.0,
    "passage_half_width_m": 0.66,
    "clearance_ratio": 1.0,
}
SLALOM_STRAIGHTS_M = (2.7, 1.2, 1.4, 2.1, 0.8, 1.2, 2.65)
SLALOM_TURNS = (1.0, -1.0, -1.0, 1.0, 1.0, -1.0)
MILLIMETRE_DIGITS = 3


class Layout(NamedTuple):
    """shipped: the dimensions of the shipped scenario. build: from dimensions to its fields."""

    shipped: dict[str, float]
    build: Callable[[Values], Fields]


def with_layout(scenario: Scenario, values: Values) -> Scenario:
    """Returns a published scenario with other dimensions; raises InputError.

    values: by name, of those in `LAYOUTS`; those not given are the shipped ones.
    """
    if not values:
        return scenario
    layout = layout_of(scenario.name)
    for name in values:
        if name not in layout.shipped:
            hint = nearest_name_hint(name, layout.shipped)
            raise InputError(f"layout of {scenario.name}: {name!r} is not a dimension{hint}")
    dimensions = layout.shipped | dict(values)
    if dimensions == layout.shipped:
        return scenario
    data = scenario.model_dump(mode="json", exclude_unset=True) | layout.build(dimensions)
    source = f"layout of {scenario.name}"
    changed = validate(Scenario, {**data, "name": ""}, source)
    return changed.model_copy(update={"name": scenario.name, "directory": scenario.directory})


def layout_of(scenario: str) -> Layout:
    """Returns a scenario's layout; raises InputError where it has none."""
    if scenario not in LAYOUTS:
        hint = nearest_name_hint(scenario, LAYOUTS)
        raise InputError(f"layouts: {scenario!r} has no layout that can be varied{hint}")
    return LAYOUTS[scenario]


def _empty(values: Values) -> Fields:
    return {"goal": [values["goal_m"], 0.0, 0.0]}


def _closed_box(values: Values) -> Fields:
    """Four walls around the start, given by their faces, and a goal behind them."""
    bearing_rad = math.radians(values["bearing_deg"])
    goal_x = GOAL_BEHIND_WALL_M * math.cos(bearing_rad)
    goal_y = GOAL_BEHIND_WALL_M * math.sin(bearing_rad)
    front, back, side = values["front_m"], values["back_m"], values["side_m"]
    left, right = -back - WALL_M, front + WALL_M
    outside = side + WALL_M
    walls = (
        ((front, -outside), (right, outside)),
        ((left, -outside), (-back, outside)),
        ((left, side), (right, outside)),
        ((left, -outside), (right, -side)),
    )
    return {
        "world": {"obstacles": [_box(*wall) | {"known_to_planner": False} for wall in walls]},
        "goal": [goal_x, goal_y, bearing_rad],
    }


def _corner(values: Values) -> Fields:
    """One box inside a bend; a keepout whose corner is cut off makes the planner's two bends."""
    leg, clearance, bevel = values["leg_m"], values["clearance_m"], values["bevel_m"]
    edge = leg - KEEPOUT_OFFSET_M
    far = leg + 1.0
    area = [
        [-1.2, KEEPOUT_START_M],
        [edge - bevel, KEEPOUT_START_M],
        [edge, KEEPOUT_START_M + bevel],
        [edge, far + 0.16],
        [-1.2, far + 0.16],
    ]
    return {
        "world": {"obstacles": [_box((-1.0, clearance), (leg - clearance, far))]},
        "goal": [leg, leg, round(math.pi / 2.0, 4)],
        "filters": [{"type": "keepout", "areas": [{"polygon": [_rounded(p) for p in area]}]}],
    }


def _slalom(values: Values) -> Fields:
    """Six bends; the obstacles keep their place beside the straights that lie along x."""
    straights = [values["straight_ratio"] * length for length in SLALOM_STRAIGHTS_M]
    bend_rad, radius = math.radians(values["bend_deg"]), values["radius_m"]
    starts = [(0.0, 0.0)]
    elements: list[Fields] = []
    x, y, yaw = 0.0, 0.0, 0.0
    for length, turn in zip(straights, (*SLALOM_TURNS, 0.0), strict=True):
        x, y = x + length * math.cos(yaw), y + length * math.sin(yaw)
        elements.append({"straight_m": round(length, MILLIMETRE_DIGITS)})
        if turn:
            after = yaw + turn * bend_rad
            x += turn * radius * (math.sin(after) - math.sin(yaw))
            y -= turn * radius * (math.cos(after) - math.cos(yaw))
            yaw = after
            elements.append({"arc_deg": turn * values["bend_deg"], "radius_m": radius})
            starts.append((x, y))
    far = values["clearance_ratio"]
    half = values["passage_half_width_m"]
    (passage_x, passage_y), (dip_x, dip_y), (end_x, end_y) = starts[2], starts[4], starts[6]
    middle = dip_x + 0.5 * straights[4]
    boxes = [
        _box((passage_x + 0.6, passage_y - half - 0.5), (passage_x + 1.2, passage_y - half)),
        _box((passage_x + 0.6, passage_y + half), (passage_x + 1.2, passage_y + half + 0.54)),
        _box((middle - 0.3, dip_y + 1.15 * far), (middle + 0.3, dip_y + 1.15 * far + 0.45)),
        _box((middle - 1.6, dip_y - 1.1 * far - 0.3), (middle + 1.6, dip_y - 1.1 * far)),
        _box((-0.8, -1.1 * far - 0.3), (2.4, -1.1 * far)),
        _box((-0.8, 1.15 * far), (2.0, 1.15 * far + 0.25)),
        _box((end_x + 0.2, end_y - 1.1 * far - 0.3), (end_x + 3.45, end_y - 1.1 * far)),
        _box((end_x + 0.4, end_y + 1.15 * far), (end_x + 3.45, end_y + 1.15 * far + 0.25)),
    ]
    return {
        "world": {"obstacles": boxes},
        "goal": _rounded((x, y, 0.0)),
        "plan": {"type": "elements", "elements": elements},
    }


def _box(low: Sequence[float], high: Sequence[float]) -> Fields:
    return {"type": "box", "min": _rounded(low), "max": _rounded(high)}


def _rounded(numbers: Sequence[float]) -> list[float]:
    return [round(number, MILLIMETRE_DIGITS) for number in numbers]


LAYOUTS: dict[str, Layout] = {
    "empty": Layout({"goal_m": 7.5}, _empty),
    "static_obstacles": Layout(SLALOM, _slalom),
    "one_obstacle": Layout(CORNER, _corner),
    "restricted_small": Layout(SMALL_BOX, _closed_box),
    "restricted_large": Layout(LARGE_BOX, _closed_box),
}
