"""Random worlds: boxes of random size and place between two walls, on the way to a random goal.

A world is a function of its number. No world is looked at before it is driven, so that a controller
that touches an obstacle in one of many worlds has no rule that keeps it off obstacles.
"""

from __future__ import annotations

import numpy as np

from drake_navbench.inputs.scenario import Scenario
from drake_navbench.typed_files.typed_yaml import validate

SUITE = "random worlds"
BOXES = 6
# The corners of the boxes' area: between the walls, past the start and in front of the goal, m.
LOWEST_CORNER, HIGHEST_CORNER = (1.3, -2.4), (6.4, 1.9)
SMALLEST_SIDE_M, LARGEST_SIDE_M = 0.15, 0.6
WALLS_AT_M, HALF_WALL_M = 2.6, 0.1
WALLS_FROM_M, WALLS_TO_M = -1.5, 9.5
GOAL_X_M, GOAL_Y_M = 8.0, 1.2
TIMEOUT_S = 60.0


def random_world(number: int) -> Scenario:
    """Returns the world of a number; in some of them the robot may find no way."""
    random = np.random.default_rng(number)
    obstacles = [
        {
            "type": "box",
            "min": [WALLS_FROM_M, side - HALF_WALL_M],
            "max": [WALLS_TO_M, side + HALF_WALL_M],
        }
        for side in (-WALLS_AT_M, WALLS_AT_M)
    ]
    for _ in range(BOXES):
        low = random.uniform(LOWEST_CORNER, HIGHEST_CORNER)
        high = low + random.uniform(SMALLEST_SIDE_M, LARGEST_SIDE_M, 2)
        obstacles.append(
            {"type": "box", "min": low.round(3).tolist(), "max": high.round(3).tolist()}
        )
    name = f"random_world_{number}"
    data = {
        "description": f"Random world {number}: {BOXES} boxes between two walls",
        "world": {"obstacles": obstacles},
        "goal": [GOAL_X_M, round(float(random.uniform(-GOAL_Y_M, GOAL_Y_M)), 3), 0.0],
        "timeout_s": TIMEOUT_S,
        "suite": {"name": SUITE},
        "name": name,
    }
    return validate(Scenario, data, name)
