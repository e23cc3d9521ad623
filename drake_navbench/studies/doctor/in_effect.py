"""Parameters without effect, because a switch in the same file turns off what they are for."""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import NamedTuple

from drake_navbench.studies.doctor.facts import CONTROLLER, Facts


class Switch(NamedTuple):
    """A switch of a controller: the parameters that count while it is on, and while it is off."""

    on: tuple[str, ...] = ()
    off: tuple[str, ...] = ()


SWITCHES: Mapping[str, Switch] = {
    "use_velocity_scaled_lookahead_dist": Switch(
        ("min_lookahead_dist", "max_lookahead_dist", "lookahead_time"), ("lookahead_dist",)
    ),
    "use_fixed_curvature_lookahead": Switch(("curvature_lookahead_dist",)),
    "use_regulated_linear_velocity_scaling": Switch(("regulated_linear_scaling_min_radius",)),
    "use_cost_regulated_linear_velocity_scaling": Switch(
        ("cost_scaling_dist", "cost_scaling_gain", "inflation_cost_scaling_factor")
    ),
    "use_collision_detection": Switch(
        ("max_allowed_time_to_collision_up_to_carrot", "min_distance_to_obstacle")
    ),
    "use_rotate_to_heading": Switch(("rotate_to_heading_min_angle",)),
    "enable_homotopy_class_planning": Switch(
        ("max_number_classes", "selection_cost_*", "switching_blocking_period")
    ),
    "oscillation_recovery": Switch(("oscillation_*_eps", "oscillation_*_duration")),
    "include_costmap_obstacles": Switch(("costmap_obstacles_behind_robot_dist",)),
}


def is_in_effect(facts: Facts, place: str) -> bool:
    """Tells whether no switch that is known turns a controller's parameter off.

    Of a file that is not whole, only switches that it gives are known.
    """
    block, _, name = place.partition(".")
    if block != CONTROLLER:
        return True
    for switch, (on, off) in SWITCHES.items():
        own = f"{CONTROLLER}.{switch}"
        value = facts[own] if facts.is_whole or own in facts.given else None
        idle = off if value is True else on if value is False else ()
        if any(fnmatchcase(name, pattern) for pattern in idle):
            return False
    return True
