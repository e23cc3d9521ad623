"""The planar scanner."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.world import World
from drake_navbench.kernels.poses import compose
from drake_navbench.kernels.ray_casting import cast_rays
from drake_navbench.kernels.read_only import read_only
from drake_navbench.log import Scan
from drake_navbench.noise import NoiseKey, NoiseStream
from drake_navbench.systems.lifetime import weakly_bound
from drake_navbench.systems.ports import STATE_SIZE, declare_object_input, value_or_none

# The nominal first scan has no pose yet; consumers see None until then.
NO_SCAN = None


class Lidar(LeafSystem):
    """Scans the true world once a period, the first time at t = 0, by one scanner or several.

    Input `state` [x m, y m, yaw rad, ...] of the base, world frame; `odometry`, likewise, where the
    odometry believes it to be (not connected: there). Input `moving` (edges (E, 4) and circles
    (D, 3) of what moves, m; need not be connected). Output `scan`: the last `Scan`, or None before
    the first. Abstract parameter 0 holds the world as (segments, circles), so that a
    test can take a thing away; parameter 1 the trial's seed. Special ranges follow REP 117: +inf
    where nothing lies within range, -inf nearer than the least range, NaN where a beam dropped out.
    """

    def __init__(self, settings: LidarSettings, world: World) -> None:
        super().__init__()
        self._settings = settings
        self._angles = read_only(settings.beam_angles)
        self.world_parameter = self.DeclareAbstractParameter(
            AbstractValue.Make((world.segments, world.circles))
        )
        self.seed_parameter = self.DeclareAbstractParameter(AbstractValue.Make(0))
        self._scan = self.DeclareAbstractState(AbstractValue.Make(NO_SCAN))
        self._state_port = self.DeclareVectorInputPort("state", STATE_SIZE)
        self._odometry_port = self.DeclareVectorInputPort("odometry", STATE_SIZE)
        self._moving_port = declare_object_input(self, "moving")
        self.DeclareStateOutputPort("scan", self._scan)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            settings.period_s, 0.0, weakly_bound(self._on_scan)
        )

    def _on_scan(self, context: Context, state: State) -> None:
        base_pose = self._state_port.Eval(context)[:3]
        odometry = value_or_none(self._odometry_port, context)
        noise = self._noise(context)
        settings = self._settings
        # In a fixed order, so that a further scanner leaves the first one's noise as it is.
        first, *further = (
            replace(
                self._scan_from(context, compose(base_pose, mounting), noise),
                odometry_pose=None if odometry is None else compose(odometry[:3], mounting),
            )
            for mounting in (settings.pose, *settings.further_poses)
        )
        scan = replace(first, further=tuple(further)) if further else first
        state.get_mutable_abstract_state(self._scan).set_value(scan)

    def _scan_from(
        self,
        context: Context,
        sensor_pose: NDArray[np.float64],
        noise: np.random.Generator | None,
    ) -> Scan:
        settings = self._settings
        segments, circles = self._outlines(context)
        ranges = cast_rays(
            sensor_pose[:2],
            sensor_pose[2] + self._angles,
            segments,
            circles,
            settings.range_max_m,
        )
        if noise is not None:
            ranges += settings.range_std_m * noise.standard_normal(ranges.size)
            ranges[noise.random(ranges.size) < settings.dropout_probability] = np.nan
        ranges[ranges < settings.range_min_m] = -np.inf
        ranges[ranges > settings.range_max_m] = np.inf
        ranges_m = ranges.astype(np.float32)
        ranges_m.flags.writeable = False
        return Scan(context.get_time(), read_only(sensor_pose), self._angles, ranges_m)

    def _outlines(self, context: Context) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Returns the edges and circles of all that is in the world."""
        segments, circles = context.get_abstract_parameter(self.world_parameter).get_value()
        moving = value_or_none(self._moving_port, context)
        if moving is None:
            return segments, circles
        return np.vstack([segments, moving[0]]), np.vstack([circles, moving[1]])

    def _noise(self, context: Context) -> np.random.Generator | None:
        """Returns the source of this scan's noise, None where there is none."""
        settings = self._settings
        if settings.range_std_m == 0.0 and settings.dropout_probability == 0.0:
            return None
        seed = context.get_abstract_parameter(self.seed_parameter).get_value()
        step = round(context.get_time() / settings.period_s)
        return NoiseKey(seed, NoiseStream.LIDAR, step).generator()
