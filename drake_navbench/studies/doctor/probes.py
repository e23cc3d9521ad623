"""Probes: short drives made for a robot's outline, each for symptoms of its own.

Distances follow from the outline's half width and radii, and from the speed that the file asks for,
so that a sound file has time for each within 20 s. Every probe has pose noise and a varied start,
so that seeds differ; the rough ones have a late base, late measurements and more noise besides.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from drake_navbench.inputs.overrides import merged
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.kernels.footprint import footprint_radii
from drake_navbench.studies.doctor.surroundings import Surroundings, tasks_on_map
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.typed_files.typed_yaml import validate

LONGEST_S = 20.0
WALL_M = 0.1
# A door is passable if it is wider than the robot by this, m.
DOOR_ROOM_M = 0.2
CORRIDOR_ROOM_M = 0.8
# Noise of the localization in all probes: each seed is another drive.
NOISE = {"xy_std_m": 0.005, "yaw_std_rad": 0.005}
ROUGH_NOISE = {"xy_std_m": 0.015, "yaw_std_rad": 0.015}
ROUGH_TIMING = {"command_latency_s": 0.12, "odometry_latency_s": 0.06, "command_jitter_s": 0.03}
VARIATION = {"start_xy_std_m": 0.03, "start_yaw_std_rad": 0.05}
# The variation of the start beside a wall.
LITTLE_VARIATION = {"start_xy_std_m": 0.01, "start_yaw_std_rad": 0.02}
# The probes that also have a rough form.
ROUGH = ("straight", "bends", "exact_heading", "door")

Fields = dict[str, Any]


@dataclass(frozen=True)
class Size:
    """Dimensions of the robot that probes depend on: half width, outer radius about the base, reach
    ahead and behind, m, and the speed that the file asks for, m/s."""

    half_width_m: float
    outer_m: float
    front_m: float
    rear_m: float
    speed_mps: float

    @property
    def way_m(self) -> float:
        """A way that takes about 9 s."""
        return min(max(9.0 * self.speed_mps, 1.5), 5.0)


def size_of(robot: Robot, speed_mps: float) -> Size:
    """Returns the size that probes are made for: the true outline's, where it is known."""
    outer = robot.radii[1]
    outline = robot.collision_outline or robot.footprint
    if robot.collision_outline is not None:
        outer = footprint_radii(robot.outline)[1]
    elif robot.is_circle or outline is None:
        return Size(outer, outer, outer, outer, speed_mps or 0.3)
    assert outline is not None
    xs, ys = zip(*outline, strict=True)
    half = max(abs(y) for y in ys)
    return Size(half, outer, max(xs), -min(xs), speed_mps or 0.3)


def _box(x0: float, y0: float, x1: float, y1: float, *, known: bool = True) -> Fields:
    shape: Fields = {"type": "box", "min": [x0, y0], "max": [x1, y1]}
    return shape if known else shape | {"known_to_planner": False}


def _straight(s: Size) -> Fields:
    return {
        "goal": [s.way_m, 0.0, 0.0],
        "plan": {"type": "elements", "elements": [{"straight_m": s.way_m}]},
    }


def _bends(s: Size) -> Fields:
    radius, piece = max(0.6, 0.5 * s.way_m / 2.6), 0.2 * s.way_m
    arc = {"arc_deg": 60.0, "radius_m": radius}
    elements = [{"straight_m": piece}, arc, arc | {"arc_deg": -60.0}, {"straight_m": piece}]
    sine, cosine = 0.8660254, 0.5
    x, y = 2 * piece + 2 * radius * sine, 2 * radius * (1.0 - cosine)
    return {
        "goal": [round(x, 3), round(y, 3), 0.0],
        "plan": {"type": "elements", "elements": elements},
    }


def _right_angle(s: Size) -> Fields:
    lane = 2.0 * s.outer_m + 0.5
    leg = max(0.5 * s.way_m, s.outer_m + 0.6)
    inner = leg - 0.5 * lane
    return {
        "world": {
            "obstacles": [
                _box(-s.outer_m - 0.6, 0.5 * lane, inner, 0.5 * lane + 2.0 * leg),
                _box(-s.outer_m - 0.6, -0.5 * lane - WALL_M, leg + lane, -0.5 * lane),
                _box(
                    leg + 0.5 * lane, -0.5 * lane, leg + 0.5 * lane + WALL_M, 0.5 * lane + 2 * leg
                ),
            ]
        },
        "goal": [leg, leg, 1.5708],
    }


def _goal_behind(s: Size) -> Fields:
    return {"goal": [-0.5 * s.way_m, 0.3, 3.1416]}


