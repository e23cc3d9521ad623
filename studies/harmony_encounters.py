"""Trials in which somebody walks straight on to where the robot will be, in an empty world.

python studies/harmony_encounters.py prints the robot's speed when they meet, for each direction
from which they come: with Nav2's costmap as it is and with one that beams without a hit clear, with
and without harmony's tracking.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from drake_navbench import run_trial
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.log import Outcome, TrialLog

# Nav2's obstacle layer is not cleared by beams that hit nothing, unless a source says so.
SCAN = {"clearing": True, "max_obstacle_height": 2.0, "obstacle_max_range": 2.95}
LAYERS = {
    "as it is": {},
    "inf_is_valid": {"observation_sources": {"scan": SCAN | {"inf_is_valid": True}}},
}
COLUMNS = ("harmony", "harmony:track_moving=true")
DIRECTIONS, WALKING_MPS = 8, (1.0, 1.4)
SPEED_MPS, MEET_S, WALKS_ON_S, RADIUS_M = 0.5, 5.0, 6.0, 0.25
# The robot loses this way while it speeds up; its middle is that far ahead of its axle, m.
START_LOSS_M, MIDDLE_M = 0.35, 0.3


def encounter(
    bearing_rad: float, walking_mps: float, layer: Mapping[str, Any] = MappingProxyType({})
) -> Scenario:
    """Returns a drive straight ahead that somebody crosses.

    bearing_rad: of the side that they come from, off the robot's heading. layer: fields of the
    local costmap's obstacle layer.
    """
    meeting = np.array([SPEED_MPS * MEET_S - START_LOSS_M + MIDDLE_M, 0.0])
    whence = np.array([math.cos(bearing_rad), math.sin(bearing_rad)])
    places = {
        0.0: meeting + walking_mps * MEET_S * whence,
        MEET_S + WALKS_ON_S: meeting - walking_mps * WALKS_ON_S * whence,
    }
    waypoints = [{"time_s": time_s, "position": list(at)} for time_s, at in places.items()]
    person = {"type": "cylinder", "radius_m": RADIUS_M, "height_m": 1.7, "waypoints": waypoints}
    return Scenario(
        name="encounter",
        description="somebody walks on to where the robot will be",
        world={"moving_obstacles": [person]},
        plan={"type": "polyline", "points": [[0.0, 0.0], [7.0, 0.0]]},
        goal=(7.0, 0.0, 0.0),
        timeout_s=60.0,
        robot_overrides={"navigation": {"local_costmap": {"obstacle_layer": dict(layer)}}},
    )


def told(log: TrialLog) -> str:
    """Returns the speed at contact in m/s, or the outcome of a trial without one."""
    if log.outcome is Outcome.COLLIDED:
        return f"{abs(log.samples['v_mps'].iloc[-1]):.2f}"
    return log.outcome.value


def speeds_of(column: str, walking_mps: float, layer: Mapping[str, Any]) -> list[str]:
    """Returns `told` of the trials from all directions, from behind on around the robot."""
    bearings = [2.0 * math.pi * (k + 0.5) / DIRECTIONS - math.pi for k in range(DIRECTIONS)]
    return [
        told(run_trial(encounter(bearing, walking_mps, layer), column, seed=k))
        for k, bearing in enumerate(bearings)
    ]


def main() -> None:
    """Prints a line for each costmap, column and walking speed."""
    for name, layer in LAYERS.items():
        for column in COLUMNS:
            for walking_mps in WALKING_MPS:
                speeds = ", ".join(speeds_of(column, walking_mps, layer))
                print(f"costmap {name}, {column}, walking {walking_mps:g} m/s: {speeds}")


if __name__ == "__main__":
    main()
