"""The collision monitor by the rules of the file's release."""

from __future__ import annotations

import math

import pytest
from nav2_texts import of_each, row_of

from drake_navbench.inputs.check import Status

CORNERS = "'[[0.5, 0.4], [0.5, -0.4], [-0.5, -0.4], [-0.5, 0.4]]'"


NUMBERS = "[0.5, 0.4, 0.5, -0.4, -0.5, -0.4, -0.5, 0.4]"


ZONE = "polygons: [Z], Z: {type: %s, action_type: %s, %s}"


def test_the_collision_monitor_of_humble_has_max_points_only(read_as):
    """As many as trigger are one more; where both are given, max_points prevails."""
    both = ZONE % ("circle", "stop", "radius: 0.6, min_points: 9, max_points: 5")
    least = ZONE % ("circle", "stop", "radius: 0.6, min_points: 9")

    def points(release, text):
        setup = read_as(release, "collision_monitor", text)
        zone = setup.robot.navigation.collision_monitor.polygons["Z"]
        return zone.min_points, row_of(setup, "Z.min_points").status

    assert of_each(lambda release: points(release, both)) == 5 * [(6, Status.UNREAD)]
    assert points("humble", least) == (4, Status.UNREAD)
    assert points("iron", least) == (9, Status.USED)


@pytest.mark.parametrize(
    ("release", "kind", "action", "rest", "reason"),
    [
        ("humble", "polygon", "stop", f"points: {CORNERS}", "humble takes a list of numbers"),
        ("iron", "polygon", "stop", f"points: {CORNERS}", "iron takes a list of numbers"),
        (
            "humble",
            "circle",
            "limit",
            "radius: 1.0",
            "the action limit, which humble does not have",
        ),
        (
            "iron",
            "velocity_polygon",
            "stop",
            "radius: 1.0",
            "a velocity_polygon, which iron does not have",
        ),
        ("jazzy", "PolygonStop", "stop", "radius: 1.0", "a PolygonStop, which jazzy does not have"),
    ],
)
def test_a_collision_monitor_that_the_release_cannot_start_is_not_there(
    read_as, release, kind, action, rest, reason
):
    setup = read_as(release, "collision_monitor", ZONE % (kind, action, rest))
    assert setup.robot.navigation.collision_monitor is None
    row = row_of(setup, "polygons")
    assert row.status == Status.STAND_IN
    assert reason in row.remark


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        # More than any scan has, so that the shape never acts: 6e9 - 2**32.
        (6_000_000_000, 1_705_032_704),
        (2**32 + 7, 7),
        (2**31 - 1, 2**31 - 1),
    ],
)
def test_of_many_points_the_last_32_bits_count_as_in_nav2(read_as, given, kept):
    text = ZONE % ("circle", "stop", f"radius: 0.6, min_points: {given}")
    setup = read_as("jazzy", "collision_monitor", text)
    assert setup.robot.navigation.collision_monitor.polygons["Z"].min_points == kept
    row = row_of(setup, "Z.min_points")
    assert row.status == (Status.USED if given == kept else Status.OTHER_FORM)


@pytest.mark.parametrize("release", ["jazzy", "kilted", "lyrical"])
def test_since_jazzy_corners_are_a_text_and_a_list_is_told(read_as, release):
    def corners(points):
        text = ZONE % ("polygon", "stop", f"points: {points}")
        setup = read_as(release, "collision_monitor", text)
        zone = setup.robot.navigation.collision_monitor.polygons["Z"]
        return zone.points[0], row_of(setup, "Z.points").status

    assert corners(CORNERS) == ((0.5, 0.4), Status.USED)
    assert corners(NUMBERS) == ((0.5, 0.4), Status.OTHER_FORM)


@pytest.mark.parametrize("points", ["'[[1, 0], [0, 1], [-1, 0]]'", '"[[1, 0],\\n[0, 1]]"'])
def test_in_a_text_of_less_than_four_corners_nav2_finds_no_polygon(read_as, points):
    """What approaches is the robot then; what stops it waits for corners on a topic."""
    for action, shapes in (("stop", None), ("approach", [None])):
        setup = read_as(
            "lyrical", "collision_monitor", ZONE % ("polygon", action, f"points: {points}")
        )
        monitor = setup.robot.navigation.collision_monitor
        assert (monitor and [zone.points for zone in monitor.polygons.values()]) == shapes
    row = row_of(setup, "Z.points")
    assert (row.status, "at least 4 corners" in row.remark) == (Status.DOUBTFUL, True)


@pytest.mark.parametrize(("holonomic", "start_rad"), [("true", -0.5), ("false", -math.pi)])
def test_directions_are_read_of_a_holonomic_velocity_polygon_only(read_as, holonomic, start_rad):
    part = f"{{points: {CORNERS}, linear_min: 0.0, linear_max: 1.0, theta_min: -1.0, theta_max: 1.0"
    part += ", direction_start_angle: -0.5, direction_end_angle: 0.5}"
    more = f"holonomic: {holonomic}, velocity_polygons: [ahead], ahead: {part}"
    setup = read_as("lyrical", "collision_monitor", ZONE % ("velocity_polygon", "stop", more))
    zone = setup.robot.navigation.collision_monitor.polygons["Z"].velocity_polygons["ahead"]
    assert zone.direction_start_angle == pytest.approx(start_rad)


def test_what_approaches_in_humble_is_the_robot_whatever_its_corners(read_as):
    def points(release):
        text = ZONE % ("polygon", "approach", f"points: {NUMBERS}")
        setup = read_as(release, "collision_monitor", text)
        zone = setup.robot.navigation.collision_monitor.polygons["Z"]
        return zone.points and zone.points[0], row_of(setup, "Z.points").status

    assert points("humble") == (None, Status.UNREAD)
    assert points("iron") == ((0.5, 0.4), Status.USED)


WATCHED = (
    "observation_sources: [scan, cloud, left], scan: {type: scan}, cloud: {type: pointcloud}, "
    "left: {type: range, topic: sonar_left}, polygons: [Z], "
    "Z: {type: circle, radius: 0.6, action_type: stop, sources_names: %s}"
)


def test_a_shape_looks_at_its_own_sources_since_jazzy(read_as):
    def own(release, names):
        setup = read_as(release, "collision_monitor", WATCHED % names)
        monitor = setup.robot.navigation.collision_monitor
        zone = monitor and monitor.polygons["Z"].sources_names
        return zone, row_of(setup, "Z.sources_names").status

    # The robot has no sensor for the cloud and the range; its lidar stands for them.
    assert own("jazzy", "[cloud, scan]") == (("scan",), Status.OTHER_FORM)
    assert own("lyrical", "[scan]") == (("scan",), Status.USED)
    assert own("iron", "[scan]") == (None, Status.UNREAD)
    # Nav2's monitor refuses to start with a source that it does not have.
    assert own("kilted", "[radar]") == (None, Status.NO_MEANING)


def test_an_exclusion_zone_that_is_enabled_is_told(read_as):
    def status(release, enabled):
        text = (
            "observation_sources: [scan], scan: {type: scan, exclusion_zones: [dock]}, "
            f"dock: {{enabled: {enabled}, type: circle, radius: 0.5}}, polygons: [Z], "
            "Z: {type: circle, radius: 0.6, action_type: stop}"
        )
        return row_of(read_as(release, "collision_monitor", text), "dock").status

    assert status("lyrical", "true") == Status.STAND_IN
    assert status("lyrical", "false") == Status.NO_MEANING
    assert status("kilted", "true") == Status.UNREAD
