"""Critics that read the costmap: BaseObstacle (the centre) and ObstacleFootprint (the outline)."""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray
from pydantic import Field

from drake_navbench.controllers.dwb.critics.base import Critic, Verdict
from drake_navbench.controllers.dwb.critics.parameters import CriticParameters
from drake_navbench.controllers.dwb.map_grids import cell_distances
from drake_navbench.controllers.dwb.scene import Scene, Situation
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import INSCRIBED, LETHAL, cell_at, line_max_cost, world_to_cell
from drake_navbench.kernels.read_only import read_only

# Positions in ObstacleFootprint.reasons, counted from 1; BaseObstacle has the first two.
OFF_GRID, HITS_OBSTACLE, FOOTPRINT_OFF_GRID, HITS_UNKNOWN = 1, 2, 3, 4
# Cells by which rounding to cells and Bresenham's line may carry an outline out of its circle.
ROUNDING_CELLS = 3


class ObstacleParameters(CriticParameters):
    """Parameters of both obstacle critics."""

    sum_scores: bool = Field(
        False, description="Score the sum over all poses, not the last pose alone."
    )


@njit(cache=True)
def score_centres(cells, on_map_counts, pose_counts, costs, sum_scores, scores, violations):
    """Writes the cost under the robot's centre: at the last pose, or summed over all.

    cells (K, N), on_map_counts (K,), pose_counts (K,): of the scene. costs: (rows * columns,).
    The first pose on a cost of INSCRIBED or more, or off the map, breaks a rule.
    """
    for k in range(cells.shape[0]):
        score, violation = 0, 0
        for i in range(on_map_counts[k]):
            cost = int(costs[cells[k, i]])
            if cost >= INSCRIBED:
                violation = HITS_OBSTACLE
                break
            score = score + cost if sum_scores else cost
        if violation == 0 and on_map_counts[k] < pose_counts[k]:
            violation = OFF_GRID
        scores[k] = score
        violations[k] = violation


class BaseObstacle(Critic):
    """score = cost under the centre at the end; a centre that meets an obstacle is illegal."""

    Parameters: ClassVar[type[CriticParameters]] = ObstacleParameters
    reasons: ClassVar[tuple[str, ...]] = ("Trajectory Goes Off Grid.", "Trajectory Hits Obstacle.")

    def score(self, scene: Scene, memory: Any) -> Verdict:
        """Returns the costs; see `score_centres`."""
        verdict = Verdict.blank(len(scene.cells))
        score_centres(
            scene.cells,
            scene.on_map_counts,
            scene.trajectories.pose_counts,
            scene.costmap.costs.ravel(),
            self._parameters.sum_scores,
            *verdict,
        )
        return verdict


class ObstacleFootprint(Critic):
    """score = largest cost under the outline at the end; touching LETHAL or unknown is illegal."""

    Parameters: ClassVar[type[CriticParameters]] = ObstacleParameters
    reasons: ClassVar[tuple[str, ...]] = (
        *BaseObstacle.reasons,
        "Footprint Goes Off Grid.",
        "Trajectory Hits Unknown Region.",
    )

    @cached_property
    def _footprint(self) -> Array:
        """(V, 2) m in the base frame."""
        return read_only(self._setup.footprint)

    @cached_property
    def _circle(self) -> tuple[float, float, float]:
        """A circle around the footprint in the base frame: x, y, radius m."""
        centre_x, centre_y = 0.5 * (self._footprint.min(axis=0) + self._footprint.max(axis=0))
        reach = np.hypot(self._footprint[:, 0] - centre_x, self._footprint[:, 1] - centre_y)
        return float(centre_x), float(centre_y), float(reach.max())

    def scale(self, situation: Situation, memory: Any) -> float:
        """Returns resolution * scale, as Nav2 weights this critic."""
        return situation.costmap.resolution * self._parameters.scale

    def score(self, scene: Scene, memory: Any) -> Verdict:
        """Returns the costs; see `score_outlines`."""
        costmap, window = scene.costmap, scene.trajectories
        verdict = Verdict.blank(len(window.poses))
        score_outlines(
            (window.poses, window.headings, scene.on_map_counts, window.pose_counts),
            self._footprint,
            self._circle,
            costmap.grid,
            clearances_of(costmap.costs),
            self._parameters.sum_scores,
            *verdict,
        )
        return verdict


def clearances_of(costs: NDArray[np.uint8]) -> NDArray[np.int32]:
    """Returns each cell's Chebyshev distance to the nearest LETHAL or unknown cell, in cells.

    Shape (rows, columns); larger than the map where there is no such cell.
    """
    rows, columns = costs.shape
    return cell_distances(rows, columns, np.flatnonzero(costs >= LETHAL), diagonal=True)


