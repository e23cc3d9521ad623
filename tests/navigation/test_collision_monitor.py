"""What the collision monitor lets through, by hand-computed numbers."""

import numpy as np
import pytest

from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import load_robot
from drake_navbench.navigation.collision_monitor import (
    INVALID_SOURCE,
    CollisionMonitor,
    MonitorState,
)
from drake_navbench.navigation.monitor_shapes import CollisionMonitorParameters
from drake_navbench.navigation.monitor_sources import points_in_base

FOOTPRINT = np.array([[0.5, 0.25], [0.5, -0.25], [-0.5, -0.25], [-0.5, 0.25]])
AHEAD = [[1.0, 0.5], [1.0, -0.5], [0.0, -0.5], [0.0, 0.5]]


def polygon(action_type, points=AHEAD, **more):
    points = {} if points is None else {"points": tuple(tuple(p) for p in points)}
    return {"type": "polygon", "action_type": action_type, "min_points": 2, **points, **more}


def monitor(**shapes):
    return CollisionMonitor(CollisionMonitorParameters(polygons=shapes), FOOTPRINT)


def cluster(x, y=0.0, count=3):
    """Returns some points close together."""
    return np.column_stack([np.full(count, x), y + 0.01 * np.arange(count)])


def let_through(watch, command, points, state=None):
    """Returns what becomes of a command [v, w] or [v, w, vy], as long as it is, and the state."""
    padded = np.array([*command, 0.0][:3])
    of_sources = points if points is None or isinstance(points, dict) else {"scan": points}
    state, output = watch.step(state or MonitorState(), padded, of_sources)
    return output[: len(command)], state


def test_without_points_the_command_passes():
    output, state = let_through(monitor(stop=polygon("stop")), [0.4, 0.1], np.empty((0, 2)))
    np.testing.assert_array_equal(output, [0.4, 0.1])
    assert (state.action, state.polygon) == ("none", "")


def test_enough_points_in_a_stop_polygon_stop():
    output, state = let_through(monitor(zone=polygon("stop")), [0.4, 0.1], cluster(0.5))
    np.testing.assert_array_equal(output, [0.0, 0.0])
    assert (state.action, state.polygon) == ("stop", "zone")


def test_too_few_points_are_noise():
    output, _ = let_through(monitor(zone=polygon("stop")), [0.4, 0.1], cluster(0.5, count=1))
    np.testing.assert_array_equal(output, [0.4, 0.1])


def test_slowdown_leaves_its_share():
    watch = monitor(zone=polygon("slowdown", slowdown_ratio=0.3))
    output, _ = let_through(watch, [0.4, -0.2], cluster(0.5))
    np.testing.assert_allclose(output, [0.12, -0.06])


def test_a_limit_keeps_both_limits_and_the_curvature():
    watch = monitor(zone=polygon("limit", linear_limit=0.3, angular_limit=0.2))
    # 0.3 / 0.5 = 0.6 for v, 0.2 / 0.8 = 0.25 for w.
    output, _ = let_through(watch, [0.5, 0.8], cluster(0.5))
    np.testing.assert_allclose(output, [0.125, 0.2])
    # Backwards the limit holds for the magnitude: 0.3 / 0.5.
    output, _ = let_through(watch, [-0.5, 0.0], cluster(0.5))
    np.testing.assert_allclose(output, [-0.3, 0.0])


def test_a_limit_that_is_kept_changes_nothing_and_is_no_action():
    output, state = let_through(monitor(zone=polygon("limit")), [0.3, 0.0], cluster(0.5))
    np.testing.assert_array_equal(output, [0.3, 0.0])
    assert state.action == "none"


def test_an_approach_slows_by_the_time_to_the_collision():
    watch = monitor(body=polygon("approach", None, time_before_collision=2.0))
    # The footprint's front at 0.5 m meets points at 0.94 m in the fifth step of 0.1 s at 1 m/s:
    # 0.4 s of 2 s.
    output, state = let_through(watch, [1.0, 0.5e-9], cluster(0.94))
    np.testing.assert_allclose(output, [0.2, 0.0], atol=1e-9)
    assert state.action == "approach"


def test_an_approach_without_a_collision_in_sight_changes_nothing():
    watch = monitor(body=polygon("approach", None))
    output, _ = let_through(watch, [0.2, 0.0], cluster(1.5))
    np.testing.assert_array_equal(output, [0.2, 0.0])


def test_the_slowest_candidate_wins_whatever_the_order():
    slow = polygon("slowdown", slowdown_ratio=0.5)
    slower = polygon("slowdown", slowdown_ratio=0.2)
    for shapes in ({"a": slow, "b": slower}, {"b": slower, "a": slow}):
        output, state = let_through(monitor(**shapes), [0.5, 0.0], cluster(0.5))
        np.testing.assert_allclose(output, [0.1, 0.0])
        assert state.polygon == "b"


