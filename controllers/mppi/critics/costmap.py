"""Critics that read the costmap: CostCritic, and the older ObstaclesCritic."""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drake_navbench.controllers.mppi.critics.base import (
    CriticContext,
    CriticParameters,
    MapView,
    PointwiseCritic,
    TermParameters,
    Trajectories,
    weigh,
)
from drake_navbench.controllers.mppi.critics.batch import Float32Array, Scene
from drake_navbench.controllers.mppi.critics.costmap_kernels import (
    INFINITY,
    add_cell_scores,
    add_distance_shortfalls,
    add_outline_collisions,
)
from drake_navbench.controllers.mppi.critics.outline_costs import OutlineCosts, OutlineView
from drake_navbench.controllers.mppi.float32_math import F32, ONE, ZERO
from drake_navbench.controllers.mppi.lanes import LANES, Lanes
from drake_navbench.errors import InputError
from drake_navbench.kernels.grid import INSCRIBED, LETHAL, NO_INFORMATION
from drake_navbench.plugins.releases import Release
from drake_navbench.typed_files.quantities import Count, Length, Number

COST_COUNT = 256


class CostCycle(NamedTuple):
    """CostCritic in one cycle.

    score: (256,) the cost of a column by the value of its cell, infinite for a collision.
    outline_collides: (256,) whether a largest value under the outline means collision.
    """

    view: MapView
    remembered: OutlineCosts
    score: Float32Array
    outline_collides: NDArray[np.bool_]


class CostParameters(TermParameters):
    """Parameters of CostCritic."""

    cost_weight: Number = Field(
        3.81, description="Weight of the mean cost of the cells under a sample."
    )
    critical_cost: Number = Field(300.0, description="Score of each step that nearly collides.")
    near_collision_cost: int = Field(
        253, ge=0, le=255, description="Cell cost from which a step nearly collides."
    )
    collision_cost: Number = Field(1e6, description="Score of a sample that collides.")
    consider_footprint: bool = Field(
        False, description="Check the footprint, not the centre alone."
    )
    near_goal_distance: Length = Field(
        0.5,
        ge=0,
        description="Length of the remaining plan below which cell costs are ignored [m].",
    )
    trajectory_point_step: Count = Field(2, ge=1, description="Check every n-th step of a sample.")
    inflation_layer_name: str = Field(
        "", description="Name of Nav2's inflation layer; no effect, as there is one layer here."
    )


class CostCritic(PointwiseCritic):
    """Mean cell cost over every `trajectory_point_step`-th column, or the collision cost."""

    Parameters: ClassVar[type[CriticParameters]] = CostParameters

    def __init__(self, parameters: Any, context: CriticContext) -> None:
        super().__init__(parameters, context)
        _require_outline("CostCritic", parameters, context)
        step = parameters.trajectory_point_step
        columns = (context.time_steps - 1) // step + 1
        if context.release.drops_last_column:
            columns = context.time_steps // step
        self.last_column = (columns - 1) * step
        self.weight = F32(parameters.cost_weight) / F32(LETHAL) / F32(columns)
        self.footprint_from = self._footprint_from()
        self._outline_view = OutlineView(context.setup.footprint)

    def _footprint_from(self) -> int:
        """Cell value from which the outline can touch an obstacle; 0 where that is unknown."""
        setup = self.context.setup
        heeds_radius = self.context.release.heeds_inflation_radius
        if heeds_radius and setup.inflation_radius_m < setup.circumscribed_radius_m:
            return 0
        if not self.context.has_inflation:
            return 0
        return self.context.inflated_cost(setup.circumscribed_radius_m)

    def begin(self, scene: Scene, blocks: int) -> CostCycle:
        p = self.parameters
        values = np.arange(COST_COUNT, dtype=np.float32)
        score = np.where(values >= p.near_collision_cost, F32(p.critical_cost), values)
        if scene.way_left < F32(p.near_goal_distance):
            score[: p.near_collision_cost] = 0
        score[0] = 0
        collides = collision_values(
            consider_footprint=p.consider_footprint, tracks_unknown=scene.costmap.tracks_unknown
        )
        if not p.consider_footprint:
            score[collides] = INFINITY
        return CostCycle(*self._outline_view.of(scene.costmap), score, collides)

    def add(self, cycle: CostCycle, chunk: Trajectories, sums: Lanes, *, first_block: int) -> None:
        step = self.parameters.trajectory_point_step
        count = self.last_column + 1
        in_float32 = self.context.release.finds_cells_in_float32
        poses = x, y, _ = chunk.x[:, :count], chunk.y[:, :count], chunk.yaw[:, :count]
        if self.parameters.consider_footprint:
            add_outline_collisions(
                cycle.view,
                cycle.remembered,
                self.footprint_from,
                cycle.outline_collides,
                step,
                in_float32,
                poses,
                sums,
            )
        add_cell_scores(cycle.view, cycle.score, step, in_float32, x, y, sums)

    def finish(self, cycle: CostCycle, costs: Float32Array) -> bool:
        collided = costs == INFINITY
        costs[collided] = F32(self.parameters.collision_cost)
        weigh(costs, self.weight, self.parameters.cost_power)
        return bool(collided.all())


