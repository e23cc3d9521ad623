"""The bands that a cycle optimises: the last cycle's, the plan's, and ways past obstacles.

The bookkeeping of teb_local_planner's HomotopyClassPlanner (ros2-master): one band of each class,
the best one first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_navbench.controllers.teb_upstream.band import band_from_plan, band_from_points, normalize
from drake_navbench.controllers.teb_upstream.exploration import (
    Graph,
    keypoint_graph,
    roadmap,
    walk_of,
    walk_on,
)
from drake_navbench.controllers.teb_upstream.memory import PlannerState, Trajectory
from drake_navbench.controllers.teb_upstream.parameters import TebUpstreamParameters
from drake_navbench.controllers.teb_upstream.signatures import (
    ClassRules,
    is_wanted,
    same_class,
    signature,
)
from drake_navbench.kernels.arrays import Array

# Other bands are compared with the best one's duration, which counts as no less than this, s.
SHORTEST_DURATION_S = 1.0

NO_CLASSES = np.empty((0, 0))


class ClassSearch:
    """The bands of one cycle and their classes."""

    def __init__(
        self,
        parameters: TebUpstreamParameters,
        obstacles: Array,
        bands: tuple[Trajectory, ...],
        state: PlannerState,
    ) -> None:
        self._parameters = parameters
        self._obstacles = obstacles
        self._bands = list(bands)
        self._classes: list[Array] = []
        self._next_number = state.next_number
        self._switched_s = state.switched_s
        self._best_class = state.best_class
        self._plan_class = state.plan_class
        self._plan_number = -1
        self._rules = ClassRules(
            in_time=parameters.include_dynamic_obstacles,
            prescaler=parameters.h_signature_prescaler,
            threshold=parameters.h_signature_threshold,
            most_of_best=parameters.max_number_plans_in_current_class,
        )
        numbers = [band.number for band in bands]
        self.previous_best = state.best if state.best in numbers else -1

    def keep_one_of_each_class(self) -> None:
        """Finds the classes of all bands, the best one's first; keeps one band of each class."""
        bands = self._bands
        for index, band in enumerate(bands):
            if band.number == self.previous_best:
                bands[0], bands[index] = bands[index], bands[0]
                self._best_class = self._signature(bands[0].poses, bands[0].time_steps)
        self._bands = []
        for band in bands:
            self._add_if_new(band, self._signature(band.poses, band.time_steps))

    def drop_detours(self) -> None:
        """Drops bands that set off elsewhere than the best one, failed, or take far longer."""
        parameters = self._parameters
        best = next((band for band in self._bands if band.number == self.previous_best), None)
        if len(self._bands) < 2 or best is None:
            return
        direction = _start_direction(best.poses, parameters.length_start_orientation_vector)
        if direction is None:
            return
        duration = max(best.duration_s, SHORTEST_DURATION_S)
        longest = parameters.max_ratio_detours_duration_best_duration * duration

        def stays(band: Trajectory) -> bool:
            own = _start_direction(band.poses, parameters.length_start_orientation_vector)
            return (
                own is not None
                and abs(normalize(own - direction)) <= parameters.detours_orientation_tolerance
                and band.is_optimized
                and band.duration_s <= longest
            )

        self._keep([band is best or stays(band) for band in self._bands])

    def drop_at_random(self, lots: Array) -> None:
        """Drops other bands than the best one with selection_dropping_probability; lots: (L,)."""
        probability = self._parameters.selection_dropping_probability
        if probability == 0.0:
            return
        self._keep(
            [
                band.number == self.previous_best or lot > probability
                for band, lot in zip(self._bands, lots, strict=False)
            ]
        )

    def add_plan(self, poses: Array, time_steps: Array) -> None:
        """Adds the band of the global plan where its class is new and there is room.

        Without room the plan keeps the class of an earlier cycle, as in the original.
        """
        if self._is_full():
            return
        self._plan_class = self._signature(poses, time_steps)
        band = Trajectory(self._next_number, poses, time_steps)
        if self._add_if_new(band, self._plan_class):
            self._plan_number = band.number
            self._next_number += 1

    def explore(
        self, start: Array, goal: Array, samples: Array, *, goal_tolerance_m: float
    ) -> None:
        """Adds bands of new classes from the paths of a graph, until there is no room."""
        parameters = self._parameters
        # Without obstacles there is one class, and every path of the graph is in it.
        is_alone = not len(self._obstacles) and parameters.max_number_plans_in_current_class <= 1
        if self._is_full() or (is_alone and self._bands):
            return
        ahead = goal[:2] - start[:2]
        backwards = parameters.allow_init_with_backwards_motion and bool(
            ahead @ [math.cos(start[2]), math.sin(start[2])] < 0.0
        )
        if math.hypot(ahead[0], ahead[1]) < goal_tolerance_m:
            if not self._bands:
                ends = np.array([start, goal])
                poses, time_steps = band_from_plan(
                    ends, True, False, parameters.min_samples, parameters.max_vel_x, 0.0
                )
                self._add_new(poses, time_steps, self._signature(poses, time_steps))
            return
        band = PathBand(
            start[2],
            goal[2],
            backwards,
            parameters.min_samples,
            parameters.max_vel_x,
            parameters.acc_lim_x,
        )
        self._add_from_paths(self._graph(start, goal, samples), band)

    def candidates(self) -> Iterator[tuple[Trajectory, bool]]:
        """Yields each band and whether it has the class of the global plan."""
        plan_class = self._plan_class
        for band, values in zip(self._bands, self._classes, strict=True):
            yield band, plan_class is not None and same_class(values, plan_class, self._rules)

    def plan_numbers(self) -> tuple[int, ...]:
        """Returns the numbers of the bands that count as the global plan's, the first that exists.

        These are the band made from the plan in this cycle, if any, and all of its class.
        """
        own = (self._plan_number,) if self._plan_number >= 0 else ()
        return own + tuple(band.number for band, follows in self.candidates() if follows)

    def state(self, bands: tuple[Trajectory, ...]) -> PlannerState:
        """Returns the state for the next cycle: the optimised bands, the best not yet chosen."""
        return PlannerState(
            trajectories=bands,
            best=-1,
            best_class=self._best_class,
            next_number=self._next_number,
            switched_s=self._switched_s,
            plan_class=self._plan_class,
        )

    def _add_from_paths(self, graph: Graph, band: PathBand) -> None:
        walk, length = walk_of(graph), 0
        while not self._is_full():
            length, poses, time_steps, values = next_wanted_band(
                graph,
                walk,
                length,
                band,
                self._obstacles,
                *self._compared(),
                self._rules,
            )
            if length == 0:
                return
            self._add_new(poses, time_steps, values)

    def _is_full(self) -> bool:
        return len(self._bands) >= self._parameters.max_number_classes

    def _graph(self, start: Array, goal: Array, samples: Array) -> Graph:
        parameters = self._parameters
        clearance, cosine = parameters.min_obstacle_dist, parameters.obstacle_heading_threshold
        if parameters.simple_exploration:
            return keypoint_graph(
                start, goal, self._obstacles, clearance_m=clearance, least_cosine=cosine
            )
        return roadmap(
            start,
            goal,
            self._obstacles,
            samples=samples,
            width_m=parameters.roadmap_graph_area_width,
            length_ratio=parameters.roadmap_graph_area_length_scale,
            clearance_m=clearance,
            least_cosine=cosine,
        )

    def _add_new(self, poses: Array, time_steps: Array, values: Array) -> None:
        if self._add_if_new(Trajectory(self._next_number, poses, time_steps), values):
            self._next_number += 1

    def _add_if_new(self, band: Trajectory, values: Array) -> bool:
        if not is_wanted(values, *self._compared(), self._rules):
            return False
        self._bands.append(band)
        self._classes.append(values)
        return True

    def _compared(self) -> tuple[Array, Array]:
        """Returns the known classes (C, N) and the best band's (1, M); (0, 0) where none is."""
        best = NO_CLASSES if self._best_class is None else self._best_class[None]
        return np.array(self._classes) if self._classes else NO_CLASSES, best

    def _keep(self, wanted: list[bool]) -> None:
        pairs = [
            pair
            for pair, keep in zip(zip(self._bands, self._classes, strict=True), wanted, strict=True)
            if keep
        ]
        self._bands = [band for band, _ in pairs]
        self._classes = [values for _, values in pairs]

    def _signature(self, poses: Array, time_steps: Array) -> Array:
        return signature(poses, time_steps, self._obstacles, self._rules)


