"""Sonars and infrared sensors tell how far the nearest thing in their cone is."""

import math

import numpy as np
import pytest
from pydantic import ValidationError
from pydrake.systems.analysis import Simulator

from drake_navbench.inputs.range_sensor import RangeSensorSettings
from drake_navbench.inputs.world import Box, World
from drake_navbench.trial.systems.range_sensors import RangeSensors

WALL = Box(type="box", min=(2.0, -5.0), max=(2.2, 5.0), height_m=1.0)
# 1 m ahead and to the left of the axis, whose lower right corner is at (1.0, 0.2).
POST = Box(type="box", min=(1.0, 0.2), max=(1.1, 0.4), height_m=1.0)
PANE = Box(type="box", min=(1.5, -5.0), max=(1.6, 5.0), height_m=1.0, material="glass")


def simulated(*obstacles, until_s=0.0, keep_s=1.0, seed=0, odometry=None, **sensors):
    """Returns the readings of sensors on a robot at the origin that faces +x."""
    settings = {name: RangeSensorSettings(**fields) for name, fields in sensors.items()}
    system = RangeSensors(settings, World(obstacles), keep_s=keep_s)
    context = system.CreateDefaultContext()
    context.get_mutable_abstract_parameter(system.seed_parameter).set_value(seed)
    system.GetInputPort("state").FixValue(context, np.zeros(6))
    if odometry is not None:
        system.GetInputPort("odometry").FixValue(context, [*odometry, 0.0, 0.0, 0.0])
    simulator = Simulator(system, context)
    simulator.Initialize()
    simulator.AdvanceTo(until_s)
    simulator.AdvancePendingEvents()
    return system.GetOutputPort("ranges").Eval(simulator.get_context())


def range_of(*obstacles, **fields):
    """Returns what one sensor tells first."""
    (reading,) = simulated(*obstacles, sonar=fields)["sonar"]
    return reading.range_m


def test_a_reading_is_the_distance_of_the_nearest_ray():
    # Straight ahead the wall is nearer than on the rays beside.
    assert range_of(WALL) == 2.0
    # 0.3 rad to the left a ray meets the post's face at 1 / cos(0.3).
    wide = {"field_of_view_rad": 0.6, "ray_count": 3}
    assert range_of(WALL, POST, **wide) == pytest.approx(1.0 / math.cos(0.3), abs=1e-6)
    # The post is outside of a narrow cone.
    assert range_of(WALL, POST, field_of_view_rad=0.2) == 2.0


def test_a_sensor_measures_from_where_it_is_mounted():
    assert range_of(WALL, pose=(0.5, 0.0, 0.0)) == 1.5
    assert range_of(WALL, pose=(0.5, 0.0, math.pi)) == 3.0


def test_ultrasound_meets_glass_and_infrared_does_not():
    assert range_of(WALL, PANE) == 1.5
    assert range_of(WALL, PANE, radiation="infrared") == 2.0


def test_what_is_lower_than_the_rays_is_not_met():
    assert range_of(WALL, height_m=1.01) == 3.0


def test_where_nothing_is_in_range_it_tells_its_longest_range_or_inf():
    assert range_of() == 3.0
    assert range_of(WALL, range_max_m=1.9, out_of_range="inf") == math.inf
    assert range_of(WALL, range_min_m=2.1) == -math.inf


def test_a_sensor_with_one_range_is_a_switch():
    switch = {"range_min_m": 2.5, "range_max_m": 2.5}
    assert range_of(WALL, **switch) == -math.inf
    assert range_of(**switch) == math.inf


def test_readings_are_kept_for_as_long_as_somebody_may_want_them():
    ranges = simulated(WALL, until_s=1.0, keep_s=0.25, fast={"period_s": 0.1}, slow={"period_s": 1})
    times = [reading.time_s for reading in ranges["fast"]]
    np.testing.assert_allclose(times, [0.8, 0.9, 1.0])
    assert [reading.time_s for reading in ranges["slow"]] == [1.0]


def test_the_newest_range_that_the_collision_monitor_takes_is_kept_until_it_takes_another():
    """The wall is out of range from 0.3 s on: then every reading is inf, which it drops."""
    sonar = RangeSensorSettings(period_s=0.1, range_max_m=1.0, out_of_range="inf")
    system = RangeSensors({"sonar": sonar}, World([WALL]), keep_s=0.25)
    context = system.CreateDefaultContext()
    kept, times = None, []
    for number, x in enumerate((1.5, 1.5, 1.5, 0.0, 0.0, 0.0, 0.0)):
        context.SetTime(0.1 * number)
        system.get_input_port(0).FixValue(context, [x, 0.0, 0.0, 0.0, 0.0, 0.0])
        kept = system._look("sonar", context, kept)
        times.append([round(one.time_s, 1) for one in kept])
    assert times[3:5] == [[0.1, 0.2, 0.3], [0.2, 0.3, 0.4]]
    assert times[5:] == [[0.2, 0.3, 0.4, 0.5], [0.2, 0.4, 0.5, 0.6]]


def test_noise_is_the_trials_own_and_each_sensors_own():
    noisy = {"range_std_m": 0.1}

    def told(seed, **more):
        ranges = simulated(WALL, until_s=0.35, seed=seed, first=noisy, **more)
        return {name: [one.range_m for one in readings] for name, readings in ranges.items()}

    alone, both, other = told(7), told(7, second=noisy), told(8)
    assert len(set(alone["first"])) == 4
    assert alone["first"] == both["first"]
    assert both["second"] != both["first"]
    assert other["first"] != alone["first"]


def test_a_reading_lies_where_the_odometry_places_it():
    (reading,) = simulated(WALL, odometry=(0.0, 1.0, math.pi / 2), sonar={"pose": (0.5, 0.0, 0.0)})[
        "sonar"
    ]
    np.testing.assert_allclose(reading.sensor_pose, [0.5, 0.0, 0.0])
    placed = reading.placed_by_odometry()
    np.testing.assert_allclose(placed.sensor_pose, [0.0, 1.5, math.pi / 2], atol=1e-12)
    assert placed.placed_by_odometry() is placed
    in_map = reading.placed_by_odometry(np.array([10.0, 0.0, math.pi]))
    np.testing.assert_allclose(in_map.sensor_pose, [10.0, -1.5, 1.5 * math.pi], atol=1e-12)


def test_a_least_range_over_the_longest_is_refused():
    with pytest.raises(ValidationError, match=r"got 4\.0, expected at most range_max_m"):
        RangeSensorSettings(range_min_m=4.0)
