"""The parts that critics are built of: their context, and the two kinds the sampler runs itself.

`PointwiseCritic`s look at one trajectory at a time: the sampler hands them chunks of the batch
while these are still in the processor's cache. `PathCritic`s compare the samples with the path
point that the whole batch reaches, so they run afterwards. A critic of your own is a subclass of
`Critic` with a `score`, installed under the entry point group `drake_navbench.mppi_critics`;
docs/controllers.md goes through it step by step.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drake_navbench.controller import ControllerSetup
from drake_navbench.controllers.critic_parameters import CriticBlock
from drake_navbench.controllers.mppi.critics.batch import Batch, Float32Array, Reach, Scene
from drake_navbench.controllers.mppi.float32_math import F32
from drake_navbench.controllers.mppi.lanes import LANES, Lanes
from drake_navbench.controllers.mppi.motion_models import MotionLimits, MotionModel
from drake_navbench.controllers.mppi.releases import RULES, Rules
from drake_navbench.kernels.grid import INSCRIBED, MAX_NON_OBSTACLE, NO_INFORMATION, Costmap, Grid
from drake_navbench.kernels.read_only import read_only
from drake_navbench.plugins.releases import NEWEST_RELEASE, Release
from drake_navbench.typed_files.quantities import Count


class Trajectories(NamedTuple):
    """A chunk of sampled trajectories: x, y m, yaw rad, vx, vy m/s, wz rad/s.

    Each (blocks, N, LANES), see `lanes`.
    """

    x: Lanes
    y: Lanes
    yaw: Lanes
    vx: Lanes
    vy: Lanes
    wz: Lanes

    @classmethod
    def empty(cls, blocks: int, steps: int) -> Trajectories:
        """Allocates zeros."""
        return cls(*(np.zeros((blocks, steps, LANES), np.float32) for _ in cls._fields))

    def blocks(self, first: int, last: int) -> Trajectories:
        """Views the blocks `first` to `last`, exclusive."""
        return Trajectories(*(quantity[first:last] for quantity in self))


class MapView(NamedTuple):
    """The costmap and the outline as the kernels take them; see `Costmap`, `ControllerSetup`.

    values: (rows * columns + 1,) uint8, the cells row by row, then NO_INFORMATION for every point
    off the map, at index `outside`.
    """

    grid: Grid
    values: NDArray[np.uint8]
    outside: int
    rows: np.int32
    columns: np.int32
    footprint: NDArray[np.float64]

    @classmethod
    def of(cls, costmap: Costmap, footprint: NDArray[np.float64]) -> MapView:
        """Views a costmap; footprint: (K, 2) m in the base frame."""
        rows, columns = costmap.costs.shape
        return cls(
            costmap.grid,
            np.append(costmap.costs.ravel(), np.uint8(NO_INFORMATION)),
            rows * columns,
            np.int32(rows),
            np.int32(columns),
            read_only(footprint),
        )


@dataclass(frozen=True)
class CriticContext:
    """The facts about its controller that every critic gets.

    The limits are those without a speed limit.
    """

    setup: ControllerSetup
    motion_model: MotionModel
    limits: MotionLimits
    min_turning_r: float
    model_dt: float
    time_steps: int
    nav2_release: Release = NEWEST_RELEASE

    @property
    def release(self) -> Rules:
        """The behaviour of the controller in `nav2_release`."""
        return RULES[self.nav2_release]

    @property
    def holonomic(self) -> bool:
        """Whether the base can move sideways, so that vy counts."""
        return self.motion_model is MotionModel.OMNI

    @property
    def has_inflation(self) -> bool:
        """Whether the local costmap has an inflation layer."""
        return self.setup.inflation_radius_m > 0

    def inflated_cost(self, distance_m: float) -> int:
        """Returns the inflation layer's cell cost at a distance from an obstacle."""
        beyond = distance_m - self.setup.inscribed_radius_m
        if beyond <= 0:
            return INSCRIBED
        decay = math.exp(-self.setup.inflation_cost_scaling_factor * beyond)
        return int(MAX_NON_OBSTACLE * decay)


class CriticParameters(CriticBlock):
    """The parameters that every MPPI critic has; a critic with more parameters subclasses it."""

    enabled: bool = Field(True, description="Use this critic.")


