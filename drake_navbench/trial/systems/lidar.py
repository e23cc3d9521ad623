"""The planar scanner."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, State

from drake_navbench.inputs.floors import FloorSight
from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.timeline import Timeline
from drake_navbench.inputs.timing import TimingSettings
from drake_navbench.inputs.world import World
from drake_navbench.kernels.depth_casting import are_within
from drake_navbench.kernels.noise import NoiseKey, NoiseStream
from drake_navbench.kernels.poses import compose
from drake_navbench.kernels.ray_casting import (
    burst_dropouts,
    cast_rays,
    reported_ranges,
    stuck_ranges,
)
from drake_navbench.kernels.read_only import read_only
from drake_navbench.kernels.scan import Scan
from drake_navbench.navigation.mission import FloorSwitch
from drake_navbench.trial.systems.floor_aware import FloorAware, FloorClock
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.mailbox import Mailbox
from drake_navbench.trial.systems.ports import (
    NOTHING,
    STATE_SIZE,
    declare_object_input,
    declare_object_output,
    value_or_none,
)

# The nominal first scan has no pose yet; consumers see None until then.
NO_SCAN = NOTHING


class Lidar(FloorAware):
    """Scans the true world once a period, the first time at t = 0, by one scanner or several.

    Input `state` [x m, y m, yaw rad, ...] of the base, world frame; `odometry`, the same by the
    odometry (not connected: equal to `state`). Input `moving` (edges (E, 4) and circles (D, 3) of
    moving bodies, m; need not be connected). Output `scan`: the last `Scan`, or None before the
    first. Abstract parameter 0 holds the world as (segments, circles), so that a test can take a
    thing away; parameter 1 the trial's seed. Special ranges follow REP 117: +inf where nothing lies
    within range, -inf nearer than the least range, NaN where a beam dropped out.

    Bodies lower than the scanned plane, or of glass, are not seen. After a lost scan the last one
    stays. With a latency the output is the newest scan that has arrived.

    floors, floor_clock: the surroundings seen on each floor of a mission, and the instants of
    change; both or neither. Scans of one floor are forgotten on the next.
    """

    def __init__(
        self,
        settings: Timeline[LidarSettings],
        world: World,
        timing: Timeline[TimingSettings] | None = None,
        *,
        floors: Sequence[FloorSight] = (),
        floor_clock: FloorClock | None = None,
    ) -> None:
        super().__init__()
        self._settings = settings
        self._timing = timing or Timeline.constant(TimingSettings())
        first = settings.at(0.0)
        self._period_s = first.period_s
        self._mountings = (first.pose, *first.further_poses)
        self._angles = read_only(first.beam_angles)
        seen = world.visible_from(first.height_m)
        self._floors = [
            (sight.world.visible_from(first.height_m), sight.bounds) for sight in floors
        ]
        if floor_clock is not None:
            self._declare_floors(floor_clock)
        self.world_parameter = self.DeclareAbstractParameter(
            AbstractValue.Make((seen.segments, seen.circles))
        )
        self.seed_parameter = self.DeclareAbstractParameter(AbstractValue.Make(0))
        self._scan = self.DeclareAbstractState(AbstractValue.Make(NO_SCAN))
        self._state_port = self.DeclareVectorInputPort("state", STATE_SIZE)
        self._odometry_port = self.DeclareVectorInputPort("odometry", STATE_SIZE)
        self._moving_port = declare_object_input(self, "moving")
        self._is_late = self._timing.any(lambda at_a_time: at_a_time.delays_scans)
        if self._is_late:
            self._coming = self.DeclareAbstractState(AbstractValue.Make(Mailbox()))
            declare_object_output(
                self,
                "scan",
                self._calc_arrived,
                {self.time_ticket(), self.abstract_state_ticket(self._coming)},
            )
        else:
            self.DeclareStateOutputPort("scan", self._scan)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            self._period_s, 0.0, weakly_bound(self._on_scan)
        )

    def _on_scan(self, context: Context, state: State) -> None:
        now_s = context.get_time()
        settings = self._settings.at(now_s)
        if settings.scan_loss_probability > 0.0:
            drawn = self._generator(context, NoiseStream.SCAN_LOSS).random()
            if drawn < settings.scan_loss_probability:
                return
        base_pose = self._state_port.Eval(context)[:3]
        odometry = value_or_none(self._odometry_port, context)
        noise = None
        if settings.range_std_m > 0.0 or settings.dropout_probability > 0.0:
            noise = self._generator(context, NoiseStream.LIDAR)
        # Scanners draw in a fixed order, so that a further one leaves the first one's noise as it
        # is.
        first, *further = (
            self._scan_from(context, settings, index, base_pose, odometry, noise)
            for index in range(len(self._mountings))
        )
        scan = replace(first, further=tuple(further)) if further else first
        state.get_mutable_abstract_state(self._scan).set_value(scan)
        if self._is_late:
            before: Mailbox = context.get_abstract_state(self._coming).get_value()
            # The robot stood there and scanned before the start: the first scan has arrived
            # already.
            due_s = self._due_s(context) if before.messages else now_s
            after = before.with_message(scan, due_s, now_s)
            state.get_mutable_abstract_state(self._coming).set_value(after)

    def _scan_from(
        self,
        context: Context,
        settings: LidarSettings,
        index: int,
        base_pose: NDArray[np.float64],
        odometry: NDArray[np.float64] | None,
        noise: np.random.Generator | None,
    ) -> Scan:
        """Returns the scan of the scanner number `index`."""
        mounting = self._mountings[index]
        sensor_pose = compose(base_pose, mounting)
        odometry_pose = None if odometry is None else compose(odometry[:3], mounting)
        segments, circles = self._outlines(context)
        ranges = cast_rays(
            sensor_pose[:2],
            sensor_pose[2] + self._angles,
            segments,
            circles,
            settings.range_max_m,
        )
        if settings.range_bias_m != 0.0:
            ranges += settings.range_bias_m
        if noise is not None:
            ranges += settings.range_std_m * noise.standard_normal(ranges.size)
            uniform, share = noise.random(ranges.size), settings.dropout_probability
            if settings.dropout_burst_beams == 1:
                ranges[uniform < share] = np.nan
            else:
                ranges[burst_dropouts(uniform, share, settings.dropout_burst_beams)] = np.nan
        if settings.stuck_beam_share > 0.0:
            seed = context.get_abstract_parameter(self.seed_parameter).get_value()
            generator = NoiseKey(seed, NoiseStream.STUCK_BEAMS, index).generator()
            stuck = stuck_ranges(
                generator, ranges.size, settings.stuck_beam_share, settings.range_max_m
            )
            ranges = np.where(np.isnan(stuck), ranges, stuck)
        ranges_m = reported_ranges(ranges, settings.range_min_m, settings.range_max_m)
        ranges_m.flags.writeable = False
        return Scan(
            context.get_time(),
            read_only(sensor_pose),
            self._angles,
            ranges_m,
            odometry_pose=odometry_pose,
        )

    def _outlines(self, context: Context) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Returns the edges and circles of all bodies, or of those on the robot's floor."""
        if self._floors:
            return self._outlines_on_floor(context)
        segments, circles = context.get_abstract_parameter(self.world_parameter).get_value()
        moving = value_or_none(self._moving_port, context)
        if moving is None:
            return segments, circles
        return np.vstack([segments, moving[0]]), np.vstack([circles, moving[1]])

    def _outlines_on_floor(
        self, context: Context
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        seen, bounds = self._floors[self._floor(context)]
        moving = value_or_none(self._moving_port, context)
        if moving is None:
            return seen.segments, seen.circles
        edges, circles = (part[are_within(part[:, :2], bounds)] for part in moving)
        return np.vstack([seen.segments, edges]), np.vstack([seen.circles, circles])

    def _on_floor(self, context: Context, state: State, switch: FloorSwitch) -> None:
        state.get_mutable_abstract_state(self._scan).set_value(NO_SCAN)
        if self._is_late:
            state.get_mutable_abstract_state(self._coming).set_value(Mailbox())

    def _generator(self, context: Context, stream: NoiseStream) -> np.random.Generator:
        """Returns the source of a scan's noise."""
        seed = context.get_abstract_parameter(self.seed_parameter).get_value()
        step = round(context.get_time() / self._period_s)
        return NoiseKey(seed, stream, step).generator()

    def _due_s(self, context: Context) -> float:
        """Returns the time at which the scan of this instant arrives, s."""
        now_s = context.get_time()
        timing = self._timing.at(now_s)
        jitter = self._generator(context, NoiseStream.SCAN_DELAY).random()
        return now_s + timing.scan_latency_s + timing.scan_jitter_s * jitter

    def _calc_arrived(self, context: Context) -> Scan | None:
        coming: Mailbox = context.get_abstract_state(self._coming).get_value()
        arrived = coming.newest(context.get_time())
        return None if arrived is None else arrived[1]
