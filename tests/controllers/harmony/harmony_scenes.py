"""Programs of one cycle that the tests of harmony share."""

from __future__ import annotations

import numpy as np

from drake_navbench.controllers.harmony.motion import V, plan_of_velocities
from drake_navbench.controllers.harmony.parameters import HarmonyParameters
from drake_navbench.controllers.harmony.planner import Planner
from drake_navbench.controllers.harmony.scene import (
    Scene,
    make_start,
    references_along,
)
from drake_navbench.controllers.harmony.way import way_along
from drake_navbench.kernels.distance_field import distance_field
from drake_navbench.kernels.grid import LETHAL, Costmap
from drake_navbench.kernels.read_only import read_only

# The wheelchair's discs by hand: 1.12 m long, four parts of 0.28 m, half of it wide 0.31 m.
DISCS = np.array([[-0.12, 0.341], [0.16, 0.341], [0.44, 0.341], [0.72, 0.341]])
WINDOW = 20


def costmap_with(*boxes) -> Costmap:
    """A map from -3 to 3 m; a box is (x0, y0, x1, y1) m."""
    costs = np.zeros((120, 120), dtype=np.uint8)
    for x0, y0, x1, y1 in boxes:
        first, last = round((x0 + 3.0) / 0.05), round((x1 + 3.0) / 0.05)
        costs[round((y0 + 3.0) / 0.05) : round((y1 + 3.0) / 0.05), first:last] = LETHAL
    return Costmap(costs, -3.0, -3.0, 0.05)


def straight(length_m=2.5, y_m=0.0):
    """A path (P, 3) along x."""
    x = np.arange(0.0, length_m + 1e-9, 0.05)
    return np.column_stack([x, np.full_like(x, y_m), np.zeros_like(x)])


def arc(radius_m=0.8, angle=2.0):
    """A path (P, 3) along a circle to the left."""
    angles = np.linspace(0.0, angle, 40)
    return np.column_stack([radius_m * np.sin(angles), radius_m * (1.0 - np.cos(angles)), angles])


def problem(
    *,
    path=None,
    boxes=(),
    start=(0.0, 0.0, 0.0),
    speed=0.3,
    turn_rate=0.0,
    goal=None,
    weights=None,
    **parameters,
) -> tuple[Scene, np.ndarray]:
    """Returns a program and a guess: the way straight on, slowing down to rest.

    weights: of terms, the others are as they come. goal: (3,), where not beyond the path.
    """
    path = straight() if path is None else path
    settings = HarmonyParameters(weights=weights or {}, **parameters)
    planner = Planner(settings, read_only(DISCS))
    first = make_start(np.array(start), speed, turn_rate)
    limits = planner.limits(settings.max_vel_x)
    field = distance_field(costmap_with(*boxes))
    goal = np.array([10.0, 0.0, 0.0]) if goal is None else np.asarray(goal, dtype=float)
    way = way_along(path, goal, limits.forward_speed * settings.horizon, field, DISCS)
    scene = planner.scene(first, way, field, limits)
    velocities = np.zeros((planner.stage_count, 2))
    velocities[:, 0] = np.clip(speed * np.linspace(1.5, 0.0, planner.stage_count), 0.0, speed)
    guess = plan_of_velocities(velocities, scene.dt, first)
    assert guess[0, V] == speed
    return scene._replace(references=references_along(scene, way.path, guess, WINDOW)), guess
