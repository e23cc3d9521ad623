"""Positions of people and groups relative to the robot, sampled for the social metrics."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from drake_navbench.analysis.metrics.body import outline_of
from drake_navbench.analysis.metrics.definition import Undefined
from drake_navbench.analysis.metrics.movers import is_there, movers_of
from drake_navbench.analysis.metrics.moving import (
    LOOK_PERIOD_S,
    clearances_m,
    look_times,
)
from drake_navbench.analysis.metrics.signals import poses_at
from drake_navbench.inputs.moving_obstacles import Bodies
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.moving_bodies import clearances_of_bodies
from drake_navbench.kernels.poses import place_outline
from drake_navbench.logs.log import TrialLog

# A group is not together at a time at which a member is farther from the group's middle than this.
TOGETHER_M = 3.6


class PeopleLooks(NamedTuple):
    """The P people of a trial at T sampled times.

    time_s: (T,). gaps_m: (T, P) between footprint and body, inf beyond 5 m. positions_m,
    velocities_mps: (T, P, 2). is_there: (T, P) whether they are in the world. wanted_mps: (P,) the
    speed at which each person wants to walk; 0 for a person who stays, and for people of a
    recording, whose wanted speed is unknown.
    """

    time_s: Array
    gaps_m: Array
    positions_m: Array
    velocities_mps: Array
    is_there: NDArray[np.bool_]
    wanted_mps: Array


class Approaches(NamedTuple):
    """Number of approaches to within a distance, by who contributed more: robot or person."""

    by_robot: int
    by_person: int


class GroupGaps(NamedTuple):
    """Distances (T, G) from the footprint to each group's hull and to its middle, m.

    A distance is inf while fewer than two members of the group are present, or while its members
    are not together.
    """

    to_hulls: Array
    to_middles: Array


@lru_cache(maxsize=1)
def people_of(log: TrialLog) -> PeopleLooks:
    """Returns the people of a trial; raises Undefined where there are none."""
    movers = movers_of(log)
    first = len(movers.things)
    if movers.body_count == first:
        raise Undefined("there were no people")
    looks = look_times(log)
    here = movers.poses_at(looks)
    rates = movers.rates_between(movers.poses_at(looks - LOOK_PERIOD_S), here, LOOK_PERIOD_S)
    wanted = np.zeros(len(movers.people))
    for index, person in enumerate(movers.people.persons):
        wanted[index] = person.speed_mps if person.goals else 0.0
    return PeopleLooks(
        looks,
        clearances_m(log)[:, first:],
        here[:, first:, :2],
        rates[:, first:, :2],
        is_there(here[:, first:]),
        wanted,
    )


def approaches_within(log: TrialLog, distance_m: float) -> Approaches:
    """Counts how often the gap of the robot and a person falls below `distance_m`.

    Raises Undefined where there were no people.
    """
    people, movers = people_of(log), movers_of(log)
    near = people.gaps_m < distance_m
    comes = near[1:] & ~near[:-1] & people.is_there[1:] & people.is_there[:-1]
    outline = np.ascontiguousarray(outline_of(log))
    robot, bodies = poses_at(log, people.time_s), movers.bodies
    poses = movers.poses_at(people.time_s)
    by_robot = 0
    for row, person in np.argwhere(comes):
        body = len(movers.things) + person
        own = bodies.only(np.arange(bodies.count) == body)

        def gap_m(of_robot: int, of_person: int, body: int = body, own: Bodies = own) -> float:
            x, y, yaw = robot[of_robot]
            there = poses[of_person]
            gaps = clearances_of_bodies(outline, x, y, yaw, own.edges, own.discs, there, np.inf)
            return float(gaps[body])

        by_robot += gap_m(row + 1, row) <= gap_m(row, row + 1)
    return Approaches(by_robot, int(comes.sum()) - by_robot)


@lru_cache(maxsize=1)
def gaps_to_groups_m(log: TrialLog) -> GroupGaps:
    """Returns the robot's distances to the groups; raises Undefined where there are none."""
    people = people_of(log)
    groups = np.array(movers_of(log).people.groups)
    members = [np.flatnonzero(groups == group) for group in np.unique(groups[groups >= 0])]
    members = [own for own in members if len(own) > 1]
    if not members:
        raise Undefined("there were no groups")
    outline = outline_of(log)
    poses = poses_at(log, people.time_s)
    footprints = np.array([shapely.Polygon(place_outline(outline, pose)) for pose in poses])
    gaps = GroupGaps(*(np.full((len(footprints), len(members)), np.inf) for _ in range(2)))
    for group, own in enumerate(members):
        there = people.is_there[:, own]
        for pattern in np.unique(there, axis=0):
            if pattern.sum() < 2:
                continue
            rows = np.flatnonzero((there == pattern).all(axis=1))
            places = people.positions_m[np.ix_(rows, own[pattern])]
            middles = places.mean(axis=1)
            away = np.hypot(*np.moveaxis(places - middles[:, None], -1, 0)).max(axis=1)
            together = away <= TOGETHER_M
            rows, places, middles = rows[together], places[together], middles[together]
            hulls = shapely.convex_hull(shapely.multipoints(places))
            gaps.to_hulls[rows, group] = shapely.distance(footprints[rows], hulls)
            points = shapely.points(middles)
            gaps.to_middles[rows, group] = shapely.distance(footprints[rows], points)
    return gaps
