"""Nav2's FeasiblePathHandler: the part of the global plan that a controller sees in a cycle."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from drake_navbench.controller import InvalidPath
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.path_pruning import (
    first_constraint_end,
    is_within_tolerances,
    local_plan_range,
)
from drake_navbench.typed_files.quantities import Angle, Length
from drake_navbench.typed_files.typed_yaml import FrozenModel
from drake_navbench.typed_files.usual_values import not_negative


class PathHandlerParameters(FrozenModel):
    """Parameters of nav2_controller::FeasiblePathHandler."""

    prune_distance: Length = Field(
        2.0,
        ge=0.0,
        description="Arc length of the local plan from the pose closest to the robot [m].",
    )
    max_robot_pose_search_dist: Length | None = Field(
        None,
        description="Arc length of the plan in which the closest pose is searched [m]; negative: "
        "all of it; null: half the local costmap's larger side.",
    )
    enforce_path_inversion: bool = Field(
        False, description="Drive to each cusp of the plan before the part behind it."
    )
    enforce_path_rotation: bool = Field(
        False, description="Drive to each turn in place of the plan before the part behind it."
    )
    inversion_xy_tolerance: Annotated[
        Length, not_negative("no cusp or turn in place counts as reached")
    ] = Field(0.2, description="Distance at which the robot has arrived at a cusp or turn [m].")
    inversion_yaw_tolerance: Annotated[
        Angle, not_negative("no cusp or turn in place counts as reached")
    ] = Field(
        0.4,
        description="Heading error at which the robot has arrived at a cusp or turn [rad].",
    )
    minimum_rotation_angle: Angle = Field(
        0.785,
        ge=0.0,
        description="Angle above which a turn in place of the plan is enforced [rad]; 0: never.",
    )
    reject_unit_path: bool = Field(False, description="Refuse plans with a single pose.")


class PathHandlerState(NamedTuple):
    """The progress along a global plan.

    plan: (N, 3) x m, y m, yaw rad, read-only, the whole global plan.
    begin, end: plan[begin:end] is being followed: passed poses are gone, and `end` lies behind the
        first cusp or turn in place that is enforced.
    """

    plan: Array
    begin: int
    end: int


class PathHandler:
    """Cuts local plans out of a global plan; pure, its state is a `PathHandlerState`.

    Source: nav2_controller::FeasiblePathHandler, branch lyrical. Plan, pose and costmap share one
    frame.
    """

    nav2_plugin = "nav2_controller::FeasiblePathHandler"
    Parameters = PathHandlerParameters

    def __init__(self, parameters: PathHandlerParameters) -> None:
        self.parameters = parameters
        self._rotation_threshold = (
            parameters.minimum_rotation_angle if parameters.enforce_path_rotation else 0.0
        )

    def set_plan(self, plan: ArrayLike) -> PathHandlerState:
        """Returns the state at the start of a new global plan (N, 3) x m, y m, yaw rad.

        Raises ValueError for another shape. An empty plan is refused by `cut`, as in Nav2.
        """
        poses = np.array(plan, dtype=np.float64, order="C")
        if poses.ndim != 2 or poses.shape[1] != 3:
            raise ValueError(f"plan: got an array of shape {poses.shape}, expected (N, 3)")
        poses.flags.writeable = False
        return PathHandlerState(poses, 0, self._constraint_end(poses, 0))

    def cut(
        self, state: PathHandlerState, pose: ArrayLike, costmap: Costmap
    ) -> tuple[Array, PathHandlerState]:
        """Returns the local plan (M, 3), a read-only view, and the state for the next cycle.

        pose: (3,) robot, x m, y m, yaw rad. Poses before the closest one are dropped for good. Once
        the robot is near an enforced cusp or turn in place, the plan behind it follows, from the
        next cycle on. Raises InvalidPath where nothing is left to follow.
        """
        plan, begin, end = state
        if begin >= end:
            raise InvalidPath("plan: found no poses, expected at least one")
        if self.parameters.reject_unit_path and end - begin == 1:
            raise InvalidPath("plan: found one pose, expected two or more (reject_unit_path)")
        x, y, yaw = np.asarray(pose, dtype=np.float64).tolist()
        first, stop = local_plan_range(
            plan,
            begin,
            end,
            x,
            y,
            self._search_distance_m(costmap),
            self.parameters.prune_distance,
            costmap.grid,
        )
        if first == stop:
            raise InvalidPath(
                f"local plan: the closest pose ({plan[first, 0]:.3f}, {plan[first, 1]:.3f}) m lies "
                "outside the local costmap, expected inside"
            )
        return plan[first:stop], self._advanced(plan, first, end, x=x, y=y, yaw=yaw)

    def _advanced(
        self, plan: Array, first: int, end: int, *, x: float, y: float, yaw: float
    ) -> PathHandlerState:
        is_constrained = end < len(plan)
        if is_constrained and is_within_tolerances(
            plan,
            end - 1,
            x,
            y,
            yaw,
            self.parameters.inversion_xy_tolerance,
            self.parameters.inversion_yaw_tolerance,
        ):
            return PathHandlerState(plan, end, self._constraint_end(plan, end))
        return PathHandlerState(plan, first, end)

    def _constraint_end(self, plan: Array, begin: int) -> int:
        enforce_inversion = self.parameters.enforce_path_inversion
        if not enforce_inversion and self._rotation_threshold == 0.0:
            return len(plan)
        return first_constraint_end(plan, begin, enforce_inversion, self._rotation_threshold)

    def _search_distance_m(self, costmap: Costmap) -> float:
        distance_m = self.parameters.max_robot_pose_search_dist
        if distance_m is None:
            return 0.5 * max(costmap.size_x_m, costmap.size_y_m)
        return distance_m if distance_m >= 0.0 else math.inf
