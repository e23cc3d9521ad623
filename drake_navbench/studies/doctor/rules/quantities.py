"""Quantities of a file that rules of several controllers use."""

from __future__ import annotations

import math

from drake_navbench.studies.doctor.facts import Facts

# From this ratio of the two radii on, an outline is not round.
NOT_ROUND = 1.3


def half_window_m(f: Facts) -> float:
    """Returns half the smaller side of the local costmap, m; no limit where it is not known."""
    sides = (f.number("local_costmap.width"), f.number("local_costmap.height"))
    return 0.5 * min(sides) if all(sides) else 1e9


def driven_mps(f: Facts) -> float:
    """Returns the largest speed that the controller asks for and the velocity smoother lets by."""
    return min(f.speed_mps, f.axis("velocity_smoother.max_velocity", 0) or f.speed_mps)


def braking_m(f: Facts, deceleration: float) -> float:
    """Returns the way to stop from full speed, with one period of delay, m."""
    return f.speed_mps**2 / (2.0 * max(abs(deceleration), 0.05)) + f.speed_mps * f.period_s


def whole_m(length: float) -> int:
    """Returns a length rounded up to whole metres, as Nav2 takes a costmap's sides."""
    return math.ceil(length - 1e-9)


def is_not_round(f: Facts) -> bool:
    """Tells whether the robot's outline is far from a circle."""
    inner = f.inscribed_radius_m
    return inner > 0.0 and f.circumscribed_radius_m > NOT_ROUND * inner


def has_critic(f: Facts, *names: str) -> bool:
    """Tells whether one of these critics is listed."""
    critics = f.controller("critics") or ()
    return any(name in critics for name in names)
