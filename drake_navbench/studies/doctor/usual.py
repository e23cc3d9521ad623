"""The usual values of parameters: Nav2's defaults and those of nav2_bringup's own file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from functools import cache
from typing import Any, NamedTuple

from drake_navbench.inputs.navigation_settings import NavigationSettings
from drake_navbench.inputs.presets import load_preset
from drake_navbench.studies.doctor.causes import Direction
from drake_navbench.studies.doctor.facts import Facts, controller_values, defaults_of, shortened
from drake_navbench.typed_files.dotted_names import flattened

# By kind of controller, the preset with the values of nav2_bringup's or the controller's own file.
PRESETS = {
    "mppi": "mppi_bringup",
    "dwb": "dwb_bringup",
    "rpp": "rpp_bringup",
    "teb": "teb_upstream",
    "graceful": "graceful",
    "vector_pursuit": "vector_pursuit",
    "shim": "rotation_shim",
}
# The values of nav2_bringup's own file, from which nearly every file is copied.
OF_BRINGUP: Mapping[str, tuple[float, ...]] = {
    "controller_server.failure_tolerance": (0.3,),
    "controller_server.min_x_velocity_threshold": (0.001,),
    "controller_server.min_y_velocity_threshold": (0.5,),
    "controller_server.min_theta_velocity_threshold": (0.001,),
    "local_costmap.inflation_radius": (0.55, 0.7),
    "local_costmap.cost_scaling_factor": (3.0,),
    "local_costmap.resolution": (0.05,),
    "local_costmap.width": (3.0,),
    "local_costmap.height": (3.0,),
    "global_costmap.inflation_radius": (0.55, 0.7),
    "global_costmap.cost_scaling_factor": (3.0,),
    "global_costmap.resolution": (0.05,),
    "global_costmap.update_frequency": (1.0,),
    "local_costmap.z_resolution": (0.05,),
    "global_costmap.z_resolution": (0.05,),
    "planner.tolerance": (0.5,),
    "planner.max_planning_time": (5.0,),
    "velocity_smoother.smoothing_frequency": (20.0,),
    "velocity_smoother.velocity_timeout": (1.0,),
    "controller.transform_tolerance": (0.2,),
}
# Further defaults of the code. Hardly any robot's file keeps those of the costmap.
OF_CODE: Mapping[str, tuple[float, ...]] = {
    "local_costmap.cost_scaling_factor": (10.0,),
    "global_costmap.cost_scaling_factor": (10.0,),
    "planner.cost_travel_multiplier": (2.0,),
    "controller.PathAlign.forward_point_distance": (0.325,),
    "controller.GoalAlign.forward_point_distance": (0.325,),
}
# From this ratio on a value is far from the usual ones.
FAR = 2.5
# Limits of motion of which 0, DWB's default, is no usual value: with it the robot stands.
NEVER_ZERO = ("max_vel_x", "max_vel_theta", "max_speed*", "acc_lim_x", "acc_lim_theta",
    "decel_lim_x", "decel_lim_theta")  # fmt: skip
# What the defaults are made for: 0.5 m/s, a TurtleBot's radius, 20 control cycles a second.
USUAL_SPEED_MPS, USUAL_RADIUS_M, USUAL_PERIOD_S = 0.5, 0.22, 0.05
USUAL_INFLATION_M = 0.55
# A robot of less than this share of the usual radius has costmaps of smaller cells.
TINY = 0.5
# Parameters whose right value grows with the robot's speed, or with its size.
_GROWTH = {
    "speed": "lookahead_dist min_lookahead_dist max_lookahead_dist min_lookahead max_lookahead "
    "prune_distance approach_velocity_scaling_dist slowdown_radius motion_target_dist vx_std "
    "max_global_plan_lookahead_dist width height min_distance_to_obstacle cost_scaling_dist "
    "curvature_lookahead_dist forward_sampling_distance min_approach_linear_velocity "
    "regulated_linear_scaling_min_speed",
    "size": "inflation_radius footprint_padding min_obstacle_dist inflation_dist width height "
    "xy_goal_tolerance required_movement_radius regulated_linear_scaling_min_radius",
}
WITH_SPEED, WITH_SIZE = (frozenset(names.split()) for names in _GROWTH.values())


class Unusual(NamedTuple):
    """A value far from the usual ones. ratio: to the nearest usual one, above 1 or below."""

    place: str
    value: float
    nearest: float
    ratio: float

    @property
    def back(self) -> Direction:
        """The direction that leads back to the usual value, also if that is negative."""
        return Direction.DOWN if self.value > self.nearest else Direction.UP


def unusual_value(facts: Facts, place: str, *, least: float = FAR) -> Unusual | None:
    """Returns a parameter's value if it is far from Nav2's default and nav2_bringup's, else None.

    A value is far if it is `least` times these or more, or less than 1 / least times. A length that
    grows with the robot's speed or size is far if it is so from the usual values as they are and
    scaled to this robot.
    """
    value = facts[place]
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    known = usual_values(facts.kinds).get(place, ())
    if value == 0.0 and known and min(known) > 0.0:
        return Unusual(place, 0.0, min(known), 1e-9)
    if any(fnmatchcase(place.rpartition(".")[2], name) for name in NEVER_ZERO):
        known = tuple(u for u in known if u != 0.0)
    usual = [u for u in known if u * value > 0.0]
    # If 0 is usual, no value between 0 and another usual value is far.
    if not usual or (0.0 in known and abs(value) < max(map(abs, known))):
        return None
    nearest = min(usual, key=lambda u: abs(math.log(value / u)))
    ratio = value / nearest
    scaled = min([abs(math.log(ratio / scale)) for scale in _scales(facts, place)])
    slack = -1e-9 if ratio > 1.0 else 1e-9
    if min(scaled, abs(math.log(ratio))) < math.log(least) + slack:
        return None
    return Unusual(place, float(value), nearest, ratio)


def _scales(facts: Facts, place: str) -> Iterator[float]:
    """Yields the factors by which the robot's speed, size and so on may change a right value."""
    name = place.rpartition(".")[2]
    yield 1.0
    if name in WITH_SPEED and facts.speed_mps > 0.0:
        yield facts.speed_mps / USUAL_SPEED_MPS
    if place == "controller.model_dt":
        yield facts.period_s / USUAL_PERIOD_S
    if place == "controller.time_steps":
        yield USUAL_PERIOD_S / max(facts.number("controller.model_dt"), 1e-3)
    if name == "cost_scaling_dist":
        # It lies within the inflation.
        yield facts.number("local_costmap.inflation_radius", USUAL_INFLATION_M) / USUAL_INFLATION_M
    size = facts.circumscribed_radius_m / USUAL_RADIUS_M
    if size > 0.0 and (name in WITH_SIZE or (name == "resolution" and size < TINY)):
        yield size


