"""Parameters without effect, because a switch in the same file turns off what they are for."""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import NamedTuple

from drake_navbench.studies.doctor.facts import CONTROLLER, COSTMAPS, Facts


class Switch(NamedTuple):
    """A switch of a controller: the parameters that count while it is on, and while it is off.

    A number is a switch, too: 0 is off.
    """

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
    "approach_velocity_scaling_dist": Switch(("min_approach_linear_velocity",)),
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

# The parameters that only some planners read, by a part of the planner's type.
_SMAC = ("max_iterations", "max_on_approach_iterations", "max_planning_time", "smooth_path")
_FEASIBLE = (
    *_SMAC, "reverse_penalty", "change_penalty", "non_straight_penalty", "cost_penalty",
    "analytic_expansion_*", "cache_obstacle_heuristic", "debug_visualizations",
)  # fmt: skip
PLANNERS: Mapping[str, tuple[str, ...]] = {
    "Navfn": ("use_astar", "use_final_approach_orientation"),
    "SmacPlanner2D": (
        *_SMAC, "cost_travel_multiplier", "downsample_costmap", "use_final_approach_orientation",
    ),
    "SmacPlannerHybrid": (
        *_FEASIBLE, "motion_model_for_search", "minimum_turning_radius", "angle_quantization_bins",
        "downsample_costmap",
    ),
    "SmacPlannerLattice": (*_FEASIBLE, "rotation_penalty", "allow_reverse_expansion"),
    "ThetaStar": ("w_traversal_cost", "use_final_approach_orientation"),
}  # fmt: skip
OF_SOME_PLANNERS = frozenset(name for names in PLANNERS.values() for name in names)
# The parameters of a costmap itself and of its static layer, which need no line; all others are
# those of layers that must be there.
OF_THE_COSTMAP = frozenset(
    {
        "always_send_full_costmap",
        "footprint",
        "footprint_padding",
        "map_subscribe_transient_local",
        "map_topic",
        "publish_frequency",
        "robot_radius",
        "transform_tolerance",
    }
)


# DWB's parameters that its critic RotateToGoal alone reads.
OF_ROTATE_TO_GOAL = ("xy_goal_tolerance", "trans_stopped_velocity")


def is_in_effect(facts: Facts, place: str) -> bool:
    """Tells whether a plugin of the file reads a parameter and no switch turns it off.

    Of a file that is not whole, only switches that it gives are known.
    """
    block, _, name = place.partition(".")
    if block != CONTROLLER:
        return not facts.is_whole or _has_reader(facts, block, name)
    critics = facts[f"{CONTROLLER}.critics"] if facts.is_whole and facts.is_kind("dwb") else None
    if isinstance(critics, list | tuple) and name in OF_ROTATE_TO_GOAL:
        return any("RotateToGoal" in str(critic) for critic in critics)
    for switch, (on, off) in SWITCHES.items():
        own = f"{CONTROLLER}.{switch}"
        value = facts[own] if facts.is_whole or own in facts.given else None
        idle = off if value is True else on if value in (False, 0.0) else ()
        if any(fnmatchcase(name, pattern) for pattern in idle):
            return False
    return True


def _has_reader(facts: Facts, block: str, name: str) -> bool:
    """Tells whether the planner, or a layer of the costmap, of a whole file reads a parameter."""
    value = facts[f"{block}.{name}"]
    if block in COSTMAPS:
        if name == "robot_radius":
            return f"{block}.footprint" not in facts.given
        if name in ("width", "height") and not facts[f"{block}.rolling_window"]:
            # The map's size counts.
            return not any("static" in str(layer) for layer in facts[f"{block}.plugins"] or ())
        return value is not None or name in OF_THE_COSTMAP
    if block != "planner" or not any(fnmatchcase(name, own) for own in OF_SOME_PLANNERS):
        return True
    plugin = str(facts["planner.plugin"] or "")
    known = [names for kind, names in PLANNERS.items() if kind in plugin]
    return not known or any(fnmatchcase(name, own) for own in known[0])
