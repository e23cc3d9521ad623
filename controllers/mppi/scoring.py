"""One pass over a batch: roll-outs and critics, chunk by chunk while a chunk is in the cache."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_navbench.controllers.mppi.critics.base import (
    Critic,
    PathCritic,
    PointwiseCritic,
    Trajectories,
)
from drake_navbench.controllers.mppi.critics.batch import (
    Batch,
    Float32Array,
    Reach,
    Scene,
    furthest_point,
)
from drake_navbench.controllers.mppi.lanes import LANES, block_count
from drake_navbench.controllers.mppi.motion_models import AXES, MotionLimits
from drake_navbench.controllers.mppi.noise import Noise
from drake_navbench.controllers.mppi.parameters import MppiParameters
from drake_navbench.controllers.mppi.roll_out import RollOutSetting, roll_out

# Blocks rolled out and scored at a time: 6 quantities x 8 blocks x 56 steps x 64 lanes in float32
# are 0.7 MB, which stays in the second-level cache.
_CHUNK_BLOCKS = 8


@dataclass
class Cycle:
    """The intermediate results of one cycle; lives no longer than `Sampler.run`.

    speed: (3,) that the roll-outs start from. costs, weights: (B,). furthest: path point reached,
    None until a critic asks. failed: a critic called the batch a failure. batch: where kept.
    """

    scene: Scene
    speed: Float32Array
    limits: MotionLimits
    costs: Float32Array
    weights: Float32Array
    furthest: int | None = None
    failed: bool = False
    batch: Batch | None = None


class BatchScorer:
    """Rolls out and scores the batches of one controller.

    critics: in the order of scoring. keeps_samples: whether cycles get the whole batch; users'
    critics get it anyway.
    """

    def __init__(
        self, parameters: MppiParameters, critics: list[Critic], *, keeps_samples: bool
    ) -> None:
        self._parameters = p = parameters
        self._critics = critics
        built_in = (PointwiseCritic, PathCritic)
        self._keeps = keeps_samples or not all(isinstance(c, built_in) for c in critics)
        steps = {getattr(critic, "column_step", 0) for critic in critics} - {0}
        self.column_step = steps.pop() if steps else p.time_steps
        self.clamped = Noise.empty(p.batch_size, p.time_steps, holonomic=p.motion_model == "Omni")
        self._allocate()

    def _allocate(self) -> None:
        """Allocates the scratch arrays, which no result depends on."""
        p = self._parameters
        blocks, steps = block_count(p.batch_size), p.time_steps
        self._chunk_blocks = min(blocks, _CHUNK_BLOCKS)
        self._stored = Trajectories.empty(blocks if self._keeps else self._chunk_blocks, steps)
        self._table = np.zeros((len(self._critics), blocks, LANES), np.float32)
        self.control_costs = np.zeros((AXES, blocks, LANES), np.float32)
        columns = (steps - 1) // self.column_step + 1
        ends = [np.zeros((blocks, LANES), np.float32) for _ in range(4)]
        kept = [np.zeros((blocks, columns, LANES), np.float32) for _ in range(3)]
        self._reach = Reach(*ends, *kept)

    @property
    def critic_costs(self) -> Float32Array:
        """(critics, B) costs of the last pass, a copy."""
        rows, blocks, _ = self._table.shape
        table = self._table.reshape(rows, blocks * LANES)
        return table[:, : self._parameters.batch_size].copy()

    def score(
        self, cycle: Cycle, setting: RollOutSetting, controls: Float32Array, noise: Noise
    ) -> None:
        """Rolls out the batch and adds all critics' costs to the cycle's.

        controls: (3, N) sequence to sample around. `control_costs` (3, blocks, LANES) and, where
        the setting clamps raw controls, `clamped` are written for the update of the sequence.
        """
        p = self._parameters
        size = p.batch_size
        begun = self._run_pointwise(cycle, setting, controls, noise)
        if self._keeps:
            cycle.batch = Batch(cycle.scene, size, *self._stored, known_furthest=cycle.furthest)
        for row, (name, critic) in enumerate(zip(p.critics, self._critics, strict=True)):
            costs = self._table[row].ravel()[:size]
            if cycle.failed:
                costs[:] = 0
                continue
            if isinstance(critic, PointwiseCritic):
                active = begun.get(row)
                cycle.failed = active is not None and critic.finish(active, costs)
            elif isinstance(critic, PathCritic):
                self._run_path_critic(cycle, critic, row)
            elif p.critic(name).enabled:
                assert cycle.batch is not None  # Kept where there is such a critic.
                costs[:], cycle.failed = critic.score(cycle.batch)
            cycle.costs += costs

    def _run_pointwise(
        self, cycle: Cycle, setting: RollOutSetting, controls: Float32Array, noise: Noise
    ) -> dict[int, object]:
        """Rolls out chunk by chunk, each scored while it is in the cache.

        Returns the results of `begin` of the active point-wise critics, by row.
        """
        self._table[:] = 0
        blocks = self._table.shape[1]
        critics = {
            row: critic
            for row, critic in enumerate(self._critics)
            if isinstance(critic, PointwiseCritic) and critic.parameters.enabled
        }
        begun = {row: critic.begin(cycle.scene, blocks) for row, critic in critics.items()}
        begun = {row: active for row, active in begun.items() if active is not None}
        for first in range(0, blocks, self._chunk_blocks):
            last = min(first + self._chunk_blocks, blocks)
            offset = first if self._keeps else 0
            chunk = self._stored.blocks(offset, offset + last - first)
            roll_out(
                setting,
                controls,
                noise,
                self.clamped,
                first,
                chunk,
                self._reach,
                self.control_costs,
            )
            for row, active in begun.items():
                sums = self._table[row, first:last]
                critics[row].add(active, chunk, sums, first_block=first)
        return begun

    def _run_path_critic(self, cycle: Cycle, critic: PathCritic, row: int) -> None:
        size = self._parameters.batch_size
        if not critic.considers(cycle.scene):
            return
        if cycle.furthest is None:
            cycle.furthest = furthest_point(cycle.scene, self._reach, size)
        terms = critic.score_reach(cycle.scene, self._reach, cycle.furthest)
        if terms is not None:
            critic.finish(terms)
            self._table[row] = terms
