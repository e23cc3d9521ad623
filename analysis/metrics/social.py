"""Social metrics: distances to people, time to collision, social forces, delay of the people.

None of these numbers measures what people feel. docs/living_world.md names the limits of such
metrics.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from drake_navbench.analysis.metrics.body import outline_of
from drake_navbench.analysis.metrics.definition import Undefined, metric
from drake_navbench.analysis.metrics.movers import movers_of
from drake_navbench.analysis.metrics.moving import collision_times_s
from drake_navbench.analysis.metrics.people import (
    PeopleLooks,
    approaches_within,
    gaps_to_groups_m,
    people_of,
)
from drake_navbench.analysis.metrics.signals import (
    column,
    hold_durations,
    lateral_velocity,
    poses_at,
    times,
)
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.poses import place_outline
from drake_navbench.kernels.social_force import social_force
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome

# The factor of the social force in HuNavSim's evaluation.
SOCIAL_FACTOR = 2.1
# Hall's zones: the gap between outline and body, m.
INTIMATE_M, PERSONAL_M, SOCIAL_M = 0.45, 1.2, 3.6
COMPLIANT_M = 0.5
# People with a smaller gap to the robot are near it.
NEAR_M = 3.6
# A person who wants to walk more slowly than this does not count as walking.
WANTS_TO_WALK_MPS = 0.1


@metric(unit="", better="lower", title="The robot ran into a person")
def ran_into_person_count(log: TrialLog) -> float:
    """Whether the trial ended because the robot ran into a person.

    Formula: as `ran_into_moving_count`, for people.
    Source: "robot on person collision" of SEAN 2.0 and HuNavSim.
    """
    people_of(log)
    contact = _contact(log)
    return float(bool(contact) and contact["robot_closing_mps"] >= contact["other_closing_mps"])


@metric(unit="", better="lower", title="A person ran into the robot")
def person_ran_into_robot_count(log: TrialLog) -> float:
    """Whether the trial ended because a person ran into the robot.

    Formula: as `was_run_into_count`, for people.
    Source: "person on robot collision" of SEAN 2.0 and HuNavSim.
    """
    people_of(log)
    contact = _contact(log)
    return float(bool(contact) and contact["robot_closing_mps"] < contact["other_closing_mps"])


@metric(unit="m", better="higher", title="Smallest distance to a person", relevant=0.01)
def min_person_distance_m(log: TrialLog) -> float:
    """Smallest distance between the footprint and a person's body.

    Formula: minimum, every 0.1 s, of the gap between outline and body disc; 0 in a trial that ended
    at such a touch.
    Source: SocNavBench, HuNavSim "minimum distance to people"; both take the robot for a disc.
    """
    nearest_m = people_of(log).gaps_m.min()
    if math.isinf(nearest_m):
        raise Undefined("nobody came within 5 m")
    return 0.0 if _contact(log) else float(nearest_m)


@metric(unit="m", better="higher", title="Mean distance to the closest person")
def mean_closest_person_distance_m(log: TrialLog) -> float:
    """Mean over time of the distance to the closest person, while a person was within 5 m.

    Formula: mean over samples 0.1 s apart of the least gap between outline and body disc.
    Source: HuNavSim "average distance to the closest person".
    """
    closest = people_of(log).gaps_m.min(axis=1)
    near = closest[np.isfinite(closest)]
    if not len(near):
        raise Undefined("nobody came within 5 m")
    return float(near.mean())


@metric(unit="", better="lower", title="Share of the time in somebody's intimate space")
def intimate_space_ratio(log: TrialLog) -> float:
    """Share of the time with a gap below 0.45 m to the closest person.

    Formula: time with a gap between footprint and body below 0.45 m / duration.
    Source: zones of Hall 1966; HuNavSim "intimate space intrusions".
    """
    return _share_of_time(log, 0.0, INTIMATE_M)


@metric(unit="", better="lower", title="Share of the time in somebody's personal space")
def personal_space_ratio(log: TrialLog) -> float:
    """Share of the time with a gap of 0.45 m to 1.2 m to the closest person.

    Formula: as intimate_space_ratio.
    Source: Hall 1966; HuNavSim "personal space intrusions".
    """
    return _share_of_time(log, INTIMATE_M, PERSONAL_M)


@metric(unit="", better="neither", title="Share of the time in somebody's social space")
def social_space_ratio(log: TrialLog) -> float:
    """Share of the time with a gap of 1.2 m to 3.6 m to the closest person.

    Formula: as intimate_space_ratio.
    Source: Hall 1966; HuNavSim "social and public space intrusions".
    """
    return _share_of_time(log, PERSONAL_M, SOCIAL_M)


@metric(unit="", better="neither", title="Share of the time in public space")
def public_space_ratio(log: TrialLog) -> float:
    """Share of the time with a gap of 3.6 m or more to the closest person, or without people.

    Formula: as intimate_space_ratio.
    Source: as of social_space_ratio.
    """
    return _share_of_time(log, SOCIAL_M, math.inf)


@metric(unit="", better="lower", title="Times that the robot came too near to somebody")
def robot_intimate_approach_count(log: TrialLog) -> float:
    """Number of times that the robot approached a person to less than 0.45 m.

    Formula: every 0.1 s; an approach is a gap below 0.45 m after one that was not. It is the
    robot's if the robot's motion alone since then would leave no larger a gap than the person's
    alone.
    Source: SEAN 2.0, which tells the two cases apart by bearing.
    """
    return float(approaches_within(log, INTIMATE_M).by_robot)


@metric(unit="", better="lower", title="Times that somebody came too near to the robot")
def person_intimate_approach_count(log: TrialLog) -> float:
    """Number of times that a person approached the robot to less than 0.45 m.

    Formula: the approaches of `robot_intimate_approach_count` that are not the robot's.
    Source: "person on robot intimate distance violation" of SEAN 2.0.
    """
    return float(approaches_within(log, INTIMATE_M).by_person)


@metric(unit="", better="lower", title="Share of the time inside a group")
def group_crossing_ratio(log: TrialLog) -> float:
    """Share of the time that the footprint was between the members of a group.

    Formula: time in which the footprint overlaps the convex hull of the members' places (of two,
    their line), while these are within 3.6 m of their mean / duration.
    Source: Group Crossing Rate of TAGA; there the robot is a point.
    """
    return _share(log, gaps_to_groups_m(log).to_hulls.min(axis=1) <= 0.0)


@metric(unit="", better="lower", title="Groups that the robot drove into")
def groups_entered_count(log: TrialLog) -> float:
    """Number of groups that the robot entered.

    Formula: number of groups whose hull the footprint ever overlapped, as in
    `group_crossing_ratio`.
    Source: after TAGA.
    """
    return float((gaps_to_groups_m(log).to_hulls <= 0.0).any(axis=0).sum())


@metric(unit="", better="lower", title="Share of the time in a group's personal space")
def group_space_ratio(log: TrialLog) -> float:
    """Share of the time with less than 1.2 m between the footprint and the middle of a group.

    Formula: time with a gap below 1.2 m to the mean of the members' places, while these are within
    3.6 m of it / duration.
    Source: HuNavSim "group intimate and personal space intrusions".
    """
    return _share(log, gaps_to_groups_m(log).to_middles.min(axis=1) < PERSONAL_M)


@metric(unit="", better="higher", title="Personal space compliance")
def personal_space_compliance_ratio(log: TrialLog) -> float:
    """Share of the time that the robot kept 0.5 m from everybody.

    Formula: time with a least gap of 0.5 m or more / duration.
    Source: PSC of Francis et al., "Principles and Guidelines for Evaluating Social Robot Navigation
    Algorithms", 2025.
    """
    return _share_of_time(log, COMPLIANT_M, math.inf)


@metric(unit="s", better="higher", title="Shortest time to collision with a person")
def person_time_to_collision_min_s(log: TrialLog) -> float:
    """Shortest time to a touch of a person, at constant twists.

    Formula: as `moving_time_to_collision_min_s`, for people alone; up to 10 s.
    Source: Hayward 1972; SocNavBench "time to collision".
    """
    people_of(log)
    shortest_s = collision_times_s(log, first_body=len(movers_of(log).things)).min()
    if math.isinf(shortest_s):
        raise Undefined("no course met a person within 10 s")
    return float(shortest_s)


@metric(unit="m/s^2", better="lower", title="Social force of the robot on people")
def social_force_on_people_mps2(log: TrialLog) -> float:
    """Mean over time of the social forces of the robot on all people, added up.

    Formula: mean over samples 0.1 s apart of the sum over people of |f|, f the social force at
    factor 2.1 from the centre of the robot's outline (HuNavSim sums over samples). The force of
    people on the robot has the same size.
    Source: HuNavSim "social force on agents"; force of Moussaid et al. 2009.
    """
    return float(np.mean(_social_forces(log).sum(axis=1)))


@metric(unit="", better="lower", title="How much slower people went near the robot")
def people_slowdown_ratio(log: TrialLog) -> float:
    """Share of their wanted speed that people lost while they were within 3.6 m of the robot.

    Formula: 1 - mean(min(speed / wanted speed, 1)) over people and samples with a gap below 3.6 m,
    without people who do not want to walk or have arrived. Others and walls slow people down, too:
    compare controllers in one world, not worlds.
    Source: after "average pedestrian velocity" of SEAN 2.0.
    """
    people = people_of(log)
    speeds = np.hypot(people.velocities_mps[..., 0], people.velocities_mps[..., 1])
    counts = (people.gaps_m < NEAR_M) & (people.wanted_mps > WANTS_TO_WALK_MPS)
    counts &= ~_has_arrived(log, people)
    if not counts.any():
        raise Undefined("nobody who walked came near the robot")
    wanted = np.broadcast_to(people.wanted_mps, speeds.shape)
    return float(1.0 - np.mean(np.minimum(speeds[counts] / wanted[counts], 1.0)))


def _contact(log: TrialLog) -> dict[str, float]:
    """Returns the log's entry on the touch of a person; {} where none was touched."""
    if log.outcome is not Outcome.COLLIDED or log.info["contact"]["kind"] != "person":
        return {}
    return dict(log.info["contact"])


