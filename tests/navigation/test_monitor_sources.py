"""What the collision monitor makes of scans and of sonars, by hand-computed numbers."""

import math

import numpy as np
import pytest

from drake_navbench.kernels.scan import Scan
from drake_navbench.navigation.costmaps.range_reading import RangeReading
from drake_navbench.navigation.monitor_sources import (
    MonitorReadings,
    MonitorSource,
    Mountings,
    arc_points,
    points_of,
)
from drake_navbench.plugins.releases import Release

MOUNTINGS = Mountings((0.0, 0.0, 0.0), {"sonar": (0.5, 0.0, 0.0)})
SCAN = Scan(0.0, np.zeros(3), np.array([0.0]), np.array([4.0], np.float32))


def reading(range_m=2.0, fov_rad=0.5, time_s=0.0):
    return RangeReading(time_s, np.array([0.5, 0.0, 0.0]), range_m, 0.1, 3.0, fov_rad)


def joined(*args, **options):
    """Returns the points (N, 2) of all sources as one array; None where one stops the robot."""
    found = points_of(*args, **options)
    return None if found is None else np.vstack([np.empty((0, 2)), *found.values()])


def looked_at(*, time_s=0.0, base_pose=(0.0, 0.0, 0.0), one=None, scan=SCAN, **sources):
    sources = {name: MonitorSource(**fields) for name, fields in sources.items()}
    base = None if base_pose is None else np.array(base_pose)
    ranges = {} if one is None else {"sonar": [one]}
    return joined(sources, 1.0, MOUNTINGS, MonitorReadings(time_s, base, scan, ranges))


def test_a_reading_is_an_arc_of_points_at_its_range():
    # 0.5 rad in steps of 0.2: -0.25, -0.05, 0.15, and the left end, 0.25.
    points = arc_points(reading(), 0.2)
    angles = np.array([-0.25, -0.05, 0.15, 0.25])
    expected = np.column_stack([0.5 + 2.0 * np.cos(angles), 2.0 * np.sin(angles)])
    np.testing.assert_allclose(points, expected, atol=1e-6)


@pytest.mark.parametrize("range_m", [0.05, 3.5, math.inf, -math.inf])
def test_what_a_sensor_cannot_measure_is_no_arc(range_m):
    assert arc_points(reading(range_m), 0.2) is None


def test_more_points_than_ten_thousand_are_none():
    assert arc_points(reading(), 0.5 / 9998.5) is not None
    assert arc_points(reading(), 0.5 / 9999.5) is None


def test_points_of_all_sources_lie_in_the_frame_of_the_base():
    # The robot has moved on by 1 m since: the scan's hit is 3 m ahead, the sonar's at 1.5 m.
    sources = {"lidar": {}, "sonar": {"type": "range", "obstacles_angle": 1.0}}
    points = looked_at(one=reading(fov_rad=1e-6), base_pose=(1.0, 0.0, 0.0), **sources)
    np.testing.assert_allclose(points[0], [3.0, 0.0])
    np.testing.assert_allclose(points[1:], [[1.5, 0.0]] * 2, atol=1e-5)
    # Without that they lie where the mounting puts them.
    points = looked_at(one=reading(fov_rad=1e-6), base_pose=None, **sources)
    np.testing.assert_allclose(points[0], [4.0, 0.0])
    np.testing.assert_allclose(points[1:], [[2.5, 0.0]] * 2, atol=1e-5)


def test_a_source_that_is_not_listed_or_not_enabled_is_not_looked_at():
    assert len(looked_at(one=reading(), lidar={})) == 1
    off = {"type": "range", "enabled": False}
    assert len(looked_at(one=reading(), lidar={}, sonar=off)) == 1


@pytest.mark.parametrize("one", [None, reading(math.inf), reading(time_s=-1.5)])
def test_a_sonar_without_a_range_stops_the_robot_unless_its_timeout_is_0(one):
    sonar = {"type": "range"}
    assert looked_at(one=one, lidar={}, sonar=sonar) is None
    patient = looked_at(one=one, lidar={}, sonar={**sonar, "source_timeout": 0.0})
    # Without a timeout what is old counts on.
    is_old = one is not None and one.time_s < 0.0
    assert len(patient) > 1 if is_old else len(patient) == 1


def test_a_missing_scan_stops_the_robot_unless_the_timeout_is_0():
    assert looked_at(scan=None, lidar={}) is None
    assert looked_at(scan=None, lidar={"source_timeout": 0.0}).shape == (0, 2)
    assert looked_at(time_s=1.5, lidar={}) is None


def test_lyrical_drops_a_range_that_is_not_finite_and_keeps_the_one_before():
    sensed = MonitorReadings(
        0.5, np.zeros(3), SCAN, {"sonar": [reading(fov_rad=1e-6), reading(math.inf, time_s=0.5)]}
    )
    sources = {"sonar": MonitorSource(type="range")}
    assert joined(sources, 1.0, MOUNTINGS, sensed, release=Release.KILTED) is None
    assert len(joined(sources, 1.0, MOUNTINGS, sensed, release=Release.LYRICAL)) == 2
    assert joined(sources, 0.4, MOUNTINGS, sensed, release=Release.LYRICAL) is None


def left_out(*, time_s=0.0, one=None, scan=SCAN, timeout_s=1.0):
    """Returns the points of a scan and a sonar by the rules of Humble and Iron."""
    sources = {"lidar": MonitorSource(), "sonar": MonitorSource(type="range")}
    sensed = MonitorReadings(time_s, np.zeros(3), scan, {"sonar": [one] if one else []})
    return joined(sources, timeout_s, MOUNTINGS, sensed, release=Release.IRON)


def test_up_to_iron_a_source_without_current_data_is_left_out():
    assert len(left_out()) == 1
    assert len(left_out(scan=None, one=reading(fov_rad=1e-6))) == 2
    assert left_out(time_s=1.5).shape == (0, 2)
    # There 0 is an age like any other.
    assert left_out(time_s=0.1, timeout_s=0.0).shape == (0, 2)
    assert len(left_out(timeout_s=0.0)) == 1


def test_ages_are_compared_in_whole_nanoseconds():
    # 1.1 - 1.0 is more than 0.1 in floating point.
    scan = Scan(1.0, np.zeros(3), np.array([0.0]), np.array([4.0], np.float32))
    lidar = {"source_timeout": 0.1}
    assert len(looked_at(time_s=1.1, scan=scan, lidar=lidar)) == 1
    assert looked_at(time_s=1.100000001, scan=scan, lidar=lidar) is None