@register_jitable
def place_outline(footprint, x, y, cos_yaw, sin_yaw, grid, vertices):
    """Writes the cells of a footprint's vertices at a pose; returns how many lie on the map
    before one does not.

    footprint: (V, 2) m in the base frame. x, y m. vertices: (V, 2) column and row, output.
    Adds in the order of DWB's own transformation, which rounds otherwise than the costmap's.
    """
    costs, origin_x, origin_y, resolution = grid
    rows, columns = costs.shape
    for v in range(footprint.shape[0]):
        vertex_x = x + footprint[v, 0] * cos_yaw - footprint[v, 1] * sin_yaw
        vertex_y = y + footprint[v, 0] * sin_yaw + footprint[v, 1] * cos_yaw
        column, row = world_to_cell(
            vertex_x, vertex_y, origin_x, origin_y, resolution, columns, rows
        )
        if column < 0:
            return v
        vertices[v, 0], vertices[v, 1] = column, row
    return footprint.shape[0]


@register_jitable
def find_forbidden_cell(costs, clearances, column_0, row_0, column_1, row_1):
    """Returns the code of the first LETHAL or unknown cell on a line of cells; 0 without one.

    The cells are those of `line_max_cost`. A step along the line is one cell in the Chebyshev
    distance, so as many cells can be skipped as the clearance says.
    """
    delta_column, delta_row = abs(column_1 - column_0), abs(row_1 - row_0)
    step_column = 1 if column_1 >= column_0 else -1
    step_row = 1 if row_1 >= row_0 else -1
    along_x = delta_column >= delta_row
    major, minor = (delta_column, delta_row) if along_x else (delta_row, delta_column)
    i = 0
    while i <= major:
        # Bresenham's minor steps after i major ones, his error starting at half the extent.
        across = (major // 2 + i * minor) // max(1, major)
        if along_x:
            column, row = column_0 + i * step_column, row_0 + across * step_row
        else:
            column, row = column_0 + across * step_column, row_0 + i * step_row
        clearance = clearances[row, column]
        if clearance == 0:
            return HITS_OBSTACLE if costs[row, column] == LETHAL else HITS_UNKNOWN
        i += clearance
    return 0


@register_jitable
def judge_outline(costs, clearances, vertices, on_map_count, is_scored):
    """Returns the code of the first rule that an outline breaks, edge by edge, 0 if none, and,
    where `is_scored` and no rule is broken, the largest cost on its edges, else 0.

    vertices, on_map_count: from `place_outline`. The last edge runs from the last to the first
    vertex.
    """
    vertex_count = vertices.shape[0]
    largest = 0
    for v in range(vertex_count):
        following = (v + 1) % vertex_count
        if max(v, following) >= on_map_count:
            return FOOTPRINT_OFF_GRID, 0
        column_0, row_0 = vertices[v, 0], vertices[v, 1]
        column_1, row_1 = vertices[following, 0], vertices[following, 1]
        code = find_forbidden_cell(costs, clearances, column_0, row_0, column_1, row_1)
        if code != 0:
            return code, 0
        if is_scored:
            edge = line_max_cost(costs, column_0, row_0, column_1, row_1)
            largest = max(largest, edge)
    return 0, largest


@register_jitable
def is_clear_of_everything(clearances, grid, x, y, radius_m):
    """Tells whether an outline inside a circle surely meets nothing forbidden and no border.

    x, y m: centre of the circle. False means that the outline has to be checked.
    """
    rows, columns = clearances.shape
    column, row = cell_at(grid, x, y)
    reach = int(radius_m / grid.resolution) + ROUNDING_CELLS
    if column < reach or column >= columns - reach or row < reach or row >= rows - reach:
        return False
    return clearances[row, column] > reach


@njit(cache=True)
def score_outlines(
    window,
    footprint,
    circle,
    grid,
    clearances,
    sum_scores,
    scores,
    violations,
):
    """Writes the largest cost under the outline: at the last pose, or summed over all.

    window: poses, headings, on_map_counts and pose_counts of the scene. footprint: (V, 2) m.
    circle: its enclosing circle in the base frame, (x, y, radius) m. clearances: from
    `clearances_of`. The first pose that breaks a rule names it.
    """
    poses, headings, on_map_counts, pose_counts = window
    costs = grid.costs
    vertices = np.empty((footprint.shape[0], 2), dtype=np.int64)
    centre_x, centre_y, radius_m = circle
    for k in range(poses.shape[0]):
        score, violation = 0, 0
        for i in range(pose_counts[k]):
            if i == on_map_counts[k]:
                violation = OFF_GRID
                break
            x, y = poses[k, i, 0], poses[k, i, 1]
            cos_yaw, sin_yaw = headings[k, i, 0], headings[k, i, 1]
            is_scored = sum_scores or i == pose_counts[k] - 1
            if not is_scored and is_clear_of_everything(
                clearances,
                grid,
                x + centre_x * cos_yaw - centre_y * sin_yaw,
                y + centre_x * sin_yaw + centre_y * cos_yaw,
                radius_m,
            ):
                continue
            on_map = place_outline(footprint, x, y, cos_yaw, sin_yaw, grid, vertices)
            violation, cost = judge_outline(costs, clearances, vertices, on_map, is_scored)
            if violation != 0:
                break
            score += cost
        scores[k] = score
        violations[k] = violation
