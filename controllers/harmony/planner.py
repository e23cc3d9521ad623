"""From one cycle's situation to a plan: guesses, and the program for the best of them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controllers.harmony.detour import distances_at
from drake_navbench.controllers.harmony.guesses import (
    GUESS_SHARE,
    LEFT,
    RIGHT,
    along_wall,
    pursuit,
    stop,
)
from drake_navbench.controllers.harmony.interior_point import SolverSettings, solve
from drake_navbench.controllers.harmony.motion import YAW, V, X, Y, plan_of_velocities, shifted
from drake_navbench.controllers.harmony.parameters import HarmonyParameters
from drake_navbench.controllers.harmony.scene import (
    Limits,
    Scene,
    Shape,
    references_along,
    required_clearances,
    velocity_bounds,
    wanted_speeds,
    with_references,
)
from drake_navbench.controllers.harmony.terms import (
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
WARM_BARRIER, COLD_BARRIER, LAST_BARRIER = 1e-3, 1e-2, 1e-5
# Another guess than the driven plan is taken if its cost is below this share of that plan's.
BETTER_GUESS_RATIO = 0.8
# Segments of the path looked at from stage to stage, as the robot's reach a stage by their length.
MOST_SEGMENTS_AHEAD = 12
# The room between a wall that is followed and the widest disc, m.
WALL_ROOM_M = 0.15
# The share of the weight `path_alignment` that holds on a detour, which nobody asked to follow.
DETOUR_ALIGNMENT_SHARE = 0.1


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


def has_room(scene: Scene, plan: Array) -> bool:
    """Returns whether the discs have their clearance along a plan (N + 1, 9), within the map.

    The distance of a disc is that of its centre's cell. Half a cell less will do: a gap that is
    wide enough for the program must not look closed.
    """
    along, radii = scene.discs.T
    yaw = plan[1:, YAW, None]
    centres = np.stack(
        [plan[1:, X, None] + along * np.cos(yaw), plan[1:, Y, None] + along * np.sin(yaw)], axis=-1
    )
    distances = distances_at(scene.field, centres.reshape(-1, 2)).reshape(len(yaw), -1)
    least = scene.required[1:, None] - 0.5 * scene.field.resolution
    # Off the map the distance is NaN, which is not enough.
    return bool((distances - radii >= least).all())


class Planner:
    """Makes the plans of a cycle. discs: (D, 2) of the robot, m."""

    def __init__(self, parameters: HarmonyParameters, discs: Array) -> None:
        self._parameters = parameters
        self._discs = discs
        # Corners lie on the rims of the discs, so the discs keep the corners' clearance.
        self.clearance = parameters.error_bound_m + ROOM_TO_SPARE_M + parameters.min_obstacle_dist
        self._weights = read_only(parameters.weights.as_array())
        self._shape = Shape(
            parameters.limit_share,
            parameters.inflation_dist,
            parameters.curve_speed,
            parameters.approach_dist,
        )

    @property
    def stage_count(self) -> int:
        """Stages of a plan, N + 1."""
        return self._parameters.step_count + 1

    def limits(self, top_speed: float) -> Limits:
        """Returns the limits of plans under a speed limit, m/s."""
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
            required_clearances(field, self._discs, start, limits.clearance, count),
            low,
            high,
            limits,
            self._shape,
            self._weights_on(way),
        )

    def _weights_on(self, way: Way) -> Array:
        weights = self._weights.copy()
        if way.is_detour:
            weights[PATH_ALIGNMENT] *= DETOUR_ALIGNMENT_SHARE
        if way.backs_up:
            weights[FORWARD_PREFERENCE] = 0.0
        return read_only(weights)

    def candidate(
        self,
        scene: Scene,
        start: Array,
        way: Way,
        *,
        driven: Array | None,
        elapsed_s: float,
        is_trapped: bool,
    ) -> tuple[Candidate | None, dict[str, Array]]:
        """Returns the plan made of the cheapest guess, None if all are blocked; and the guesses.

        The guesses are as the replay takes them: poses (S, N + 1, 3) and costs (S,), NaN of a
        blocked one. start: (9,) first stage. driven: the plan driven so far, committed `elapsed_s`
        ago; given one, it is the first guess.
        """
        window = self._window(way)
        guesses = self._guesses(scene, start, way, is_trapped=is_trapped, window=window)
        if driven is not None:
            guesses = [shifted(driven, scene.dt, elapsed_s, start), *guesses]
        costs = np.array([self._cost_of_guess(scene, way, one, window) for one in guesses])
        best, kept = int(np.argmin(costs)), 0 if driven is not None else None
        if not np.isfinite(costs[best]):
            found = None
        elif kept is not None and costs[best] > BETTER_GUESS_RATIO * costs[kept]:
            found = self._improved(scene, way, guesses[kept], True, window)
        else:
            found = self._improved(scene, way, guesses[best], False, window)
            if not found.solved and kept is not None:
                # A guess ignores the limits of jerk, so the driven plan is the safer one.
                found = self._improved(scene, way, guesses[kept], True, window)
        costs[np.isinf(costs)] = np.nan
        poses = np.stack([guess[:, : YAW + 1] for guess in guesses])
        return found, {"sampled_trajectories": poses, "sampled_costs": costs}

    def _cost_of_guess(self, scene: Scene, way: Way, guess: Array, window: int) -> float:
        """Returns the cost of the terms, inf without room; jerk is left to the program."""
        if not has_room(scene, guess):
            return np.inf
        weights = scene.weights.copy()
        weights[LINEAR_JERK] = 0.0
        references = references_along(scene, way.path, guess, window)
        return float(plan_cost(scene._replace(weights=weights, references=references), guess))

    def ways_to_stop(
        self, start: Array, limits: Limits, driven: Array | None, elapsed_s: float
    ) -> Iterator[tuple[str, Array]]:
        """Yields names and plans that need no program and end nearly at rest.

        They are the rest of the plan driven so far, which an earlier cycle accepted, and a stop
        within the limits.
        """
        dt = self._parameters.time_step
        if driven is not None:
            yield "plan so far", shifted(driven, dt, elapsed_s, start)
        velocities = stop(start, limits, dt, self.stage_count)
        yield "gentle stop", plan_of_velocities(velocities, dt, start)

    def _window(self, way: Way) -> int:
        spacing = way.length_m / max(len(way.path) - 1, 1)
        reach = 3.0 * self._parameters.max_vel_x * self._parameters.time_step
        needed = int(np.ceil(2.0 * reach / spacing)) if spacing > 0.0 else 1
        return max(MOST_SEGMENTS_AHEAD, needed)

    def _guesses(
        self, scene: Scene, start: Array, way: Way, *, is_trapped: bool, window: int
    ) -> list[Array]:
        limits, dt, count = scene.limits, scene.dt, self.stage_count
        velocities = [
            pursuit(way.path, start, scene.target, scene.nears_goal, limits, dt, count, window),
            stop(start, limits, dt, count),
        ]
        if is_trapped:
            keep = float(self._discs[:, 1].max()) + limits.clearance + WALL_ROOM_M
            ahead = float(self._discs[-1, 0])
            velocities += [
                along_wall(scene.field, side, keep, start, scene.target, limits, dt, count, ahead)
                for side in (LEFT, RIGHT)
            ]
        return [plan_of_velocities(one, dt, start) for one in velocities]

    def _improved(
        self,
        scene: Scene,
        way: Way,
        guess: Array,
        is_warm: bool,
        window: int,
    ) -> Candidate:
        """Returns the guess improved by the program.

        It is unchanged if the program finds no solution or `use_program` is off.
        """
        parameters = self._parameters
        scene = with_references(scene, references_along(scene, way.path, guess, window))
        if not parameters.use_program:
            cost = plan_cost(scene, guess)
            return Candidate(guess, cost, True, 0, 0.0)
        settings = SolverSettings(
            parameters.warm_iterations if is_warm else parameters.cold_iterations,
            WARM_BARRIER if is_warm else COLD_BARRIER,
            LAST_BARRIER,
            TOLERANCE,
        )
        solution = solve(scene, guess, settings)
        plan = solution.plan if solution.solved else guess
        cost = solution.cost if solution.solved else plan_cost(scene, guess)
        return Candidate(plan, cost, solution.solved, solution.iterations, solution.violation)
