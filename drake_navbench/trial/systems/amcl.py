"""Monte Carlo localization: the robot's pose in the map, by its scans."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, State

from drake_navbench.inputs.amcl import OMNIDIRECTIONAL, AmclSettings
from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.localization import LocalizationSettings
from drake_navbench.inputs.timeline import SLACK_S, Timeline
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.immutable import Immutable
from drake_navbench.kernels.noise import NoiseKey, NoiseStream
from drake_navbench.kernels.particle_filter import (
    heaviest_cluster,
    hit_points,
    move_differential,
    move_omnidirectional,
    resample,
    weigh,
)
from drake_navbench.kernels.poses import carrier_pose, compose, placed_state
from drake_navbench.kernels.scan import Scan
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.navigation.mission import FloorSwitch
from drake_navbench.trial.systems.floor_aware import FloorAware, FloorClock
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import (
    POSE_SIZE,
    STATE_SIZE,
    declare_object_input,
    value_or_none,
)
from drake_navbench.trial.systems.scripted_localization import NO_NOISE, SAME_FRAME, jump_of

PERIOD_S = 0.05
# The value of a free cell of an occupancy grid.
FREE = 0
# The number of the first draw on a further floor; no trial has as many updates.
FIRST_OF_FLOORS = 2**31


@dataclass(frozen=True, eq=False)
class Belief(Immutable):
    """AMCL's belief about the robot's pose.

    particles: (N, 3) x m, y m, yaw rad in the map. weights: (N,), which sum to 1. slow, fast:
    running means of the particles' likelihood, 0 before the first. odometry_pose: (3,) at the last
    update, None before the first. updates: the number of updates. scan_time_s: time of the last
    scan used. map_from_odometry: (3,) pose of the odometry frame in the map. has_jumped: whether
    the belief was displaced already.
    """

    particles: Array
    weights: Array
    map_from_odometry: Array
    slow: float = 0.0
    fast: float = 0.0
    odometry_pose: Array | None = None
    updates: int = 0
    scan_time_s: float = -math.inf
    has_jumped: bool = False


NOBODY = Belief(np.zeros((1, POSE_SIZE)), np.ones(1), np.zeros(POSE_SIZE))


class _KnownMap(NamedTuple):
    """A map as the filter looks at it: frame of its cells, likelihood field, free cells (F, 2)."""

    frame: tuple[float, float, float]
    field: Array
    off_map: float
    free_cells: NDArray[np.int64]


class Amcl(FloorAware):
    """Adaptive Monte Carlo localization on a map, as nav2_amcl does it with the likelihood field.

    Input `scan` (Scan or None), with the sensor's pose by the odometry, and `odometry_estimate` [x
    m, y m, yaw rad, v m/s, w rad/s, vy m/s] in the odometry's frame. Outputs `estimate`, the same
    six numbers in the map frame, and `map_from_odometry` (3,) x m, y m, yaw rad. Abstract state
    `belief_state` is the `Belief`.

    A new scan is processed within 0.05 s, at `offset_s` and every period later; the filter is
    updated where the odometry has moved far enough since the last update, and the transform where
    it is resampled. With several scanners, AMCL uses the first. grid: the map, in the world frame.

    At the settings' `jump_time_s` all particles and the transform are displaced by the jump: the
    robot is forcibly unlocalized, as if it had been carried away.

    floors, floor_clock: the map of each floor of a mission, and the instants of change; both or
    neither. On another floor the particles begin anew, spread as at the start around the true pose
    (input `state`) plus the error of the lift.
    """

    def __init__(
        self,
        settings: Timeline[LocalizationSettings],
        lidar: LidarSettings,
        grid: OccupancyMap,
        *,
        offset_s: float,
        floors: Sequence[OccupancyMap] = (),
        floor_clock: FloorClock | None = None,
    ) -> None:
        super().__init__()
        if floor_clock is not None:
            self._declare_floors(floor_clock)
            self._state_port = self.DeclareVectorInputPort("state", STATE_SIZE)
        at_start = settings.at(0.0)
        assert at_start.amcl is not None
        self._amcl: AmclSettings = at_start.amcl
        self._settings, self._lidar = settings, lidar
        self._range_min, self._range_max = _range_limits(self._amcl, lidar)
        self._maps = [
            _KnownMap(
                one.frame,
                *likelihood_field(self._amcl, one, self._range_max),
                np.argwhere(one.occupancy == FREE),
            )
            for one in floors or (grid,)
        ]
        self.seed_parameter = self.DeclareAbstractParameter(AbstractValue.Make(0))
        self.belief_state = self.DeclareAbstractState(AbstractValue.Make(NOBODY))
        self._scan_port = declare_object_input(self, "scan")
        self._odometry_port = self.DeclareVectorInputPort("odometry_estimate", STATE_SIZE)
        belief = self.abstract_state_ticket(self.belief_state)
        odometry = self.input_port_ticket(self._odometry_port.get_index())
        self.DeclareVectorOutputPort(
            "estimate",
            STATE_SIZE,
            weakly_bound(self._calc_estimate),
            prerequisites_of_calc={belief, odometry},
        )
        self.DeclareVectorOutputPort(
            "map_from_odometry",
            POSE_SIZE,
            weakly_bound(self._calc_map_from_odometry),
            prerequisites_of_calc={belief},
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            PERIOD_S, offset_s, weakly_bound(self._on_period)
        )

    def set_start(self, context: Context, pose: Array, seed: int) -> None:
        """Sets the belief to a start pose (3,), with the spread of the settings."""
        context.get_mutable_abstract_parameter(self.seed_parameter).set_value(seed)
        particles, weights = self._around(pose, _generator(seed, 0))
        context.SetAbstractState(self.belief_state, Belief(particles, weights, np.zeros(POSE_SIZE)))

    def _around(self, pose: Array, generator: np.random.Generator) -> tuple[Array, Array]:
        """Returns particles (N, 3) around a pose (3,), with their weights (N,)."""
        count = self._amcl.max_particles
        normals = generator.standard_normal((count, POSE_SIZE))
        xy_std, yaw_std = self._amcl.initial_xy_std_m, self._amcl.initial_yaw_std_rad
        particles = pose + normals * (xy_std, xy_std, yaw_std)
        return particles, np.full(count, 1.0 / count)

    def _on_floor(self, context: Context, state: State, switch: FloorSwitch) -> None:
        before: Belief = context.get_abstract_state(self.belief_state).get_value()
        seed = context.get_abstract_parameter(self.seed_parameter).get_value()
        arrival = switch.carried(self._state_port.Eval(context)[:POSE_SIZE])
        pose = arrival + np.array(switch.error)
        generator = _generator(seed, FIRST_OF_FLOORS + switch.number)
        particles, weights = self._around(pose, generator)
        odometry = self._odometry_port.Eval(context)[:POSE_SIZE]
        after = replace(
            before,
            particles=particles,
            weights=weights,
            map_from_odometry=carrier_pose(pose, odometry),
            slow=0.0,
            fast=0.0,
            odometry_pose=None,
        )
        state.get_mutable_abstract_state(self.belief_state).set_value(after)

    def _on_period(self, context: Context, state: State) -> None:
        before: Belief = context.get_abstract_state(self.belief_state).get_value()
        seed = context.get_abstract_parameter(self.seed_parameter).get_value()
        after = self._displaced(before, context, seed)
        scan: Scan | None = value_or_none(self._scan_port, context)
        if scan is not None and scan.time_s != after.scan_time_s:
            after = self._after_scan(after, scan, seed, self._maps[self._floor(context)])
        if after is not before:
            state.get_mutable_abstract_state(self.belief_state).set_value(after)

    def _displaced(self, belief: Belief, context: Context, seed: int) -> Belief:
        """Returns the belief after its jump; unchanged if that is not due or has happened."""
        now_s = context.get_time()
        settings = self._settings.at(now_s)
        is_due = now_s >= settings.jump_time_s - SLACK_S
        if belief.has_jumped or not is_due or not (settings.jump_m or settings.jump_yaw_rad):
            return belief
        jump = jump_of(settings, seed)
        odometry = self._odometry_port.Eval(context)[:POSE_SIZE]
        robot = compose(belief.map_from_odometry, odometry)
        return replace(
            belief,
            particles=belief.particles + jump,
            map_from_odometry=carrier_pose(robot + jump, odometry),
            has_jumped=True,
        )

    def _after_scan(self, belief: Belief, scan: Scan, seed: int, known: _KnownMap) -> Belief:
        """Returns the belief after a new scan, updated only if the robot has moved."""
        assert scan.odometry_pose is not None
        pose = carrier_pose(scan.odometry_pose, self._lidar.pose)
        belief = replace(belief, scan_time_s=scan.time_s)
        generator = _generator(seed, belief.updates + 1)
        particles, weights = belief.particles.copy(), belief.weights.copy()
        if belief.odometry_pose is not None:
            delta = pose - belief.odometry_pose
            delta[2] = wrap(delta[2])
            if not self._has_moved(delta):
                return belief
            is_omnidirectional = self._amcl.robot_model_type == OMNIDIRECTIONAL
            move = move_omnidirectional if is_omnidirectional else move_differential
            normals = generator.standard_normal(particles.shape)
            move(particles, belief.odometry_pose[2], delta, np.array(self._amcl.alphas), normals)
        belief = self._weighed(replace(belief, particles=particles), weights, scan, known)
        belief = replace(belief, odometry_pose=pose, updates=belief.updates + 1)
        if belief.updates % self._amcl.resample_interval == 0:
            belief = self._resampled(belief, generator, known)
        elif belief.updates > 1:
            return belief
        found = heaviest_cluster(belief.particles, belief.weights)
        return replace(belief, map_from_odometry=carrier_pose(found[:POSE_SIZE], pose))

    def _has_moved(self, delta: Array) -> bool:
        far, turned = self._amcl.update_min_d, self._amcl.update_min_a
        return bool(abs(delta[0]) > far or abs(delta[1]) > far or abs(delta[2]) > turned)

    def _weighed(self, belief: Belief, weights: Array, scan: Scan, known: _KnownMap) -> Belief:
        """Returns the belief with the weights that a scan gives; weights are changed in place."""
        points = hit_points(
            scan.ranges_m,
            scan.angles_rad,
            np.array(self._lidar.pose),
            max_beams=self._amcl.max_beams,
            range_min=self._range_min,
            range_max=self._range_max,
        )
        total = weigh(belief.particles, weights, points, known.field, known.off_map, *known.frame)
        mean = total / weights.size
        slow, fast = belief.slow, belief.fast
        slow += (self._amcl.recovery_alpha_slow if slow else 1.0) * (mean - slow)
        fast += (self._amcl.recovery_alpha_fast if fast else 1.0) * (mean - fast)
        return replace(belief, weights=weights / total, slow=slow, fast=fast)

    def _resampled(
        self, belief: Belief, generator: np.random.Generator, known: _KnownMap
    ) -> Belief:
        amcl = self._amcl
        random_share = max(1.0 - belief.fast / belief.slow, 0.0)
        draws = generator.random((amcl.max_particles, 2))
        strangers = np.empty((0, POSE_SIZE))
        if random_share > 0.0:
            strangers = self._anywhere(generator, known)
        limits = (amcl.pf_err, amcl.pf_z, amcl.min_particles, amcl.max_particles)
        particles = resample(
            belief.particles, belief.weights, draws, random_share, strangers, limits
        )
        weights = np.full(len(particles), 1.0 / len(particles))
        belief = replace(belief, particles=particles, weights=weights)
        # As in nav2_amcl: the averages begin anew, so that not all particles become random in the
        # end.
        return replace(belief, slow=0.0, fast=0.0) if random_share > 0.0 else belief

    def _anywhere(self, generator: np.random.Generator, known: _KnownMap) -> Array:
        """Returns (max_particles, 3) random poses at lower left corners of free cells."""
        count = self._amcl.max_particles
        cells = known.free_cells[generator.integers(len(known.free_cells), size=count)]
        origin_x, origin_y, resolution = known.frame
        return np.column_stack(
            [
                origin_x + resolution * cells[:, 1],
                origin_y + resolution * cells[:, 0],
                math.pi * (2.0 * generator.random(count) - 1.0),
            ]
        )

    def _calc_estimate(self, context: Context, output: BasicVector) -> None:
        belief: Belief = context.get_abstract_state(self.belief_state).get_value()
        state = self._odometry_port.Eval(context)
        output.SetFromVector(placed_state(state, SAME_FRAME, NO_NOISE, belief.map_from_odometry))

    def _calc_map_from_odometry(self, context: Context, output: BasicVector) -> None:
        belief: Belief = context.get_abstract_state(self.belief_state).get_value()
        output.SetFromVector(belief.map_from_odometry)


def likelihood_field(
    amcl: AmclSettings, grid: OccupancyMap, range_max: float
) -> tuple[Array, float]:
    """Returns the likelihood term of a hit in each cell (rows, columns), and of a hit off the map.

    The term is the cube of z_hit exp(-d^2 / (2 sigma^2)) + z_rand / range_max, with d m the
    distance of the cell's centre from that of the nearest occupied cell, at most
    laser_likelihood_max_dist.
    """
    # Imported late: it takes a while, and only AMCL needs it.
    from scipy.ndimage import distance_transform_edt

    farthest = amcl.laser_likelihood_max_dist
    is_free = ~grid.is_occupied
    distances = np.full(is_free.shape, farthest)
    if not is_free.all():
        distances = np.minimum(grid.resolution * distance_transform_edt(is_free), farthest)
    random = amcl.z_rand / range_max
    sigma = amcl.sigma_hit

    def added(distance: Array) -> Array:
        return (amcl.z_hit * np.exp(-(distance**2) / (2.0 * sigma * sigma)) + random) ** 3

    return added(distances), float(added(np.array(farthest)))


def _range_limits(amcl: AmclSettings, lidar: LidarSettings) -> tuple[float, float]:
    """Returns the ranges between which a hit counts, m."""
    least, most = lidar.range_min_m, lidar.range_max_m
    if amcl.laser_min_range > 0.0:
        least = max(least, amcl.laser_min_range)
    if amcl.laser_max_range > 0.0:
        most = min(most, amcl.laser_max_range)
    return least, most


def _generator(seed: int, update: int) -> np.random.Generator:
    """Returns the source of one update's random numbers; 0: the first particles'."""
    return NoiseKey(seed, NoiseStream.PARTICLES, update).generator()
