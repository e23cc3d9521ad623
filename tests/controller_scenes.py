"""What tests hand to a controller: a robot's setup, plans, maps, observations."""

from __future__ import annotations

import math

import numpy as np
from scenes import WHEELCHAIR, straight_plan

from drake_navbench.controller import ControllerError, ControllerSetup, Decision, Observation
from drake_navbench.kernels.footprint import circle_footprint, footprint_radii
from drake_navbench.kernels.grid import Costmap

RESOLUTION = 0.05
CELLS = 120
ORIGIN = -3.0


def setup_of(footprint, **values) -> ControllerSetup:
    """Returns a setup at 20 Hz for an outline (K, 2), m."""
    return ControllerSetup(0.05, footprint, *footprint_radii(footprint), **values)


def make_setup(*, circle=False, **values) -> ControllerSetup:
    """Returns a setup at 20 Hz for the wheelchair, or for a circle of 0.22 m."""
    footprint = circle_footprint(0.22) if circle else WHEELCHAIR
    return setup_of(footprint, footprint_is_circle=circle, **values)


def make_costmap(cost=0, *, cells=(), tracks_unknown=False) -> Costmap:
    """Returns a map of one cost from -3 to 3 m; cells: (x m, y m, cost) of others."""
    costs = np.full((CELLS, CELLS), cost, np.uint8)
    for x, y, other in cells:
        costs[int((y - ORIGIN) / RESOLUTION), int((x - ORIGIN) / RESOLUTION)] = other
    return Costmap(costs, ORIGIN, ORIGIN, RESOLUTION, tracks_unknown=tracks_unknown)


def turned_plan(angle, length_m=2.0):
    """Returns a straight plan from the origin at an angle, each pose along it."""
    plan = straight_plan(length_m)
    x = plan[:, 0].copy()
    return np.column_stack([x * math.cos(angle), x * math.sin(angle), np.full_like(x, angle)])


def arc_plan(radius_m, angle, count=41):
    """Returns a plan along a circle to the left, from the origin."""
    angles = np.linspace(0.0, angle, count)
    return np.column_stack([radius_m * np.sin(angles), radius_m * (1.0 - np.cos(angles)), angles])


def observe(plan, *, pose=(0.0, 0.0, 0.0), twist=(0.0, 0.0), **values) -> Observation:
    """Returns what a robot sees, at rest at the origin of a free map unless told otherwise."""
    plan = np.array(plan, dtype=float)
    given = {
        "time_s": 0.0,
        "pose": np.array(pose, dtype=float),
        "twist": np.array(twist, dtype=float),
        "plan": plan,
        "plan_id": 1,
        "goal": plan[-1] if len(plan) else np.zeros(3),
    }
    if "costmap" not in values:
        values["costmap"] = make_costmap()
    return Observation(**given | values)


def command_of(controller, observation, memory=None):
    """Returns (v, w) of a cycle, or the name of the error that it ends with."""
    memory = controller.initial_memory() if memory is None else memory
    try:
        decision: Decision = controller.step(observation, memory)
    except ControllerError as error:
        return type(error).__name__
    return tuple(decision.command.tolist())
