"""The sensors that send points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context

from drake_navbench.inputs.depth_sensor import DepthSensorSettings
from drake_navbench.inputs.floors import FloorSight
from drake_navbench.inputs.world import World
from drake_navbench.kernels.depth_casting import cast_cone
from drake_navbench.kernels.poses import carrier_pose, compose
from drake_navbench.navigation.costmaps.point_cloud import PointCloud
from drake_navbench.trial.systems.floor_aware import FloorClock
from drake_navbench.trial.systems.ports import value_or_none
from drake_navbench.trial.systems.shape_sensors import ShapeSensors


class DepthSensors(ShapeSensors):
    """Depth cameras and flat lidars, which see the true world.

    Inputs as of ShapeSensors. Output `clouds`: the newest PointCloud of each sensor by its name, in
    the world frame. Glass is not seen. Abstract parameter 0 holds the world as Solids, so that a
    test can take a thing away.

    floors, floor_clock: the surroundings seen on each floor of a mission, and the instants of
    change; both or neither.
    """

    def __init__(
        self,
        sensors: Mapping[str, DepthSensorSettings],
        world: World,
        *,
        floors: Sequence[FloorSight] = (),
        floor_clock: FloorClock | None = None,
    ) -> None:
        periods_s = ((name, settings.period_s) for name, settings in sensors.items())
        super().__init__(periods_s, output="clouds", floor_clock=floor_clock)
        self._floors = [(sight.world.opaque.solids, sight.bounds) for sight in floors]
        self._sensors = sensors
        self._rays = {name: settings.rays() for name, settings in sensors.items()}
        self.world_parameter = self.DeclareAbstractParameter(
            AbstractValue.Make(world.opaque.solids)
        )

    def _look(self, name: str, context: Context, before: PointCloud | None) -> PointCloud:
        settings = self._sensors[name]
        headings, slopes = self._rays[name]
        base_pose = self._state_port.Eval(context)[:3]
        odometry = value_or_none(self._odometry_port, context)
        x, y, yaw = compose(base_pose, settings.pose)
        origin = np.array([x, y, settings.height_m])
        standing = context.get_abstract_parameter(self.world_parameter).get_value()
        solids = self._in_sight(standing, self._floors, context)
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
