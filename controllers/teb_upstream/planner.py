"""One cycle of the original planner, with one band or with one of each class.

teb_local_planner's TebOptimalPlanner and HomotopyClassPlanner (ros2-master) as pure functions of
the bands of the last cycle. `Scene` holds the cycle's inputs.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import NoValidControl, SpeedLimit
from drake_navbench.controllers.teb.band_parameters import FEWEST_SAMPLES
from drake_navbench.controllers.teb_upstream.association import attach
from drake_navbench.controllers.teb_upstream.band import band_from_plan, normalize, warm_start
from drake_navbench.controllers.teb_upstream.classes import ClassSearch
from drake_navbench.controllers.teb_upstream.memory import PlannerState, Trajectory
from drake_navbench.controllers.teb_upstream.normal_equations import COST_KINDS, System
from drake_navbench.controllers.teb_upstream.optimizer import optimize_band
from drake_navbench.controllers.teb_upstream.parameters import TebUpstreamParameters
from drake_navbench.controllers.teb_upstream.penalties import BandSurroundings, add_edges
from drake_navbench.controllers.teb_upstream.robot_models import RobotModel
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.read_only import read_only
from drake_navbench.kernels.speed_limit import speed_limit_ratio

NO_POINTS = np.empty((0, 2))
# The parameters that a speed limit scales.
SPEEDS = ("max_vel_x", "max_vel_x_backwards", "max_vel_theta")
# Kind of penalty -> its weight.
PENALTY_WEIGHTS = {
    "time": "weight_optimaltime",
    "length": "weight_shortest_path",
    "speed limit": "weight_max_vel_x",
    "turn rate limit": "weight_max_vel_theta",
    "acceleration": "weight_acc_lim_x",
    "angular acceleration": "weight_acc_lim_theta",
    "arc (no sideways)": "weight_kinematics_nh",
    "driving backwards": "weight_kinematics_forward_drive",
    "turning radius": "weight_kinematics_turning_radius",
    "obstacle distance": "weight_obstacle",
    "inflation": "weight_inflation",
    "via-points": "weight_viapoint",
    "side to turn to": "weight_prefer_rotdir",
    "speed near obstacles": "weight_velocity_obstacle_ratio",
}


class Scene(NamedTuple):
    """The inputs of one cycle.

    plan: (P, 3) the local plan, from the robot's pose to the local goal. twist: (2,) measured.
    obstacles: (N, 2) m. via_points: (V, 2) m. samples: (K, 2) in [0, 1) for the roadmap. lots:
    (L,) in [0, 1), one a band that may be dropped. goal_tolerance_m: nearer goals are not explored.
    preferred_turn: 1 left, -1 right, 0 neither; for a single band.
    """

    plan: Array
    twist: Array
    obstacles: Array
    via_points: Array
    samples: Array
    lots: Array
    goal_tolerance_m: float
    time_s: float
    preferred_turn: float = 0.0


class Planned(NamedTuple):
    """The result of a cycle's planning.

    plan_numbers: bands that follow the global plan; the first that exists is preferred. previous:
    the band that was driven so far and still exists, or -1.
    """

    state: PlannerState
    plan_numbers: tuple[int, ...] = ()
    previous: int = -1

    @property
    def best(self) -> Trajectory | None:
        """The band to drive, or None."""
        bands = self.state.trajectories
        return next((band for band in bands if band.number == self.state.best), None)

    def without_best(self) -> Planned:
        """Returns the planning without the best band; no other one is chosen in its place."""
        state = self.state
        kept = tuple(band for band in state.trajectories if band.number != state.best)
        return self._replace(state=state._replace(trajectories=kept, best=-1), previous=-1)


def limited(parameters: TebUpstreamParameters, limit: SpeedLimit | None) -> TebUpstreamParameters:
    """Returns the parameters under a speed limit, which scales all speeds and raises none."""
    scale = min(speed_limit_ratio(parameters.max_vel_x, limit), 1.0)
    speeds = {name: scale * getattr(parameters, name) for name in SPEEDS}
    return parameters.model_copy(update=speeds)


class Settings(NamedTuple):
    """The parameters of a cycle, and the record of them that the kernels take."""

    parameters: TebUpstreamParameters
    record: NDArray[np.void]


class TebPlanner:
    """Plans one cycle: warm start, other classes, optimisation, choice."""

    def __init__(self, parameters: TebUpstreamParameters, robot: RobotModel) -> None:
        self._parameters = parameters
        self._robot = robot
        self._unlimited = Settings(parameters, parameters.kernel_record())

    def settings(self, limit: SpeedLimit | None) -> Settings:
        """Returns the settings of a cycle with this speed limit."""
        parameters = limited(self._parameters, limit)
        if parameters == self._parameters:
            return self._unlimited
        return Settings(parameters, parameters.kernel_record())

    def plan(self, state: PlannerState, scene: Scene, settings: Settings) -> Planned:
        """Returns optimised bands and the best of them.

        Raises NoValidControl where one band is planned alone and fails.
        """
        if self._parameters.enable_homotopy_class_planning:
            return self._plan_classes(state, scene, settings)
        band = state.trajectories[0] if state.trajectories else None
        if band is None or self._goal_jumped(band, scene.plan[-1]):
            # The side to turn to outlives the band: the original's planner of one band keeps it.
            turn = scene.preferred_turn
            band = Trajectory(0, *self._from_plan(scene, settings), preferred_turn=turn)
        else:
            band = self._warm_started(band, scene, self._parameters.min_samples)
        band = self._optimized(band, scene, settings, scene.via_points)
        if not band.is_optimized:
            raise NoValidControl("the band could not be optimised")
        return Planned(state._replace(trajectories=(band,), best=band.number), previous=band.number)

    def _plan_classes(self, state: PlannerState, scene: Scene, settings: Settings) -> Planned:
        parameters = self._parameters
        bands = state.trajectories
        if bands and self._goal_jumped(bands[0], scene.plan[-1]):
            bands = ()
        # The number of samples that is kept is the default here, whatever min_samples says.
        bands = tuple(self._warm_started(band, scene, FEWEST_SAMPLES) for band in bands)
        search = ClassSearch(settings.parameters, scene.obstacles, bands, state)
        search.keep_one_of_each_class()
        if parameters.delete_detours_backwards:
            search.drop_detours()
        search.drop_at_random(scene.lots)
        search.add_plan(*self._from_plan(scene, settings))
        search.explore(
            scene.plan[0], scene.plan[-1], scene.samples, goal_tolerance_m=scene.goal_tolerance_m
        )
        optimised = []
        for band, follows_plan in search.candidates():
            attracted = parameters.viapoints_all_candidates or follows_plan
            via_points = scene.via_points if attracted else NO_POINTS
            optimised.append(self._optimized(band, scene, settings, via_points))
        state = search.state(tuple(optimised))
        planned = Planned(state, search.plan_numbers(), search.previous_best)
        return self.select(planned, scene.time_s)

    def select(self, planned: Planned, time_s: float) -> Planned:
        """Returns the planning with the cheapest band as the best; a change may be blocked."""
        parameters = self._parameters
        state, plan_numbers, previous = planned
        present = [band.number for band in state.trajectories]
        preferred = next((number for number in plan_numbers if number in present), -1)
        best, least = -1, float(np.finfo(np.float64).max)
        for band in state.trajectories:
            cost = band.cost
            if band.number == previous:
                cost *= parameters.selection_cost_hysteresis
            elif band.number == preferred:
                cost *= parameters.selection_prefer_initial_plan
            if cost < least:
                best, least = band.number, cost
        if previous >= 0 and best != previous:
            if time_s - state.switched_s > parameters.switching_blocking_period:
                state = state._replace(switched_s=time_s)
            else:
                best = previous
        return planned._replace(state=state._replace(best=best))

    def _from_plan(self, scene: Scene, settings: Settings) -> tuple[Array, Array]:
        parameters = self._parameters
        start, goal = scene.plan[0], scene.plan[-1]
        ahead = (goal[:2] - start[:2]) @ [math.cos(start[2]), math.sin(start[2])]
        poses, time_steps = band_from_plan(
            scene.plan,
            parameters.global_plan_overwrite_orientation,
            parameters.allow_init_with_backwards_motion and bool(ahead < 0.0),
            parameters.min_samples,
            settings.parameters.max_vel_x,
            settings.parameters.max_vel_theta,
        )
        return poses, time_steps

    def _goal_jumped(self, band: Trajectory, goal: Array) -> bool:
        distance = math.hypot(*(goal[:2] - band.poses[-1, :2]))
        turn = abs(normalize(goal[2] - band.poses[-1, 2]))
        return (
            distance >= self._parameters.force_reinit_new_goal_dist
            or turn >= self._parameters.force_reinit_new_goal_angular
        )

    def _warm_started(self, band: Trajectory, scene: Scene, fewest: int) -> Trajectory:
        poses, time_steps = warm_start(
            band.poses, band.time_steps, scene.plan[0], scene.plan[-1], fewest
        )
        return band._replace(poses=poses, time_steps=time_steps)

    def _optimized(
        self, band: Trajectory, scene: Scene, settings: Settings, via_points: Array
    ) -> Trajectory:
        if not self._parameters.optimization_activate:
            return band._replace(is_optimized=False)
        around = self._around(band, scene, via_points)
        result = optimize_band(band.poses, band.time_steps, settings.record, around)
        return band._replace(
            poses=result.poses,
            time_steps=result.time_steps,
            cost=result.cost if result.succeeded else band.cost,
            chi_squared=result.chi_squared,
            is_optimized=result.succeeded,
        )

    def _around(self, band: Trajectory, scene: Scene, via_points: Array) -> BandSurroundings:
        parameters = self._parameters
        return BandSurroundings(
            start_twist=read_only(scene.twist),
            stops_at_goal=not parameters.free_goal_vel,
            preferred_turn=band.preferred_turn,
            obstacles=scene.obstacles if parameters.weight_obstacle != 0.0 else NO_POINTS,
            via_points=via_points if parameters.weight_viapoint != 0.0 else NO_POINTS,
            robot=self._robot,
        )

    def penalties(self, band: Trajectory, scene: Scene, settings: Settings) -> dict[str, float]:
        """Returns the penalties of an optimised band by kind, as the last round weighs them.

        Each is computed with the weights of all others at zero. All via-points attract the band.
        """
        parameters = self._parameters
        multiplier = parameters.weight_adapt_factor ** (parameters.no_outer_iterations - 1)
        around = self._around(band, scene, scene.via_points)
        costs = np.zeros(COST_KINDS)
        # Writable as while it is optimised, so that the edges are compiled once.
        poses, steps = band.poses.copy(), band.time_steps.copy()
        count = len(poses)
        attached = attach(poses, count, around, settings.record)
        system = System(np.zeros((1, 1)), np.zeros(1), False, costs, np.zeros((count, 8)))
        found: dict[str, float] = {}
        for kind, name in PENALTY_WEIGHTS.items():
            record = settings.record.copy()
            for weight in PENALTY_WEIGHTS.values():
                record[weight] = record[weight] if weight == name else 0.0
            record.flags.writeable = False
            add_edges(poses, steps, count, record, around, attached, multiplier, system)
            found[kind] = float(costs.sum())
        return found