def _start_direction(poses: Array, length_m: float) -> float | None:
    """Returns the direction (rad) to the first pose farther than length_m; None without one.

    It points backwards, from that pose to the first one, as in the original.
    """
    offsets = poses[0, :2] - poses[:, :2]
    far = np.flatnonzero(np.hypot(offsets[:, 0], offsets[:, 1]) > length_m)
    if far.size == 0:
        return None
    return math.atan2(offsets[far[0], 1], offsets[far[0], 0])


class PathBand(NamedTuple):
    """The arguments by which `band_from_points` makes a band of a path's points."""

    start_yaw: float
    goal_yaw: float
    backwards: bool
    fewest: int
    max_speed: float
    max_acceleration: float


@njit(cache=True, error_model="numpy")
def next_wanted_band(graph, walk, length, band, obstacles, known, best, rules):
    """Walks on through a graph until the points (K, 2) m of a path make a band that is wanted.

    length: length of the walk's path so far. known, best, rules: see `is_wanted`. Returns the
    path's new length, poses, time steps and signature; the length is 0 where the walk has ended.
    """
    points, edges = graph
    goal = points.shape[0] - 1
    while True:
        length = walk_on(edges, walk, length)
        if length == 0:
            return 0, np.empty((0, 3)), np.empty(0), np.empty(0)
        if not edges[walk.path[length - 1], goal]:
            continue
        # Behind the walk's points there is room for the goal, which they never contain.
        walk.path[length] = goal
        poses, steps = band_from_points(
            points[walk.path[: length + 1]],
            band.start_yaw,
            band.goal_yaw,
            band.backwards,
            band.fewest,
            band.max_speed,
            band.max_acceleration,
        )
        values = signature(poses, steps, obstacles, rules)
        if is_wanted(values, known, best, rules):
            return length, poses, steps, values