def _share_of_time(log: TrialLog, low_m: float, high_m: float) -> float:
    """Returns the share of the time with the least gap from `low_m` up to `high_m`."""
    closest = people_of(log).gaps_m.min(axis=1)
    return _share(log, (closest >= low_m) & ((closest < high_m) | math.isinf(high_m)))


def _share(log: TrialLog, holds: NDArray[np.bool_]) -> float:
    """Returns the share of the time for which flags (T,) at `look_times` hold."""
    held_s = hold_durations(people_of(log).time_s)
    if held_s.sum() == 0.0:
        raise Undefined("the trial has no duration")
    return float(held_s[holds].sum() / held_s.sum())


def _has_arrived(log: TrialLog, people: PeopleLooks) -> NDArray[np.bool_]:
    """Returns flags (T, P): the person has arrived at the last goal and does not turn back."""
    arrived: NDArray[np.bool_] = np.zeros(people.gaps_m.shape, dtype=bool)
    for index, person in enumerate(movers_of(log).people.persons):
        if person.goals and (len(person.goals) == 1 or not person.repeats):
            left = people.positions_m[:, index] - person.goals[-1]
            arrived[:, index] = np.hypot(left[:, 0], left[:, 1]) < 2.0 * person.radius_m
    return arrived


def _social_forces(log: TrialLog) -> Array:
    """Returns the size of the robot's social force on each person, (T, P) m/s^2."""
    people = people_of(log)
    own = times(log)
    outline = outline_of(log)
    middle = 0.5 * (outline.min(axis=0) + outline.max(axis=0))
    poses = poses_at(log, people.time_s)
    names = (column(log, "v_mps"), lateral_velocity(log), column(log, "w_radps"))
    v, vy, w = (np.interp(people.time_s, own, values) for values in names)
    count = people.positions_m.shape[1]
    sizes = np.empty((len(poses), count))
    for row, pose in enumerate(poses):
        x, y = place_outline(middle[None], pose)[0]
        ahead, aside = v[row] - w[row] * middle[1], vy[row] + w[row] * middle[0]
        cos_yaw, sin_yaw = math.cos(pose[2]), math.sin(pose[2])
        vx_world, vy_world = ahead * cos_yaw - aside * sin_yaw, ahead * sin_yaw + aside * cos_yaw
        for index in range(count):
            own_x, own_y = people.positions_m[row, index]
            own_vx, own_vy = people.velocities_mps[row, index]
            force = social_force(own_x, own_y, own_vx, own_vy, x, y, vx_world, vy_world)
            sizes[row, index] = SOCIAL_FACTOR * np.hypot(*np.asarray(force))
    return sizes
