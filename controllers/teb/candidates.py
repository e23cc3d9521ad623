"""The bands that a cycle tries: the driven one, the plan's, and ways past the other side."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import NamedTuple

import numpy as np

from drake_navbench.controllers.teb.band import Band, Pace, initialise, warm_start
from drake_navbench.controllers.teb.homotopy import (
    LEFT,
    RIGHT,
    Clusters,
    path_past_cluster,
    same_class,
    swept_angles,
)
from drake_navbench.controllers.teb.local_plan import LocalPlan
from drake_navbench.controllers.teb.memory import Alternative, TebMemory
from drake_navbench.controllers.teb.parameters import TebParameters
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.distance_field import DistanceField
from drake_navbench.kernels.path_geometry import path_length

SIDES = (LEFT, RIGHT)


class Ends(NamedTuple):
    """The ends of the bands of a cycle: start (3,), goal (3,), and the speed at the start, m/s."""

    start: Array
    goal: Array
    speed: float


class Candidate(NamedTuple):
    """A guess for a band, with the facts about its class.

    angles: (C,) swept about the clusters, rad. is_driven: it continues the band driven so far.
    follows_plan: it has the class of the global plan. predecessor: the alternative it continues.
    is_spare: a new guess for the class of the driven band.
    """

    guess: Band
    angles: Array
    is_driven: bool
    follows_plan: bool
    predecessor: Alternative | None
    is_spare: bool = False

    @property
    def is_cold(self) -> bool:
        """Whether the candidate is a guess that was never optimised."""
        is_new = self.predecessor is None or self.predecessor.is_queued
        return is_new and not self.is_driven

    @property
    def length_m(self) -> float:
        """Length of the guess, m."""
        return path_length(self.guess.poses)


def ways_past_block(
    pose: Array, plan: LocalPlan, *, field: DistanceField, clusters: Clusters, longest_ratio: float
) -> list[Array]:
    """Returns paths (P, 2) m from the robot's pose to the plan's goal around the plan's obstacle.

    At most one on either side, shorter one first, none longer than `longest_ratio` times the plan.
    """
    if plan.blocked_index is None or len(clusters.anchors) == 0:
        return []
    start, goal = pose[:2], plan.poses[plan.goal_index, :2]
    blocked = plan.poses[plan.blocked_index, :2]
    cluster = int(np.argmin(np.sum((clusters.anchors - blocked) ** 2, axis=1)))
    label = clusters.label_near(blocked, field)
    if label is not None:
        cluster = label
    longest = longest_ratio * (
        path_length(plan.poses[: plan.goal_index + 1])
        + float(np.hypot(*(plan.poses[0, :2] - start)))
    )
    past = partial(path_past_cluster, field, clusters, start=start, goal=goal)
    return _shortest_first([past(cluster=cluster, side=side) for side in SIDES], longest)


def ways_past_narrow(
    pose: Array,
    plan: LocalPlan,
    *,
    field: DistanceField,
    clusters: Clusters,
    reach_m: float,
    longest_ratio: float,
) -> list[Array]:
    """Returns paths (P, 2) m from the robot's pose to the plan's goal past its narrowest place.

    On either side of each cluster within `reach_m` of that place, shortest first, none longer than
    `longest_ratio` times the plan. The plan's own way may be among them.
    """
    start, goal = pose[:2], plan.poses[plan.goal_index, :2]
    narrowest = plan.poses[int(np.argmin(plan.clearances[: plan.goal_index + 1])), :2]
    longest = longest_ratio * path_length(plan.poses[: plan.goal_index + 1])
    past = partial(path_past_cluster, field, clusters, start=start, goal=goal)
    beside = clusters.labels_beside(narrowest, field, reach_m)
    return _shortest_first([past(cluster=c, side=side) for c in beside for side in SIDES], longest)


def _shortest_first(paths: Iterable[Array | None], longest: float) -> list[Array]:
    """Returns the paths of at most `longest` m, the shortest first; None stands for no path."""
    short = [path for path in paths if path is not None and path_length(path) <= longest]
    return sorted(short, key=path_length)


def gather_candidates(
    memory: TebMemory,
    paths: list[Array],
    ends: Ends,
    *,
    time_s: float,
    leads_through: bool,
    clusters: Clusters,
    pace: Pace,
    parameters: TebParameters,
) -> list[Candidate]:
    """Returns at most max_number_classes candidates of different classes, the driven one first.

    leads_through: whether the plan itself can be driven, as the first of the paths.
    """
    start, goal, speed = ends
    plan_angles = [
        swept_angles(np.vstack([start[:2], path, goal[:2]]), clusters.anchors) for path in paths
    ]
    found: list[Candidate] = []

    def add(guess: Band, *, is_driven: bool = False, known: Alternative | None = None) -> None:
        # A copy: for read-only poses the kernel would be compiled once more.
        angles = swept_angles(guess.poses.copy(), clusters.anchors)
        if len(found) < parameters.max_number_classes and not any(
            same_class(angles, other.angles) for other in found
        ):
            follows = leads_through and same_class(angles, plan_angles[0])
            found.append(Candidate(guess, angles, is_driven, follows, known))

    def continued(band: Band, stamp_s: float) -> Band:
        return warm_start(band, time_s - stamp_s, start, goal, pace=pace)

    if memory.band is not None and not _goal_jumped(memory.band, goal, parameters):
        add(continued(memory.band, memory.stamp_s), is_driven=True)
    if parameters.enable_homotopy_class_planning:
        for known in memory.alternatives:
            # A failed guess only keeps its class from being tried again for a while.
            is_of_use = known.accepted or known.is_queued or known.is_recent(time_s)
            if is_of_use and not _goal_jumped(known.band, goal, parameters):
                add(continued(known.band, known.stamp_s), known=known)
    for path, path_angles in zip(paths, plan_angles, strict=True):
        if found and not parameters.enable_homotopy_class_planning:
            break
        if not any(same_class(path_angles, other.angles) for other in found):
            add(initialise(path, start, goal, pace=pace, speed=speed))
    return found


def spare_candidate(
    candidates: list[Candidate],
    paths: list[Array],
    ends: Ends,
    *,
    clusters: Clusters,
    pace: Pace,
) -> Candidate | None:
    """Returns a new guess of the driven band's class, for where that band fails; None without one.

    Arguments as for `gather_candidates`.
    """
    start, goal, speed = ends
    if not candidates or not candidates[0].is_driven:
        return None
    driven = candidates[0]
    for path in paths:
        angles = swept_angles(np.vstack([start[:2], path, goal[:2]]), clusters.anchors)
        if same_class(angles, driven.angles):
            guess = initialise(path, start, goal, pace=pace, speed=speed)
            return driven._replace(guess=guess, is_driven=False, is_spare=True)
    return None


def _goal_jumped(band: Band, goal: Array, parameters: TebParameters) -> bool:
    """Whether the local goal is too far from a band's end to keep the band."""
    distance = float(np.hypot(*(band.poses[-1, :2] - goal[:2])))
    turn = abs(wrap(float(band.poses[-1, 2] - goal[2])))
    return (
        distance >= parameters.force_reinit_new_goal_dist
        or turn >= parameters.force_reinit_new_goal_angular
    )
