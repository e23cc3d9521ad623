"""The inputs of a critic: the scene of this cycle and a batch of sampled trajectories."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import ArrayLike, NDArray

from drake_navbench.controllers.mppi.float32_math import ONE, ZERO
from drake_navbench.controllers.mppi.lanes import LANES, Lanes, unpack
from drake_navbench.controllers.mppi.releases import Furthest
from drake_navbench.kernels.grid import INSCRIBED, LETHAL, NO_INFORMATION, OFF_MAP, Costmap, cost_at
from drake_navbench.kernels.poses import with_wrapped_headings

Float32Array = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Scene:
    """The facts that stay the same within a cycle.

    pose: (3,) x m, y m, yaw rad. path: (n, 3) float32, the local plan, same units.
    path_length: length of the local plan, float32 m. goal_xy_tolerance_m: tolerance of the goal
    checker.
    straight_goal: (3,) x m, y m, yaw rad, to which the releases up to Kilted measure the distance
    to the goal; None: along the local plan. furthest: the rule by which its furthest reached point
    is searched.
    """

    pose: NDArray[np.float64]
    path: Float32Array
    path_length: np.float32
    costmap: Costmap
    goal_xy_tolerance_m: float = 0.25
    straight_goal: NDArray[np.float64] | None = None
    furthest: Furthest = Furthest.BY_LENGTH

    @classmethod
    def from_plan(
        cls,
        plan: ArrayLike,
        *,
        pose: ArrayLike,
        costmap: Costmap,
        goal_xy_tolerance_m: float = 0.25,
        straight_goal: NDArray[np.float64] | None = None,
        furthest: Furthest = Furthest.BY_LENGTH,
    ) -> Scene:
        """Builds a scene from a local plan (n, 3) in m and rad, n >= 1.

        The length is summed in double and then rounded, as Nav2 does. Headings beyond half a turn
        are wrapped, as Nav2 reads them from quaternions: in float32 that is another number.
        """
        plan = with_wrapped_headings(np.asarray(plan, dtype=np.float64))
        pose = np.asarray(pose, dtype=np.float64)
        goal = None if straight_goal is None else with_wrapped_headings(straight_goal[None])[0]
        steps = np.diff(plan[:, :2], axis=0)
        length = np.float32(np.sum(np.hypot(steps[:, 0], steps[:, 1])))
        return cls(
            with_wrapped_headings(pose[None])[0],
            np.ascontiguousarray(plan, dtype=np.float32),
            length,
            costmap,
            goal_xy_tolerance_m,
            goal,
            furthest,
        )

    @cached_property
    def way_left(self) -> np.float32:
        """The distance to the goal, m."""
        if self.straight_goal is None:
            return self.path_length
        return np.float32(np.hypot(*(self.pose[:2] - self.straight_goal[:2])))

    @cached_property
    def goal(self) -> Float32Array:
        """(3,) x m, y m, yaw rad that the critics near the goal pull to."""
        if self.straight_goal is None:
            return self.path[-1]
        return self.straight_goal.astype(np.float32)

    @cached_property
    def path_x(self) -> Float32Array:
        """(n,) the x of the local plan's points, m."""
        return np.ascontiguousarray(self.path[:, 0])

    @cached_property
    def path_y(self) -> Float32Array:
        """(n,) the y of the local plan's points, m."""
        return np.ascontiguousarray(self.path[:, 1])

    @cached_property
    def path_yaw(self) -> Float32Array:
        """(n,) the yaw of the local plan's points, rad."""
        return np.ascontiguousarray(self.path[:, 2])

    @cached_property
    def arc_lengths(self) -> Float32Array:
        """(n,) length of the local plan up to each point, summed in float32, m."""
        return _arc_lengths(self.path_x, self.path_y)

    @cached_property
    def path_valid(self) -> NDArray[np.bool_]:
        """(n - 1,) whether the robot's centre may be at a path point, the last one left out."""
        costmap = self.costmap
        return _path_valid(
            self.path[:-1].astype(np.float64),
            costmap.grid,
            costmap.tracks_unknown,
        )


class Reach(NamedTuple):
    """The end and the sparse columns of each sample's trajectory, for the path critics.

    end_x, end_y m, end_yaw rad, length m: (blocks, LANES); the length leaves out the first step.
    column_x, column_y, column_yaw: (blocks, K, LANES), every q-th column from column 0.
    """

    end_x: Lanes
    end_y: Lanes
    end_yaw: Lanes
    length: Lanes
    column_x: Lanes
    column_y: Lanes
    column_yaw: Lanes


