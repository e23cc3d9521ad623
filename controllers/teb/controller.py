"""The TEB controller: one cycle from observation to command."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

import numpy as np

from drake_navbench.controller import ControllerSetup, Decision, NoValidControl, Observation
from drake_navbench.controllers.teb.candidates import (
    Ends,
    gather_candidates,
    spare_candidate,
    ways_past_block,
    ways_past_narrow,
)
from drake_navbench.controllers.teb.choice import Attempt, BandChooser
from drake_navbench.controllers.teb.homotopy import Clusters, find_clusters
from drake_navbench.controllers.teb.local_plan import (
    LEAST_CLEARANCE_RATIO,
    LocalPlan,
    cut_local_plan,
    via_points,
)
from drake_navbench.controllers.teb.memory import REVISIT_PERIOD_S, TebMemory
from drake_navbench.controllers.teb.obstacle_tracking import Track, track_obstacles
from drake_navbench.controllers.teb.parameters import TebParameters
from drake_navbench.controllers.teb.passage import plan_passage
from drake_navbench.controllers.teb.planner import (
    BandPlanner,
    Task,
    band_limits,
    pace_of,
)
from drake_navbench.controllers.teb.reasons import ListeningChooser, explained
from drake_navbench.controllers.teb.surroundings import (
    Surroundings,
    standing,
    with_moving,
)
from drake_navbench.errors import InputError
from drake_navbench.explanation import Explanation
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.distance_field import DistanceField

# A band ignores moving obstacles that are this much farther than its required clearance, m.
PREDICTED_ROOM_M = 0.3
# The longest time by which a base that follows its commands lags behind them, s.
RESPONSE_S = 0.3


class TimedElasticBand:
    """TEB with limits as true constraints (upstream: teb_local_planner::TebLocalPlannerROS).

    Rösmann, Hoffmann, Bertram (2012, 2013, 2017) write the limits as penalties; here each band is
    a nonlinear program (program.py), and each topology that pays is one of them (candidates.py).
    """

    Parameters: ClassVar[type[TebParameters]] = TebParameters
    nav2_plugin: ClassVar[str | None] = "teb_local_planner::TebLocalPlannerROS"

    def __init__(self, parameters: TebParameters, setup: ControllerSetup) -> None:
        """Raises InputError where min_obstacle_dist leaves no corridor in the local costmap."""
        self._parameters = parameters
        self._setup = setup
        self._discs = parameters.footprint_model.discs(setup)
        planner = BandPlanner(parameters, self._discs)
        self._chooser = BandChooser(parameters, setup, planner)
        radius = float(self._discs[:, 1].min())
        if 2.0 * (radius + parameters.min_obstacle_dist) >= setup.costmap_size_m:
            raise InputError(
                f"min_obstacle_dist = {parameters.min_obstacle_dist} m and the robot's radius of"
                f" {radius:g} m leave no corridor in a local costmap of {setup.costmap_size_m} m"
            )
        self._radius = radius

    def initial_memory(self) -> TebMemory:
        """Returns the memory of a controller that has no band yet."""
        return TebMemory()

    def step(self, observation: Observation, memory: TebMemory) -> Decision:
        """Returns the mean twist over the first poses of the best band.

        Raises InvalidPath for an empty plan, NoValidControl where no band is free of collision or
        the plan is blocked and the robot is as near to the obstacle as it may go.
        """
        around = standing(observation.costmap)
        memory, moving = self._track(observation, memory, around)
        if moving:
            reach = float(self._discs[:, 1].max()) + self._parameters.min_obstacle_dist
            elapsed = observation.time_s - observation.costmap.stamp_s
            predicted = with_moving(
                observation.costmap, moving, elapsed_s=elapsed, reach_m=reach + PREDICTED_ROOM_M
            )
            try:
                decision = self._cycle(observation, memory, predicted, is_tentative=True)
            except NoValidControl:
                decision = None
            if decision is not None:
                return decision
        # Nothing moves, or no way leads through moving obstacles: then they count as standing.
        decision = self._cycle(observation, memory, around)
        if decision is None:
            # Before it gives up, postponed candidates are tried as well.
            decision = self._cycle(observation, memory.afresh(), around, is_last=True)
        assert decision is not None
        return decision

    def explain(self, observation: Observation, memory: TebMemory) -> Explanation:
        """Returns the constraints that hold the driven band."""
        if len(observation.plan) == 0:
            return Explanation(None, "TEB stops: nothing is left of the plan.", (), ())
        listening = ListeningChooser(
            self._parameters, self._setup, BandPlanner(self._parameters, self._discs)
        )
        own = TimedElasticBand(self._parameters, self._setup)
        own._chooser = listening
        try:
            decision = own.step(observation, memory)
        except NoValidControl as failure:
            return Explanation(None, f"TEB stops: {failure}.", (), ())
        assert listening.choice is not None
        return explained(listening.choice, decision.command)

    def _track(
        self, observation: Observation, memory: TebMemory, around: Surroundings
    ) -> tuple[TebMemory, list[Track]]:
        """Returns the memory with the costmap's tracks added, and the tracks of moving things."""
        if not self._parameters.include_dynamic_obstacles:
            return memory, []
        tracking = track_obstacles(
            memory.tracking, observation.costmap, around.field, observation.pose
        )
        return memory._replace(tracking=tracking), tracking.moving()

    def _cycle(
        self,
        observation: Observation,
        memory: TebMemory,
        around: Surroundings,
        *,
        is_tentative: bool = False,
        is_last: bool = False,
    ) -> Decision | None:
        """Returns the decision for these surroundings.

        Returns None where an attempt that is tentative fails (see `Attempt`).
        """
        parameters, field = self._parameters, around.field
        plan = cut_local_plan(observation, parameters, discs=self._discs, field=field)
        clusters = find_clusters(field, self._least_distance(plan, field))
        plan, paths = self._settle_block(observation, memory, plan, field, clusters)
        leads_through = plan.blocked_index is None
        explores = leads_through and self._explores(plan, memory, observation.time_s)
        if explores:
            paths += self._other_ways(observation, plan, field, clusters)
            memory = memory._replace(explored_s=observation.time_s)
        limits = band_limits(parameters, observation.speed_limit)
        twist = self._start_twist(observation, memory)
        task = Task(
            start=np.array(observation.pose, dtype=np.float64),
            goal=plan.goal(parameters.global_plan_overwrite_orientation),
            twist=twist,
            around=around,
            passage=plan_passage(plan, field, self._discs, parameters.min_obstacle_dist),
            via_points=via_points(plan, parameters.global_plan_viapoint_sep),
            limits=limits,
        )
        pace = pace_of(parameters, limits)
        ends = Ends(task.start, task.goal, float(twist[0]))
        candidates = gather_candidates(
            memory,
            paths,
            ends,
            time_s=observation.time_s,
            leads_through=leads_through,
            clusters=clusters,
            pace=pace,
            parameters=parameters,
        )
        spare = partial(
            spare_candidate,
            candidates,
            paths,
            ends,
            clusters=clusters,
            pace=pace,
        )
        attempt = Attempt(
            observation,
            memory,
            task,
            pace,
            plan.is_cut_short,
            spare,
            is_tentative=is_tentative,
            is_last=is_last,
        )
        return self._chooser.decide(attempt, candidates)

    def _least_distance(self, plan: LocalPlan, field: DistanceField) -> float:
        """Returns the least distance at which the robot's centre passes obstacles, m.

        It is at most the plan's own distance, so that obstacles on both sides of the plan do not
        become one cluster.
        """
        clearance = LEAST_CLEARANCE_RATIO * self._parameters.min_obstacle_dist
        if plan.blocked_index is None:
            narrowest = float(plan.clearances[: plan.goal_index + 1].min())
            clearance = min(clearance, max(narrowest - 0.5 * field.resolution, 0.0))
        return self._radius + clearance

    def _explores(self, plan: LocalPlan, memory: TebMemory, time_s: float) -> bool:
        """Whether other classes are searched: the plan's way is narrow, and a search is due.

        A way with min_obstacle_dist on either side needs no other, as plans are the shortest ways.
        """
        parameters = self._parameters
        narrowest = float(plan.clearances[: plan.goal_index + 1].min())
        return (
            parameters.enable_homotopy_class_planning
            and narrowest < parameters.min_obstacle_dist
            and time_s - memory.explored_s >= REVISIT_PERIOD_S
        )

    def _other_ways(
        self, observation: Observation, plan: LocalPlan, field: DistanceField, clusters: Clusters
    ) -> list[Array]:
        parameters = self._parameters
        return ways_past_narrow(
            observation.pose,
            plan,
            field=field,
            clusters=clusters,
            reach_m=float(self._discs[:, 1].max()) + parameters.min_obstacle_dist,
            longest_ratio=parameters.max_ratio_detours_duration_best_duration,
        )

    def _start_twist(self, observation: Observation, memory: TebMemory) -> Array:
        """Returns (2,) the twist that bands start with: the last command, which the base follows.

        The measured one where there is no last command, or where the base does not follow it.
        """
        command = memory.command
        if command is None:
            return np.array(observation.twist, dtype=np.float64)
        parameters = self._parameters
        lag = RESPONSE_S * np.array([parameters.acc_lim_x, parameters.acc_lim_theta])
        follows = bool(np.all(np.abs(command - observation.twist) <= lag))
        return command if follows else np.array(observation.twist, dtype=np.float64)

    def _settle_block(
        self,
        observation: Observation,
        memory: TebMemory,
        plan: LocalPlan,
        field: DistanceField,
        clusters: Clusters,
    ) -> tuple[LocalPlan, list[Array]]:
        """Returns the plan to drive and the paths to try: the plan's own, or ways past a block.

        Raises NoValidControl where there is no way past and the robot stands before the block.
        """
        parameters = self._parameters
        if plan.blocked_index is not None:
            ways = ways_past_block(
                observation.pose,
                plan,
                field=field,
                clusters=clusters,
                longest_ratio=parameters.max_ratio_detours_duration_best_duration,
            )
            if ways:
                return plan, ways
            plan = plan.before_the_block(parameters.min_obstacle_dist)
        ahead = float(np.hypot(*(plan.poses[plan.goal_index, :2] - observation.pose[:2])))
        is_used_up = plan.goal_index == 0 or ahead < parameters.blocked_goal_distance_m
        if plan.is_cut_short and is_used_up:
            raise NoValidControl(
                "the plan is blocked and nothing of its free part is left at a min_obstacle_dist of"
                f" {parameters.min_obstacle_dist} m",
                details={"is_blocked": True},
                memory=memory.afresh(),
            )
        return plan, [plan.path]
