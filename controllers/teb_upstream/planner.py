"""One cycle of the original planner, with one band or with one of each class.

teb_local_planner's TebOptimalPlanner and HomotopyClassPlanner (ros2-master) as pure functions of
the bands of the last cycle. `Scene` holds the cycle's inputs.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from drake_navbench.controller import NoValidControl, SpeedLimit
from drake_navbench.controllers.teb.band_parameters import FEWEST_SAMPLES
from drake_navbench.controllers.teb_upstream.association import Association, attach
from drake_navbench.controllers.teb_upstream.band import band_from_plan, normalize, warm_start
from drake_navbench.controllers.teb_upstream.classes import ClassSearch
from drake_navbench.controllers.teb_upstream.memory import PlannerState, Trajectory
from drake_navbench.controllers.teb_upstream.normal_equations import COST_KINDS, System
from drake_navbench.controllers.teb_upstream.optimizer import Rounds, optimize_band
from drake_navbench.controllers.teb_upstream.parameters import TebUpstreamParameters
from drake_navbench.controllers.teb_upstream.penalties import BandSurroundings, Terms, add_edges
from drake_navbench.controllers.teb_upstream.robot_models import RobotModel
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.read_only import read_only
from drake_navbench.kernels.speed_limit import speed_limit_ratio

NO_POINTS = np.empty((0, 2))
# Kind of penalty -> its weight in Terms.
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

    plan_number: the band of the global plan's class, or -1. previous: the band that was driven so
    far and still exists, or -1.
    """

    state: PlannerState
    plan_number: int = -1
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


def penalty_terms(parameters: TebUpstreamParameters, limit: SpeedLimit | None) -> Terms:
    """Returns limits and weights of the edges; a speed limit scales all speeds, and raises none."""
    scale = min(speed_limit_ratio(parameters.max_vel_x, limit), 1.0)
    given = parameters.model_dump()
    speeds = ("max_vel_x", "max_vel_x_backwards", "max_vel_theta")
    return Terms(
        **{name: scale * given[name] for name in speeds},
        **{name: given[name] for name in Terms._fields if name in given and name not in speeds},
        is_carlike=parameters.min_turning_radius != 0.0
        and parameters.weight_kinematics_turning_radius != 0.0,
        proximity_ratio=parameters.obstacle_proximity_ratio_max_vel,
        proximity_lower=parameters.obstacle_proximity_lower_bound,
        proximity_upper=parameters.obstacle_proximity_upper_bound,
    )


def association(parameters: TebUpstreamParameters) -> Association:
    """Returns the rules by which obstacles and via-points attach to poses."""
    wanted = parameters.min_obstacle_dist
    return Association(
        include_at=wanted * parameters.obstacle_association_force_inclusion_factor,
        cut_off_at=wanted * parameters.obstacle_association_cutoff_factor,
        is_legacy=parameters.legacy_obstacle_association,
        poses_affected=parameters.obstacle_poses_affected,
        with_first_pose=parameters.weight_velocity_obstacle_ratio != 0.0,
        via_points_ordered=parameters.via_points_ordered,
    )


def rounds(parameters: TebUpstreamParameters) -> Rounds:
    """Returns the numbers of rounds of an optimisation and the rules of resizing."""
    return Rounds(
        inner=parameters.no_inner_iterations,
        outer=parameters.no_outer_iterations,
        adapt_factor=parameters.weight_adapt_factor,
        resizes=parameters.teb_autosize,
        dt_ref=parameters.dt_ref,
        dt_hysteresis=parameters.dt_hysteresis,
        fewest=parameters.min_samples,
        most=parameters.max_samples,
        once=not parameters.include_dynamic_obstacles,
        obstacle_scale=parameters.selection_obst_cost_scale,
        via_point_scale=parameters.selection_viapoint_cost_scale,
        by_duration=parameters.selection_alternative_time_cost,
        detects_divergence=parameters.divergence_detection_enable,
    )