class ObstaclesCycle(NamedTuple):
    """ObstaclesCritic in one cycle.

    margin_shortfall, repulsion: (2, 256) m by value, [0] read at the centre, [1] at the outline:
    the margin less the distance to the obstacle (infinite for a collision), and the inflation
    radius less that distance. repulsion_sums: (blocks, LANES), kept apart from the raw terms.
    """

    view: MapView
    remembered: OutlineCosts
    margin_shortfall: Float32Array
    repulsion: Float32Array
    repulsion_sums: Lanes


class ObstaclesParameters(TermParameters):
    """Parameters of ObstaclesCritic."""

    repulsion_weight: Number = Field(
        1.5, description="Weight of the missing distance within the inflation radius [1/m]."
    )
    critical_weight: Number = Field(
        20.0, description="Weight of the distance missing from collision_margin_distance [1/m]."
    )
    collision_cost: Number = Field(
        1e5, description="Missing distance that a colliding sample counts with [m]."
    )
    collision_margin_distance: Length = Field(
        0.10, ge=0, description="Distance to obstacles that samples should keep [m]."
    )
    near_goal_distance: Length = Field(
        0.5, ge=0, description="Length of the remaining plan below which repulsion is ignored [m]."
    )
    consider_footprint: bool = Field(
        False, description="Check the footprint, not the centre alone."
    )
    inflation_layer_name: str = Field(
        "", description="Name of Nav2's inflation layer; no effect, as there is one layer here."
    )
    cost_scaling_factor: Number = Field(
        10.0,
        ge=0.0,
        description="Humble: cost_scaling_factor of the inflation layer; must equal the "
        "layer's [1/m].",
    )
    inflation_radius: Length = Field(
        0.55,
        ge=0.0,
        description="Humble: inflation_radius of the inflation layer; must equal the layer's [m].",
    )


