"""The rule about costmaps that take the robot for smaller than its own model."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from drake_navbench.inputs.robot import Robot
from drake_navbench.kernels.footprint import footprint_radii
from drake_navbench.nav2.body import REACHES, reach_beyond_m
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.rule import SURE, Rule, put, up
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

# A body whose outer circle is at most so much larger than its inner one counts as round.
ROUND = 1.2
# The outline is written to a millimetre.
PER_M = 1000


def _body(f: Facts) -> Robot:
    """Returns the robot whose body the user's own model gives."""
    assert f.robot is not None
    return f.robot


def _is_smaller(f: Facts) -> bool:
    """Tells whether the body reaches at least half a cell beyond the costmaps' outline."""
    if f.robot is None or not any(REACHES in remark for remark in f.doubts.values()):
        return False
    return reach_beyond_m(f.robot) >= 0.5 * f.number("local_costmap.resolution", 0.05)


def _given(f: Facts) -> str:
    name = "robot_radius" if _body(f).is_circle else "footprint"
    value = f[f"local_costmap.{name}"]
    return f"{name} is {value} m" if name == "robot_radius" else f"{name} is {value}"


def _seen(f: Facts) -> str:
    robot = _body(f)
    x, y = (f"{side.min():.2f} to {side.max():.2f} m" for side in robot.outline.T)
    return (
        f"local_costmap.{_given(f)}, but the body of the robot's own model goes from x = {x} and "
        f"from y = {y} about its base, {reach_beyond_m(robot):.2f} m farther: Nav2 plans and "
        "checks for a smaller robot"
    )


def _radius(f: Facts) -> float | None:
    """Returns the radius of a round body in a file that gives a radius; None of other bodies."""
    robot = _body(f)
    inner_m, outer_m = footprint_radii(robot.outline)
    return outer_m if robot.is_circle and outer_m <= ROUND * inner_m else None


def _footprint(f: Facts) -> Any:
    """Returns an outline as Nav2 reads a footprint; None where a radius tells it.

    Where the file has an outline, it is the hull of that and the body: the model may lack a load.
    """
    if _radius(f) is not None:
        return None
    robot = _body(f)
    corners = [*map(tuple, robot.outline)]
    if robot.footprint is None:
        return str(np.round(corners, 3).tolist())
    # The hull of whole millimetres has no corner between two others on one line.
    points_mm = np.rint(np.array([*corners, *robot.footprint], dtype=float) * PER_M)
    hull = shapely.MultiPoint(points_mm).convex_hull
    return str((shapely.get_coordinates(hull)[:-1] / PER_M).tolist())


RULES = (
    Rule(
        "outline-smaller-than-the-model",
        _is_smaller,
        _seen,
        {S.COLLISION: SURE, S.NEAR_MISS: 0.5 * SURE, S.CORNER_CUTTING: 0.5},
        (
            up("local_costmap.robot_radius", _radius),
            put("local_costmap.footprint", _footprint),
        ),
        "nav2_costmap_2d: costmap_2d_ros.cpp, footprint.cpp",
    ),
)