def test_a_circle_is_about_the_base():
    watch = monitor(zone={"type": "circle", "action_type": "stop", "radius": 0.6, "min_points": 2})
    np.testing.assert_array_equal(let_through(watch, [0.4, 0.0], cluster(0.55))[0], [0.0, 0.0])
    np.testing.assert_array_equal(let_through(watch, [0.4, 0.0], cluster(0.65))[0], [0.4, 0.0])


def part(linear, points):
    corners = tuple(tuple(p) for p in points)
    low, high = linear
    limits = {"linear_min": low, "linear_max": high, "theta_min": -1.0, "theta_max": 1.0}
    return {"points": corners} | limits


def test_a_velocity_polygon_follows_the_command_and_keeps_the_last_shape():
    behind = [[-x, y] for x, y in AHEAD]
    watch = monitor(
        zone={
            "type": "velocity_polygon",
            "action_type": "stop",
            "min_points": 2,
            "velocity_polygons": {
                "forward": part((0.0, 1.0), AHEAD),
                "backward": part((-0.5, 0.0), behind),
            },
        }
    )
    ahead = cluster(0.5)
    output, state = let_through(watch, [0.3, 0.0], ahead)
    np.testing.assert_array_equal(output, [0.0, 0.0])
    output, state = let_through(watch, [-0.3, 0.0], ahead, state)
    np.testing.assert_array_equal(output, [-0.3, 0.0])
    # -0.8 m/s is covered by none: the one for backward motion stays.
    output, _ = let_through(watch, [-0.8, 0.0], ahead, state)
    np.testing.assert_array_equal(output, [-0.8, 0.0])


def test_a_holonomic_velocity_polygon_follows_the_direction_of_motion():
    left = [[0.5, 1.0], [0.5, 0.0], [-0.5, 0.0], [-0.5, 1.0]]
    right = [[x, -y] for x, y in left]
    # The backward sector goes across the direction straight back.
    quarter = np.pi / 4
    directions = {
        "left": (quarter, 3 * quarter, left),
        "right": (-3 * quarter, -quarter, right),
        "back": (3 * quarter, -3 * quarter, [[-x, y] for x, y in AHEAD]),
        "front": (-quarter, quarter, AHEAD),
    }
    watch = monitor(
        zone={
            "type": "velocity_polygon",
            "action_type": "stop",
            "min_points": 2,
            "holonomic": True,
            "velocity_polygons": {
                name: part((0.0, 1.0), points)
                | {"direction_start_angle": start, "direction_end_angle": end}
                for name, (start, end, points) in directions.items()
            },
        }
    )
    for name, command, points in (
        ("left", [0.0, 0.0, 0.4], cluster(0.0, 0.7)),
        ("right", [0.1, 0.0, -0.4], cluster(0.0, -0.7)),
        ("back", [-0.4, 0.0, 0.1], cluster(-0.5)),
        ("back", [-0.4, 0.0, -0.1], cluster(-0.5)),
        ("front", [0.0, 0.5, 0.0], cluster(0.5)),
    ):
        output, state = let_through(watch, command, points)
        assert state.shapes["zone"].sub_polygon == name
        np.testing.assert_array_equal(output, [0.0, 0.0, 0.0])


def test_a_limit_holds_for_the_speed_over_the_floor():
    watch = monitor(zone=polygon("limit", linear_limit=0.25))
    # hypot(0.3, 0.4) = 0.5: half of everything is left.
    output, _ = let_through(watch, [0.3, 0.1, 0.4], cluster(0.5))
    np.testing.assert_allclose(output, [0.15, 0.05, 0.2])


def test_an_approach_looks_sideways_where_the_robot_goes_sideways():
    watch = monitor(body=polygon("approach", None, time_before_collision=2.0))
    # The left side at 0.25 m meets points at 0.69 m in the fifth step of 0.1 s at 1 m/s.
    output, _ = let_through(watch, [0.0, 0.0, 1.0], cluster(0.0, 0.69, count=2))
    np.testing.assert_allclose(output, [0.0, 0.0, 0.2], atol=1e-9)


def test_consecutive_cycles_delay_the_stop_and_the_release():
    zone = polygon("stop", trigger_consecutive_points=2, release_consecutive_points=3)
    watch, state = monitor(zone=zone), MonitorState()
    stops = []
    for is_there in [1, 1, 0, 0, 0, 1]:
        points = cluster(0.5) if is_there else np.empty((0, 2))
        output, state = let_through(watch, [0.4, 0.0], points, state)
        stops.append(bool(output[0] == 0.0))
    assert stops == [False, True, True, True, False, False]


