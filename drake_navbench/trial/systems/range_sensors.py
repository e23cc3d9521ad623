"""The sonars and infrared sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, State

from drake_navbench.inputs.floors import FloorSight
from drake_navbench.inputs.range_sensor import RangeSensorSettings
from drake_navbench.inputs.world import World
from drake_navbench.kernels.depth_casting import Solids, cast_cone
from drake_navbench.kernels.noise import NoiseKey, NoiseStream
from drake_navbench.kernels.poses import compose
from drake_navbench.kernels.read_only import read_only
from drake_navbench.navigation.costmaps.range_reading import RangeReading
from drake_navbench.navigation.mission import FloorSwitch
from drake_navbench.trial.systems.floor_aware import FloorAware, FloorClock
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import STATE_SIZE, declare_object_input, value_or_none

Readings = Mapping[str, tuple[RangeReading, ...]]

# The noise's key is the sensor's place among the sensors times this, plus the reading's number.
READINGS_A_SENSOR = 1 << 24


class RangeSensors(FloorAware):
    """Measures one distance by each sensor once in its period, the first time at t = 0.

    Input `state` [x m, y m, yaw rad, ...] of the base, world frame; `odometry`, the same by the
    odometry (not connected: equal to `state`); `moving` (Solids of moving bodies; need not be
    connected). Output `ranges`: by the sensor's name the readings of the last `keep_s`, the oldest
    first; empty before the first reading. Abstract parameter 0 is the trial's seed.

    keep_s: the longest period of a system that reads every reading. floors: the surroundings seen
    on each floor of a mission; with them comes floor_clock. Readings of one floor are forgotten on
    the next.
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
        super().__init__()
        self._sensors = sensors
        self._keep_s = keep_s
        self._solids = {name: _met_by(settings, world).solids for name, settings in sensors.items()}
        self._floors = [
            (
                {name: _met_by(settings, sight.world).solids for name, settings in sensors.items()},
                sight.bounds,
            )
            for sight in floors
        ]
        if floor_clock is not None:
            self._declare_floors(floor_clock)
        self.seed_parameter = self.DeclareAbstractParameter(AbstractValue.Make(0))
        none: Readings = {}
        self._readings = self.DeclareAbstractState(AbstractValue.Make(none))
        self._state_port = self.DeclareVectorInputPort("state", STATE_SIZE)
        self._odometry_port = self.DeclareVectorInputPort("odometry", STATE_SIZE)
        self._moving_port = declare_object_input(self, "moving")
        self.DeclareStateOutputPort("ranges", self._readings)
        measure = weakly_bound(self._on_measure)
        for name, settings in sensors.items():
            self.DeclarePeriodicUnrestrictedUpdateEvent(
                settings.period_s, 0.0, partial(measure, name)
            )

    def _on_measure(self, name: str, context: Context, state: State) -> None:
        readings = state.get_mutable_abstract_state(self._readings)
        before: Readings = readings.get_value()
        oldest_s = context.get_time() - self._keep_s
        kept = (one for one in before.get(name, ()) if one.time_s >= oldest_s)
        readings.set_value({**before, name: (*kept, self._reading(name, context))})

    def _on_floor(self, context: Context, state: State, switch: FloorSwitch) -> None:
        none: Readings = {}
        state.get_mutable_abstract_state(self._readings).set_value(none)

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
                self._in_sight(name, context),
            ).min()
        )
        if settings.range_std_m > 0.0:
            distance_m += settings.range_std_m * self._noise(name, context)
        # In the single precision of ROS's message.
        range_m, least_m, longest_m, field_of_view_rad = np.array(
            [
                settings.told_of(distance_m),
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

    def _in_sight(self, name: str, context: Context) -> Solids:
        """Returns the solids that a sensor can meet, those of the robot's storey."""
        solids = self._solids[name]
        moving = value_or_none(self._moving_port, context)
        if self._floors:
            by_sensor, bounds = self._floors[self._floor(context)]
            solids = by_sensor[name]
            moving = None if moving is None else moving.within(bounds)
        return solids if moving is None else solids.joined(moving)

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
