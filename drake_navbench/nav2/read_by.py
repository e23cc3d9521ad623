"""The releases of Nav2 that read a parameter, and the releases whose default differs from ours.

Every release reads a parameter that is not listed here, with one default. The lists follow the
parameters that the branches humble, iron, jazzy, kilted and lyrical of navigation2 declare.
Controllers have such lists in their parameter models.
"""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import BaseModel

from drake_navbench.costmaps.built_in_layers import KeepoutFilterParameters, StaticLayerParameters
from drake_navbench.costmaps.costmap_rules import CostmapRules
from drake_navbench.costmaps.observation_layers import VoxelLayerParameters
from drake_navbench.inputs.navigation_settings import ControllerServerSettings
from drake_navbench.navigation.behaviors import DriveLimits
from drake_navbench.navigation.collision_monitor import (
    CollisionMonitorParameters,
    MonitorCircle,
    MonitorPolygon,
    VelocityPolygon,
)
from drake_navbench.navigation.goal_checkers import (
    PositionGoalCheckerParameters,
    SimpleGoalCheckerParameters,
)
from drake_navbench.navigation.navfn_planner import NavfnPlannerParameters
from drake_navbench.navigation.smac_planner_2d_parameters import (
    GridSmootherParameters,
    SmacPlanner2DParameters,
)
from drake_navbench.navigation.smac_planner_hybrid_parameters import SmacPlannerHybridParameters
from drake_navbench.navigation.smoother_parameters import (
    SavitzkyGolaySmootherParameters,
    SimpleSmootherParameters,
)
from drake_navbench.navigation.theta_star_planner import ThetaStarPlannerParameters
from drake_navbench.releases import ReadBy, Release, before, since, until

HUMBLE, IRON, JAZZY, KILTED, LYRICAL = Release
EVERY = frozenset(Release)
# No cell has more: before there was a limit, curves to the goal were held to none.
ANY_COST = 255.0
# No point lies lower, m: voxel layers had no least height.
ANY_HEIGHT_M = -1000.0
# How many times smoothers went over their path again before it was a parameter.
REFINEMENTS_OF_HUMBLE = 4


# Humble has them, 0 being none; iron and jazzy have not; in kilted they came again, for good.
_RAMP = ReadBy(frozenset({HUMBLE, KILTED, LYRICAL}), before(KILTED, None))
_SHAPE: Mapping[str, ReadBy] = {
    "min_points": since(IRON),
    "linear_limit": since(IRON),
    "angular_limit": since(IRON),
    "trigger_consecutive_points": since(LYRICAL),
    "release_consecutive_points": since(LYRICAL),
}
_REFINEMENT: Mapping[str, ReadBy] = {
    "refinement_num": since(IRON, before(IRON, REFINEMENTS_OF_HUMBLE)),
}

READ_BY: Mapping[type[BaseModel], Mapping[str, ReadBy]] = {
    ControllerServerSettings: {
        # The value in earlier releases is in nav2_release, since it also counts without a
        # controller server.
        "costmap_update_timeout": since(JAZZY),
        "path_handler_plugins": since(LYRICAL),
        "progress_checker_plugin": until(IRON),
        "progress_checker_plugins": since(IRON),
    },
    PositionGoalCheckerParameters: {
        "path_length_tolerance": since(LYRICAL, before(LYRICAL, None)),
        "xy_goal_tolerance_buffer": since(LYRICAL),
    },
    SimpleGoalCheckerParameters: {
        "symmetric_yaw_tolerance": ReadBy(EVERY - {IRON}),
    },
    CostmapRules: {
        "inscribed_obstacle_cost_value": since(LYRICAL),
    },
    StaticLayerParameters: {
        "restore_cleared_footprint": since(KILTED, before(KILTED, False)),
    },
    VoxelLayerParameters: {
        "min_obstacle_height": since(JAZZY, before(JAZZY, ANY_HEIGHT_M)),
    },
    KeepoutFilterParameters: {
        "override_lethal_cost": since(JAZZY),
        "lethal_override_cost": since(JAZZY),
    },
    NavfnPlannerParameters: {
        "max_cycles_factor": since(LYRICAL),
    },
    SmacPlanner2DParameters: {
        "terminal_checking_interval": since(JAZZY),
    },
    SmacPlannerHybridParameters: {
        "debug_visualizations": since(IRON),
        # Read from jazzy on, and only in lyrical true by default.
        "allow_primitive_interpolation": since(JAZZY, before(LYRICAL, False)),
        "analytic_expansion_max_cost": since(JAZZY, before(JAZZY, ANY_COST)),
        "analytic_expansion_max_cost_override": since(JAZZY),
        "downsample_obstacle_heuristic": since(JAZZY),
        "terminal_checking_interval": since(JAZZY),
        "use_quadratic_cost_penalty": since(JAZZY),
        "coarse_search_resolution": since(KILTED),
        "goal_heading_mode": since(KILTED),
    },
    GridSmootherParameters: _REFINEMENT,
    ThetaStarPlannerParameters: {
        "terminal_checking_interval": since(JAZZY),
    },
    SimpleSmootherParameters: {
        **_REFINEMENT,
        "enforce_path_inversion": since(KILTED),
    },
    SavitzkyGolaySmootherParameters: {
        "enforce_path_inversion": since(KILTED),
        "poly_order": since(LYRICAL),
        "window_size": since(LYRICAL),
    },
    DriveLimits: {
        "acceleration_limit": _RAMP,
        "deceleration_limit": _RAMP,
        "minimum_speed": _RAMP._replace(defaults=before(KILTED, 0.0)),
    },
    CollisionMonitorParameters: {
        "enabled": since(LYRICAL),
    },
    MonitorPolygon: _SHAPE,
    MonitorCircle: _SHAPE,
    VelocityPolygon: _SHAPE,
}
"""By the model of a plugin or server, then by parameter."""


def read_by(model: type[BaseModel], name: str) -> ReadBy:
    """Returns the releases that read a parameter; READ_BY may list it under a base of `model`."""
    known = (READ_BY.get(base, {}).get(name) for base in model.__mro__)
    return next((found for found in known if found is not None), ReadBy())
