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
from drake_navbench.navigation.task import (
    BehaviorGoal,
    ClearRequest,
    GlobalPlan,
    PoseState,
    TaskPose,
    TaskStatus,
)
from drake_navbench.plugins.releases import NEWEST_RELEASE, Release

PATH = "path"
"""The variable in which Nav2's trees keep the planned path."""
GOAL = "goal"
"""The variable to which NavigateToPose writes its goal."""
GOALS = "goals"
"""The variable to which NavigateThroughPoses writes its goals."""

Pose = NDArray[np.float64]
Poses = NDArray[np.float64]
MakePlan = Callable[[Pose, Pose, Costmap], NDArray[np.float64]]
"""From start and goal (3,) and the global costmap to a plan (N, 3); raises PlanningError."""
IsPathValid = Callable[..., bool]
"""Whether a path (N, 3) is free of collisions on the global costmap; see `is_path_valid`."""
SmoothPath = Callable[[NDArray[np.float64], Costmap], NDArray[np.float64]]
"""From a path (N, 3) and the global costmap to a smoothed one; raises PlanningError."""
PoseCost = Callable[[Pose, Costmap, bool], int | None]
"""From a pose, the global costmap and whether the outline counts to a cost; see `cost_of_pose`."""


@dataclass(frozen=True, eq=False)
class Blackboard(Immutable):
    """The values of a tree that change from tick to tick, besides its nodes' own.

    goal_id, goal: the present goal, (3,) x m, y m, yaw rad; None in NavigateThroughPoses, whose
    goals are lists["goals"]. goal_id grows whenever the goal or that list changes. poses: (3,)
    each, the tree's other variables with a pose. lists, paths: (N, 3) each, lists of goals and
    paths, by the names of the tree's variables; one that is missing is empty. task_poses: the poses
    of NavigateThroughPoses with what became of them.
    results: the last result of each action, by its key; an action that was never tried is missing.
    follow_path, behavior, clear_local, clear_global: the present requests to the servers.
    plan_count, task_count, recovery_count: numbers of plans, tasks and recoveries begun.
    """

    goal_id: int = 0
    goal: Pose | None = None
    poses: Mapping[str, Pose] = field(default_factory=dict)
    lists: Mapping[str, Poses] = field(default_factory=dict)
    task_poses: tuple[TaskPose, ...] = ()
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

    inputs: inputs of the present tick; unset before the first. release: the release of Nav2 whose
    nodes the leaves are.
    """

    make_plan: MakePlan
    is_path_valid: IsPathValid
    smooth_path: SmoothPath
    pose_cost: PoseCost
    release: Release = NEWEST_RELEASE
    inputs: TickInputs = field(init=False)
    values: Blackboard = field(default_factory=Blackboard)

    def write(self, **changes: Any) -> None:
        """Changes values of the blackboard."""
        self.values = replace(self.values, **changes)

    def pose(self, name: str) -> Pose | None:
        """Returns the pose in a variable, (3,), None before it is written."""
        return self.values.goal if name == GOAL else self.values.poses.get(name)

    def write_pose(self, name: str, pose: Pose) -> None:
        """Writes a pose (3,) to a variable."""
        if name != GOAL:
            self.write(poses={**self.values.poses, name: pose})
        elif self.values.goal is None or not np.array_equal(pose, self.values.goal):
            self.write(goal=pose, goal_id=self.values.goal_id + 1)

    def goals(self, name: str) -> Poses:
        """Returns the list of goals in a variable, (N, 3), empty before it is written."""
        return self.values.lists.get(name, np.empty((0, 3)))

    def write_goals(self, name: str, goals: Poses) -> None:
        """Writes a list of goals (N, 3) to a variable."""
        is_new = name == GOALS and not np.array_equal(goals, self.goals(name))
        goal_id = self.values.goal_id + is_new
        self.write(lists={**self.values.lists, name: goals}, goal_id=goal_id)

    def mark(self, goal: Pose, state: PoseState) -> bool:
        """Notes what became of the first pending pose of the task that equals a goal.

        Returns whether there is one.
        """
        poses = list(self.values.task_poses)
        for index, pose in enumerate(poses):
            if pose.state is PoseState.PENDING and pose.pose == tuple(goal):
                poses[index] = replace(pose, state=state)
                self.write(task_poses=tuple(poses))
                return True
        return False

    def write_path(self, name: str, path: NDArray[np.float64] | None, **changes: Any) -> None:
        """Changes a path, which None empties, and other values with it."""
        paths = {key: value for key, value in self.values.paths.items() if key != name}
        if path is not None:
            paths[name] = path
        self.write(paths=paths, **changes)

    def write_result(self, key: str, status: TaskStatus) -> None:
        """Keeps the status with which an action ended."""
        self.write(results={**self.values.results, key: status})
