"""Critics that count cells to the plan: PathDist, GoalDist, PathAlign, GoalAlign.

All four read a grid of Manhattan distances (Nav2's MapGridCritic). The Dist critics look at the
robot's centre, the Align critics at a point ahead of it, so that the nose follows too.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from enum import IntEnum
from typing import Any, ClassVar

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray
from pydantic import Field

from drake_navbench.controllers.dwb.critics.base import Critic, Verdict
from drake_navbench.controllers.dwb.critics.parameters import CriticParameters
from drake_navbench.controllers.dwb.scene import Scene, Situation
from drake_navbench.kernels.grid import world_to_cell
from drake_navbench.kernels.read_only import read_only
from drake_navbench.typed_files.quantities import Length

# Positions in the critics' reasons, counted from 1.
OFF_GRID, UNREACHABLE = 1, 2
# Nav2 weights a distance in cells as if the scale were meant per two metres.
CELLS_TO_SCALE = 0.5


class Aggregation(IntEnum):
    """The combination of the values at a trajectory's poses to one score."""

    LAST = 0
    SUM = 1
    PRODUCT = 2


# Numba takes the members as plain integers.
LAST, SUM, PRODUCT = (int(aggregation) for aggregation in Aggregation)


class MapGridParameters(CriticParameters):
    """Parameters of the Dist critics."""

    aggregation_type: str = Field(
        "last",
        description="How the costs of a trajectory's poses become one score: last, sum or "
        "product, upper or lower case; any other word means last.",
    )

    @property
    def aggregation(self) -> Aggregation:
        """The aggregation that `aggregation_type` names."""
        return Aggregation.__members__.get(self.aggregation_type.upper(), Aggregation.LAST)


class AlignParameters(MapGridParameters):
    """Parameters of the Align critics."""

    forward_point_distance: Length = Field(
        0.325, description="Distance of the scored point ahead of the robot's origin [m]."
    )


@register_jitable
def aggregate(aggregation, score, value):
    """Returns the score after one more pose with `value`; a product stops growing at zero."""
    if aggregation == SUM:
        return score + value
    if aggregation == PRODUCT:
        return score * value if score > 0.0 else score
    return value


@njit(cache=True)
def score_centres(cells, on_map_counts, pose_counts, distances, aggregation, scores, violations):
    """Writes the aggregated distance of the robot's centre; all poses must be on the map.

    cells (K, N), on_map_counts (K,), pose_counts (K,): of the scene. distances: (rows * columns,)
    cells. Where the grid had no seed, the first pose on the map is already unreachable.
    """
    unreachable = distances.size + 1
    has_seed = distances[0] != unreachable
    for k in range(cells.shape[0]):
        scores[k] = 0.0
        violations[k] = 0
        if not has_seed and on_map_counts[k] > 0:
            violations[k] = UNREACHABLE
        elif on_map_counts[k] < pose_counts[k]:
            violations[k] = OFF_GRID
        elif aggregation == LAST:
            scores[k] = distances[cells[k, pose_counts[k] - 1]]
        else:
            score = 1.0 if aggregation == PRODUCT else 0.0
            for i in range(pose_counts[k]):
                score = aggregate(aggregation, score, float(distances[cells[k, i]]))
            scores[k] = score


@njit(cache=True)
def score_forward_points(
    poses,
    headings,
    pose_counts,
    forward_m,
    distances,
    aggregation,
    scores,
    violations,
):
    """Writes the aggregated distance of the point `forward_m` ahead of the robot.

    poses (K, N, 3), headings (K, N, 2), pose_counts (K,): of the window. distances: `Grid` of
    cells. With aggregation LAST only the last pose is read, so only there the point must be on the
    map.
    """
    values, origin_x, origin_y, resolution = distances
    rows, columns = values.shape
    for k in range(poses.shape[0]):
        score = 1.0 if aggregation == PRODUCT else 0.0
        violations[k] = 0
        first = pose_counts[k] - 1 if aggregation == LAST else 0
        for i in range(first, pose_counts[k]):
            x = poses[k, i, 0] + forward_m * headings[k, i, 0]
            y = poses[k, i, 1] + forward_m * headings[k, i, 1]
            column, row = world_to_cell(x, y, origin_x, origin_y, resolution, columns, rows)
            if column < 0:
                violations[k] = OFF_GRID
                break
            score = aggregate(aggregation, score, float(values[row, column]))
        scores[k] = score


