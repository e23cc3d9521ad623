"""From a guess to an optimised band: scene, bounds and the programs of all sizes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import SpeedLimit
from drake_navbench.controllers.teb.arcs import band_geometry
from drake_navbench.controllers.teb.band import Band, Pace, freeze, resampled, unwrapped_goal
from drake_navbench.controllers.teb.constraints import BandScene
from drake_navbench.controllers.teb.ipopt_program import SolverSettings
from drake_navbench.controllers.teb.layout import pack_band
from drake_navbench.controllers.teb.local_plan import LEAST_CLEARANCE_RATIO
from drake_navbench.controllers.teb.objective import Weights
from drake_navbench.controllers.teb.parameters import TebParameters
from drake_navbench.controllers.teb.passage import Passage
from drake_navbench.controllers.teb.predicted import clearance_now, encounters_of
from drake_navbench.controllers.teb.program import (
    BandLimits,
    BandProgram,
    BandSolution,
    NewtonResult,
)
from drake_navbench.controllers.teb.surroundings import Surroundings
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.distance_field import path_clearance
from drake_navbench.kernels.speed_limit import speed_limit_ratio

SHORTEST_STEP_RATIO = 0.2
LONGEST_STEP_RATIO = 4.0
# A band is good enough to drive while no limit is exceeded by more (m, m/s, rad/s, m/s^2, rad/s^2).
ACCEPTED_VIOLATION = 1e-2
# The share of the braking acceleration that a stop at the goal may use.
BRAKING_RESERVE_RATIO = 0.9


class Task(NamedTuple):
    """The inputs that the bands of one cycle share.

    start (3,), goal (3,), twist (2,) as measured, around: obstacles, passage: that of the plan,
    via_points (V, 2) m, limits.
    """

    start: Array
    goal: Array
    twist: Array
    around: Surroundings
    passage: Passage
    via_points: Array
    limits: BandLimits


class PlannedBand(NamedTuple):
    """An optimised band and how it came about.

    accepted: it obeys the limits. given_up_m: the clearance, of min_obstacle_dist, that it need not
    keep at its narrowest place; the slack comes on top. newton: the result of Newton's method.
    """

    band: Band
    solution: BandSolution
    accepted: bool
    given_up_m: float
    newton: NewtonResult


def band_limits(parameters: TebParameters, speed_limit: SpeedLimit | None) -> BandLimits:
    """Returns the limits under a speed limit, which scales all speeds and raises none."""
    scale = min(speed_limit_ratio(parameters.max_vel_x, speed_limit), 1.0)
    return BandLimits(
        forward_speed=scale * parameters.max_vel_x,
        backward_speed=scale * parameters.max_vel_x_backwards,
        turn_rate=scale * parameters.max_vel_theta,
        acceleration=parameters.acc_lim_x,
        angular_acceleration=parameters.acc_lim_theta,
        clearance=parameters.min_obstacle_dist,
        shortest_step=SHORTEST_STEP_RATIO * parameters.dt_ref,
        longest_step=LONGEST_STEP_RATIO * parameters.dt_ref,
        largest_slack=(1.0 - LEAST_CLEARANCE_RATIO) * parameters.min_obstacle_dist,
        stops_at_goal=not parameters.free_goal_vel,
    )


def pace_of(parameters: TebParameters, limits: BandLimits) -> Pace:
    """Returns the speeds and resolution of first guesses under the limits."""
    return Pace(
        speed=limits.forward_speed,
        turn_rate=limits.turn_rate,
        acceleration=limits.acceleration,
        dt_ref=parameters.dt_ref,
        dt_hysteresis=parameters.dt_hysteresis,
        fewest=parameters.min_samples,
        most=parameters.max_samples,
        turns_on_spot=parameters.min_turning_radius == 0.0,
    )


class BandPlanner:
    """Optimises bands; keeps one program for each size."""

    def __init__(self, parameters: TebParameters, discs: Array) -> None:
        self._discs = discs
        self._turning_radius = parameters.min_turning_radius
        self._programs: dict[tuple[int, bool], BandProgram] = {}
        self._weights = Weights(
            time=parameters.weight_optimaltime,
            length=parameters.weight_shortest_path,
            backwards=parameters.weight_kinematics_forward_drive,
            via_point=parameters.weight_viapoint,
            inflation=parameters.weight_inflation,
            inflation_dist=parameters.inflation_dist,
            smoothness=parameters.weight_smoothness,
            slack=parameters.weight_slack,
        )

    def lead_cold(self, guess: Band, task: Task, *, pace: Pace) -> PlannedBand:
        """Returns the band of a guess whose duration is a guess as well.

        Where its time steps come out too long or too short it is cut anew and optimised once more,
        as teb_local_planner resizes its bands between its rounds.
        """
        planned = self.run_newton(guess, task)
        if not planned.accepted:
            return planned
        current = len(planned.band.time_steps)
        count = pace.interval_count(planned.band.duration_s, current)
        if count == current:
            return planned
        again = self.run_newton(resampled(planned.band, count), task)
        return again if again.accepted else planned

    def run_newton(self, guess: Band, task: Task) -> PlannedBand:
        """Returns the band that Newton's method makes of a guess."""
        scene = self._scene(guess, task)
        longest = max(task.limits.longest_step, 2.0 * float(guess.time_steps.max()))
        clearance = min(
            float(path_clearance(task.around.field, self._discs, guess.poses[:1].copy())[0]),
            clearance_now(task.around.moving, self._discs, *guess.poses[0]),
        )
        limits = task.limits._replace(
            longest_step=longest,
            # A robot that already stands closer may stay as close, not come closer.
            largest_slack=max(task.limits.largest_slack, task.limits.clearance - clearance),
        )
        program = self._program(
            len(guess.time_steps), meets_moving=len(scene.encounters.things) > 0
        )
        newton = program.run_newton(
            pack_band(guess.poses, guess.time_steps, 0.0),
            scene=scene,
            weights=self._weights,
            limits=limits,
        )
        planned = self._planned(newton, program.unconfirmed(newton), limits)
        return planned._replace(accepted=planned.accepted and newton.descent.converged)

    def confirm(self, planned: PlannedBand, task: Task, *, iterations: int) -> PlannedBand:
        """Returns the band that IPOPT makes of a band in at most so many iterations.

        It starts where Newton's method ended, or from the guess where that failed.
        """
        problem = planned.newton.problem
        meets_moving = len(problem.scene.encounters.things) > 0
        program = self._program(problem.interval_count, meets_moving=meets_moving)
        solution = program.confirm(planned.newton, iterations)
        return self._planned(planned.newton, solution, task.limits)

    def _planned(
        self, newton: NewtonResult, solution: BandSolution, limits: BandLimits
    ) -> PlannedBand:
        finite = bool(np.isfinite(solution.poses).all() and np.isfinite(solution.time_steps).all())
        least_share = float(newton.problem.scene.clearance_shares.min(initial=1.0))
        return PlannedBand(
            Band(freeze(solution.poses), freeze(solution.time_steps)),
            solution,
            finite and solution.violation <= ACCEPTED_VIOLATION,
            (1.0 - least_share) * limits.clearance,
            newton,
        )

    def _program(self, interval_count: int, *, meets_moving: bool) -> BandProgram:
        """Returns the program of a size, built at its first use."""
        program = self._programs.get((interval_count, meets_moving))
        if program is None:
            program = BandProgram(
                interval_count,
                len(self._discs),
                settings=SolverSettings(),
                is_car=self._turning_radius > 0.0,
                meets_moving=meets_moving,
            )
            self._programs[interval_count, meets_moving] = program
        return program

    def _scene(self, guess: Band, task: Task) -> BandScene:
        limits = task.limits
        speed = min(max(float(task.twist[0]), -limits.backward_speed), limits.forward_speed)
        turn_rate = min(max(float(task.twist[1]), -limits.turn_rate), limits.turn_rate)
        distance = math.hypot(task.goal[0] - task.start[0], task.goal[1] - task.start[1])
        braked = speed * speed - 2.0 * BRAKING_RESERVE_RATIO * limits.acceleration * distance
        goal_speed = math.copysign(math.sqrt(max(braked, 0.0)), speed)
        return BandScene(
            start=np.ascontiguousarray(guess.poses[0]),
            goal=unwrapped_goal(task.goal, guess),
            start_twist=np.array([speed, turn_rate]),
            goal_twist=np.array([goal_speed, 0.0]),
            discs=self._discs,
            field=task.around.field,
            clearance_shares=task.passage.shares_at(guess.poses[1:-1]),
            via_points=task.via_points,
            via_poses=_nearest_inner_poses(guess.poses, task.via_points),
            turning_radius=self._turning_radius,
            directions=np.where(band_geometry(guess.poses.copy())[0] < 0.0, -1.0, 1.0),
            encounters=encounters_of(
                task.around.moving, self._discs, guess.poses, guess.time_steps
            ),
        )


def _nearest_inner_poses(poses: Array, points: Array) -> NDArray[np.int64]:
    """Returns (V,) the index of the inner pose nearest to each point."""
    inner = poses[1:-1, :2]
    squared = np.sum((points[:, None, :] - inner[None, :, :]) ** 2, axis=2)
    return 1 + np.argmin(squared, axis=1) if len(points) else np.empty(0, dtype=np.int64)
