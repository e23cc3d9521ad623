"""The columns of a log's table: those of every trial, and those that only some have."""

from __future__ import annotations

from collections.abc import Collection, Mapping

# Column -> meaning; the unit is in the name.
COLUMNS: Mapping[str, str] = {
    "time_s": "time since the start of the trial",
    "x_m": "true position, world frame",
    "y_m": "true position, world frame",
    "yaw_rad": "true heading in the world frame, not wrapped",
    "v_mps": "true forward velocity, base frame",
    "w_radps": "true yaw rate",
    "estimated_x_m": "estimated position, map frame",
    "estimated_y_m": "estimated position, map frame",
    "estimated_yaw_rad": "estimated heading, map frame",
    "measured_v_mps": "measured forward velocity, base frame",
    "measured_w_radps": "measured yaw rate",
    "command_v_mps": "last commanded forward velocity, base frame",
    "command_w_radps": "last commanded yaw rate",
    "clearance_m": "distance from the footprint to the nearest obstacle, every 0.05 s; "
    "0 at a touch",
    "obstacle_cell_distance_m": "distance from the base origin to the nearest centre of a "
    "lethal cell of the local costmap",
    "obstacle_corner_distance_m": "distance from the base origin to the nearest lower left "
    "corner of a lethal cell, which the publication uses as the cell's position",
    "cycle_count": "number of control cycles so far",
    "compute_time_ms": "wall-clock time of the last control cycle (varies from run to run)",
    "compute_cpu_time_ms": "processor time of the thread in the last control cycle (likewise); "
    "empty in logs from before it was measured",
}
# Columns only in logs of robots that move sideways.
LATERAL_COLUMNS: Mapping[str, str] = {
    "vy_mps": "true velocity to the left, base frame",
    "measured_vy_mps": "measured velocity to the left, base frame",
    "command_vy_mps": "last commanded velocity to the left, base frame",
}
# Columns only in logs of robots whose odometry has a frame of its own.
ODOMETRY_COLUMNS: Mapping[str, str] = {
    "odometry_x_m": "true position, odometry frame: the frame of local costmaps and of the "
    "controller's diagnostics",
    "odometry_y_m": "true position, odometry frame",
    "odometry_yaw_rad": "true heading, odometry frame",
}
# Columns only in logs of missions over several floors.
MISSION_COLUMNS: Mapping[str, str] = {
    "floor": "index of the robot's floor in the list `floors` of the header",
    "leg": "index of the leg of the mission; a ride belongs to the leg before it",
}
# Groups of columns of some logs: a log has all of a group, or none.
OWN_COLUMNS = (LATERAL_COLUMNS, ODOMETRY_COLUMNS, MISSION_COLUMNS)
# Columns that were added later: a log without them is still valid.
LATER_COLUMNS = frozenset({"compute_cpu_time_ms"})
# Columns that are no function of the trial: two runs of one trial differ in them.
UNREPEATABLE_COLUMNS = ("compute_time_ms", "compute_cpu_time_ms")


def own_columns(found: Collection[str]) -> list[str]:
    """Returns the found columns that only some logs have, in the order of OWN_COLUMNS."""
    return [name for columns in OWN_COLUMNS for name in columns if name in found]
