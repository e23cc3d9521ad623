"""Critics that compare the samples with the path: PathAlign, PathFollow, PathAngle.

They need the point that the whole batch reaches, so they run on the ends and on every q-th column
of the samples (`Reach`) once these are known.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any, ClassVar, Literal

import numpy as np
from numba import njit
from numpy.typing import NDArray
from pydantic import Field

from drake_navbench.controllers.mppi.critics.base import (
    Critic,
    CriticContext,
    CriticParameters,
    PathCritic,
    TermParameters,
    weigh,
)
from drake_navbench.controllers.mppi.critics.batch import Batch, Float32Array, Reach, Scene
from drake_navbench.controllers.mppi.float32_math import F32, HALF_PI, ONE, PI, ZERO, wrap32
from drake_navbench.controllers.mppi.lanes import LANES
from drake_navbench.controllers.mppi.releases import Rules
from drake_navbench.typed_files.quantities import Angle, Count, Length, Number

# PathAlign ignores up to this many invalid path points, whatever their share.
MAX_IGNORED_POINTS = 2
# Below this smallest velocity PathAngle takes the robot for one that cannot reverse, m/s.
_NO_REVERSE = 1e-6


class PathAngleMode(IntEnum):
    """Which way the robot may point to be taken as aligned with the path."""

    FORWARD_PREFERENCE = 0
    NO_DIRECTIONAL_PREFERENCE = 1
    CONSIDER_FEASIBLE_PATH_ORIENTATIONS = 2


class PathAlignParameters(TermParameters):
    """Parameters of PathAlignCritic."""

    cost_weight: Number = Field(
        10.0, description="Weight of a sample's mean distance to the path [1/m]."
    )
    max_path_occupancy_ratio: Number = Field(
        0.07, ge=0, description="Share of occupied path points above which the critic is idle."
    )
    offset_from_furthest: Count = Field(
        20,
        ge=0,
        description="Index of the furthest reached path point below which the critic is idle.",
    )
    trajectory_point_step: Count = Field(
        4, ge=1, description="Compare every n-th step of a sample."
    )
    threshold_to_consider: Length = Field(
        0.5, ge=0, description="Length of the remaining plan below which the critic is idle [m]."
    )
    use_path_orientations: bool = Field(False, description="Add the yaw error to the distance.")


class PathAlignCritic(PathCritic):
    """Keeps samples on the path, point by point."""

    Parameters: ClassVar[type[CriticParameters]] = PathAlignParameters

    def __init__(self, parameters: Any, context: CriticContext) -> None:
        super().__init__(parameters, context)
        self.column_step = parameters.trajectory_point_step

    def score_reach(self, scene: Scene, reach: Reach, furthest: int) -> Float32Array | None:
        p = self.parameters
        if furthest < max(1, p.offset_from_furthest):
            return None
        aligns_onward = self.context.release.aligns_onward
        begin = 0 if aligns_onward else closest_to_first_sample(scene, reach)
        if self.is_off(scene, begin, furthest):
            return None
        costs = np.empty_like(reach.end_x)
        path_align_costs(
            (scene.path_x, scene.path_y, scene.path_yaw),
            scene.arc_lengths,
            scene.path_valid,
            furthest,
            p.use_path_orientations,
            aligns_onward,
            reach,
            costs,
        )
        return costs

    def is_off(self, scene: Scene, begin: int, furthest: int) -> bool:
        """Returns whether too many of the path points from `begin` to `furthest` are occupied."""
        valid = scene.path_valid[begin:]
        ratio = self.parameters.max_path_occupancy_ratio
        return is_path_blocked(valid, max(0, furthest - begin), ratio)


def closest_to_first_sample(scene: Scene, reach: Reach) -> int:
    """Returns the path point closest to the first pose of the first sample; the first of equals."""
    dx = scene.path_x - reach.column_x[0, 0, 0]
    dy = scene.path_y - reach.column_y[0, 0, 0]
    return int(np.argmin(dx * dx + dy * dy))


def is_path_blocked(valid: NDArray[np.bool_], furthest: int, max_occupancy_ratio: float) -> bool:
    """Returns whether too many of the path points before `furthest` are occupied."""
    invalid = furthest - int(np.count_nonzero(valid[:furthest]))
    if invalid <= MAX_IGNORED_POINTS:
        return False
    return bool(np.float32(invalid) / np.float32(furthest) > np.float32(max_occupancy_ratio))


@njit(cache=True)
def path_align_costs(path, lengths, valid, furthest, use_yaw, onward, reach, costs):
    """PathAlignCritic: mean distance between a sample's columns and the path, by arc length.

    Path points 0 .. furthest - 1 count. A column is compared with the point whose arc length is
    nearest to the distance driven since column 0; invalid points are left out. onward: the rule by
    which that point is searched, see `Rules.aligns_onward`. path: x, y, yaw of its points. costs:
    (blocks, LANES), written.
    """
    path_x, path_y, path_yaw = path
    arcs = np.full(LANES, ZERO)
    for block in range(costs.shape[0]):
        x, y, yaw = reach.column_x[block], reach.column_y[block], reach.column_yaw[block]
        indices = np.zeros(LANES, np.int32)
        counts = np.zeros(LANES, np.float32)
        sums = costs[block]
        sums[:] = ZERO
        arcs[:] = ZERO
        for t in range(1, x.shape[0]):
            for lane in range(LANES):
                dx, dy = x[t, lane] - x[t - 1, lane], y[t, lane] - y[t - 1, lane]
                arcs[lane] += np.sqrt(dx * dx + dy * dy)
            if onward:
                _nearest_by_length_row(lengths, furthest, arcs, indices)
            else:
                _first_by_length_row(lengths, furthest, arcs, indices)
            for lane in range(LANES):
                i = indices[lane]
                if i >= valid.shape[0] or not valid[i]:
                    continue
                dx, dy = path_x[i] - x[t, lane], path_y[i] - y[t, lane]
                squared = dx * dx + dy * dy
                if use_yaw:
                    turn = wrap32(yaw[t, lane] - path_yaw[i])
                    squared += turn * turn
                sums[lane] += np.sqrt(squared)
                counts[lane] += ONE
        for lane in range(LANES):
            sums[lane] = sums[lane] / counts[lane] if counts[lane] > ZERO else ZERO


@njit(cache=True)
def _nearest_by_length_row(lengths, count, arcs, indices):
    """Advances each lane's index to the path point, of `count`, nearest by arc length.

    The scan only goes forward; a tie goes to the later point, and the last point catches all.
    """
    for lane in range(LANES):
        driven = arcs[lane]
        start = indices[lane]
        found = np.int32(count - 1)
        for j in range(start + 1, count):
            if lengths[j] > driven:
                before_is_nearer = driven - lengths[j - 1] < lengths[j] - driven
                found = np.int32(j - 1 if before_is_nearer else j)
                break
        indices[lane] = found


@njit(cache=True)
def _first_by_length_row(lengths, count, arcs, indices):
    """Advances each lane's index to the path point nearest by arc length, as Nav2 does up to Iron.

    Candidates are the first point, from the lane's index on, that is as far as the lane has driven,
    and the point before it. Where the point at the index is already as far, the index returns to 0.
    Beyond the last of `count` points Nav2 reads memory behind its list; that is taken for 0, so
    that the index becomes `count`, which may be the path's last point, which is never valid.
    """
    for lane in range(LANES):
        driven = arcs[lane]
        start = indices[lane]
        found = start
        while found < count and lengths[found] < driven:
            found += 1
        if found == start:
            indices[lane] = 0
        elif found == count:
            indices[lane] = count
        elif driven - lengths[found - 1] < lengths[found] - driven:
            indices[lane] = found - 1
        else:
            indices[lane] = found


class PathFollowParameters(TermParameters):
    """Parameters of PathFollowCritic."""

    cost_weight: Number = Field(
        5.0, description="Weight of a sample's distance to the carrot at its end [1/m]."
    )
    offset_from_furthest: Count = Field(
        6, ge=0, description="Path points from the furthest reached one to the carrot."
    )
    threshold_to_consider: Length = Field(
        1.4, ge=0, description="Length of the remaining plan below which the critic is idle [m]."
    )


class PathFollowCritic(PathCritic):
    """Pulls the ends of the samples toward a free path point ahead of all of them."""

    Parameters: ClassVar[type[CriticParameters]] = PathFollowParameters

    def score_reach(self, scene: Scene, reach: Reach, furthest: int) -> Float32Array | None:
        last = len(scene.path) - 1
        if last < 1:
            return None
        carrot = min(furthest + self.parameters.offset_from_furthest, last)
        while carrot < last - 1 and not scene.path_valid[carrot]:
            carrot += 1
        x, y, _ = scene.path[carrot]
        costs = np.empty_like(reach.end_x)
        distance_costs(x, y, reach.end_x, reach.end_y, costs)
        return costs


@njit(cache=True)
def distance_costs(target_x, target_y, x, y, costs):
    """PathFollowCritic: distance of the samples' ends x, y from the target, all (blocks, LANES)."""
    for block in range(x.shape[0]):
        for lane in range(LANES):
            dx, dy = x[block, lane] - target_x, y[block, lane] - target_y
            costs[block, lane] = np.sqrt(dx * dx + dy * dy)


