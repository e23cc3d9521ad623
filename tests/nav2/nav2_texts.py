"""Plugin types of Nav2, pieces of its files, and the rows that are told about them."""

from __future__ import annotations

from drake_navbench.inputs.check import CheckRow
from drake_navbench.inputs.robot import load_robot
from drake_navbench.nav2.nav2_setup import Nav2Setup

DWB = "dwb_core::DWBLocalPlanner"
MPPI = "nav2_mppi_controller::MPPIController"
RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
TEB = "teb_local_planner::TebLocalPlannerROS"
GRACEFUL = "nav2_graceful_controller::GracefulController"
SHIM = "nav2_rotation_shim_controller::RotationShimController"
VECTOR_PURSUIT = "vector_pursuit_controller::VectorPursuitController"
ALL = ("humble", "iron", "jazzy", "kilted", "lyrical")
WHEELCHAIR = load_robot("wheelchair")
COLUMN = f"""
controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath:
      plugin: {RPP}
"""
LOCAL = "local_costmap: {local_costmap: {ros__parameters: {%s}}}\n"
SEEING = "rolling_window: true, plugins: [obstacles], obstacles: {plugin: %s, %s}"


def as_nested(values):
    """Returns blocks in blocks for dotted names."""
    result = {}
    for name, value in values.items():
        *blocks, last = name.split(".")
        target = result
        for block in blocks:
            target = target.setdefault(block, {})
        target[last] = value
    return result


def row_of(setup: Nav2Setup, parameter: str) -> CheckRow:
    """Returns the only row about a parameter."""
    (row,) = (row for row in setup.check.rows if row.parameter == parameter)
    return row


def of_each(value_of) -> list:
    """Returns a value for each release, the oldest first."""
    return [value_of(release) for release in ALL]
