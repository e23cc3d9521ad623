"""The planner of Nav2's tutorial on planner plugins: a straight line, whatever stands there.

Source: navigation2_tutorials (nav2_straightline_planner), as Nav2's documentation describes it.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import Costmap
from drake_navbench.navigation.planner import as_pose
from drake_navbench.typed_files.quantities import Length
from drake_navbench.typed_files.typed_yaml import FrozenModel


class StraightLineParameters(FrozenModel):
    """Parameters of nav2_straightline_planner::StraightLine."""

    plugin: Literal["nav2_straightline_planner::StraightLine"] = (
        "nav2_straightline_planner::StraightLine"
    )
    interpolation_resolution: Length = Field(
        0.1, ge=0.001, description="Least distance between two poses of the path [m]."
    )


class StraightLine:
    """Answers requests by a straight line; all headings are 0 but that of the goal."""

    nav2_plugin = "nav2_straightline_planner::StraightLine"
    Parameters = StraightLineParameters

    def __init__(self, parameters: StraightLineParameters, footprint: Array | None) -> None:
        """footprint: without effect, as the planner ignores all obstacles."""
        self.parameters = parameters

    def plan(self, costmap: Costmap, start: ArrayLike, goal: ArrayLike) -> Array:
        """See `Planner.plan`; there always is a path, even off the map."""
        start, goal = as_pose(start, "start"), as_pose(goal, "goal")
        length_m = np.hypot(goal[0] - start[0], goal[1] - start[1])
        count = int(length_m / self.parameters.interpolation_resolution)
        path = np.zeros((count + 1, 3))
        for axis in (0, 1):
            step = (goal[axis] - start[axis]) / max(count, 1)
            path[:count, axis] = start[axis] + step * np.arange(count)
        path[-1] = goal
        return path
