"""The TEB controller: one cycle from observation to command."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import ControllerSetup, Decision, NoValidControl, Observation
from drake_navbench.controllers.teb.band import (
    Band,
    Pace,
    braking_band,
    next_twist,
    shift,
)
from drake_navbench.controllers.teb.candidates import (
    REVISIT_PERIOD_S,
    Candidate,
    gather_candidates,
    ways_past_block,
    ways_past_narrow,
)
from drake_navbench.controllers.teb.feasibility import checked_pose_count, is_free
from drake_navbench.controllers.teb.homotopy import Clusters, class_name, find_clusters
from drake_navbench.controllers.teb.local_plan import (
    LEAST_CLEARANCE_RATIO,
    LocalPlan,
    cut_local_plan,
    via_points,
)
from drake_navbench.controllers.teb.memory import Alternative, TebMemory
from drake_navbench.controllers.teb.parameters import TebParameters
from drake_navbench.controllers.teb.passage import plan_passage
from drake_navbench.controllers.teb.planner import (
    BandPlanner,
    PlannedBand,
    Task,
    band_limits,
    pace_of,
)
from drake_navbench.errors import InputError
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.distance_field import DistanceField, distance_field

Array = NDArray[np.float64]

# Clearance that is missing on a way is worth a detour that takes longer by this share at most.
MOST_TIME_FOR_CLEARANCE_RATIO = 0.5
# No base that follows its commands lags behind them by more, s.
RESPONSE_S = 0.3

Tried = tuple[Candidate, PlannedBand]


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
        self._planner = BandPlanner(parameters, self._discs)
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
        parameters = self._parameters
        field = distance_field(observation.costmap)
        plan = cut_local_plan(observation, parameters, discs=self._discs, field=field)
        clusters = find_clusters(field, self._least_distance(plan, field))
        plan, paths = self._settle_block(observation, plan, field, clusters)
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
            field=field,
            passage=plan_passage(plan, field, self._discs, parameters.min_obstacle_dist),
            via_points=via_points(plan, parameters.global_plan_viapoint_sep),
            limits=limits,
        )
        pace = pace_of(parameters, limits)
        candidates = gather_candidates(
            memory,
            paths,
            start=task.start,
            goal=task.goal,
            time_s=observation.time_s,
            leads_through=leads_through,
            speed=float(twist[0]),
            clusters=clusters,
            pace=pace,
            parameters=parameters,
        )
        tried, postponed = self._optimise(candidates, task, pace, observation.time_s)
        return self._decide(
            observation,
            memory,
            tried,
            postponed=postponed,
            task=task,
            is_blocked=plan.is_cut_short,
        )

    def _least_distance(self, plan: LocalPlan, field: DistanceField) -> float:
        """Returns how far the robot's centre keeps from obstacles that it can pass between, m.

        No farther than the plan does: what lies on either side of it is not one obstacle.
        """
        clearance = LEAST_CLEARANCE_RATIO * self._parameters.min_obstacle_dist
        if plan.blocked_index is None:
            narrowest = float(plan.clearances[: plan.goal_index + 1].min())
            clearance = min(clearance, max(narrowest - 0.5 * field.resolution, 0.0))
        return self._radius + clearance

    def _explores(self, plan: LocalPlan, memory: TebMemory, time_s: float) -> bool:
        """Whether other classes are looked for: the plan's way is narrow, and it is time again.

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
        self, observation: Observation, plan: LocalPlan, field: DistanceField, clusters: Clusters
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
                memory=TebMemory(),
            )
        return plan, [plan.path]

    def _optimise(
        self, candidates: list[Candidate], task: Task, pace: Pace, time_s: float
    ) -> tuple[list[Tried], list[Alternative]]:
        """Optimises the candidates that can pay; returns them and those to look at again later.

        No guess can be driven faster than its length, and what lost a moment ago loses again.
        """
        parameters = self._parameters
        warm = parameters.no_inner_iterations * parameters.no_outer_iterations
        tried: list[Tried] = []
        postponed: list[Alternative] = []
        for candidate in candidates:
            best = min((self._cost(*other) for other in tried), default=np.inf)
            known = candidate.predecessor
            if np.isfinite(best) and known is not None and candidate.lost_lately(time_s):
                postponed.append(known)
                continue
            if candidate.length_m / task.limits.forward_speed > best:
                continue
            is_first = candidate.is_cold and not np.isfinite(best)
            iterations = parameters.cold_start_iterations if is_first else warm
            if candidate.is_cold:
                planned = self._planner.optimise_cold(
                    candidate.guess, task, pace=pace, iterations=iterations
                )
            else:
                planned = self._planner.optimise(candidate.guess, task, iterations=iterations)
            tried.append((candidate, planned))
        return tried, postponed

    def _cost(self, candidate: Candidate, planned: PlannedBand) -> float:
        """Returns what a band is chosen by: its duration, weighed, and its missing clearance."""
        if not planned.accepted:
            return np.inf
        cost = planned.band.duration_s
        if candidate.is_driven:
            cost *= self._parameters.selection_cost_hysteresis
        elif candidate.follows_plan:
            cost *= self._parameters.selection_prefer_initial_plan
        missing = max(planned.solution.slack, 0.0) + planned.given_up_m
        price = self._parameters.weight_slack * missing
        return cost + min(price, MOST_TIME_FOR_CLEARANCE_RATIO * planned.band.duration_s)

    def _ranked(self, tried: list[Tried], memory: TebMemory, time_s: float) -> list[Tried]:
        """Returns the accepted bands, best first; soon after a switch the driven one is best."""
        accepted = [pair for pair in tried if pair[1].accepted]
        held = time_s - memory.switched_s < self._parameters.switching_blocking_period
        return sorted(
            accepted, key=lambda pair: (not (held and pair[0].is_driven), self._cost(*pair))
        )

    def _decide(
        self,
        observation: Observation,
        memory: TebMemory,
        tried: list[Tried],
        *,
        postponed: list[Alternative],
        task: Task,
        is_blocked: bool,
    ) -> Decision:
        scalars = self._scalars(tried, is_blocked)
        for candidate, planned in self._ranked(tried, memory, observation.time_s):
            if not self._is_free(observation, planned.band):
                continue
            others = [
                Alternative(other.band, observation.time_s, other.accepted)
                for kept, other in tried
                if kept is not candidate
            ]
            switched = memory.band is not None and not candidate.is_driven
            new_memory = TebMemory(
                band=planned.band,
                alternatives=(*others, *postponed),
                stamp_s=observation.time_s,
                switched_s=observation.time_s if switched else memory.switched_s,
                explored_s=memory.explored_s,
            )
            return self._decision(planned.band, new_memory, scalars, tried, task)
        fallback = self._shifted(observation, memory)
        if fallback is not None:
            scalars["is_fallback"] = True
            kept = memory._replace(band=fallback, alternatives=(), stamp_s=observation.time_s)
            return self._decision(fallback, kept, scalars, tried, task)
        braking = self._braking(observation, task)
        if braking is not None:
            scalars["is_fallback"] = True
            return self._decision(braking, TebMemory(), scalars, tried, task)
        raise NoValidControl(
            f"none of {len(tried)} bands obeys the limits and keeps the outline off obstacles"
            f" (solver: {scalars['solver_status']}, violation {scalars['violation']:.3g})",
            details=scalars,
            memory=TebMemory(),
        )

    def _is_free(self, observation: Observation, band: Band) -> bool:
        """Whether the robot's outline keeps off lethal cells over the next poses of a band."""
        parameters = self._parameters
        count = checked_pose_count(
            band.poses,
            parameters.feasibility_check_no_poses,
            parameters.feasibility_check_lookahead_distance,
        )
        return is_free(observation.costmap, self._setup.footprint, band.poses[:count])

    def _shifted(self, observation: Observation, memory: TebMemory) -> Band | None:
        """Returns the rest of the last driven band if the robot can still drive it, else None."""
        if memory.band is None:
            return None
        rest = shift(memory.band, observation.time_s - memory.stamp_s)
        if rest is None:
            return None
        from_here = Band(rest.poses.copy(), rest.time_steps)
        from_here.poses[0, :2] = observation.pose[:2]
        from_here.poses[0, 2] += wrap(float(observation.pose[2] - rest.poses[0, 2]))
        return rest if self._is_free(observation, from_here) else None

    def _braking(self, observation: Observation, task: Task) -> Band | None:
        """Returns the way to rest within the accelerations; None where it is blocked or at rest."""
        limits = task.limits
        band = braking_band(
            observation.pose,
            task.twist,
            acceleration=limits.acceleration,
            angular_acceleration=limits.angular_acceleration,
        )
        if band.duration_s <= self._setup.control_period_s:
            return None
        return band if is_free(observation.costmap, self._setup.footprint, band.poses) else None

    def _scalars(self, tried: list[Tried], is_blocked: bool) -> dict[str, Any]:
        """Returns what the log keeps of every cycle, of the first candidate where it is one's."""
        solutions = [planned.solution for _, planned in tried]
        return {
            "solver_status": solutions[0].status,
            "evaluations": sum(solution.evaluations for solution in solutions),
            "newton_steps": sum(solution.newton_steps for solution in solutions),
            "slack_m": solutions[0].slack,
            "violation": solutions[0].violation,
            "candidate_count": len(solutions),
            "is_blocked": is_blocked,
            "is_fallback": False,
        }

    def _decision(
        self,
        band: Band,
        memory: TebMemory,
        scalars: dict[str, Any],
        tried: list[Tried],
        task: Task,
    ) -> Decision:
        """Returns the twist of a band after the next control period.

        Within the limits to the last bit: those of the speeds, and before them those of the change
        from the twist that the band starts with, so that a new speed limit is braked for.
        """
        parameters, limits = self._parameters, task.limits
        period = self._setup.control_period_s
        command = next_twist(band, task.twist, period, parameters.control_look_ahead_poses)
        fastest = np.array([limits.forward_speed, limits.turn_rate])
        slowest = np.array([-limits.backward_speed, -limits.turn_rate])
        change = period * np.array([limits.acceleration, limits.angular_acceleration])
        command = np.clip(command, slowest, fastest)
        command = np.clip(command, task.twist - change, task.twist + change)
        if parameters.min_turning_radius > 0.0:
            command[1] = self._steered(command)
        command.flags.writeable = False
        memory = memory._replace(command=command)
        diagnostics = dict(
            scalars, interval_count=len(band.time_steps), band_duration_s=band.duration_s
        )
        if self._setup.wants_diagnostics:
            diagnostics.update(_arrays(band, tried))
        return Decision(command, memory, diagnostics)

    def _steered(self, command: Array) -> float:
        """Returns the turn rate of a car for a command (2,): no sharper than it can turn, rad/s."""
        sharpest = abs(float(command[0])) / self._parameters.min_turning_radius
        return float(np.clip(command[1], -sharpest, sharpest))


def _arrays(band: Band, tried: list[Tried]) -> dict[str, Any]:
    """Returns the band with its times and the candidates with their classes, for the replay.

    Candidates of fewer poses repeat their last one, so that all fit one array.
    """
    longest = max(len(planned.band.poses) for _, planned in tried)
    trajectories = np.stack(
        [
            np.pad(p.band.poses, ((0, longest - len(p.band.poses)), (0, 0)), mode="edge")
            for _, p in tried
        ]
    )
    reference = tried[0][0].angles
    return {
        "predicted_trajectory": band.poses,
        "predicted_times_s": np.concatenate([[0.0], np.cumsum(band.time_steps)]),
        "sampled_trajectories": trajectories,
        "sampled_costs": np.array([p.solution.cost for _, p in tried]),
        "sampled_classes": "; ".join(class_name(c.angles, reference) for c, _ in tried),
    }
