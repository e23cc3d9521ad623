"""The scanner sees walls where they are."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.timeline import Timeline
from drake_navbench.inputs.timing import TimingSettings
from drake_navbench.inputs.world import Box, Cylinder, World
from drake_navbench.kernels.scan import Scan
from drake_navbench.trial.systems.lidar import Lidar
from drake_navbench.trial.systems.ports import read_object

WALL_AHEAD = World((Box(type="box", min=(3.0, -5.0), max=(3.2, 5.0)),))


def scan_from(base_pose, world=WALL_AHEAD, seed=0, **settings) -> Scan:
    """Returns the first scan of a robot standing at a pose."""
    lidar = Lidar(Timeline.constant(LidarSettings(**{"beam_count": 8} | settings)), world)
    context = lidar.CreateDefaultContext()
    lidar.GetInputPort("state").FixValue(context, [*base_pose, 0.0, 0.0, 0.0])
    context.get_mutable_abstract_parameter(lidar.seed_parameter).set_value(seed)
    simulator = Simulator(lidar, context)
    simulator.Initialize()
    simulator.AdvancePendingEvents()
    return read_object(lidar.GetOutputPort("scan"), simulator.get_context())


def beam(scan: Scan, angle: float) -> float:
    """Returns the range of the beam nearest to an angle."""
    return float(scan.ranges_m[np.argmin(np.abs(scan.angles_rad - angle))])


def test_the_beam_ahead_measures_the_distance_to_the_wall():
    scan = scan_from((1.0, 0.0, 0.0))
    assert beam(scan, 0.0) == pytest.approx(2.0)
    # A beam at 45 degrees goes sqrt(2) as far.
    assert beam(scan, np.pi / 4) == pytest.approx(2.0 * np.sqrt(2.0))


def test_a_scan_cannot_be_changed():
    scan = scan_from((1.0, 0.0, 0.0))
    for array in (scan.sensor_pose, scan.angles_rad, scan.ranges_m):
        assert not array.flags.writeable


def test_nothing_behind_is_plus_infinity():
    assert beam(scan_from((1.0, 0.0, 0.0)), -np.pi) == np.inf


def test_a_wall_beyond_the_longest_range_is_not_seen():
    assert beam(scan_from((1.0, 0.0, 0.0), range_max_m=1.5), 0.0) == np.inf


def test_a_wall_nearer_than_the_least_range_is_minus_infinity():
    assert beam(scan_from((2.99, 0.0, 0.0), range_min_m=0.05), 0.0) == -np.inf


def test_a_mount_ahead_of_the_axle_shortens_the_range():
    scan = scan_from((1.0, 0.0, 0.0), pose=(0.4, 0.0, 0.0))
    assert beam(scan, 0.0) == pytest.approx(1.6)
    np.testing.assert_allclose(scan.sensor_pose, [1.4, 0.0, 0.0])


def test_turning_robot_and_world_together_changes_nothing():
    east = scan_from((1.0, 0.5, 0.3))
    north_wall = World((Box(type="box", min=(-5.0, 3.0), max=(5.0, 3.2)),))
    north = scan_from((-0.5, 1.0, 0.3 + np.pi / 2), north_wall)
    np.testing.assert_allclose(north.ranges_m, east.ranges_m, rtol=1e-6)


def test_hits_lie_on_the_cylinder():
    world = World((Cylinder(type="cylinder", centre=(2.0, 0.0), radius_m=0.5),))
    hits = scan_from((0.0, 0.0, 0.0), world, beam_count=360).hits
    assert len(hits) > 10
    np.testing.assert_allclose(np.hypot(hits[:, 0] - 2.0, hits[:, 1]), 0.5, atol=1e-6)


def test_noise_has_the_asked_spread_and_depends_on_the_seed():
    noisy = scan_from((1.0, 0.0, 0.0), beam_count=2000, range_std_m=0.02, seed=1)
    exact = scan_from((1.0, 0.0, 0.0), beam_count=2000)
    seen = np.isfinite(exact.ranges_m)
    assert np.std(noisy.ranges_m[seen] - exact.ranges_m[seen]) == pytest.approx(0.02, rel=0.1)
    again = scan_from((1.0, 0.0, 0.0), beam_count=2000, range_std_m=0.02, seed=1)
    np.testing.assert_array_equal(noisy.ranges_m, again.ranges_m)
    other = scan_from((1.0, 0.0, 0.0), beam_count=2000, range_std_m=0.02, seed=2)
    assert not np.array_equal(noisy.ranges_m, other.ranges_m)


def test_a_beam_that_drops_out_is_not_a_number():
    scan = scan_from((1.0, 0.0, 0.0), beam_count=2000, dropout_probability=0.25)
    assert np.mean(np.isnan(scan.ranges_m)) == pytest.approx(0.25, abs=0.04)


BETWEEN_WALLS = World(
    (
        Box(type="box", min=(2.0, -9.0), max=(2.1, 9.0)),
        Box(type="box", min=(-3.1, -9.0), max=(-3.0, 9.0)),
    )
)


def test_a_second_scanner_sees_at_the_same_time_from_its_own_place():
    mounted = {"pose": (0.4, 0.0, 0.0), "further_poses": ((-0.4, 0.0, np.pi),)}
    scan = scan_from((0.0, 0.0, 0.0), BETWEEN_WALLS, **mounted)
    (rear,) = scan.further
    assert rear.time_s == scan.time_s
    assert beam(scan, 0.0) == pytest.approx(1.6)
    assert beam(rear, 0.0) == pytest.approx(2.6)
    assert scan.of_all_scanners == (scan, rear)


def test_a_second_scanner_leaves_the_noise_of_the_first_as_it_is():
    alone = scan_from((0.0, 0.0, 0.0), range_std_m=0.05)
    both = scan_from((0.0, 0.0, 0.0), range_std_m=0.05, further_poses=((0.0, 0.0, 0.0),))
    np.testing.assert_array_equal(alone.ranges_m, both.ranges_m)
    assert np.any(both.further[0].ranges_m != both.ranges_m)


def test_beams_pass_through_glass_and_over_what_is_low():
    near = {"type": "box", "min": (2.0, -5.0), "max": (2.1, 5.0)}
    far = Box(type="box", min=(3.0, -5.0), max=(3.2, 5.0))
    for hidden in ({"material": "glass"}, {"height_m": 0.15}):
        world = World((Box(**near, **hidden), far))
        assert beam(scan_from((0.0, 0.0, 0.0), world), 0.0) == pytest.approx(3.0)
        # It stands there all the same.
        assert world.segments.shape == (8, 4)
    low = World((Box(**near, height_m=0.15), far))
    assert beam(scan_from((0.0, 0.0, 0.0), low, height_m=0.1), 0.0) == pytest.approx(2.0)


def test_a_bias_is_added_to_what_is_hit_and_to_nothing_else():
    scan = scan_from((1.0, 0.0, 0.0), range_bias_m=0.25)
    assert beam(scan, 0.0) == pytest.approx(2.25)
    assert beam(scan, -np.pi) == np.inf


def test_stuck_beams_tell_the_same_whatever_is_there():
    settings = {"beam_count": 90, "stuck_beam_share": 0.3}
    here, there = (scan_from(pose, **settings).ranges_m for pose in ((1, 0, 0), (0, 1, 2)))
    plain = scan_from((1, 0, 0), beam_count=90).ranges_m
    stuck = here != plain
    assert 10 < stuck.sum() < 45
    np.testing.assert_array_equal(here[stuck], there[stuck])


def scans_of(times_s, *, seed=0, timing=None, **settings):
    """Returns what a robot's lidar shows at some times; the robot stands."""
    timing = Timeline.constant(TimingSettings(**timing or {}))
    lidar = Lidar(Timeline.constant(LidarSettings(beam_count=8, **settings)), WALL_AHEAD, timing)
    simulator = Simulator(lidar)
    context = simulator.get_mutable_context()
    lidar.GetInputPort("state").FixValue(context, np.zeros(6))
    context.get_mutable_abstract_parameter(lidar.seed_parameter).set_value(seed)
    shown = []
    for time_s in times_s:
        simulator.AdvanceTo(time_s)
        shown.append(read_object(lidar.GetOutputPort("scan"), context))
    return shown