class PathAngleParameters(TermParameters):
    """Parameters of PathAngleCritic."""

    cost_weight: Number = Field(
        2.2, description="Weight of the angle between the robot's heading and the carrot [1/rad]."
    )
    offset_from_furthest: Count = Field(
        4, ge=0, description="Path points from the furthest reached one to the carrot."
    )
    threshold_to_consider: Length = Field(
        0.5, ge=0, description="Length of the remaining plan below which the critic is idle [m]."
    )
    max_angle_to_furthest: Angle = Field(
        0.785398, ge=0, description="Angle below which the critic is idle [rad]."
    )
    mode: Literal[0, 1, 2] = Field(
        0,
        description="0: prefer driving forward; 1: either direction; 2: the direction of the "
        "path's orientations.",
    )
    forward_preference: bool = Field(True, description="Humble: true is mode 0, false mode 1.")


class PathAngleCritic(PathCritic):
    """Turns the robot toward a path point where it points far away from it."""

    Parameters: ClassVar[type[CriticParameters]] = PathAngleParameters

    def __init__(self, parameters: Any, context: CriticContext) -> None:
        super().__init__(parameters, context)
        self.mode = path_angle_mode(parameters, context)

    @classmethod
    def of_release(cls, release: Rules) -> type[Critic]:
        """Returns the class that scores as a release of Nav2 does."""
        return cls if release.angles_at_end else MeanPathAngleCritic

    def score_reach(self, scene: Scene, reach: Reach, furthest: int) -> Float32Array | None:
        p = self.parameters
        target = scene.path[min(furthest + p.offset_from_furthest, len(scene.path) - 1)]
        pose = scene.pose.astype(np.float32)
        if angle_to_target(pose, target, self.mode) < F32(p.max_angle_to_furthest):
            return None
        costs = np.empty_like(reach.end_x)
        path_angle_costs(target, self.mode, reach.end_x, reach.end_y, reach.end_yaw, costs)
        return costs