class TermParameters(CriticParameters):
    """The parameters of critics whose cost is (weight term)^power; each adds its own weight."""

    cost_power: Count = Field(1, ge=1, description="Exponent of the weighted score.")


class Critic(ABC):
    """Scores a whole batch in one call; keeps no state between calls.

    A subclass finds its own block in `self.parameters` and the facts about its controller in
    `self.context`. A critic with `enabled: false` in its block is not called.

    Parameters: its parameter model.
    """

    Parameters: ClassVar[type[CriticParameters]] = CriticParameters

    def __init__(self, parameters: Any, context: CriticContext) -> None:
        self.parameters = parameters
        self.context = context

    @classmethod
    def of_release(cls, release: Rules) -> type[Critic]:
        """Returns the class that scores as a release of Nav2 does."""
        return cls

    @abstractmethod
    def score(self, batch: Batch) -> tuple[Float32Array, bool]:
        """Returns the cost of each sample (B,) and whether the critic calls the batch a failure."""


class PointwiseCritic(Critic):
    """Base of the critics that look at one trajectory at a time.

    In a cycle: `begin` once, `add` for every chunk, `finish` once.

    is_mean, is_integral: whether the cost is the mean of the terms over the horizon's steps, or
    their integral over time; else it is their sum.
    """

    is_mean: ClassVar[bool] = False
    is_integral: ClassVar[bool] = False

    def begin(self, scene: Scene, blocks: int) -> Any:
        """Returns the data that `add` needs for `blocks` blocks; None: the critic is inactive."""
        raise NotImplementedError

    def add(self, cycle: Any, chunk: Trajectories, sums: Lanes, *, first_block: int) -> None:
        """Adds the chunk's raw terms to `sums` (blocks, LANES), its rows of the cost table."""
        raise NotImplementedError

    def finish(self, cycle: Any, costs: Float32Array) -> bool:
        """Turns the batch's raw terms (B,) into costs in place; returns the fail flag."""
        if self.is_mean:
            costs /= F32(self.context.time_steps)
        if self.is_integral:
            costs *= F32(self.context.model_dt)
        weigh(costs, F32(self.parameters.cost_weight), self.parameters.cost_power)
        return False

    def score(self, batch: Batch) -> tuple[Float32Array, bool]:
        """Scores a batch by `begin`, `add` and `finish`, without the sampler; see `Critic`."""
        costs = np.zeros(batch.x.shape[::2], np.float32)
        cycle = self.begin(batch.scene, len(costs)) if self.parameters.enabled else None
        if cycle is None:
            return costs.ravel()[: batch.size], False
        chunk = Trajectories(batch.x, batch.y, batch.yaw, batch.vx, batch.vy, batch.wz)
        self.add(cycle, chunk, costs, first_block=0)
        scored = costs.ravel()[: batch.size]
        fail = self.finish(cycle, scored)
        return scored, fail


class PathCritic(Critic):
    """Base of the critics that need the path point which the whole batch reaches."""

    column_step: int = 0

    def considers(self, scene: Scene) -> bool:
        """Whether the critic may act in this cycle; only then is the reached point needed."""
        threshold = F32(self.parameters.threshold_to_consider)
        return self.parameters.enabled and bool(scene.way_left >= threshold)

    def score_reach(self, scene: Scene, reach: Reach, furthest: int) -> Float32Array | None:
        """Returns the raw terms (blocks, LANES); None where the critic is inactive."""
        raise NotImplementedError

    def finish(self, costs: Float32Array) -> None:
        """Turns raw terms into costs in place."""
        weigh(costs, F32(self.parameters.cost_weight), self.parameters.cost_power)

    def score(self, batch: Batch) -> tuple[Float32Array, bool]:
        """Scores a batch by `score_reach` and `finish`, without the sampler; see `Critic`."""
        costs = None
        if self.considers(batch.scene):
            reach = batch.reach(max(1, self.column_step))
            costs = self.score_reach(batch.scene, reach, batch.furthest)
        if costs is None:
            return np.zeros(batch.size, np.float32), False
        scored = costs.ravel()[: batch.size]
        self.finish(scored)
        return scored, False


def weigh(costs: Float32Array, weight: np.float32, power: int) -> None:
    """Replaces each raw term by (weight term)^power in place."""
    costs *= weight
    if power > 1:
        np.power(costs, power, out=costs)
