"""The choice of the driven band: the best that IPOPT confirms, else a fallback."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from drake_navbench.controller import ControllerSetup, Decision, NoValidControl, Observation
from drake_navbench.controllers.teb.band import Band, Pace, braking_band, next_twist, shift
from drake_navbench.controllers.teb.candidates import Candidate
from drake_navbench.controllers.teb.feasibility import checked_pose_count, is_free
from drake_navbench.controllers.teb.homotopy import class_name
from drake_navbench.controllers.teb.memory import REVISIT_PERIOD_S, Alternative, TebMemory
from drake_navbench.controllers.teb.parameters import TebParameters
from drake_navbench.controllers.teb.planner import BandPlanner, PlannedBand, Task
from drake_navbench.controllers.teb.surroundings import Surroundings, keeps_off
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array

# The largest price of missing clearance, as a share of the band's duration.
MOST_TIME_FOR_CLEARANCE_RATIO = 0.5

# Newton's steps times intervals in a cycle, after which other candidates have to wait for the next
# one: about 4 ms. A band that is driven on takes a fifth of it.
ENOUGH_WORK = 1000

# A candidate, and the band that the solver made of it.
Tried = tuple[Candidate, PlannedBand]


class Attempt(NamedTuple):
    """The inputs of a cycle's search for a band.

    is_blocked: the local goal lies before a block. spare: makes a new guess of the driven band's
    class where that band fails, or None. is_tentative: another attempt follows where this one
    finds no band. is_last: no attempt follows, so every candidate is tried now.
    """

    observation: Observation
    memory: TebMemory
    task: Task
    pace: Pace
    is_blocked: bool
    spare: Callable[[], Candidate | None]
    is_tentative: bool = False
    is_last: bool = False


class BandChooser:
    """Chooses a band: runs Newton's method on candidates and has the best one confirmed.

    A candidate on which Newton's method fails is not tried again for a while: nearly always there
    is no band of its class. IPOPT gets to try it only where the robot would brake otherwise.
    """

    def __init__(
        self, parameters: TebParameters, setup: ControllerSetup, planner: BandPlanner
    ) -> None:
        self._parameters = parameters
        self._setup = setup
        self._planner = planner
        self._warm_iterations = parameters.no_inner_iterations * parameters.no_outer_iterations

    def decide(self, attempt: Attempt, candidates: list[Candidate]) -> Decision | None:
        """Returns the decision; None where there is no band and another attempt is worth it.

        Raises NoValidControl where the robot stands and there is no band.
        """
        memory, task = attempt.memory, attempt.task
        time_s = attempt.observation.time_s
        tried, postponed = self._lead(attempt, candidates)
        for candidate, led in self._ranked(tried, memory, time_s):
            planned = self._confirmed(led, task)
            if planned is not None:
                return self._driven(attempt, candidate, planned, tried, postponed)
        if attempt.is_tentative:
            return None
        failed = [
            Alternative(candidate.guess, time_s, accepted=False)
            for candidate, planned in tried
            if not (planned.accepted or candidate.is_driven or candidate.is_spare)
        ]
        left = (*failed, *postponed)
        fallback = self._shifted(attempt)
        if fallback is not None:
            spare_failed = any(candidate.is_spare for candidate, _ in tried)
            kept = memory._replace(
                band=fallback,
                alternatives=left,
                stamp_s=time_s,
                spare_failed_s=time_s if spare_failed else memory.spare_failed_s,
            )
            return self._decision(attempt, fallback, kept, tried, is_fallback=True)
        braking = self._braking(attempt)
        if braking is None and postponed:
            return None
        if tried and not postponed:
            candidate, led = tried[0]
            planned = self._own_way(led, task, is_last=braking is None)
            if planned is not None:
                return self._driven(attempt, candidate, planned, tried, postponed)
        if braking is not None:
            kept = memory.afresh()._replace(alternatives=left)
            return self._decision(attempt, braking, kept, tried, is_fallback=True)
        scalars = scalars_of(tried, is_blocked=attempt.is_blocked, is_fallback=False)
        raise NoValidControl(
            f"none of {len(tried)} bands obeys the limits and keeps the outline off obstacles"
            f" (solver: {scalars['solver_status']}, violation {scalars['violation']:.3g})",
            details=scalars,
            memory=memory.afresh(),
        )

    def _lead(
        self, attempt: Attempt, candidates: list[Candidate]
    ) -> tuple[list[Tried], list[Alternative]]:
        """Runs Newton's method on candidates that can win; returns them and those for later.

        A candidate cannot win that is too long even at full speed, or that lost or broke a limit a
        moment ago. Where there is a band to drive, a new or the last one, long searches are spread
        over several cycles.
        """
        task, time_s = attempt.task, attempt.observation.time_s
        work = 0
        tried: list[Tried] = []
        postponed: list[Alternative] = []
        for candidate in candidates:
            best = min((self._cost(*other) for other in tried), default=np.inf)
            known = candidate.predecessor
            if known is not None and known.is_recent(time_s):
                has_failed = not known.accepted
                if has_failed or np.isfinite(best):
                    postponed.append(known)
                    continue
            if candidate.length_m / task.limits.forward_speed > best:
                continue
            if work > ENOUGH_WORK and self._can_wait(attempt, has_band=bool(np.isfinite(best))):
                postponed.append(Alternative(candidate.guess, time_s, False, is_queued=True))
                continue
            if candidate.is_cold:
                planned = self._planner.lead_cold(candidate.guess, task, pace=attempt.pace)
            else:
                planned = self._planner.run_newton(candidate.guess, task)
            tried.append((candidate, planned))
            work += planned.solution.newton_steps * len(planned.solution.time_steps)
        failed_lately = time_s - attempt.memory.spare_failed_s < REVISIT_PERIOD_S
        if not failed_lately and not any(planned.accepted for _, planned in tried):
            spare = attempt.spare()
            if spare is not None:
                planned = self._planner.lead_cold(spare.guess, task, pace=attempt.pace)
                tried.append((spare, planned))
        return tried, postponed

    def _can_wait(self, attempt: Attempt, *, has_band: bool) -> bool:
        """Whether the robot has a band to drive without the remaining candidates."""
        return not attempt.is_last and (has_band or self._shifted(attempt) is not None)

    def _cost(self, candidate: Candidate, planned: PlannedBand) -> float:
        """Returns the cost by which bands are compared.

        It is the weighted duration plus the price of missing clearance; inf for a band not
        accepted.
        """
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

    def _confirmed(self, led: PlannedBand, task: Task) -> PlannedBand | None:
        """Returns a band that Newton's method found with IPOPT's last word, None if it is no good.

        IPOPT is left out where the parameters say so.
        """
        if not self._is_free(task.around, led.band):
            return None
        if self._parameters.solver != "ipopt":
            return led
        return self._checked(led, task, self._warm_iterations)

    def _own_way(self, led: PlannedBand, task: Task, *, is_last: bool) -> PlannedBand | None:
        """Returns the band that IPOPT makes of a guess on which Newton's method failed.

        Returns None where Newton's band was accepted or IPOPT's is not. is_last: the robot gives up
        without it.
        """
        if led.accepted:
            return None
        iterations = self._parameters.cold_start_iterations if is_last else self._warm_iterations
        return self._checked(led, task, iterations)

    def _checked(self, led: PlannedBand, task: Task, iterations: int) -> PlannedBand | None:
        planned = self._planner.confirm(led, task, iterations=iterations)
        is_good = planned.accepted and self._is_free(task.around, planned.band)
        return planned if is_good else None

    def _is_free(self, around: Surroundings, band: Band) -> bool:
        """Whether the robot's outline keeps off obstacles over the next poses of a band."""
        parameters = self._parameters
        count = checked_pose_count(
            band.poses,
            parameters.feasibility_check_no_poses,
            parameters.feasibility_check_lookahead_distance,
        )
        times = np.concatenate([[0.0], np.cumsum(band.time_steps[: count - 1])])
        return keeps_off(around, self._setup.footprint, band.poses[:count], times)

    def _shifted(self, attempt: Attempt) -> Band | None:
        """Returns the rest of the last driven band if the robot can still drive it, else None."""
        observation, memory = attempt.observation, attempt.memory
        if memory.band is None:
            return None
        rest = shift(memory.band, observation.time_s - memory.stamp_s)
        if rest is None:
            return None
        from_here = Band(rest.poses.copy(), rest.time_steps)
        from_here.poses[0, :2] = observation.pose[:2]
        from_here.poses[0, 2] += wrap(float(observation.pose[2] - rest.poses[0, 2]))
        return rest if self._is_free(attempt.task.around, from_here) else None

    def _braking(self, attempt: Attempt) -> Band | None:
        """Returns the way to rest within the accelerations; None where it is blocked or at rest."""
        observation, limits = attempt.observation, attempt.task.limits
        band = braking_band(
            observation.pose,
            attempt.task.twist,
            acceleration=limits.acceleration,
            angular_acceleration=limits.angular_acceleration,
        )
        if band.duration_s <= self._setup.control_period_s:
            return None
        return band if is_free(observation.costmap, self._setup.footprint, band.poses) else None

    def _driven(
        self,
        attempt: Attempt,
        candidate: Candidate,
        planned: PlannedBand,
        tried: list[Tried],
        postponed: list[Alternative],
    ) -> Decision:
        """Returns the decision to drive a candidate's band, the others remembered."""
        memory, time_s = attempt.memory, attempt.observation.time_s
        # A candidate that failed is remembered by its guess: the solver's result is no band.
        others = [
            Alternative(other.band if other.accepted else kept.guess, time_s, other.accepted)
            for kept, other in tried
            if kept is not candidate
        ]
        switched = memory.band is not None and not candidate.is_driven
        new_memory = TebMemory(
            band=planned.band,
            alternatives=(*others, *postponed),
            stamp_s=time_s,
            switched_s=time_s if switched else memory.switched_s,
            explored_s=memory.explored_s,
            tracking=memory.tracking,
        )
        tried = [(kept, planned if kept is candidate else other) for kept, other in tried]
        return self._decision(attempt, planned.band, new_memory, tried, is_fallback=False)

    def _decision(
        self,
        attempt: Attempt,
        band: Band,
        memory: TebMemory,
        tried: list[Tried],
        *,
        is_fallback: bool,
    ) -> Decision:
        """Returns the twist of a band after the next control period.

        Within the limits to the last bit: those of the speeds, and before them those of the change
        from the twist that the band starts with, so that a new speed limit is braked for.
        """
        parameters, task = self._parameters, attempt.task
        limits = task.limits
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
        diagnostics = scalars_of(tried, is_blocked=attempt.is_blocked, is_fallback=is_fallback)
        diagnostics.update(interval_count=len(band.time_steps), band_duration_s=band.duration_s)
        if self._setup.wants_diagnostics and tried:
            diagnostics.update(_arrays(band, tried))
        return Decision(command, memory, diagnostics)

    def _steered(self, command: Array) -> float:
        """Returns the turn rate of a car for a command (2,): no sharper than it can turn, rad/s."""
        sharpest = abs(float(command[0])) / self._parameters.min_turning_radius
        return float(np.clip(command[1], -sharpest, sharpest))


def scalars_of(tried: list[Tried], *, is_blocked: bool, is_fallback: bool) -> dict[str, Any]:
    """Returns the scalars that the log keeps of every cycle.

    Status, slack and violation are those of the first candidate, the counts those of all
    candidates.
    """
    solutions = [planned.solution for _, planned in tried]
    first = solutions[0] if solutions else None
    return {
        "solver_status": first.status if first else "none",
        "evaluations": sum(solution.evaluations for solution in solutions),
        "newton_steps": sum(solution.newton_steps for solution in solutions),
        "slack_m": first.slack if first else 0.0,
        "violation": first.violation if first else 0.0,
        "candidate_count": len(solutions),
        "is_blocked": is_blocked,
        "is_fallback": is_fallback,
    }


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
