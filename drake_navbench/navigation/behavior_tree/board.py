"""The blackboard: the values that the leaves of a tree read and write.

py_trees' own blackboard is one dictionary for the whole process, shared by all trees and all
Contexts; this one is a value.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.immutable import Immutable
from drake_navbench.navigation.task import BehaviorGoal, ClearRequest, GlobalPlan, TaskStatus

PATH = "path"
"""The variable in which Nav2's trees keep the planned path."""

Pose = NDArray[np.float64]
MakePlan = Callable[[Pose, Pose, Costmap], NDArray[np.float64]]
"""From start and goal (3,) and the global costmap to a plan (N, 3); raises PlanningError."""
IsPathValid = Callable[..., bool]
"""Whether a path (N, 3) is free of collisions on the global costmap; see `is_path_valid`."""
SmoothPath = Callable[[NDArray[np.float64], Costmap], NDArray[np.float64]]
"""From a path (N, 3) and the global costmap to a smoothed one; raises PlanningError."""


@dataclass(frozen=True, eq=False)
class Blackboard(Immutable):
    """The values of a tree that change from tick to tick, besides its nodes' own.

    goal_id, goal: the present goal, (3,) x m, y m, yaw rad. paths: (N, 3) each, by the names of the
    tree's variables; one that is missing is empty.
    results: the last result of each action, by its key; an action that was never tried is missing.
    follow_path, behavior, clear_local, clear_global: the present requests to the servers.
    plan_count, task_count, recovery_count: numbers of plans, tasks and recoveries begun.
    """

    goal_id: int = 0
    goal: Pose | None = None
    paths: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    results: Mapping[str, TaskStatus] = field(default_factory=dict)
    follow_path: GlobalPlan | None = None
    behavior: BehaviorGoal | None = None
    clear_local: ClearRequest | None = None
    clear_global: ClearRequest | None = None
    plan_count: int = 0
    task_count: int = 0
    recovery_count: int = 0

    @property
    def path(self) -> NDArray[np.float64] | None:
        """The path that Nav2's trees plan, (N, 3); None where it is empty."""
        return self.paths.get(PATH)


@dataclass(frozen=True, eq=False)
class TickInputs:
    """The inputs of one tick of the tree.

    now_s: time of the tick. pose: (3,) estimate. global_costmap: the latest one.
    controller_status, behavior_status: status of the servers. twist: (2,) measured velocity forward
    and to the left, m/s.
    """

    now_s: float
    pose: Pose
    global_costmap: Costmap
    controller_status: TaskStatus = field(default_factory=TaskStatus)
    behavior_status: TaskStatus = field(default_factory=TaskStatus)
    twist: tuple[float, float] = (0.0, 0.0)


@dataclass
class Board:
    """The data that the leaves of a tree share: inputs to read, and values to read and write.

    inputs: inputs of the present tick; unset before the first.
    """

    make_plan: MakePlan
    is_path_valid: IsPathValid
    smooth_path: SmoothPath
    inputs: TickInputs = field(init=False)
    values: Blackboard = field(default_factory=Blackboard)

    def write(self, **changes: Any) -> None:
        """Changes values of the blackboard."""
        self.values = replace(self.values, **changes)

    def write_path(self, name: str, path: NDArray[np.float64] | None, **changes: Any) -> None:
        """Changes a path, which None empties, and other values with it."""
        paths = {key: value for key, value in self.values.paths.items() if key != name}
        if path is not None:
            paths[name] = path
        self.write(paths=paths, **changes)

    def write_result(self, key: str, status: TaskStatus) -> None:
        """Keeps the status with which an action ended."""
        self.write(results={**self.values.results, key: status})
