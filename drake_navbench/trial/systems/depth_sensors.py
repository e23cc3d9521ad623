"""The sensors that send points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, State

from drake_navbench.inputs.depth_sensor import DepthSensorSettings
from drake_navbench.inputs.floors import FloorSight
from drake_navbench.inputs.world import World
from drake_navbench.kernels.depth_casting import cast_cone
from drake_navbench.kernels.poses import carrier_pose, compose
from drake_navbench.navigation.costmaps.point_cloud import PointCloud
from drake_navbench.navigation.mission import FloorSwitch
from drake_navbench.trial.systems.floor_aware import FloorAware, FloorClock
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import STATE_SIZE, declare_object_input, value_or_none

Clouds = Mapping[str, PointCloud]


class DepthSensors(FloorAware):
    """Sees the true world by each sensor once in its period, the first time at t = 0.

    Input `state` [x m, y m, yaw rad, ...] of the base, world frame; `odometry`, the same by the
    odometry (not connected: equal to `state`); `moving` (Solids of moving bodies; need not be
    connected). Output `clouds`: the newest PointCloud of each sensor by its name, in the world
    frame; empty before the first. Glass is not seen. Abstract parameter 0 holds the world as
    Solids, so that a test can take a thing away.

    floors: the surroundings seen on each floor of a mission; with them comes floor_clock. Clouds of
    one floor are forgotten on the next.
    """

    def __init__(
        self,
        sensors: Mapping[str, DepthSensorSettings],
        world: World,
        *,
        floors: Sequence[FloorSight] = (),
        floor_clock: FloorClock | None = None,
    ) -> None:
        super().__init__()
        self._floors = [(sight.world.opaque.solids, sight.bounds) for sight in floors]
        if floor_clock is not None:
            self._declare_floors(floor_clock)
        self._sensors = sensors
        self._rays = {name: settings.rays() for name, settings in sensors.items()}
        self.world_parameter = self.DeclareAbstractParameter(
            AbstractValue.Make(world.opaque.solids)
        )
        none: Clouds = {}
        self._clouds = self.DeclareAbstractState(AbstractValue.Make(none))
        self._state_port = self.DeclareVectorInputPort("state", STATE_SIZE)
        self._odometry_port = self.DeclareVectorInputPort("odometry", STATE_SIZE)
        self._moving_port = declare_object_input(self, "moving")
        self.DeclareStateOutputPort("clouds", self._clouds)
        see = weakly_bound(self._on_look)
        for name, settings in sensors.items():
            self.DeclarePeriodicUnrestrictedUpdateEvent(settings.period_s, 0.0, partial(see, name))

    def _on_look(self, name: str, context: Context, state: State) -> None:
        clouds = state.get_mutable_abstract_state(self._clouds)
        clouds.set_value({**clouds.get_value(), name: self._cloud(name, context)})

    def _on_floor(self, context: Context, state: State, switch: FloorSwitch) -> None:
        none: Clouds = {}
        state.get_mutable_abstract_state(self._clouds).set_value(none)

    def _cloud(self, name: str, context: Context) -> PointCloud:
        settings = self._sensors[name]
        headings, slopes = self._rays[name]
        base_pose = self._state_port.Eval(context)[:3]
        odometry = value_or_none(self._odometry_port, context)
        x, y, yaw = compose(base_pose, settings.pose)
        origin = np.array([x, y, settings.height_m])
        solids = context.get_abstract_parameter(self.world_parameter).get_value()
        moving = value_or_none(self._moving_port, context)
        if self._floors:
            solids, bounds = self._floors[self._floor(context)]
            moving = None if moving is None else moving.within(bounds)
        if moving is not None:
            solids = solids.joined(moving)
        along = cast_cone(origin, yaw + headings, slopes, solids, sees_floor=settings.sees_floor)
        ranges = along * np.hypot(1.0, slopes)
        is_hit = (ranges >= settings.range_min_m) & (ranges <= settings.range_max_m)
        column, _ = np.nonzero(is_hit)
        along, heading = along[is_hit], yaw + headings[column]
        points = np.column_stack(
            [
                x + along * np.cos(heading),
                y + along * np.sin(heading),
                # Points on the floor are put at height 0, not a rounding error below.
                np.maximum(settings.height_m + along * slopes[is_hit], 0.0),
            ]
        )
        return PointCloud(
            origin,
            points,
            context.get_time(),
            yaw,
            settings.pitch_rad,
            None if odometry is None else carrier_pose(odometry[:3], base_pose),
        )