@cache
def usual_values(kinds: tuple[str, ...]) -> Mapping[str, tuple[float, ...]]:
    """Returns the numbers that Nav2's code and nav2_bringup have, by place."""
    found: dict[str, set[float]] = {}
    for place, value in _usual_pairs(kinds):
        if isinstance(value, int | float) and not isinstance(value, bool):
            found.setdefault(place, set()).add(float(value))
    for more in (OF_BRINGUP, OF_CODE):
        for place, values in more.items():
            found.setdefault(place, set()).update(values)
    return {place: tuple(sorted(values)) for place, values in found.items()}


@cache
def usual_switches(kinds: tuple[str, ...]) -> Mapping[str, frozenset[bool]]:
    """Returns the switches that Nav2's code and nav2_bringup have, by place."""
    found: dict[str, set[bool]] = {}
    for place, value in _usual_pairs(kinds):
        if isinstance(value, bool):
            found.setdefault(place, set()).add(value)
    return {place: frozenset(values) for place, values in found.items()}


def _usual_pairs(kinds: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    settings = NavigationSettings().model_dump(mode="json")
    yield from ((shortened(name), value) for name, value in flattened(settings))
    for kind in kinds:
        if kind in PRESETS:
            preset = load_preset(PRESETS[kind])
            yield from controller_values(preset)
            yield from defaults_of(preset).items()
