"""harmony: a program makes plans of guesses, a gatekeeper lets the safe ones by."""

from __future__ import annotations

import math
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import (
    CollisionAhead,
    ControllerSetup,
    Decision,
    InvalidPath,
    Observation,
)
from drake_navbench.controllers.harmony.base_response import (
    LONGEST_STOP_S,
    Response,
    braking_time,
    command_of,
    follow_then_brake,
    response_of,
    steps_in,
)
from drake_navbench.controllers.harmony.discs import covering_discs
from drake_navbench.controllers.harmony.gatekeeper import (
    is_clear,
    is_on_free_cell,
    lethal_edges,
)
from drake_navbench.controllers.harmony.learning import (
    Learnt,
    candidates_of,
    learnt,
    possible_bases,
    prediction_error,
)
from drake_navbench.controllers.harmony.memory import HarmonyMemory
from drake_navbench.controllers.harmony.motion import ALPHA, A, V, W, stage_at
from drake_navbench.controllers.harmony.parameters import HarmonyParameters
from drake_navbench.controllers.harmony.planner import Candidate, Planner
from drake_navbench.controllers.harmony.prediction import (
    LATENCIES_S,
    observed,
    predicted,
    with_command,
)
from drake_navbench.controllers.harmony.scene import make_start
from drake_navbench.controllers.harmony.tracking import MOST, followed, moving_at, touches
from drake_navbench.controllers.harmony.way import is_trapped
from drake_navbench.controllers.harmony.way_finder import FoundWay, WayFinder
from drake_navbench.errors import InputError
from drake_navbench.kernels.distance_field import distance_field
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.kernels.read_only import read_only
from drake_navbench.kernels.speed_limit import limited_speed

Array = NDArray[np.float64]

# The base counts as following a plan while its velocities differ from the plan's by no more than
# noise (m/s, rad/s) plus the change within FOLLOWING_S, its time constant and a cycle.
FOLLOWING_S, FOLLOWING_MPS, FOLLOWING_RADPS = 0.05, 0.03, 0.05
# In a turn plans keep off obstacles by SWEEP_RATIO times the error of the prediction: its bound
# grows, and a jump of the map by the corners cannot be answered. As if it grew in proportion to the
# turn rate; at this one the ratio is exact, rad/s.
SWEEP_RATIO, SWEEP_AT_RADPS = 3.5, 0.5
# The command of the stop plan.
REST = read_only(np.zeros(2))
# A cycle is late after LATE_RATIO periods. The next one is then expected to be as late, up to
# LONGEST_INTERVAL_S.
LATE_RATIO, LONGEST_INTERVAL_S = 1.5, 0.5
# The robot brakes for a thing that would touch it in LOOK_S on its plan and, if it brakes a cycle
# later, would come within SURE_M of it in HOLD_S or until SURE_S after it is at rest. Both must be
# so by all places of the thing, and by the last LAST ones: who has just turned away does not count.
LOOK_S, HOLD_S, SURE_S, SURE_M, LAST = 1.0, 0.5, 0.25, 0.10, 4
# The robot hurries after such a stop until it has this share of its speed.
HURRIES_UP_TO = 0.9
# The log keeps every SHOWN_STOP_STRIDE-th pose of the stop.
SHOWN_STOP_STRIDE = 10


class Check(NamedTuple):
    """The gatekeeper's conditions for every motion of a cycle.

    edges: (E, 4) of lethal cells. bound: least gap of a robot at rest, m. state: (5,) of the base
    when the next command arrives. interval_s: the time for which that command holds. is_on_map:
    whether the base is on a free cell of the map; nothing is accepted elsewhere. response: the
    base's likeliest one. possible: (M, 3) the responses that it may have, see `possible_bases`.
    """

    edges: Array
    bound: float
    state: Array
    interval_s: float
    is_on_map: bool
    response: Response
    possible: Array


