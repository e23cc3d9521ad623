"""From one cycle's situation to a plan: guesses, and the program for the best of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controllers.harmony.guesses import GUESS_SHARE, pursuit, stop
from drake_navbench.controllers.harmony.interior_point import SolverSettings, solve
from drake_navbench.controllers.harmony.motion import V, W, plan_of_velocities, shifted
from drake_navbench.controllers.harmony.parameters import HarmonyParameters
from drake_navbench.controllers.harmony.rating import cost_of_motion
from drake_navbench.controllers.harmony.scene import (
    Limits,
    Scene,
    references_along,
    required_clearances,
    velocity_bounds,
    wanted_speeds,
)
from drake_navbench.controllers.harmony.terms import (
    COSTMAP_COST,
    FORWARD_PREFERENCE,
    LINEAR_JERK,
    PATH_ALIGNMENT,
    plan_cost,
)
from drake_navbench.controllers.harmony.way import Way
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.distance_field import DistanceField
from drake_navbench.kernels.read_only import read_only

Array = NDArray[np.float64]

# Plans keep this much more room than the gatekeeper asks for, m: estimates jump, and the distance
# field is up to 1 cm too large off a corner.
ROOM_TO_SPARE_M = 0.02
# The allowed violation of the program's rows, in parts of their limits.
TOLERANCE = 1e-2
# Most iterations, and the first barrier, for the plan driven so far and for any other one.
WARM_ITERATIONS, COLD_ITERATIONS = 12, 25
WARM_BARRIER, COLD_BARRIER, LAST_BARRIER = 1e-3, 1e-2, 1e-5
# Another guess than the driven plan is taken if its cost is below this share of that plan's.
BETTER_GUESS_RATIO = 0.8
# Segments of the path looked at from stage to stage, as the robot's reach a stage by their length.
MOST_SEGMENTS_AHEAD = 12
# The share of the weight `path_alignment` that holds on a detour, which nobody asked to follow, and
# with the goal in reach: who keeps to the path up to the goal turns late to the goal's heading.
LOOSE_ALIGNMENT_SHARE = 0.1
# The share of `linear_jerk` that holds after the hard stop for something that moves.
HURRIED_JERK_SHARE = 0.1


class Candidate(NamedTuple):
    """A plan (N + 1, 9).

    cost: of the terms. solved: by the program, within its limits. iterations, violation: of the
    program.
    """

    plan: Array
    cost: float
    solved: bool
    iterations: int
    violation: float


class Planner:
    """Makes the plans of a cycle. discs: (D, 2) of the robot, m."""

    def __init__(self, parameters: HarmonyParameters, discs: Array) -> None:
        self._parameters = parameters
        self._discs = discs
        # Corners lie on the rims of the discs, so the discs keep the corners' clearance.
        self.clearance = parameters.error_bound_m + ROOM_TO_SPARE_M + parameters.min_obstacle_dist
        self._weights = read_only(parameters.weights.as_array())

    @property
    def stage_count(self) -> int:
        """Stages of a plan, N + 1."""
        return self._parameters.step_count + 1

    def limits(self, top_speed: float, sweep: float = 0.0) -> Limits:
        """Returns the limits of plans under a speed limit, m/s.

        sweep: by how much the clearance grows in a turn, m for each rad/s.
        """
        p = self._parameters
        scale = min(top_speed / p.max_vel_x, 1.0)
        return Limits(
            forward_speed=scale * p.max_vel_x,
            backward_speed=scale * p.max_vel_x_backwards,
            turn_rate=p.max_vel_theta,
            acceleration=p.acc_lim_x,
            angular_acceleration=p.acc_lim_theta,
            jerk=p.jerk_lim_x,
            angular_jerk=p.jerk_lim_theta,
            wheel_speed=p.max_wheel_speed,
            half_track=0.5 * p.wheel_separation,
            lateral_acceleration=p.max_lateral_acceleration,
            clearance=self.clearance,
            sweep=sweep,
        )

    def scene(self, start: Array, way: Way, field: DistanceField, limits: Limits) -> Scene:
        """Returns the program's data without the references, which depend on the guess."""
        dt, count = self._parameters.time_step, self.stage_count
        low, high = velocity_bounds(start, limits, dt, count)
        speeds = wanted_speeds(
            count,
            dt,
            max(float(start[V]), 0.0),
            limits.forward_speed,
            GUESS_SHARE * limits.acceleration,
            way.stop_m,
        )
        references = np.zeros((count, 4))
        references[:, 3] = -limits.backward_speed if way.backs_up else speeds
        target = way.target.copy()
        target[2] = start[2] + wrap(target[2] - start[2])
        return Scene(
            dt,
            target,
            1.0 if way.nears_goal else 0.0,
            references,
            field,
            self._discs,
            required_clearances(field, self._discs, start, limits, dt, count),
            low,
            high,
            limits,
            self._parameters.limit_share,
            self._weights_on(way),
        )

    def _weights_on(self, way: Way) -> Array:
        weights = self._weights.copy()
        if way.hurries:
            weights[LINEAR_JERK] *= HURRIED_JERK_SHARE
        if way.is_detour or way.nears_goal:
            weights[PATH_ALIGNMENT] *= LOOSE_ALIGNMENT_SHARE
        if way.backs_up:
            weights[FORWARD_PREFERENCE] = 0.0
        return read_only(weights)

    def candidate(
        self, scene: Scene, start: Array, way: Way, *, driven: Array | None, elapsed_s: float
    ) -> tuple[Candidate | None, dict[str, Array]]:
        """Returns the plan made of the cheapest guess, None if all are blocked; and the guesses.

        The guesses are as the replay takes them: poses (S, N + 1, 3) and costs (S,), NaN of a
        blocked one. start: (9,) first stage. driven: the plan driven so far, committed `elapsed_s`
        ago; given one, it is the first guess.
        """
        window = self._window(way)
        rest = None if driven is None else shifted(driven, scene.dt, elapsed_s, start)
        guesses = self._guesses(scene, start, way, rest, window)
        motions, costs = self._rated(scene, start, way, guesses, window)
        best = int(np.argmin(costs))
        if not np.isfinite(costs[best]):
            found = None
        elif rest is not None and costs[best] > BETTER_GUESS_RATIO * costs[0]:
            found = self._improved(scene, way, rest, True, window)
        else:
            guess = plan_of_velocities(guesses[best], scene.dt, start)
            found = self._improved(scene, way, guess, False, window)
            if rest is not None and np.isfinite(costs[0]) and not found.solved:
                # A guess ignores the limits of jerk, so the driven plan is the safer one.
                found = self._improved(scene, way, rest, True, window)
        costs[np.isinf(costs)] = np.nan
        return found, {"sampled_trajectories": motions, "sampled_costs": costs}

    def _rated(
        self, scene: Scene, start: Array, way: Way, guesses: list[Array], window: int
    ) -> tuple[Array, Array]:
        """Returns the motions (S, N + 1, 3) of guessed velocities, and their costs (S,)."""
        weights = scene.weights.copy()
        weights[COSTMAP_COST] = 0.0
        without = scene._replace(weights=read_only(weights))
        motions = np.empty((len(guesses), self.stage_count, 3))
        costs = [
            cost_of_motion(scene, without, way.path, guess, start, window, motion)
            for guess, motion in zip(guesses, motions, strict=True)
        ]
        return motions, np.array(costs)

    def _window(self, way: Way) -> int:
        spacing = way.length_m / max(len(way.path) - 1, 1)
        reach = 3.0 * self._parameters.max_vel_x * self._parameters.time_step
        needed = int(np.ceil(2.0 * reach / spacing)) if spacing > 0.0 else 1
        return max(MOST_SEGMENTS_AHEAD, needed)

    def _guesses(
        self, scene: Scene, start: Array, way: Way, rest: Array | None, window: int
    ) -> list[Array]:
        """Returns the guessed velocities (N + 1, 2), those of the plan driven so far first."""
        limits, dt, count = scene.limits, scene.dt, self.stage_count
        guesses = [] if rest is None else [np.ascontiguousarray(rest[:, V : W + 1])]
        guesses += [
            pursuit(way.path, start, scene.target, scene.nears_goal, limits, dt, count, window),
            stop(start, limits, dt, count),
        ]
        return guesses

    def _improved(
        self, scene: Scene, way: Way, guess: Array, is_warm: bool, window: int
    ) -> Candidate:
        """Returns the guess improved by the program.

        It is unchanged if the program finds no solution.
        """
        scene = scene._replace(references=references_along(scene, way.path, guess, window))
        settings = SolverSettings(
            WARM_ITERATIONS if is_warm else COLD_ITERATIONS,
            WARM_BARRIER if is_warm else COLD_BARRIER,
            LAST_BARRIER,
            TOLERANCE,
        )
        solution = solve(scene, guess, settings)
        plan = solution.plan if solution.solved else guess
        cost = solution.cost if solution.solved else plan_cost(scene, guess)
        return Candidate(plan, cost, solution.solved, solution.iterations, solution.violation)
