"""Metrics of moving obstacles and people: clearance, time to collision, and cause of a touch."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from drake_navbench.analysis.metrics.body import outline_of
from drake_navbench.analysis.metrics.definition import Undefined, metric
from drake_navbench.analysis.metrics.movers import Movers, movers_of
from drake_navbench.analysis.metrics.signals import column, lateral_velocity, poses_at, times
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.moving_bodies import clearances_of_bodies
from drake_navbench.kernels.moving_collision_time import time_to_moving_contact
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome

LOOK_PERIOD_S = 0.1
# For so long a body is assumed to keep its velocity.
COLLISION_TIME_HORIZON_S = 10.0
# Distances to bodies farther away than this are not measured, as in a trial.
MAX_CLEARANCE_M = 5.0


@metric(unit="", better="lower", title="Touches of standing obstacles")
def standing_collision_count(log: TrialLog) -> float:
    """Whether the trial ended at a standing obstacle; only in worlds where something moves.

    Formula: 1 or 0; the mean over trials is their share.
    """
    _require_movers(log)
    return float(_contact_kind(log) == "obstacle")


@metric(unit="", better="lower", title="The robot ran into a moving body")
def ran_into_moving_count(log: TrialLog) -> float:
    """Whether the trial ended because the robot ran into something that moves.

    Formula: 1 where, along the line between the two points that touch, the robot's closed the gap
    at least as fast as the other body's, else 0.
    Source: SEAN 2.0 and HuNavSim, which tell the cases by bearing.
    """
    _require_movers(log)
    return float(_contact_kind(log) == "robot")


@metric(unit="", better="lower", title="A moving body ran into the robot")
def was_run_into_count(log: TrialLog) -> float:
    """Whether the trial ended because something that moves ran into the robot.

    Formula: 1 where the other body closed the gap faster than the robot did, else 0. A body on a
    given way does not avoid a robot that stands on it.
    Source: as of ran_into_moving_count.
    """
    _require_movers(log)
    return float(_contact_kind(log) == "other")


@metric(unit="m", better="higher", title="Smallest clearance to a moving body", relevant=0.01)
def min_moving_clearance_m(log: TrialLog) -> float:
    """Smallest distance between the footprint and a moving obstacle or person.

    Formula: minimum, every 0.1 s and at the end, of the exact distance in the plane, up to 5 m; 0
    in a trial that ended at such a touch.
    """
    nearest_m = clearances_m(log).min()
    if math.isinf(nearest_m):
        raise Undefined("nothing that moves came within 5 m")
    return float(nearest_m) if _contact_kind(log) in ("", "obstacle") else 0.0


@metric(unit="s", better="higher", title="Shortest time to collision with a moving body")
def moving_time_to_collision_min_s(log: TrialLog) -> float:
    """Shortest time to a touch of something that moves, at constant twists.

    Formula: minimum, every 0.1 s, of the time until the outlines touch, the robot at constant v and
    w, the other body at its velocity of the next 0.1 s; up to 10 s.
    Source: Hayward 1972; SocNavBench.
    """
    shortest_s = collision_times_s(log).min()
    if math.isinf(shortest_s):
        raise Undefined("no course met a moving obstacle within 10 s")
    return float(shortest_s)


def look_times(log: TrialLog) -> Array:
    """Returns the times at which a trial is examined, (T,) s: every 0.1 s and at its end."""
    time_s = times(log)
    return np.append(np.arange(time_s[0], time_s[-1] - 1e-9, LOOK_PERIOD_S), time_s[-1])


@lru_cache(maxsize=1)
def clearances_m(log: TrialLog) -> Array:
    """Returns the footprint's distance from each body at `look_times`, (T, B) m; inf beyond 5 m."""
    movers, looks = _require_movers(log), look_times(log)
    outline = np.ascontiguousarray(outline_of(log))
    bodies, moved = movers.bodies, movers.poses_at(looks)
    return np.array(
        [
            clearances_of_bodies(
                outline, x, y, yaw, bodies.edges, bodies.discs, poses, MAX_CLEARANCE_M
            )
            for (x, y, yaw), poses in zip(poses_at(log, looks), moved, strict=True)
        ]
    )


def collision_times_s(log: TrialLog, first_body: int = 0) -> Array:
    """Returns the times to collision at `look_times`, (T,) s; inf if there is none within 10 s.

    first_body: bodies with a smaller index are left out.
    """
    movers, looks = _require_movers(log), look_times(log)
    own = times(log)
    twists = np.column_stack(
        [
            np.interp(looks, own, values)
            for values in (column(log, "v_mps"), column(log, "w_radps"), lateral_velocity(log))
        ]
    )
    here = movers.poses_at(looks)
    later = movers.poses_at(looks + LOOK_PERIOD_S)
    rates = movers.rates_between(here, later, LOOK_PERIOD_S)
    outline = np.ascontiguousarray(outline_of(log))
    bodies = movers.bodies.without_first(first_body)
    return np.array(
        [
            time_to_moving_contact(
                outline,
                pose,
                twist,
                (bodies.edges, bodies.discs),
                poses,
                velocities,
                movers.reaches_m,
                COLLISION_TIME_HORIZON_S,
            )
            for pose, twist, poses, velocities in zip(
                poses_at(log, looks), twists, here, rates, strict=True
            )
        ]
    )


def _require_movers(log: TrialLog) -> Movers:
    """Returns the moving obstacles and people of a trial; raises Undefined where there are none."""
    movers = movers_of(log)
    if movers.body_count == 0:
        raise Undefined("nothing moved but the robot")
    return movers


def _contact_kind(log: TrialLog) -> str:
    """Returns the cause of the touch that ended a trial.

    'obstacle' for a touch of a standing obstacle; else 'robot' or 'other', whichever closed the
    gap faster; '' where the robot touched nothing.
    """
    if log.outcome is not Outcome.COLLIDED:
        return ""
    contact = log.info["contact"]
    if contact["kind"] == "obstacle":
        return "obstacle"
    return "robot" if contact["robot_closing_mps"] >= contact["other_closing_mps"] else "other"