class Harmony:
    """A constrained program and a verified stop plan; see docs/harmony.md.

    Raises InputError for a base that cannot turn in place or takes too long to stop, and ValueError
    for an outline without an area.
    """

    Parameters: ClassVar[type[HarmonyParameters]] = HarmonyParameters
    nav2_plugin: ClassVar[str | None] = None

    def __init__(self, parameters: HarmonyParameters, setup: ControllerSetup) -> None:
        if setup.min_turning_radius_m > 0.0:
            raise InputError(
                f"got a base with a turning radius of {setup.min_turning_radius_m:g} m, expected "
                "one that turns in place"
            )
        self._parameters = parameters
        self._setup = setup
        self._outline = read_only(setup.footprint)
        self._discs = read_only(covering_discs(setup))
        self._planner = Planner(parameters, self._discs)
        self._way_finder = WayFinder(parameters, setup, self._discs, self._planner.clearance)
        self._response = response_of(setup)
        self._candidates = candidates_of(self._response, parameters.response_error)
        braking_s = braking_time(self._response, parameters.top_speed, parameters.max_vel_theta)
        if braking_s > LONGEST_STOP_S:
            raise InputError(
                f"drive: got a base that brakes for {braking_s:.1f} s, expected at most "
                f"{LONGEST_STOP_S:g} s"
            )

    def initial_memory(self) -> HarmonyMemory:
        """Returns the memory at the start of a goal."""
        return HarmonyMemory()

    def step(self, observation: Observation, memory: HarmonyMemory) -> Decision:
        """Returns the command of one cycle.

        Raises InvalidPath for an empty plan. Raises CollisionAhead if the plan leads into an
        obstacle nearer than `give_up_distance` and the map has no short way past it, or if no
        command has been accepted for `patience`. The server then commands 0: the stop plan.
        """
        if len(observation.plan) == 0:
            raise InvalidPath("plan: got no poses, expected at least one")
        parameters = self._parameters
        field = distance_field(observation.costmap)
        sent = observed(memory.sent, self._response, observation.twist, observation.time_s)
        memory = memory._replace(sent=sent)
        tracks = followed(memory.tracks, observation.costmap, observation.pose[:2])
        if moving_at(tracks, observation.time_s)[:, 5].any():
            memory = memory._replace(met_s=observation.time_s)
        memory = memory._replace(tracks=tracks, learnt=self._learnt(observation, memory))
        check = self._check(observation, memory)
        start = self._start(observation, memory, check)
        top_speed = limited_speed(parameters.max_vel_x, observation.speed_limit)
        limits = self._planner.limits(top_speed, self._sweep(check))
        reach_m = limits.forward_speed * parameters.horizon
        found = self._way_finder.find(observation, memory, start, field, reach_m)
        hurries = memory.hurries and bool(start[V] < HURRIES_UP_TO * limits.forward_speed)
        way = found.way._replace(hurries=hurries)
        memory = memory._replace(detour=found.detour, backs_up=way.backs_up, hurries=hurries)
        candidate, guesses = self._planner.candidate(
            self._planner.scene(start, way, field, limits),
            start,
            way,
            driven=memory.plan,
            elapsed_s=observation.time_s - memory.time_s,
        )
        notes = self._notes(candidate, found)
        if not found.is_open and found.blocked_m <= parameters.give_up_distance:
            raise CollisionAhead(
                f"the plan is blocked {found.blocked_m:.2f} m ahead and the map has no way past "
                f"shorter than {self._way_finder.longest_m:.1f} m",
                details=notes,
                memory=self._stopped(observation, memory),
            )
        if candidate is not None and self._accepts(check, candidate.plan):
            notes.update(accepted="plan")
            if self._setup.wants_diagnostics:
                notes.update(guesses, **self._arrays(check, candidate.plan))
            decision = self._commit(observation, memory, check, candidate.plan, notes)
            tolerance_m = observation.goal_xy_tolerance_m
            trapped = is_trapped(way, candidate.plan, start, tolerance_m)
            return decision._replace(memory=decision.memory._replace(is_trapped=trapped))
        return self._refused(observation, memory, check, notes)

    def _latency_s(self, memory: HarmonyMemory) -> float:
        return 0.0 if memory.sent is None else float(LATENCIES_S[memory.sent.latency])

    def _learnt(self, observation: Observation, memory: HarmonyMemory) -> Learnt:
        return learnt(
            memory.learnt,
            self._candidates,
            memory.sent,
            twist=observation.twist,
            time_s=observation.time_s,
            latency_s=self._latency_s(memory),
        )

    def _check(self, observation: Observation, memory: HarmonyMemory) -> Check:
        assert memory.learnt is not None
        latency_s = self._latency_s(memory)
        possible = possible_bases(memory.learnt, self._candidates)
        time_s, linear, angular = map(float, possible[0])
        response = self._response
        response = Response(time_s, linear, angular, response.most_v, response.most_w)
        state = predicted(
            memory.sent,
            response,
            pose=observation.pose,
            twist=observation.twist,
            time_s=observation.time_s,
            latency_s=latency_s,
        )
        reach = self._parameters.top_speed * (self._parameters.horizon + 1.0)
        edges = lethal_edges(
            observation.costmap.grid,
            state[0],
            state[1],
            reach + self._setup.circumscribed_radius_m + self._parameters.error_bound_m,
        )
        return Check(
            edges,
            self._parameters.error_bound_m,
            state,
            self._interval_s(observation, memory),
            bool(is_on_free_cell(observation.costmap.grid, state[0], state[1])),
            response,
            possible,
        )

    def _bound(self, check: Check, plan: Array) -> float:
        """Returns the gap, m, to keep until rest after a cycle of a plan.

        It grows with the speed until then, as long as the base's response is not known well.
        """
        stages = math.ceil(check.interval_s / self._parameters.time_step - 1e-9) + 1
        speeds = np.abs(np.vstack([check.state[3:], plan[:stages, V : W + 1]]))
        reach_m = self._setup.circumscribed_radius_m
        largest = speeds.max(axis=0, keepdims=True)
        return check.bound + float(prediction_error(check.possible, largest, reach_m)[0])

    def _sweep(self, check: Check) -> float:
        """Returns by how much plans keep farther off obstacles in a turn, m for each rad/s."""
        reach_m = self._setup.circumscribed_radius_m
        error_m = prediction_error(check.possible, np.array([[0.0, SWEEP_AT_RADPS]]), reach_m)
        return SWEEP_RATIO * float(error_m[0]) / SWEEP_AT_RADPS

    def _interval_s(self, observation: Observation, memory: HarmonyMemory) -> float:
        """Returns the time for which the next command will hold, s.

        It is the control period. If the last interval was longer, it is that one: a cycle that
        takes too long delays the next one.
        """
        period_s = self._setup.control_period_s
        if memory.sent is None:
            return period_s
        last_s = observation.time_s - float(memory.sent.times_s[-1])
        return min(last_s, LONGEST_INTERVAL_S) if last_s > LATE_RATIO * period_s else period_s

    def _start(self, observation: Observation, memory: HarmonyMemory, check: Check) -> Array:
        """Returns the state (9,) in which plans begin: that of an ideal base.

        A plan is the motion of an ideal base. Commands make up for the real base's time constant as
        long as its velocities are the plan's. Where they differ, the real base falls behind by the
        difference times the time constant, and the ideal base is put there.
        """
        state = check.state
        v, w, a, alpha = float(state[3]), float(state[4]), 0.0, 0.0
        if memory.plan is not None:
            parameters = self._parameters
            elapsed_s = observation.time_s - memory.time_s
            stage = stage_at(memory.plan, parameters.time_step, elapsed_s)
            lag_s = FOLLOWING_S + check.response.time_constant_s + check.interval_s
            if (
                abs(stage[V] - v) <= FOLLOWING_MPS + lag_s * parameters.acc_lim_x
                and abs(stage[W] - w) <= FOLLOWING_RADPS + lag_s * parameters.acc_lim_theta
            ):
                v, w, a, alpha = (float(stage[i]) for i in (V, W, A, ALPHA))
        lag = check.response.time_constant_s
        ahead, turned = lag * (float(state[3]) - v), lag * (float(state[4]) - w)
        yaw = float(state[2]) + turned
        pose = np.array([state[0] + ahead * math.cos(yaw), state[1] + ahead * math.sin(yaw), yaw])
        return make_start(pose, v, w, a, alpha)

    def _stop(self, check: Check, plan: Array) -> Array:
        """Returns (M, 3) the poses of a cycle of a plan and the stop behind it."""
        return follow_then_brake(
            check.response, check.state, plan, self._parameters.time_step, check.interval_s, 1
        )

    def _accepts(self, check: Check, plan: Array) -> bool:
        """Returns whether the gatekeeper lets a cycle of a plan pass."""
        reach_m = self._setup.circumscribed_radius_m
        return check.is_on_map and bool(
            is_clear(
                check.edges,
                self._outline,
                reach_m,
                self._stop(check, plan),
                self._bound(check, plan),
            )
        )

    def _commit(
        self,
        observation: Observation,
        memory: HarmonyMemory,
        check: Check,
        plan: Array,
        notes: dict[str, Any],
    ) -> Decision:
        if self._must_brake(observation.time_s, memory, check, plan):
            notes.update(accepted="stop for moving")
            memory = memory._replace(refused_since_s=None, hurries=True)
            return Decision(REST, self._stopped(observation, memory), notes)
        dt = self._parameters.time_step
        command = read_only(np.array(command_of(check.response, plan, dt, check.interval_s, 0)))
        kept = memory._replace(
            plan=read_only(plan),
            time_s=observation.time_s,
            sent=with_command(memory.sent, observation.twist, observation.time_s, command),
            refused_since_s=None,
        )
        return Decision(command, kept, notes)

    def _must_brake(self, time_s: float, memory: HarmonyMemory, check: Check, plan: Array) -> bool:
        """Returns whether this is the last moment to brake for something that surely moves.

        It is if the thing would touch the robot on the plan, and also before the robot is at rest
        if that brakes one cycle later.
        """
        if not self._parameters.stop_for_moving or memory.tracks is None:
            return False
        at_s = time_s + self._latency_s(memory)
        estimates = [moving_at(memory.tracks, at_s, most) for most in (MOST, LAST)]
        # Feet that step swing the lines: one of both holds a stop that both have begun.
        together = np.logical_or if memory.hurries else np.logical_and
        is_met = estimates[0][:, 5] > 0.0
        dt, period_s = self._parameters.time_step, check.interval_s
        step_s = period_s / steps_in(period_s)
        for cycles in (1, math.ceil(LOOK_S / period_s)):
            poses = follow_then_brake(check.response, check.state, plan, dt, period_s, cycles)
            stop_s = max((len(poses) - 1) * step_s + SURE_S, HOLD_S)
            until_s, bound = (stop_s, SURE_M) if cycles == 1 else (LOOK_S, 0.0)
            is_met &= together(
                *(
                    touches(moving, self._outline, poses, step_s, bound, until_s)
                    for moving in estimates
                )
            )
        return bool(is_met.any())

    def _refused(
        self, observation: Observation, memory: HarmonyMemory, check: Check, notes: dict[str, Any]
    ) -> Decision:
        """Returns the stop plan: command 0, which was verified in the last cycle."""
        since_s = memory.refused_since_s
        if since_s is None:
            since_s = observation.time_s
        stopped = self._stopped(observation, memory)._replace(refused_since_s=since_s)
        if observation.time_s - since_s >= self._parameters.patience:
            raise CollisionAhead(
                f"no command keeps {check.bound:.3f} m away from obstacles",
                details=notes,
                memory=stopped,
            )
        notes.update(accepted="stop")
        return Decision(REST, stopped, notes)

    def _stopped(self, observation: Observation, memory: HarmonyMemory) -> HarmonyMemory:
        """Returns the memory after a command of 0, without a plan."""
        sent = with_command(memory.sent, observation.twist, observation.time_s, REST)
        return memory._replace(plan=None, sent=sent)

    def _notes(self, candidate: Candidate | None, found: FoundWay) -> dict[str, Any]:
        """Returns the diagnostics that the log keeps of every cycle."""
        return {
            "is_solved": candidate is not None and candidate.solved,
            "iterations": candidate.iterations if candidate else 0,
            "cost": candidate.cost if candidate else None,
            "violation": candidate.violation if candidate else None,
            "blocked_m": found.blocked_m if np.isfinite(found.blocked_m) else None,
            "detour_m": None if found.detour is None else path_length(found.detour),
        }

    def _arrays(self, check: Check, plan: Array) -> dict[str, Any]:
        """Returns the accepted plan and the stop after its first cycle, for the replay."""
        stop = self._stop(check, plan)
        return {
            "predicted_trajectory": plan[:, :3].copy(),
            "stop_trajectory": np.vstack([stop[::SHOWN_STOP_STRIDE], stop[-1:]]),
        }