class ObstaclesCritic(PointwiseCritic):
    """Distances to obstacles, read back from the inflated costs, or the collision cost."""

    Parameters: ClassVar[type[CriticParameters]] = ObstaclesParameters

    def __init__(self, parameters: Any, context: CriticContext) -> None:
        super().__init__(parameters, context)
        _require_outline("ObstaclesCritic", parameters, context)
        self.footprint_from = COST_COUNT
        if parameters.consider_footprint:
            radius = context.setup.circumscribed_radius_m
            self.footprint_from = context.inflated_cost(radius) if context.has_inflation else 0
        self.scaling_factor = context.setup.inflation_cost_scaling_factor
        self.inflation_radius_m = context.setup.inflation_radius_m
        if not context.release.reads_inflation_layer:
            self.scaling_factor = parameters.cost_scaling_factor
            self.inflation_radius_m = parameters.inflation_radius
        self.distances = self._distances()
        self._outline_view = OutlineView(context.setup.footprint)

    def _distances(self) -> Float32Array:
        """(2, 256) distance to the obstacle in m by cell value, at the centre and at the outline.

        Inverts the inflation, cost = 253 exp(-k (d - r_in)); infinite where nothing is known.
        """
        distances = np.full((2, COST_COUNT), INFINITY)
        k = F32(self.scaling_factor)
        if not self.context.has_inflation or k == 0:
            return distances
        inscribed_radius = F32(self.context.setup.inscribed_radius_m)
        costs = np.arange(1, COST_COUNT, dtype=np.float32)
        outline = (k * inscribed_radius - np.log(costs) + np.log(F32(INSCRIBED))) / k
        distances[0, 1:] = outline - inscribed_radius
        distances[1, 1:] = outline
        return distances

    def begin(self, scene: Scene, blocks: int) -> ObstaclesCycle:
        p = self.parameters
        known = np.isfinite(self.distances)
        distances = np.where(known, self.distances, ZERO)
        shortfall = np.where(known, F32(p.collision_margin_distance) - distances, ZERO)
        shortfall = np.maximum(shortfall, ZERO)
        collides = collision_values(
            consider_footprint=p.consider_footprint, tracks_unknown=scene.costmap.tracks_unknown
        )
        shortfall[:, collides] = INFINITY
        repels = known & bool(scene.way_left >= F32(p.near_goal_distance))
        repulsion = F32(self.inflation_radius_m) - distances
        if not self.context.release.repels_above_least:
            repels &= shortfall == 0
        return ObstaclesCycle(
            *self._outline_view.of(scene.costmap),
            shortfall,
            np.where(repels, repulsion, ZERO),
            np.zeros((blocks, LANES), np.float32),
        )

    def add(
        self, cycle: ObstaclesCycle, chunk: Trajectories, sums: Lanes, *, first_block: int
    ) -> None:
        add_distance_shortfalls(
            cycle.view,
            cycle.remembered,
            self.footprint_from,
            cycle.margin_shortfall,
            cycle.repulsion,
            (chunk.x, chunk.y, chunk.yaw),
            sums,
            cycle.repulsion_sums[first_block : first_block + len(sums)],
        )

    def finish(self, cycle: ObstaclesCycle, costs: Float32Array) -> bool:
        p = self.parameters
        collided = costs == INFINITY
        costs[collided] = F32(p.collision_cost)
        costs *= F32(p.critical_weight)
        repulsion = cycle.repulsion_sums.ravel()[: costs.size]
        if self.context.release.repels_above_least:
            repulsion = repulsion - repulsion.min()
        mean_repulsion = repulsion / F32(self.context.time_steps)
        costs += F32(p.repulsion_weight) * mean_repulsion
        weigh(costs, ONE, p.cost_power)
        return bool(collided.all())


def collision_values(*, consider_footprint: bool, tracks_unknown: bool) -> NDArray[np.bool_]:
    """Returns (256,) which cell values mean collision."""
    collides = np.zeros(COST_COUNT, np.bool_)
    collides[LETHAL] = True
    collides[INSCRIBED] = not consider_footprint
    collides[NO_INFORMATION] = not tracks_unknown
    return collides


def _require_outline(name: str, parameters: Any, context: CriticContext) -> None:
    # The costmap makes a polygon of a radius. Humble refused it from 1.1.19 on, jazzy from 1.3.6.
    takes_polygon = context.nav2_release <= Release.JAZZY
    refuses = context.setup.footprint_is_circle and not takes_polygon
    if parameters.consider_footprint and refuses:
        raise InputError(
            f"{name}.consider_footprint: got true, expected false for a robot given by a radius"
        )