def _goal_beside_wall(s: Size) -> Fields:
    wall = s.half_width_m + 0.2
    return {
        "world": {"obstacles": [_box(0.5 * s.way_m, wall, s.way_m + 2.0, wall + WALL_M)]},
        "start": [0.0, -0.4, 0.0],
        "goal": [s.way_m, 0.0, 0.0],
    }


def _exact_heading(s: Size) -> Fields:
    return {"goal": [0.5 * s.way_m, 0.2, 1.5708]}


def _door(s: Size) -> Fields:
    at, half = 0.5 * s.way_m, s.half_width_m + 0.5 * DOOR_ROOM_M
    side = s.outer_m + 1.2
    return {
        "world": {
            "obstacles": [_box(at, half, at + WALL_M, side), _box(at, -side, at + WALL_M, -half)]
        },
        "start": [min(0.0, at - s.front_m - 0.5), -0.2, 0.0],
        "goal": [s.way_m + s.rear_m, 0.2, 0.0],
    }


def _corridor(s: Size) -> Fields:
    half = s.half_width_m + 0.5 * CORRIDOR_ROOM_M
    x0, x1 = -s.outer_m - 0.5, s.way_m + s.outer_m + 0.5
    return {
        "world": {
            "obstacles": [_box(x0, half, x1, half + WALL_M), _box(x0, -half - WALL_M, x1, -half)]
        },
        "goal": [s.way_m, 0.0, 0.0],
    }


def _box_on_path(s: Size) -> Fields:
    at = s.front_m + 0.45 * s.way_m
    return {
        "world": {"obstacles": [_box(at, -0.1, at + 0.3, 0.2, known=False)]},
        "goal": [at + 0.3 + s.rear_m + 0.5 * s.way_m, 0.0, 0.0],
        "navigation_mode": "navigate_to_pose",
    }


def _dead_end(s: Size) -> Fields:
    half = s.half_width_m + 0.25
    end = s.front_m + 0.25
    return {
        "world": {
            "obstacles": [
                _box(0.0, half, end + WALL_M, half + WALL_M),
                _box(0.0, -half - WALL_M, end + WALL_M, -half),
                _box(end, -half, end + WALL_M, half),
            ]
        },
        "goal": [-max(0.4 * s.way_m, s.outer_m + 0.8), 0.6, 3.1416],
        "navigation_mode": "navigate_to_pose",
        "variation": LITTLE_VARIATION,
    }


def _closed_way(s: Size) -> Fields:
    ahead, side, behind = s.front_m + 0.75, s.outer_m + 0.4, -s.outer_m - 0.4
    return {
        "world": {
            "obstacles": [
                _box(ahead, -side, ahead + WALL_M, side, known=False),
                _box(behind - WALL_M, -side, behind, side, known=False),
                _box(behind, side, ahead, side + WALL_M, known=False),
                _box(behind, -side - WALL_M, ahead, -side, known=False),
            ]
        },
        "goal": [ahead + max(s.way_m, 2.0), 0.0, 0.0],
        "plan": {"type": "elements", "elements": [{"straight_m": ahead + max(s.way_m, 2.0)}]},
        "expected_outcome": "aborted",
    }


def _beside_obstacle(s: Size) -> Fields:
    near = s.front_m + 0.15
    return {
        "world": {"obstacles": [_box(near, -0.3, near + 0.4, 0.3)]},
        "goal": [0.0, s.outer_m + 0.5 * s.way_m, 1.5708],
        "navigation_mode": "navigate_to_pose",
        "variation": LITTLE_VARIATION,
    }


def _person_crossing(s: Size) -> Fields:
    at = s.front_m + 0.5 * s.way_m
    # The person steps onto the path while the robot is 1.2 m away, and stays. One who walked on
    # would walk into a robot that goes around, and no file could prevent that.
    stops_s = max((at - s.front_m - 1.2) / max(s.speed_mps, 0.1), 0.0) + 1.0
    walker = {
        "type": "cylinder",
        "name": "person",
        "radius_m": 0.25,
        "waypoints": [
            {"time_s": max(stops_s - 4.0, 0.0), "position": [at, -2.0]},
            {"time_s": stops_s, "position": [at, -0.1]},
        ],
    }
    return {
        "world": {"moving_obstacles": [walker]},
        "goal": [at + 0.4 * s.way_m, 0.0, 0.0],
        "navigation_mode": "navigate_to_pose",
    }


def _slow_zone(s: Size) -> Fields:
    area = [
        [0.3 * s.way_m, -1.0],
        [0.6 * s.way_m, -1.0],
        [0.6 * s.way_m, 1.0],
        [0.3 * s.way_m, 1.0],
    ]
    return _straight(s) | {
        "filters": [{"type": "speed_percent", "areas": [{"polygon": area, "value": 50}]}]
    }


