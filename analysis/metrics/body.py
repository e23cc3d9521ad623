"""The robot of a log as a body: its outline, and the quantities that its energy depends on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drake_navbench.analysis.metrics.definition import Undefined
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.footprint import circle_footprint
from drake_navbench.logs.log import TrialLog

# The ratio of tyres on a hard floor, for logs without the robot's own value.
ROLLING_RESISTANCE_RATIO = 0.015


class Body(NamedTuple):
    """The robot's physical quantities from which the energy of its motion is computed.

    mass_kg: with the load. gyration_squared_m2: yaw inertia per mass. drag_area_m2: frontal area
    times drag coefficient.
    """

    mass_kg: float
    gyration_squared_m2: float
    rolling_resistance_ratio: float
    drag_area_m2: float


def outline_of(log: TrialLog) -> Array:
    """Returns the true outline of the robot in its base frame, (K, 2) m."""
    robot = log.info["robot"]
    corners = robot.get("collision_outline") or robot.get("footprint")
    return circle_footprint(robot["robot_radius"]) if corners is None else np.array(corners)


def gyration_squared_m2(log: TrialLog) -> float:
    """Returns the yaw inertia per mass of a uniform box around the outline, or of a uniform disc.

    Formula: (length^2 + width^2) / 12; r^2 / 2.
    """
    robot = log.info["robot"]
    if not (robot.get("collision_outline") or robot.get("footprint")):
        return 0.5 * robot["robot_radius"] ** 2
    length, width = np.ptp(outline_of(log), axis=0)
    return float(length**2 + width**2) / 12.0


def body_of(log: TrialLog) -> Body:
    """Returns the robot as a body; raises Undefined where its file gives no mass."""
    robot = log.info["robot"]
    mass_kg = robot.get("mass_kg")
    if mass_kg is None:
        raise Undefined("the robot file gives no mass_kg")
    return Body(
        mass_kg=mass_kg,
        gyration_squared_m2=gyration_squared_m2(log),
        rolling_resistance_ratio=robot.get("rolling_resistance_ratio", ROLLING_RESISTANCE_RATIO),
        drag_area_m2=robot.get("drag_area_m2", 0.0),
    )