class TebPlanner:
    """Plans one cycle: warm start, other classes, optimisation, choice."""

    def __init__(self, parameters: TebUpstreamParameters, robot: RobotModel) -> None:
        self._parameters = parameters
        self._robot = robot
        self._association = association(parameters)
        self._rounds = rounds(parameters)

    def plan(self, state: PlannerState, scene: Scene, terms: Terms) -> Planned:
        """Returns optimised bands and the best of them.

        Raises NoValidControl where one band is planned alone and fails.
        """
        if self._parameters.enable_homotopy_class_planning:
            return self._plan_classes(state, scene, terms)
        band = state.trajectories[0] if state.trajectories else None
        if band is None or self._goal_jumped(band, scene.plan[-1]):
            # The side to turn to outlives the band: the original's planner of one band keeps it.
            turn = scene.preferred_turn
            band = Trajectory(0, *self._from_plan(scene, terms), preferred_turn=turn)
        else:
            band = self._warm_started(band, scene, self._parameters.min_samples)
        band = self._optimized(band, scene, terms, scene.via_points)
        if not band.is_optimized:
            raise NoValidControl("the band could not be optimised")
        return Planned(state._replace(trajectories=(band,), best=band.number), previous=band.number)

    def _plan_classes(self, state: PlannerState, scene: Scene, terms: Terms) -> Planned:
        parameters = self._parameters
        bands = state.trajectories
        if bands and self._goal_jumped(bands[0], scene.plan[-1]):
            bands = ()
        # The number of samples that is kept is the default here, whatever min_samples says.
        bands = tuple(self._warm_started(band, scene, FEWEST_SAMPLES) for band in bands)
        search = ClassSearch(parameters, scene.obstacles, bands, state, max_speed=terms.max_vel_x)
        search.keep_one_of_each_class()
        if parameters.delete_detours_backwards:
            search.drop_detours()
        search.drop_at_random(scene.lots)
        search.add_plan(*self._from_plan(scene, terms))
        search.explore(
            scene.plan[0], scene.plan[-1], scene.samples, goal_tolerance_m=scene.goal_tolerance_m
        )
        optimised = []
        for band, follows_plan in search.candidates():
            attracted = parameters.viapoints_all_candidates or follows_plan
            via_points = scene.via_points if attracted else NO_POINTS
            optimised.append(self._optimized(band, scene, terms, via_points))
        state = search.state(tuple(optimised))
        return self.select(Planned(state, search.plan_number(), search.previous_best), scene.time_s)

    def select(self, planned: Planned, time_s: float) -> Planned:
        """Returns the planning with the cheapest band as the best; a change may be blocked."""
        parameters = self._parameters
        state, plan_number, previous = planned
        best, least = -1, float(np.finfo(np.float64).max)
        for band in state.trajectories:
            cost = band.cost
            if band.number == previous:
                cost *= parameters.selection_cost_hysteresis
            elif band.number == plan_number:
                cost *= parameters.selection_prefer_initial_plan
            if cost < least:
                best, least = band.number, cost
        if previous >= 0 and best != previous:
            if time_s - state.switched_s > parameters.switching_blocking_period:
                state = state._replace(switched_s=time_s)
            else:
                best = previous
        return planned._replace(state=state._replace(best=best))

    def _from_plan(self, scene: Scene, terms: Terms) -> tuple[Array, Array]:
        parameters = self._parameters
        start, goal = scene.plan[0], scene.plan[-1]
        ahead = (goal[:2] - start[:2]) @ [math.cos(start[2]), math.sin(start[2])]
        poses, time_steps = band_from_plan(
            scene.plan,
            parameters.global_plan_overwrite_orientation,
            parameters.allow_init_with_backwards_motion and bool(ahead < 0.0),
            parameters.min_samples,
            terms.max_vel_x,
            terms.max_vel_theta,
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
        self, band: Trajectory, scene: Scene, terms: Terms, via_points: Array
    ) -> Trajectory:
        if not self._parameters.optimization_activate:
            return band._replace(is_optimized=False)
        around = self._around(band, scene, terms, via_points)
        result = optimize_band(
            band.poses, band.time_steps, terms, around, self._association, self._rounds
        )
        return band._replace(
            poses=result.poses,
            time_steps=result.time_steps,
            cost=result.cost if result.succeeded else band.cost,
            chi_squared=result.chi_squared,
            is_optimized=result.succeeded,
        )

    def _around(
        self, band: Trajectory, scene: Scene, terms: Terms, via_points: Array
    ) -> BandSurroundings:
        return BandSurroundings(
            start_twist=read_only(scene.twist),
            stops_at_goal=not self._parameters.free_goal_vel,
            preferred_turn=band.preferred_turn,
            obstacles=scene.obstacles if terms.weight_obstacle != 0.0 else NO_POINTS,
            via_points=via_points if terms.weight_viapoint != 0.0 else NO_POINTS,
            robot=self._robot,
        )

    def penalties(self, band: Trajectory, scene: Scene, terms: Terms) -> dict[str, float]:
        """Returns the penalties of an optimised band by kind, as the last round weighs them.

        Each is computed with the weights of all others at zero. All via-points attract the band.
        """
        multiplier = self._rounds.adapt_factor ** (self._rounds.outer - 1)
        around = self._around(band, scene, terms, scene.via_points)
        costs = np.zeros(COST_KINDS)
        # Writable as while it is optimised, so that the edges are compiled once.
        poses, steps = band.poses.copy(), band.time_steps.copy()
        count = len(poses)
        attached = attach(poses, count, around, self._association)
        system = System(np.zeros((1, 1)), np.zeros(1), False, costs, np.zeros((count, 8)))
        found: dict[str, float] = {}
        for kind, name in PENALTY_WEIGHTS.items():
            others: dict[str, Any] = {
                weight: 0.0 for weight in PENALTY_WEIGHTS.values() if weight != name
            }
            add_edges(
                poses,
                steps,
                count,
                terms._replace(**others),
                around,
                attached,
                multiplier,
                system,
            )
            found[kind] = float(costs.sum())
        return found