MAKERS: Mapping[str, tuple[str, Callable[[Size], Fields]]] = {
    "straight": ("straight ahead, no obstacle near", _straight),
    "bends": ("two bends of 60 degrees", _bends),
    "right_angle": ("a right angle between walls", _right_angle),
    "goal_behind": ("the goal behind the robot", _goal_behind),
    "goal_beside_wall": ("the goal beside a wall", _goal_beside_wall),
    "exact_heading": ("a quarter turn at the goal", _exact_heading),
    "door": ("a door 0.2 m wider than the robot", _door),
    "corridor": ("a corridor", _corridor),
    "box_on_path": ("a box on the path that the planner does not know", _box_on_path),
    "dead_end": ("out of a dead end", _dead_end),
    "closed_way": ("a closed way: the robot must stop without a touch", _closed_way),
    "beside_obstacle": ("a start in front of an obstacle", _beside_obstacle),
    "person_crossing": ("a person steps onto the path and stays", _person_crossing),
    "slow_zone": ("through a zone of half speed", _slow_zone),
}


# A symptom that the probes show is treated in these probes, which were made for it.
MADE_FOR: Mapping[Symptom, tuple[str, ...]] = {
    Symptom.CORNER_CUTTING: ("bends", "bends_rough", "right_angle"),
    Symptom.DOOR_STOP: ("door", "door_rough", "corridor", "right_angle"),
    Symptom.GOAL_NOT_REACHED: ("exact_heading", "exact_heading_rough", "goal_beside_wall"),
    Symptom.GOAL_OSCILLATION: (
        "exact_heading",
        "exact_heading_rough",
        "straight",
        "straight_rough",
    ),
    Symptom.GOAL_OVERSHOOT: ("exact_heading", "exact_heading_rough", "straight", "straight_rough"),
    Symptom.NO_RECOVERY: ("beside_obstacle", "dead_end", "box_on_path"),
    Symptom.NO_TURNING: ("goal_behind", "exact_heading"),
    Symptom.REVERSE_FAILURE: ("goal_behind", "straight"),
    Symptom.STALL_BEFORE_GOAL: ("straight", "straight_rough", "exact_heading", "goal_beside_wall"),
    Symptom.TOO_SLOW: ("straight", "straight_rough", "bends"),
    Symptom.WOBBLE_STRAIGHT: ("straight", "straight_rough", "corridor"),
}


# A touch shows where there is something to touch.
BESIDE_SOMETHING = (
    *("door", "right_angle", "corridor", "box_on_path", "goal_beside_wall", "dead_end"),
    *("beside_obstacle", "person_crossing", "door_rough", "closed_way"),
)
NEAR = {**MADE_FOR, **dict.fromkeys((Symptom.COLLISION, Symptom.NEAR_MISS), BESIDE_SOMETHING)}


def nearest_first(names: Iterable[str], symptoms: Iterable[Symptom]) -> list[str]:
    """Returns names of probes: those that may show the symptoms first, then the user's map."""
    near = list(dict.fromkeys(name for symptom in symptoms for name in NEAR.get(symptom, ())))
    places = {name: place for place, name in enumerate(near)}
    # Stable: the others stay in their order.
    return sorted(names, key=lambda n: (places.get(n, len(near)), not n.startswith("map_")))


def probes_for(
    robot: Robot, speed_mps: float, around: Surroundings | None = None, *, seed: int = 0
) -> dict[str, Scenario]:
    """Returns the probes for a robot, by name; the rough ones are called `straight_rough`.

    Tasks on the user's map are called `map_1` and so on, and are drawn by the seed. Raises
    InputError where the map has no room for them.
    """
    around = around or Surroundings()
    found = _made_for(size_of(robot, speed_mps), robot, around.overrides)
    return found | tasks_on_map(robot, around, found["straight"], LITTLE_VARIATION, seed=seed)


def _made_for(size: Size, robot: Robot, overrides: Mapping[str, Any]) -> dict[str, Scenario]:
    has_filter = "speed_filter" in (*robot.navigation.local_costmap.filters,)
    found: dict[str, Scenario] = {}
    for name, (about, make) in MAKERS.items():
        if name == "slow_zone" and not has_filter:
            continue
        fields = {
            "description": about,
            "timeout_s": LONGEST_S,
            "variation": VARIATION,
            "robot_overrides": merged({"localization": NOISE}, overrides),
        } | make(size)
        found[name] = _scenario(name, fields)
        if name in ROUGH:
            rough = merged({"localization": ROUGH_NOISE, "timing": ROUGH_TIMING}, overrides)
            fields = fields | {
                "description": f"{about}, with a late base and more pose noise",
                "robot_overrides": rough,
            }
            found[f"{name}_rough"] = _scenario(f"{name}_rough", fields)
    return found


def _scenario(name: str, fields: Fields) -> Scenario:
    return validate(Scenario, fields | {"name": f"probe_{name}"}, f"probe {name}")
