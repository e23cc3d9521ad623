"""The planar scanner."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_navbench.inputs.robot import LidarSettings
from drake_navbench.inputs.world import World
from drake_navbench.kernels.poses import compose
from drake_navbench.kernels.ray_casting import cast_rays
from drake_navbench.kernels.read_only import read_only
from drake_navbench.log import Scan
from drake_navbench.noise import NoiseKey, NoiseStream
from drake_navbench.systems.lifetime import weakly_bound
from drake_navbench.systems.ports import STATE_SIZE

# The nominal first scan has no pose yet; consumers see None until then.
NO_SCAN = None


class Lidar(LeafSystem):
    """Scans the true world once a period, the first time at t = 0.

    Input `state` [x m, y m, yaw rad, ...] of the base, world frame. Output `scan`: the last `Scan`,
    or None before the first. Abstract parameter 0 holds the world as (segments, circles), so that a
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
        self.DeclareStateOutputPort("scan", self._scan)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            settings.period_s, 0.0, weakly_bound(self._on_scan)
        )

    def _on_scan(self, context: Context, state: State) -> None:
        settings = self._settings
        base = self._state_port.Eval(context)
        sensor_pose = compose(base[:3], settings.pose)
        segments, circles = context.get_abstract_parameter(self.world_parameter).get_value()
        ranges = cast_rays(
            sensor_pose[:2],
            sensor_pose[2] + self._angles,
            segments,
            circles,
            settings.range_max_m,
        )
        self._add_noise(context, ranges)
        ranges[ranges < settings.range_min_m] = -np.inf
        ranges[ranges > settings.range_max_m] = np.inf
        ranges_m = ranges.astype(np.float32)
        ranges_m.flags.writeable = False
        scan = Scan(context.get_time(), read_only(sensor_pose), self._angles, ranges_m)
        state.get_mutable_abstract_state(self._scan).set_value(scan)

    def _add_noise(self, context: Context, ranges: NDArray[np.float64]) -> None:
        settings = self._settings
        if settings.range_std_m == 0.0 and settings.dropout_probability == 0.0:
            return
        seed = context.get_abstract_parameter(self.seed_parameter).get_value()
        step = round(context.get_time() / settings.period_s)
        generator = NoiseKey(seed, NoiseStream.LIDAR, step).generator()
        ranges += settings.range_std_m * generator.standard_normal(ranges.size)
        ranges[generator.random(ranges.size) < settings.dropout_probability] = np.nan
