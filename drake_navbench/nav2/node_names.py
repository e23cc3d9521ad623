"""The names of Nav2's nodes whose parameters are read here."""

from __future__ import annotations

from drake_navbench.nav2.controllers import SERVER
from drake_navbench.nav2.costmaps import GLOBAL_COSTMAP, LOCAL_COSTMAP

PLANNER_SERVER = "planner_server"
SMOOTHER_SERVER = "smoother_server"
BT_NAVIGATOR = "bt_navigator"
COLLISION_MONITOR = "collision_monitor"
BEHAVIOR_SERVER = "behavior_server"
WAYPOINT_FOLLOWER = "waypoint_follower"
VELOCITY_SMOOTHER = "velocity_smoother"
READ = (
    SERVER,
    LOCAL_COSTMAP,
    GLOBAL_COSTMAP,
    PLANNER_SERVER,
    SMOOTHER_SERVER,
    BT_NAVIGATOR,
    COLLISION_MONITOR,
    BEHAVIOR_SERVER,
    WAYPOINT_FOLLOWER,
    VELOCITY_SMOOTHER,
)