class MeanPathAngleCritic(Critic):
    """PathAngleCritic up to Iron: the mean over all columns of the samples, not their ends."""

    Parameters: ClassVar[type[CriticParameters]] = PathAngleParameters

    def __init__(self, parameters: Any, context: CriticContext) -> None:
        super().__init__(parameters, context)
        self.mode = path_angle_mode(parameters, context)

    def score(self, batch: Batch) -> tuple[Float32Array, bool]:
        """Scores a batch; see `Critic.score`."""
        p, scene = self.parameters, batch.scene
        costs = np.zeros(batch.x.shape[::2], np.float32)
        scored = costs.ravel()[: batch.size]
        if scene.way_left < F32(p.threshold_to_consider):
            return scored, False
        target = scene.path[min(batch.furthest + p.offset_from_furthest, len(scene.path) - 1)]
        pose = scene.pose.astype(np.float32)
        if angle_to_target(pose, target, self.mode) < F32(p.max_angle_to_furthest):
            return scored, False
        angles = np.empty_like(costs)
        for t in range(batch.x.shape[1]):
            x, y, yaw = (np.ascontiguousarray(q[:, t]) for q in (batch.x, batch.y, batch.yaw))
            path_angle_costs(target, self.mode, x, y, yaw, angles)
            costs += angles
        scored /= F32(batch.x.shape[1])
        weigh(scored, F32(p.cost_weight), p.cost_power)
        return scored, False


def path_angle_mode(parameters: PathAngleParameters, context: CriticContext) -> int:
    """Returns the PathAngleMode; 0 (forward) without a preference, if the robot cannot reverse."""
    cannot_reverse = abs(context.limits.vx_min) < _NO_REVERSE
    no_preference = PathAngleMode.NO_DIRECTIONAL_PREFERENCE
    mode = parameters.mode if parameters.forward_preference else no_preference
    return 0 if cannot_reverse and mode == no_preference else mode


def angle_to_target(pose: Float32Array, target: Float32Array, mode: int) -> np.float32:
    """Returns the angle in rad between the robot's heading and a path point (3,), by mode."""
    yaw, target_yaw = np.float32(pose[2]), target[2]
    bearing = np.float32(math.atan2(target[1] - pose[1], target[0] - pose[0]))
    if mode == PathAngleMode.CONSIDER_FEASIBLE_PATH_ORIENTATIONS and (
        abs(wrap32(target_yaw - bearing)) > HALF_PI
    ):
        bearing = bearing + PI
    angle = abs(wrap32(yaw - bearing))
    if mode == PathAngleMode.NO_DIRECTIONAL_PREFERENCE:
        angle = min(angle, abs(wrap32(yaw + PI - bearing)))
    return np.float32(angle)


@njit(cache=True)
def path_angle_costs(target, mode, x, y, yaw, costs):
    """PathAngleCritic: |angle| between the samples' last heading and the target point (3,).

    x, y, yaw, costs: (blocks, LANES). Mode 1 lets the robot point away; mode 2 lets it where the
    path itself points away.
    """
    for block in range(x.shape[0]):
        for lane in range(LANES):
            bearing = math.atan2(target[1] - y[block, lane], target[0] - x[block, lane])
            heading = yaw[block, lane] if mode == 1 else target[2]
            if mode != 0 and np.abs(wrap32(bearing - heading)) >= HALF_PI:
                bearing = wrap32(bearing + PI)
            costs[block, lane] = np.abs(wrap32(bearing - yaw[block, lane]))
