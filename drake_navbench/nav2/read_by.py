"""The releases of Nav2 that read a parameter, and the releases whose default differs from ours.

Every release reads a parameter that is not listed here, with one default. The lists follow the
parameters that the branches humble, iron, jazzy, kilted and lyrical of navigation2 declare.
Controllers have such lists of their own, READ_FROM and READ_UNTIL.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from pydantic import BaseModel

from drake_navbench.costmaps.costmap_settings import (
    CostmapSettings,
    KeepoutFilterSettings,
    StaticLayerSettings,
    VoxelLayerSettings,
)
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
from drake_navbench.releases import Release

HUMBLE, IRON, JAZZY, KILTED, LYRICAL = Release
EVERY = frozenset(Release)
# No cell has more: before there was a limit, curves to the goal were held to none.
ANY_COST = 255.0
# No point lies lower, m: voxel layers had no least height.
ANY_HEIGHT_M = -1000.0
# How many times smoothers went over their path again before it was a parameter.
REFINEMENTS_OF_HUMBLE = 4


class ReadBy(NamedTuple):
    """The releases that read a parameter, and the defaults that differ from ours.

    releases: those that read the parameter. defaults: by release, the value that counts there if no
    file gives one; only where it differs from the default of our model.
    """

    releases: frozenset[Release]
    defaults: Mapping[Release, Any] = {}


def _before(release: Release, value: Any) -> dict[Release, Any]:
    return {other: value for other in Release if other < release}


def _since(release: Release, before: Mapping[Release, Any] | None = None) -> ReadBy:
    releases = frozenset(other for other in Release if other >= release)
    return ReadBy(releases, before or {})


def _until(release: Release) -> ReadBy:
    return ReadBy(frozenset(other for other in Release if other <= release))


# Humble has them, 0 being none; iron and jazzy have not; in kilted they came again, for good.
_RAMP = ReadBy(frozenset({HUMBLE, KILTED, LYRICAL}), _before(KILTED, None))
_SHAPE: Mapping[str, ReadBy] = {
    "min_points": _since(IRON),
    "linear_limit": _since(IRON),
    "angular_limit": _since(IRON),
    "trigger_consecutive_points": _since(LYRICAL),
    "release_consecutive_points": _since(LYRICAL),
}
_VOXEL_LAYER: Mapping[str, ReadBy] = {
    "min_obstacle_height": _since(JAZZY, _before(JAZZY, ANY_HEIGHT_M)),
}
_REFINEMENT: Mapping[str, ReadBy] = {
    "refinement_num": _since(IRON, _before(IRON, REFINEMENTS_OF_HUMBLE)),
}

READ_BY: Mapping[type[BaseModel], Mapping[str, ReadBy]] = {
    ControllerServerSettings: {
        # The value in earlier releases is in nav2_release, since it also counts without a
        # controller server.
        "costmap_update_timeout": _since(JAZZY),
        "path_handler_plugins": _since(LYRICAL),
        "progress_checker_plugin": _until(IRON),
        "progress_checker_plugins": _since(IRON),
    },
    PositionGoalCheckerParameters: {
        "path_length_tolerance": _since(LYRICAL, _before(LYRICAL, None)),
        "xy_goal_tolerance_buffer": _since(LYRICAL),
    },
    SimpleGoalCheckerParameters: {
        "symmetric_yaw_tolerance": ReadBy(EVERY - {IRON}),
    },
    CostmapSettings: {
        "inscribed_obstacle_cost_value": _since(LYRICAL),
    },
    StaticLayerSettings: {
        "restore_cleared_footprint": _since(KILTED, _before(KILTED, False)),
    },
    VoxelLayerSettings: _VOXEL_LAYER,
    VoxelLayerParameters: _VOXEL_LAYER,
    KeepoutFilterSettings: {
        "override_lethal_cost": _since(JAZZY),
        "lethal_override_cost": _since(JAZZY),
    },
    NavfnPlannerParameters: {
        "max_cycles_factor": _since(LYRICAL),
    },
    SmacPlanner2DParameters: {
        "terminal_checking_interval": _since(JAZZY),
    },
    SmacPlannerHybridParameters: {
        "debug_visualizations": _since(IRON),
        # Read from jazzy on, and only in lyrical true by default.
        "allow_primitive_interpolation": _since(JAZZY, _before(LYRICAL, False)),
        "analytic_expansion_max_cost": _since(JAZZY, _before(JAZZY, ANY_COST)),
        "analytic_expansion_max_cost_override": _since(JAZZY),
        "downsample_obstacle_heuristic": _since(JAZZY),
        "terminal_checking_interval": _since(JAZZY),
        "use_quadratic_cost_penalty": _since(JAZZY),
        "coarse_search_resolution": _since(KILTED),
        "goal_heading_mode": _since(KILTED),
    },
    GridSmootherParameters: _REFINEMENT,
    ThetaStarPlannerParameters: {
        "terminal_checking_interval": _since(JAZZY),
    },
    SimpleSmootherParameters: {
        **_REFINEMENT,
        "enforce_path_inversion": _since(KILTED),
    },
    SavitzkyGolaySmootherParameters: {
        "enforce_path_inversion": _since(KILTED),
        "poly_order": _since(LYRICAL),
        "window_size": _since(LYRICAL),
    },
    DriveLimits: {
        "acceleration_limit": _RAMP,
        "deceleration_limit": _RAMP,
        "minimum_speed": _RAMP._replace(defaults=_before(KILTED, 0.0)),
    },
    CollisionMonitorParameters: {
        "enabled": _since(LYRICAL),
    },
    MonitorPolygon: _SHAPE,
    MonitorCircle: _SHAPE,
    VelocityPolygon: _SHAPE,
}
"""By the model of a plugin or server, then by parameter."""


def read_by(model: type[BaseModel], name: str) -> ReadBy:
    """Returns which releases read a model's parameter; READ_BY may list it under a base class."""
    known = (READ_BY.get(base, {}).get(name) for base in model.__mro__)
    return next((found for found in known if found is not None), ReadBy(EVERY))
