"""Sets up the polish for one cycle and decides whether its result replaces the sampled one."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_navbench.controllers.mppi.critics.batch import Float32Array, Scene
from drake_navbench.controllers.mppi.lanes import frozen
from drake_navbench.controllers.mppi.memory import SamplerState
from drake_navbench.controllers.mppi.motion_models import (
    VX,
    WZ,
    MotionLimits,
    integrate_controls,
)
from drake_navbench.controllers.mppi.objective import (
    PolishSituation,
    Weights,
    cost_field,
    objective,
)
from drake_navbench.controllers.mppi.parameters import MppiParameters
from drake_navbench.controllers.mppi.polish import Polish, PolishOutcome, PolishStatus
from drake_navbench.controllers.mppi.sampler import CycleResult, Sampler
from drake_navbench.controllers.mppi.validator import is_trajectory_clear
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.read_only import read_only

# Stands in for a sampling deviation of zero: an axis that is not sampled may hardly be corrected.
_LEAST_DEVIATION = 1e-3
_COLLISION_CRITICS = ("CostCritic", "ObstaclesCritic")


class Refinement(NamedTuple):
    """A polished cycle.

    state: the sampler's state, before sending. trajectory: (N, 3) poses of its sequence. status:
    whether the polished sequence is in it. outcome: outcome of the solve.
    """

    state: SamplerState
    trajectory: Float32Array
    status: PolishStatus
    outcome: PolishOutcome


class Refiner:
    """Polishes the sequences of one sampler (differential or Ackermann)."""

    def __init__(self, parameters: MppiParameters, sampler: Sampler) -> None:
        self._sampler = sampler
        self._parameters = p = parameters
        polish = p.polish
        self._weights = Weights(
            path=polish.path_weight,
            heading=polish.heading_weight,
            obstacle=polish.obstacle_weight,
            progress=polish.progress_weight,
            linear_deviation=polish.deviation_weight / p.vx_std**2,
            angular_deviation=polish.deviation_weight / max(p.wz_std, _LEAST_DEVIATION) ** 2,
            linear_jerk=polish.jerk_weight,
            angular_jerk=polish.angular_jerk_weight,
        )
        self._polish = Polish(
            p.time_steps,
            p.model_dt,
            first_time_s=0.0 if sampler.rules.shifts else sampler.setup.control_period_s,
            knot_count=polish.knot_count,
            max_iterations=polish.max_iterations,
            weights=self._weights,
            limits=sampler.rules.base_limits,
        )
        critics = [p.critic(name) for name in _COLLISION_CRITICS if name in p.critics]
        self._checks_outline = p.TrajectoryValidator.consider_footprint or any(
            critic.enabled and critic.consider_footprint for critic in critics
        )

    def refine(
        self, scene: Scene, sampled: CycleResult, earlier_speed: Array, limits: MotionLimits
    ) -> Refinement:
        """Polishes a sampled cycle.

        earlier_speed: (2,) v, w that the cycle before started from. The polished sequence is taken
        where IPOPT ended in a point within the constraints, its objective is below the sampled
        sequence's, and its trajectory is free of collision.
        """
        situation = self._situation(scene, sampled, earlier_speed)
        outcome = self._polish.solve(situation, limits)
        if not outcome.found:
            return self._keep(sampled, PolishStatus.INFEASIBLE, outcome)
        controls = np.zeros_like(sampled.controls)
        controls[[VX, WZ]] = outcome.sequence.T
        self._sampler.rules.constrain(controls, sampled.speed, limits)
        controls = frozen(controls)
        before, _ = objective(situation, self._weights, situation.sampled)
        after, _ = objective(situation, self._weights, _as_sequence(controls))
        if not after < before:
            return self._keep(sampled, PolishStatus.NOT_BETTER, outcome)
        dt = np.float32(self._parameters.model_dt)
        trajectory = integrate_controls(scene.pose.astype(np.float32), dt, controls)
        grid, footprint = scene.costmap.grid, self._sampler.setup.footprint
        checked = len(trajectory)
        if not is_trajectory_clear(grid, footprint, trajectory, checked, self._checks_outline):
            return self._keep(sampled, PolishStatus.COLLIDES, outcome)
        state = sampled.solved._replace(controls=controls)
        return Refinement(state, trajectory, PolishStatus.ACCEPTED, outcome)

    def _keep(
        self, sampled: CycleResult, status: PolishStatus, outcome: PolishOutcome
    ) -> Refinement:
        return Refinement(sampled.solved, sampled.trajectory, status, outcome)

    def _situation(
        self, scene: Scene, sampled: CycleResult, earlier_speed: Array
    ) -> PolishSituation:
        p = self._parameters
        costmap = scene.costmap
        path = scene.path.astype(np.float64)
        references, last_index = path_references(path, sampled.trajectory.astype(np.float64))
        carrot = min(last_index + p.polish.carrot_offset, len(path) - 1)
        return PolishSituation(
            pose=read_only(scene.pose),
            speed=sampled.speed[[VX, WZ]].astype(np.float64),
            earlier_speed=earlier_speed,
            references=references,
            carrot=np.ascontiguousarray(path[carrot, :2]),
            sampled=_as_sequence(sampled.controls),
            field=cost_field(costmap.grid, tracks_unknown=costmap.tracks_unknown),
            dt=p.model_dt,
            starts_now=self._sampler.rules.shifts,
        )


@njit(cache=True)
def path_references(path, trajectory):
    """Returns the reference of each pose (N, 3), and the path index nearest to the end.

    path, trajectory: (n, 3), (N, 3). A reference is the nearest path point with the heading of the
    path there, turned around where the robot drives backward along it. The heading is that of the
    chord between the neighbouring points; at the last point it is that point's own yaw, which at
    the end of the plan is the goal's, and is not turned around.
    """
    references = np.empty_like(trajectory)
    nearest = 0
    for t in range(len(trajectory)):
        nearest = _nearest_point(path, trajectory[t])
        ahead = path[min(nearest + 1, len(path) - 1)]
        behind = path[max(nearest - 1, 0)]
        along_x, along_y = ahead[0] - behind[0], ahead[1] - behind[1]
        is_still = along_x == 0.0 and along_y == 0.0
        is_last = nearest == len(path) - 1
        heading = path[nearest, 2] if is_still or is_last else math.atan2(along_y, along_x)
        if not is_last and abs(wrap(trajectory[t, 2] - heading)) > math.pi / 2:
            heading += math.pi
        references[t, 0], references[t, 1] = path[nearest, 0], path[nearest, 1]
        references[t, 2] = heading
    return references, nearest


@register_jitable
def _nearest_point(path, pose):
    """Returns the index of the path point closest to a pose; of equal ones the first."""
    nearest, least = 0, np.inf
    for index in range(len(path)):
        x, y = path[index, 0] - pose[0], path[index, 1] - pose[1]
        squared = x * x + y * y
        if squared < least:
            nearest, least = index, squared
    return nearest


def _as_sequence(controls: Float32Array) -> Array:
    """Returns v and w of controls (3, N) as (N, 2) float64."""
    return np.ascontiguousarray(controls[[VX, WZ]].T, dtype=np.float64)