def test_a_missing_scan_stops_even_a_monitor_that_is_disabled():
    parameters = CollisionMonitorParameters(polygons={"zone": polygon("stop")}, enabled=False)
    watch = CollisionMonitor(parameters, FOOTPRINT)
    output, state = let_through(watch, [0.4, 0.0], None)
    np.testing.assert_array_equal(output, [0.0, 0.0])
    assert state.polygon == INVALID_SOURCE
    output, _ = let_through(watch, [0.4, 0.0], cluster(0.5))
    np.testing.assert_array_equal(output, [0.4, 0.0])


def test_a_shape_counts_the_points_of_its_own_sources():
    two = {"lidar": cluster(0.5, count=1), "sonar": cluster(0.6, count=1)}
    sources = {"lidar": {"type": "scan"}, "sonar": {"type": "range"}}

    def after(**shape):
        given = {"zone": polygon("stop", **shape)}
        parameters = CollisionMonitorParameters(polygons=given, observation_sources=sources)
        return let_through(CollisionMonitor(parameters, FOOTPRINT), [0.4, 0.0], two)[1].action

    # One point of each source: together as many as min_points, 2.
    assert after() == after(sources_names=["sonar", "lidar"]) == "stop"
    assert after(sources_names=["lidar"]) == after(sources_names=[]) == "none"
    assert after(sources_names=["lidar"], min_points=1) == "stop"
    with pytest.raises(ValueError, match=r"zone\.sources_names: got 'radar', expected"):
        after(sources_names=["radar"])


def test_hits_are_turned_into_the_base_frame():
    # Facing north at (1, 2), what lies at (1, 5) is 3 m ahead, what lies at (0, 2) 1 m to the left.
    seen = points_in_base(np.array([[1.0, 5.0], [0.0, 2.0]]), np.array([1.0, 2.0, np.pi / 2]))
    np.testing.assert_allclose(seen, [[3.0, 0.0], [0.0, 1.0]], atol=1e-12)


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        (
            {"type": "polygon", "points": [[0.0, 0.0], [1.0, 1.0]]},
            r"polygons\.zone\.polygon\.points: .*at least 4 items",
        ),
        ({"type": "polygon", "action_type": "stop"}, "points: missing, but required"),
        ({"type": "circle"}, r"circle\.radius: missing, but required"),
        ({"type": "circle", "radius": 1.0, "min_point": 3}, "did you mean 'min_points'"),
        ({"type": "circle", "radius": 1.0, "action_type": "halt"}, "'stop', 'slowdown'"),
    ],
)
def test_a_shape_that_makes_no_sense_is_refused_in_one_line(shape, message):
    overrides = {"navigation": {"collision_monitor": {"polygons": {"zone": shape}}}}
    with pytest.raises(InputError, match=message) as caught:
        load_robot("wheelchair", overrides)
    assert "\n" not in str(caught.value)


def by_release(release, **shapes):
    parameters = CollisionMonitorParameters(polygons=shapes, nav2_release=release)
    return CollisionMonitor(parameters, FOOTPRINT)


def test_an_approach_of_humble_stops_at_one_point_less_inside():
    zone, one = polygon("approach", points=None), cluster(0.2, count=1)
    output, _ = let_through(by_release("lyrical", zone=zone), [0.1, 0.0], one)
    np.testing.assert_array_equal(output, [0.1, 0.0])
    output, state = let_through(by_release("humble", zone=zone), [0.1, 0.0], one)
    np.testing.assert_array_equal(output, [0.0, 0.0])
    assert (state.action, state.polygon) == ("approach", "zone")
    # max_points: 0 stops the robot whatever it sees.
    output, _ = let_through(
        by_release("humble", zone={**zone, "min_points": 1}), [0.1, 0.0], np.empty((0, 2))
    )
    np.testing.assert_array_equal(output, [0.0, 0.0])


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        ([1.0, 0.25], [0.5, 0.25]),
        ([-0.25, -1.0], [-0.25, -0.5]),
        ([0.6, 0.0, 0.8], [0.3, 0.0, 0.4]),
    ],
)
def test_iron_limits_speed_and_turn_rate_separately(command, expected):
    zone = polygon("limit", linear_limit=0.5, angular_limit=0.5)
    output, state = let_through(by_release("iron", zone=zone), command, cluster(0.5))
    np.testing.assert_allclose(output, expected)
    assert state.action == "limit"


def test_in_kilted_a_holonomic_base_chooses_a_sub_polygon_by_v():
    # v = 0.3 m/s lies within the range, the speed of 0.5 m/s does not.
    slow = {"points": AHEAD, "linear_min": 0.0, "linear_max": 0.4, "theta_min": -1.0}
    zone = {
        "type": "velocity_polygon",
        "action_type": "stop",
        "min_points": 2,
        "holonomic": True,
        "velocity_polygons": {"slow": {**slow, "theta_max": 1.0}},
    }
    for release, passes in (("jazzy", True), ("kilted", False), ("lyrical", True)):
        output, _ = let_through(by_release(release, zone=zone), [0.3, 0.0, 0.4], cluster(0.5))
        assert output.any() == passes
