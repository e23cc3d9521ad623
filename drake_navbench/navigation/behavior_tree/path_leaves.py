"""Leaves that cut and join paths.

Source: nav2_behavior_tree (TruncatePath, TruncatePathLocal, ConcatenatePaths), branches humble to
lyrical.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from py_trees.common import Status

from drake_navbench.kernels.angles import absolute_turns
from drake_navbench.kernels.read_only import read_only
from drake_navbench.navigation.behavior_tree.board import PATH, Board
from drake_navbench.navigation.behavior_tree.leaves import REMAINING_PATH, Leaf, nearest_index
from drake_navbench.plugins.releases import Release

# (N, 3): x m, y m, yaw rad in the map frame.
Path = NDArray[np.float64]


class PathCut(Leaf):
    """A leaf that writes a part of a path."""

    def update(self) -> Status:
        """Writes the shortened path; an empty path stays empty."""
        path = self._path()
        self.board.write_path(self._result, None if path is None else self._cut(path))
        return Status.SUCCESS

    def _cut(self, path: Path) -> Path:
        raise NotImplementedError


class TruncatePath(PathCut):
    """Cuts off the end of a path, up to the last pose that is a distance from the goal.

    That pose then looks at the goal. Two poses stay in any case.
    """

    def __init__(
        self, name: str, board: Board, *, distance_m: float, source: str, result: str
    ) -> None:
        super().__init__(name, board, source=source, result=result)
        self._distance_m = distance_m

    def _cut(self, path: Path) -> Path:
        goal = path[-1]
        to_goal_m = np.hypot(path[:, 0] - goal[0], path[:, 1] - goal[1])
        count = len(path)
        while to_goal_m[count - 1] < self._distance_m and count > 2:
            count -= 1
        left = path[:count].copy()
        left[-1, 2] = math.atan2(goal[1] - left[-1, 1], goal[0] - left[-1, 0])
        return read_only(left)


class TruncatePathLocal(PathCut):
    """Cuts a path to the part around the robot: some way before and behind it.

    forward_m: length kept ahead of the robot; negative: all of it, up to Kilted one pose.
    angle_weight_m: the m that 1 rad of difference in heading adds to the distance, in the search
    for the pose nearest to the robot. search_distance_m: length of the path that is searched, from
    the robot's last place on it; infinity searches all of it.
    """

    MEMORY = ("path", "begin")

    def __init__(
        self,
        name: str,
        board: Board,
        *,
        forward_m: float = -1.0,
        backward_m: float = 0.0,
        angle_weight_m: float = 0.0,
        search_distance_m: float = math.inf,
        source: str = PATH,
        result: str = REMAINING_PATH,
    ) -> None:
        super().__init__(name, board, source=source, result=result)
        keeps_all = forward_m < 0.0 and board.release >= Release.LYRICAL
        self._reach_m = (math.inf if keeps_all else forward_m, backward_m)
        self._angle_weight_m = angle_weight_m
        self._search_distance_m = search_distance_m
        self.path: Path | None = None
        self.begin = 0

    def _cut(self, path: Path) -> Path:
        if math.isinf(self._search_distance_m):
            nearest = self._nearest(path)
        else:
            if path is not self.path:
                self.path, self.begin = path, 0
            end = self.begin + _count_within(path[self.begin :], self._search_distance_m)
            nearest = self.begin + self._nearest(path[self.begin : end])
            self.begin = nearest
        forward_m, backward_m = self._reach_m
        end = nearest + _count_within(path[nearest:], forward_m)
        begin = nearest + 1 - _count_within(path[nearest::-1], backward_m)
        return path[begin:end]

    def _nearest(self, path: Path) -> int:
        """Returns the index of the pose nearest to the robot; of equals Humble takes the first."""
        pose = self.board.inputs.pose
        if self._angle_weight_m == 0.0 and self.board.release > Release.HUMBLE:
            return nearest_index(path, pose)
        turns = self._angle_weight_m * absolute_turns(pose[2], path[:, 2])
        offsets = np.hypot(path[:, 0] - pose[0], path[:, 1] - pose[1])
        distances_m = np.hypot(offsets, turns)
        if self.board.release is Release.HUMBLE:
            return int(np.argmin(distances_m))
        return len(path) - 1 - int(np.argmin(distances_m[::-1]))


class ConcatenatePaths(Leaf):
    """Joins two paths, one behind the other; fails where both are empty.

    sources: names of the two on the board.
    """

    def __init__(self, name: str, board: Board, *, sources: tuple[str, str], result: str) -> None:
        super().__init__(name, board, result=result)
        self._sources = sources

    def update(self) -> Status:
        """Writes the joined path."""
        paths = self.board.values.paths
        parts = [paths[name] for name in self._sources if name in paths]
        if not parts:
            return Status.FAILURE
        self.board.write_path(self._result, read_only(np.vstack(parts)))
        return Status.SUCCESS


def _count_within(path: Path, distance_m: float) -> int:
    """Returns the number of first poses within a distance along the path, m; at least 1."""
    if math.isinf(distance_m):
        return len(path)
    steps_m = np.hypot(*np.diff(path[:, :2], axis=0).T)
    return 1 + int(np.count_nonzero(np.cumsum(steps_m) <= distance_m))
