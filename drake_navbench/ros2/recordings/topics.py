"""The topics of an exported trial: Nav2's names and types where Nav2 has them, ours for the rest.

docs/recordings.md is held against these tables by a test.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple


class Topic(NamedTuple):
    """A topic. is_latched: whether subscribers that join later still get the last message."""

    name: str
    type: str
    is_latched: bool = False


# A message on its topic, with its stamp in ns.
Message = tuple[Topic, int, Any]


MAP_FRAME, ODOM_FRAME, BASE_FRAME, LIDAR_FRAME = "map", "odom", "base_link", "base_scan"
FOOTPRINT_FRAME = "base_footprint"

CLOCK = Topic("/clock", "rosgraph_msgs/msg/Clock")
TF = Topic("/tf", "tf2_msgs/msg/TFMessage")
TF_STATIC = Topic("/tf_static", "tf2_msgs/msg/TFMessage", is_latched=True)
ROBOT_DESCRIPTION = Topic("/robot_description", "std_msgs/msg/String", is_latched=True)
MAP = Topic("/map", "nav_msgs/msg/OccupancyGrid", is_latched=True)
GOAL = Topic("/goal_pose", "geometry_msgs/msg/PoseStamped")
ODOMETRY = Topic("/odom", "nav_msgs/msg/Odometry")
TRUTH = Topic("/ground_truth/odom", "nav_msgs/msg/Odometry")
ESTIMATE = Topic("/amcl_pose", "geometry_msgs/msg/PoseWithCovarianceStamped")
COMMAND = Topic("/cmd_vel", "geometry_msgs/msg/TwistStamped")
SCAN = Topic("/scan", "sensor_msgs/msg/LaserScan")
PLAN = Topic("/plan", "nav_msgs/msg/Path")
RECEIVED_PLAN = Topic("/received_global_plan", "nav_msgs/msg/Path")
COSTMAP = Topic("/local_costmap/costmap", "nav_msgs/msg/OccupancyGrid", is_latched=True)
FOOTPRINT = Topic("/local_costmap/published_footprint", "geometry_msgs/msg/PolygonStamped")
PREDICTED = Topic("/predicted_trajectory", "visualization_msgs/msg/MarkerArray")
SAMPLED = Topic("/trajectories", "visualization_msgs/msg/MarkerArray")
LOOKAHEAD = Topic("/lookahead_point", "geometry_msgs/msg/PointStamped")
OBSTACLES = Topic("/obstacles", "visualization_msgs/msg/MarkerArray", is_latched=True)
MOVING = Topic("/moving_obstacles", "visualization_msgs/msg/MarkerArray")
DIAGNOSTICS = Topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
NAVIGATE_STATUS = Topic(
    "/navigate_to_pose/_action/status", "action_msgs/msg/GoalStatusArray", is_latched=True
)
THROUGH_STATUS = Topic(
    "/navigate_through_poses/_action/status", "action_msgs/msg/GoalStatusArray", is_latched=True
)
FOLLOW_STATUS = Topic(
    "/follow_path/_action/status", "action_msgs/msg/GoalStatusArray", is_latched=True
)
# Navigation mode -> the states of the goal.
STATUS_OF_MODE = {
    "navigate_to_pose": NAVIGATE_STATUS,
    "navigate_through_poses": THROUGH_STATUS,
    "follow_path": FOLLOW_STATUS,
}
TRIAL = Topic("/drake_navbench/trial", "std_msgs/msg/String", is_latched=True)

# The log's columns that no ROS message carries; each gets a topic of numbers.
SCALAR_COLUMNS = (
    "clearance_m",
    "obstacle_cell_distance_m",
    "obstacle_corner_distance_m",
    "cycle_count",
    "compute_time_ms",
    "compute_cpu_time_ms",
)
SCALARS: Mapping[str, Topic] = {
    name: Topic(f"/drake_navbench/{name}", "std_msgs/msg/Float64") for name in SCALAR_COLUMNS
}