@dataclass(frozen=True, eq=False)
class Batch:
    """Sampled trajectories in one scene. `x` ... `wz` are (blocks, N, LANES), see `lanes`.

    size: number of samples B. furthest: index of the path point that the batch reaches, where it
    is already known for this cycle; else it is found from this batch.
    """

    scene: Scene
    size: int
    x: Lanes
    y: Lanes
    yaw: Lanes
    vx: Lanes
    vy: Lanes
    wz: Lanes
    known_furthest: int | None = None
    _reach: dict[int, Reach] = field(default_factory=dict, repr=False)

    @property
    def poses(self) -> Float32Array:
        """(B, N, 3) x m, y m, yaw rad: a copy in the order that numpy code likes."""
        return np.stack([unpack(q, self.size) for q in (self.x, self.y, self.yaw)], axis=2)

    @property
    def velocities(self) -> Float32Array:
        """(B, N, 3) vx m/s, vy m/s, wz rad/s: a copy in the order that numpy code likes."""
        return np.stack([unpack(q, self.size) for q in (self.vx, self.vy, self.wz)], axis=2)

    def reach(self, column_step: int = 1) -> Reach:
        """Returns the samples' ends, lengths and every `column_step`-th column."""
        if column_step not in self._reach:
            columns = [
                np.ascontiguousarray(q[:, ::column_step]) for q in (self.x, self.y, self.yaw)
            ]
            x, y, yaw = (np.ascontiguousarray(q[:, -1]) for q in (self.x, self.y, self.yaw))
            lengths = np.zeros_like(x)
            for block in range(len(lengths)):
                length_lanes(self.x[block], self.y[block], lengths[block])
            self._reach[column_step] = Reach(x, y, yaw, lengths, *columns)
        return self._reach[column_step]

    @cached_property
    def furthest(self) -> int:
        """Index of the furthest path point that any sample ends closest to."""
        if self.known_furthest is not None:
            return self.known_furthest
        return furthest_point(self.scene, self.reach(), self.size)


def furthest_point(scene: Scene, reach: Reach, size: int) -> int:
    """Returns the largest index of a path point closest to the end of one of `size` samples.

    A sample may only use points up to the first whose arc length is at least its own length, so
    that a path which comes back past itself is not skipped (utils::findPathFurthestReachedPoint).
    Releases up to Kilted have no such bound.
    """
    if scene.furthest is not Furthest.BY_LENGTH:
        restarts = scene.furthest is Furthest.ALL
        return int(_furthest_of_all(scene.path_x, scene.path_y, reach, size, restarts))
    return int(_furthest_point(scene.path_x, scene.path_y, scene.arc_lengths, reach, size))


@njit(cache=True)
def length_lanes(x, y, lengths):
    """Adds the distances between consecutive columns of x, y (N, LANES) to `lengths` (LANES,)."""
    for t in range(1, x.shape[0]):
        for lane in range(LANES):
            dx = x[t, lane] - x[t - 1, lane]
            dy = y[t, lane] - y[t - 1, lane]
            lengths[lane] += np.sqrt(dx * dx + dy * dy)


@njit(cache=True)
def _arc_lengths(path_x, path_y):
    lengths = np.zeros(path_x.shape[0], np.float32)
    for k in range(1, path_x.shape[0]):
        dx, dy = path_x[k] - path_x[k - 1], path_y[k] - path_y[k - 1]
        lengths[k] = lengths[k - 1] + np.sqrt(dx * dx + dy * dy)
    return lengths


@njit(cache=True)
def _path_valid(points, grid, tracks_unknown):
    valid = np.zeros(points.shape[0], np.bool_)
    for k in range(points.shape[0]):
        cost = cost_at(grid, points[k, 0], points[k, 1])
        if cost == OFF_MAP:
            continue
        if cost == NO_INFORMATION:
            valid[k] = tracks_unknown
        else:
            valid[k] = cost != LETHAL and cost != INSCRIBED
    return valid


@njit(cache=True)
def _furthest_point(path_x, path_y, arc_lengths, reach, size):
    last = path_x.shape[0] - 1
    furthest = 0
    nearest = np.empty(LANES, np.int32)
    best = np.empty(LANES, np.float32)
    for block in range(reach.end_x.shape[0]):
        _nearest_row(
            path_x,
            path_y,
            arc_lengths,
            reach.end_x[block],
            reach.end_y[block],
            reach.length[block],
            best,
            nearest,
        )
        for lane in range(min(LANES, size - block * LANES)):
            furthest = max(furthest, nearest[lane])
        if furthest == last:
            break
    return furthest


@njit(cache=True)
def _furthest_of_all(path_x, path_y, reach, size, restarts):
    furthest = 0
    for sample in range(size):
        block, lane = sample // LANES, sample % LANES
        best, nearest = np.float32(np.inf), 0
        for k in range(0 if restarts else furthest, path_x.shape[0]):
            dx = path_x[k] - reach.end_x[block, lane]
            dy = path_y[k] - reach.end_y[block, lane]
            distance = dx * dx + dy * dy
            if distance < best:
                best, nearest = distance, k
        furthest = max(furthest, nearest)
    return furthest


@register_jitable
def _nearest_row(path_x, path_y, arc_lengths, end_x, end_y, length, best, nearest):
    """Finds, lane by lane, the first closest path point among those within the sample's length."""
    longest = ZERO
    for lane in range(LANES):
        best[lane] = np.inf
        nearest[lane] = 0
        longest = max(longest, length[lane])
    reached_before = -ONE
    for k in range(path_x.shape[0]):
        # Point k counts where the point before it is not yet as far as the sample is long.
        if k > 0 and reached_before >= longest:
            break
        index = np.int32(k)
        px, py = path_x[k], path_y[k]
        for lane in range(LANES):
            dx, dy = px - end_x[lane], py - end_y[lane]
            distance = dx * dx + dy * dy
            closer = (distance < best[lane]) & (reached_before < length[lane])
            best[lane] = distance if closer else best[lane]
            nearest[lane] = index if closer else nearest[lane]
        reached_before = arc_lengths[k]
