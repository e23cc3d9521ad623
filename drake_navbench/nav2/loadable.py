"""Names that each release of Nav2 loads: of plugins, and of libraries of tree nodes.

Source: the plugin descriptions and nav2_behavior_tree/CMakeLists.txt of the branches foxy to
lyrical of navigation2. Older releases than Humble count as Humble, but for the names in OLD.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from drake_navbench.plugins.releases import Release

# By package the classes that servers load.
_CLASSES = {
    "dwb_core": "DWBLocalPlanner",
    "nav2_amcl": "DifferentialMotionModel OmniMotionModel",
    "nav2_behaviors": "AssistedTeleop BackUp DriveOnHeading Spin Wait",
    "nav2_bt_navigator": "NavigateThroughPosesNavigator NavigateToPoseNavigator",
    "nav2_constrained_smoother": "ConstrainedSmoother",
    "nav2_controller": "AdaptiveToleranceGoalChecker AxisGoalChecker FeasiblePathHandler "
    "PoseProgressChecker PositionGoalChecker SimpleGoalChecker SimpleProgressChecker "
    "StoppedGoalChecker",
    "nav2_costmap_2d": "AsymmetricInflationLayer BinaryFilter DenoiseLayer InflationLayer "
    "KeepoutFilter LegacyInflationLayer ObstacleLayer PluginContainerLayer RangeSensorLayer "
    "SpeedFilter StaticLayer VoxelLayer ZoneParameterFilter",
    "nav2_graceful_controller": "GracefulController",
    "nav2_mppi_controller": "MPPIController",
    "nav2_navfn_planner": "NavfnPlanner",
    "nav2_regulated_pure_pursuit_controller": "RegulatedPurePursuitController",
    "nav2_rotation_shim_controller": "RotationShimController",
    "nav2_smac_planner": "SmacPlanner2D SmacPlannerHybrid SmacPlannerLattice",
    "nav2_smoother": "SavitzkyGolaySmoother SimpleSmoother",
    "nav2_theta_star_planner": "ThetaStarPlanner",
    "nav2_waypoint_follower": "InputAtWaypoint PhotoAtWaypoint WaitAtWaypoint",
}
CLASSES: Mapping[str, frozenset[str]] = {
    package: frozenset(names.split()) for package, names in _CLASSES.items()
}
# Packages whose plugins have a slash in their names up to a release, and colons after it.
SLASH_UNTIL = {
    "nav2_behaviors": Release.IRON,
    "nav2_bt_navigator": Release.IRON,
    "nav2_constrained_smoother": Release.LYRICAL,
    "nav2_navfn_planner": Release.IRON,
    "nav2_smac_planner": Release.IRON,
    "nav2_theta_star_planner": Release.IRON,
}
# Names of Galactic and older -> those of Humble and newer.
OLD = {
    "differential": "nav2_amcl::DifferentialMotionModel",
    "omnidirectional": "nav2_amcl::OmniMotionModel",
    "nav2_recoveries/BackUp": "nav2_behaviors/BackUp",
    "nav2_recoveries/Spin": "nav2_behaviors/Spin",
    "nav2_recoveries/Wait": "nav2_behaviors/Wait",
}
PLUGIN = re.compile(r"(?P<package>\w+)(?:/|::)(?P<kind>\w+)")
# The libraries of behaviour tree nodes, by the first release from Humble on that has them, without
# the beginning `nav2_` and the end `_bt_node`.
_NODES = {
    Release.HUMBLE: "assisted_teleop_action assisted_teleop_cancel back_up_action back_up_cancel "
    "clear_costmap_service compute_and_track_route compute_path_through_poses_action "
    "compute_path_to_pose_action compute_route controller_cancel controller_selector "
    "distance_controller distance_traveled_condition drive_on_heading drive_on_heading_cancel "
    "follow_path_action get_pose_from_path_action globally_updated_goal_condition "
    "goal_checker_selector goal_reached_condition goal_updated_condition goal_updated_controller "
    "goal_updater_node initial_pose_received_condition is_battery_charging_condition "
    "is_battery_low_condition is_path_valid_condition is_stuck_condition "
    "navigate_through_poses_action navigate_to_pose_action path_longer_on_approach "
    "pipeline_sequence planner_selector progress_checker_selector rate_controller recovery_node "
    "reinitialize_global_localization_service remove_passed_goals_action round_robin_node "
    "single_trigger smooth_path_action smoother_selector speed_controller spin_action "
    "spin_cancel time_expired_condition transform_available_condition truncate_path_action "
    "truncate_path_local_action wait_action wait_cancel",
    Release.IRON: "are_error_codes_active_condition would_a_controller_recovery_help_condition "
    "would_a_planner_recovery_help_condition would_a_smoother_recovery_help_condition",
    Release.JAZZY: "are_poses_near_condition compute_and_track_route_cancel "
    "concatenate_paths_action get_current_pose_action",
    Release.KILTED: "append_goal_pose_to_goals_action extract_route_nodes_as_goals_action "
    "get_next_few_goals_action is_stopped_condition remove_in_collision_goals_action "
    "would_a_route_recovery_help_condition",
    Release.LYRICAL: "is_goal_nearby_condition is_within_path_tracking_bounds_condition "
    "nonblocking_sequence path_expiring_timer_condition path_handler_selector "
    "pause_resume_controller persistent_sequence toggle_collision_monitor_service",
}
NODES_SINCE: Mapping[str, Release] = {
    f"nav2_{name}_bt_node": release for release, names in _NODES.items() for name in names.split()
} | {"nav2_path_expiring_timer_condition": Release.HUMBLE}
# An unknown library whose name has words of these alone is one of Nav2's, misspelt.
WORDS = frozenset(word for name in NODES_SINCE for word in name.split("_")) | {"control"}


def loadable_name(name: str, release: Release) -> str:
    """Returns a plugin's name as a release loads it; the name itself where no release knows it."""
    name = OLD.get(name, name)
    found = PLUGIN.fullmatch(name)
    if found is None or found["kind"] not in CLASSES.get(found["package"], ()):
        return name
    until = SLASH_UNTIL.get(found["package"])
    has_slash = until is not None and release <= until
    return f"{found['package']}{'/' if has_slash else '::'}{found['kind']}"


def faults_of_libraries(names: list[str], release: Release) -> dict[str, str]:
    """Returns by name why the navigator does not start with a library in `plugin_lib_names`.

    The reason goes on after "the file lists NAME, which".

    From Jazzy on it loads all of Nav2's libraries by itself, and none of them twice.
    """
    faults = {}
    for name in dict.fromkeys(names):
        since = NODES_SINCE.get(name)
        if names.count(name) > 1:
            faults[name] = "is listed twice, but bt_navigator loads no library twice"
        elif since is not None and since <= release and release >= Release.JAZZY:
            faults[name] = f"{release}'s bt_navigator loads by itself and cannot load a second time"
        elif since is not None and since > release:
            faults[name] = f"exists from {since} on, not in {release}"
        elif since is None and name.startswith("nav2_") and WORDS.issuperset(name.split("_")):
            faults[name] = "exists in no release of Nav2"
    return faults