class MapGridCritic(Critic):
    """Base of the map grid critics: a grid of distances, weighted with resolution * 0.5 * scale."""

    Parameters: ClassVar[type[CriticParameters]] = MapGridParameters
    reasons: ClassVar[tuple[str, ...]] = (
        "Trajectory Goes Off Grid.",
        "Trajectory Hits Unreachable Area.",
    )

    def scale(self, situation: Situation, memory: Any) -> float:
        """Returns resolution * 0.5 * scale, as Nav2 weights distances in cells."""
        return situation.costmap.resolution * CELLS_TO_SCALE * self._parameters.scale

    @abstractmethod
    def distances(self, situation: Situation) -> NDArray[np.int32]:
        """Returns the (rows, columns) distances in cells that the poses are looked up in."""

    def score(self, scene: Scene, memory: Any) -> Verdict:
        """Returns the distances of the robot's centre; see `score_centres`."""
        verdict = Verdict.blank(len(scene.cells))
        score_centres(
            scene.cells,
            scene.on_map_counts,
            scene.trajectories.pose_counts,
            self.distances(scene).ravel(),
            int(self._parameters.aggregation),
            *verdict,
        )
        return verdict


class AlignCritic(MapGridCritic):
    """Base of the two critics that look at a point ahead of the robot."""

    Parameters: ClassVar[type[CriticParameters]] = AlignParameters

    def score(self, scene: Scene, memory: Any) -> Verdict:
        """Returns the distances of the forward point; see `score_forward_points`."""
        window = scene.trajectories
        verdict = Verdict.blank(len(window.poses))
        score_forward_points(
            window.poses,
            window.headings,
            window.pose_counts,
            self._parameters.forward_point_distance,
            scene.costmap.grid._replace(costs=self.distances(scene)),
            int(self._parameters.aggregation),
            *verdict,
        )
        return verdict


class PathDist(MapGridCritic):
    """score = cells from the robot to the local plan."""

    def distances(self, situation: Situation) -> NDArray[np.int32]:
        """Returns the distances to the cells under the local plan."""
        return situation.path_distances


class GoalDist(MapGridCritic):
    """score = cells from the robot to the end of the local plan (not to the global goal)."""

    def distances(self, situation: Situation) -> NDArray[np.int32]:
        """Returns the distances to the last cell under the local plan."""
        return situation.distances_to(situation.path_cells[-1:])


class PathAlign(AlignCritic):
    """score = cells from the robot's nose to the local plan; silent near the global goal."""

    def scale(self, situation: Situation, memory: Any) -> float:
        """Returns resolution * 0.5 * scale; 0 once the nose could be at the goal or beyond."""
        dx, dy = situation.pose[0] - situation.goal[0], situation.pose[1] - situation.goal[1]
        if dx * dx + dy * dy <= self._parameters.forward_point_distance**2:
            return 0.0
        return super().scale(situation, memory)

    def distances(self, situation: Situation) -> NDArray[np.int32]:
        """Returns the distances to the cells under the local plan."""
        return situation.path_distances


class GoalAlign(AlignCritic):
    """score = cells from the robot's nose to the nose's place with the robot at the plan's end.

    That point is the local plan's end, moved on in the direction from the robot to the global goal.
    """

    def distances(self, situation: Situation) -> NDArray[np.int32]:
        """Returns the distances to the last cell under the plan with its end moved on."""
        forward_m = self._parameters.forward_point_distance
        bearing = math.atan2(
            situation.goal[1] - situation.pose[1], situation.goal[0] - situation.pose[0]
        )
        plan = situation.plan.copy()
        plan[-1, 0] += forward_m * math.cos(bearing)
        plan[-1, 1] += forward_m * math.sin(bearing)
        return situation.distances_to(situation.cells_under(read_only(plan))[-1:])
