"""Critics that read the costmap: BaseObstacle (the centre) and ObstacleFootprint (the outline)."""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numba import njit
from pydantic import Field

from drake_navbench.controllers.dwb.critics.base import Array, Critic, Verdict
from drake_navbench.controllers.dwb.critics.parameters import CriticParameters
from drake_navbench.controllers.dwb.outlines import (
    HITS_OBSTACLE,
    OFF_GRID,
    clearances_of,
    score_outlines,
)
from drake_navbench.controllers.dwb.scene import Scene, Situation
from drake_navbench.kernels.grid import INSCRIBED
from drake_navbench.kernels.read_only import read_only


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
            window.poses,
            window.headings,
            scene.on_map_counts,
            window.pose_counts,
            self._footprint,
            self._circle,
            costmap.grid,
            clearances_of(costmap.costs),
            self._parameters.sum_scores,
            *verdict,
        )
        return verdict
