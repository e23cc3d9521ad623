"""The sonars and infrared sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context

from drake_navbench.inputs.floors import FloorSight
from drake_navbench.inputs.range_sensor import RangeSensorSettings
from drake_navbench.inputs.world import World
from drake_navbench.kernels.depth_casting import cast_cone
from drake_navbench.kernels.noise import NoiseKey, NoiseStream
from drake_navbench.kernels.poses import compose
from drake_navbench.kernels.read_only import read_only
from drake_navbench.navigation.costmaps.range_reading import RangeReading
from drake_navbench.trial.systems.floor_aware import FloorClock
from drake_navbench.trial.systems.ports import value_or_none
from drake_navbench.trial.systems.shape_sensors import ShapeSensors

# The noise's key is the sensor's place among the sensors times this, plus the reading's number.
READINGS_A_SENSOR = 1 << 24


class RangeSensors(ShapeSensors):
    """Sonars and infrared sensors, which measure one distance each.

    Inputs as of ShapeSensors. Output `ranges`: by the sensor's name the readings of the last
    `keep_s`, the oldest first; where the collision monitor takes none of these, the newest one that
    it takes comes before them. Abstract parameter 0 is the trial's seed.

    keep_s: the longest period of a system that reads every reading. floors, floor_clock: the
    surroundings seen on each floor of a mission, and the instants of change; both or neither.
    """

    def __init__(
        self,
        sensors: Mapping[str, RangeSensorSettings],
        world: World,
        *,
        keep_s: float,
        floors: Sequence[FloorSight] = (),
        floor_clock: FloorClock | None = None,
    ) -> None:
        periods_s = ((name, settings.period_s) for name, settings in sensors.items())
        super().__init__(periods_s, output="ranges", floor_clock=floor_clock)
        self._sensors = sensors
        self._keep_s = keep_s
        self._solids = {name: _met_by(settings, world).solids for name, settings in sensors.items()}
        self._floors = {
            name: [(_met_by(settings, sight.world).solids, sight.bounds) for sight in floors]
            for name, settings in sensors.items()
        }
        self.seed_parameter = self.DeclareAbstractParameter(AbstractValue.Make(0))

    def _look(
        self, name: str, context: Context, before: tuple[RangeReading, ...] | None
    ) -> tuple[RangeReading, ...]:
        oldest_s = context.get_time() - self._keep_s
        kept = [one for one in before or () if one.time_s >= oldest_s]
        kept.append(self._reading(name, context))
        if not any(one.is_taken for one in kept):
            kept = [one for one in before or () if one.is_taken][-1:] + kept
        return tuple(kept)

    def _reading(self, name: str, context: Context) -> RangeReading:
        settings = self._sensors[name]
        base_pose = self._state_port.Eval(context)[:3]
        odometry = value_or_none(self._odometry_port, context)
        pose = compose(base_pose, settings.pose)
        distance_m = float(
            cast_cone(
                np.array([pose[0], pose[1], settings.height_m]),
                pose[2] + settings.ray_angles,
                np.zeros((settings.ray_count, 1)),
                self._in_sight(self._solids[name], self._floors[name], context),
            ).min()
        )
        if settings.range_std_m > 0.0:
            distance_m += settings.range_std_m * self._noise(name, context)
        # In the single precision of ROS's message.
        range_m, least_m, longest_m, field_of_view_rad = np.array(
            [
                settings.reported_range_m(distance_m),
                settings.range_min_m,
                settings.range_max_m,
                settings.field_of_view_rad,
            ],
            dtype=np.float32,
        ).tolist()
        return RangeReading(
            context.get_time(),
            read_only(pose),
            range_m,
            least_m,
            longest_m,
            field_of_view_rad,
            None if odometry is None else compose(odometry[:3], settings.pose),
        )

    def _noise(self, name: str, context: Context) -> float:
        """Returns a standard normal number for this reading of a sensor."""
        seed = context.get_abstract_parameter(self.seed_parameter).get_value()
        index = list(self._sensors).index(name)
        count = round(context.get_time() / self._sensors[name].period_s)
        key = NoiseKey(seed, NoiseStream.RANGE_SENSORS, index * READINGS_A_SENSOR + count)
        return float(key.generator().standard_normal())


def _met_by(settings: RangeSensorSettings, world: World) -> World:
    """Returns the part of a world that a sensor's radiation can meet."""
    return world if settings.radiation == "ultrasound" else world.opaque
