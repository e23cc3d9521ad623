"""The state of a running trial at one time, for the live view."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from numpy.typing import NDArray

from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.scan import Scan


class Moment(NamedTuple):
    """The state of a trial at one time, as the live view draws it.

    state: (6,) x m, y m, yaw rad, v m/s, w rad/s, vy m/s. scan, costmap: the latest, None before
    there was any. plan: (N, 3) poses of the plan in force, x m, y m, yaw rad; None before there is
    one. diagnostics: the controller's, of its last cycle. moving_poses: (B, 3) x m, y m, yaw rad
    of the moving obstacles and people. odometry_from_world: (3,) the pose X_OW of the world frame W
    in the odometry frame O, in which costmap and diagnostics are; None where both frames are one.
    """

    time_s: float
    state: NDArray[Any]
    scan: Scan | None
    costmap: Costmap | None
    plan: NDArray[Any] | None
    diagnostics: Mapping[str, Any]
    moving_poses: NDArray[Any]
    odometry_from_world: NDArray[Any] | None = None