def test_a_late_scan_keeps_its_stamp():
    first, early, late = scans_of([0.01, 0.25, 0.31], timing={"scan_latency_s": 0.2})
    # The robot has stood there before, so its first scan is there at once.
    assert (first.time_s, early.time_s) == (0.0, 0.0)
    assert late.time_s == pytest.approx(0.1)


def test_lost_scans_leave_the_one_before():
    stamps = [
        scan and scan.time_s
        for scan in scans_of(np.arange(0.05, 40.0, 0.1), scan_loss_probability=0.6)
    ]
    new = np.diff([stamp for stamp in stamps if stamp is not None]) > 0.0
    # Of 400 scans, to within three standard deviations.
    assert new.mean() == pytest.approx(0.4, abs=0.075)


@pytest.mark.parametrize("span_rad", [6.2832, 6.28319, 6.283185, 2.0 * np.pi])
def test_a_rounded_turn_is_a_whole_one(span_rad):
    """The last of 4 beams lies a quarter of a turn before the first."""
    angles = LidarSettings(beam_count=4, angle_span_rad=span_rad).beam_angles
    np.testing.assert_array_equal(angles, [-np.pi, -0.5 * np.pi, 0.0, 0.5 * np.pi])
    nearly = LidarSettings(beam_count=4, angle_span_rad=6.28).beam_angles
    assert nearly[-1] == pytest.approx(6.28 - np.pi)
