"""Rules about the inflation layer."""

from __future__ import annotations

import math

from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.costmaps import CODE
from drake_navbench.studies.doctor.rules.rule import Rule, down, put, up
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

OBSTACLES = (
    "obstacle",
    "voxel",
    "stvl",
    "range",
    "nonpersistent",
    "spatio",
    "kinect",
    "scan",
    "lidar",
)


# A smaller difference of two lengths is none.
LEAST_M = 0.01
# Nav2's own padding of an outline where the file gives none.
PADDING_M = 0.01


def _inflation_is_last(f: Facts) -> bool:
    plugins = [str(name).lower() for name in f["local_costmap.plugins"] or ()]
    places = [index for index, name in enumerate(plugins) if "inflation" in name]
    return not places or all(
        not any(word in name for word in OBSTACLES) for name in plugins[places[0] :]
    )


def _beyond(radius_m: float) -> float:
    """Returns the least inflation radius by which a robot keeps some way from walls, m, to a cm."""
    return math.ceil(100.0 * (radius_m + max(0.1, 0.25 * radius_m))) / 100.0


def _beyond_the_outline(f: Facts) -> float:
    return _beyond(f.inscribed_radius_m)


def _planned_radius_m(f: Facts) -> float:
    """Returns the inscribed radius that the planner takes, m: the global costmap's own, if given.

    A footprint is that of both costmaps, or else the local one's is the best guess.
    """
    place = "global_costmap.robot_radius"
    if place not in f.given or "global_costmap.footprint" in f.given:
        return f.inscribed_radius_m
    return f.number(place) + f.number("global_costmap.footprint_padding", PADDING_M)


RULES = (
    Rule(
        "inflation-below-inscribed-radius",
        # A few millimetres, as by rounding, are less than a cell.
        lambda f: (
            0.0 < f.number("local_costmap.inflation_radius", 1.0) < f.inscribed_radius_m - LEAST_M
        ),
        lambda f: (
            f"inflation_radius is {f['local_costmap.inflation_radius']} m, less than the "
            f"robot's inscribed radius of {f.inscribed_radius_m:.2f} m: a cell beside a wall, "
            "where the robot would touch it, has no cost"
        ),
        {S.COLLISION: 1.0, S.NEAR_MISS: 0.9},
        (up("local_costmap.inflation_radius", _beyond_the_outline),),
        f"{CODE}: inflation_layer.cpp",
    ),
    Rule(
        "plans-inflate-little",
        lambda f: (
            0.0
            < f.number("global_costmap.inflation_radius", 1.0)
            < min(_planned_radius_m(f) + 0.05, 1.2 * _planned_radius_m(f)) - 1e-9
        ),
        lambda f: (
            f"global_costmap.inflation_radius is {f['global_costmap.inflation_radius']} m "
            f"and the robot's inscribed radius there {_planned_radius_m(f):.2f} m: to pass close "
            "along a wall costs the planner hardly anything"
        ),
        {S.COLLISION: 0.6, S.NEAR_MISS: 0.8, S.CORNER_CUTTING: 0.6, S.DOOR_STOP: 0.4},
        (up("global_costmap.inflation_radius", lambda f: _beyond(_planned_radius_m(f))),),
        f"{CODE}: inflation_layer.cpp; docs.nav2.org, tuning guide: inflation potential fields",
    ),
    Rule(
        "wide-inflation",
        lambda f: f.number("local_costmap.inflation_radius", 0.55) > 1.0,
        lambda f: (
            f"inflation_radius is {f['local_costmap.inflation_radius']} m and "
            f"cost_scaling_factor {f['local_costmap.cost_scaling_factor']}: in a door every cell "
            "has a high cost"
        ),
        {S.DOOR_STOP: 0.9, S.TOO_SLOW: 0.4, S.WOBBLE_STRAIGHT: 0.2, S.STALL_BEFORE_GOAL: 0.3},
        (down("local_costmap.inflation_radius", 0.55), up("local_costmap.cost_scaling_factor")),
        f"{CODE}: inflation_layer.cpp",
        is_certain=False,
    ),
    Rule(
        "plans-inflate-much",
        lambda f: (
            f.number("global_costmap.inflation_radius", 0.55)
            > max(0.8, 2.0 * f.circumscribed_radius_m)
            or (
                f["global_costmap.robot_radius"] is None
                and f["global_costmap.footprint"] is not None
                and f.number("global_costmap.inflation_radius", 0.55) > 0.35
            )
        ),
        lambda f: (
            f"global_costmap.inflation_radius is {f['global_costmap.inflation_radius']} m: "
            "at the start, at the goal or in a passage a corner of the footprint may lie in "
            "inflated cells, and the planner finds no plan"
        ),
        {S.PLANNER_FAILS: 0.8, S.DOOR_STOP: 0.4},
        (down("global_costmap.inflation_radius"),),
        f"{CODE}; nav2_smac_planner: start occupied",
        is_certain=False,
    ),
    Rule(
        "steep-costs",
        lambda f: f.number("local_costmap.cost_scaling_factor", 3.0) > 8.0,
        lambda f: (
            f"cost_scaling_factor is {f['local_costmap.cost_scaling_factor']}: cells more than "
            "about 0.1 m from the robot's outline have hardly any cost"
        ),
        {S.NEAR_MISS: 1.0, S.COLLISION: 0.4, S.CORNER_CUTTING: 0.3},
        (down("local_costmap.cost_scaling_factor", 3.0),),
        f"{CODE}: inflation_layer.cpp",
        is_certain=False,
    ),
    Rule(
        "flat-costs",
        lambda f: 0.0 < f.number("local_costmap.cost_scaling_factor", 3.0) < 1.5,
        lambda f: (
            f"cost_scaling_factor is {f['local_costmap.cost_scaling_factor']}: the middle "
            "of a door costs nearly as much as its jambs"
        ),
        {S.DOOR_STOP: 0.9, S.TOO_SLOW: 0.4},
        (up("local_costmap.cost_scaling_factor", 3.0),),
        f"{CODE}: inflation_layer.cpp",
        is_certain=False,
    ),
    Rule(
        "no-inflation-layer",
        lambda f: (
            f.is_whole
            and bool(f["local_costmap.plugins"])
            and f["local_costmap.inflation_radius"] is None
        ),
        lambda f: (
            f"local_costmap.plugins is {f['local_costmap.plugins']}: without an inflation layer "
            "only cells with obstacles in them have a cost"
        ),
        {S.COLLISION: 0.9, S.NEAR_MISS: 0.9, S.DOOR_STOP: 0.2},
        (put("local_costmap.plugins"),),
        f"{CODE}: inflation_layer.cpp",
        is_certain=False,
    ),
    Rule(
        "inflation-before-obstacles",
        lambda f: not _inflation_is_last(f),
        lambda f: (
            f"local_costmap.plugins is {f['local_costmap.plugins']}: the inflation layer comes "
            "before other layers and does not inflate the obstacles that these mark"
        ),
        {S.COLLISION: 0.9, S.NEAR_MISS: 0.9, S.IGNORES_OBSTACLES: 0.3},
        (put("local_costmap.plugins"),),
        f"{CODE}: layered_costmap.cpp",
    ),
)
