"""The ray caster finds exact distances to segments and circles."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_navbench.kernels.ray_casting import cast_rays, reported_ranges

NO_SEGMENTS = np.empty((0, 4))
NO_CIRCLES = np.empty((0, 3))
UNIT_SQUARE = np.array(
    [[-1, -1, 1, -1], [1, -1, 1, 1], [1, 1, -1, 1], [-1, 1, -1, -1]], dtype=float
)

coordinates = st.floats(-5.0, 5.0)


def cast(origin, angles, *, segments=NO_SEGMENTS, circles=NO_CIRCLES, range_max=100.0):
    return cast_rays(
        np.array(origin, dtype=float), np.array(angles, dtype=float), segments, circles, range_max
    )


def random_world(seed):
    generator = np.random.default_rng(seed)
    starts = generator.uniform(-5.0, 5.0, (12, 2))
    segments = np.hstack([starts, starts + generator.normal(size=(12, 2))])
    circles = np.column_stack([generator.uniform(-5.0, 5.0, (4, 2)), [0.1, 0.2, 0.5, 1.0]])
    return segments, circles


def test_wall_ahead_is_seen_at_its_distance():
    wall = np.array([[3.0, -1.0, 3.0, 1.0]])
    assert cast([1.0, 0.5], [0.0], segments=wall) == pytest.approx([2.0])


def test_oblique_beam_is_longer_by_the_cosine():
    wall = np.array([[2.0, -10.0, 2.0, 10.0]])
    expected = [2.0 / math.cos(math.radians(60)), 2.0 / math.cos(math.radians(-30))]
    assert cast([0, 0], np.radians([60, -30]), segments=wall) == pytest.approx(expected)


def test_beam_past_the_end_of_a_wall_meets_nothing():
    wall = np.array([[2.0, 0.5, 2.0, 1.0]])
    beams = [math.atan2(0.49, 2.0), math.atan2(0.51, 2.0), math.atan2(1.01, 2.0)]
    missed, met, passed = cast([0, 0], beams, segments=wall)
    assert missed == passed == math.inf
    assert met == pytest.approx(math.hypot(2.0, 0.51))


def test_wall_behind_is_not_seen():
    wall = np.array([[-1.0, -1.0, -1.0, 1.0]])
    assert cast([0, 0], [0.0], segments=wall)[0] == math.inf


def test_nearest_of_several_things_is_seen_whatever_their_order():
    segments = np.array([[4, -1, 4, 1], [2, -1, 2, 1], [3, -1, 3, 1]], dtype=float)
    circles = np.array([[9.0, 0.0, 7.5], [1.75, 0.0, 0.25]])
    for order in ([0, 1], [1, 0]):
        ranges = cast([0, 0], [0.0], segments=segments, circles=circles[order])
        assert ranges == pytest.approx([1.5])


def test_circle_is_met_at_its_near_side_and_at_its_rim():
    circle = np.array([[5.0, 0.0, 3.0]])
    # The tangent from the origin has length sqrt(5^2 - 3^2) = 4 at asin(3 / 5).
    tangent = math.asin(0.6)
    ahead, almost_rim, outside = cast([0, 0], [0.0, tangent - 1e-9, tangent + 1e-9], circles=circle)
    assert ahead == pytest.approx(2.0)
    assert almost_rim == pytest.approx(4.0, abs=1e-3)
    assert outside == math.inf


def test_circle_behind_is_not_seen():
    assert cast([0, 0], [math.pi], circles=np.array([[5.0, 0.0, 1.0]]))[0] == math.inf


def test_beam_from_inside_a_circle_meets_the_far_side():
    circle = np.array([[0.5, 0.0, 2.0]])
    assert cast([0, 0], [0.0, math.pi], circles=circle) == pytest.approx([2.5, 1.5])


def test_beam_from_inside_a_polygon_meets_its_boundary():
    angles = np.radians([0, 90, 180, 270, 45])
    expected = [1.0, 1.0, 1.0, 1.0, math.sqrt(2.0)]
    assert cast([0, 0], angles, segments=UNIT_SQUARE) == pytest.approx(expected)


def test_things_beyond_range_max_are_not_seen():
    wall = np.array([[3.0, -100.0, 3.0, 100.0]])
    circle = np.array([[0.0, 4.0, 1.0]])
    angles = np.radians([0, 60, 90])
    assert (
        list(cast([0, 0], angles, segments=wall, circles=circle, range_max=2.9)) == [math.inf] * 3
    )
    near, far, at_circle = cast([0, 0], angles, segments=wall, circles=circle, range_max=5.0)
    assert (near, at_circle) == pytest.approx((3.0, 3.0))
    assert far == math.inf  # 3 / cos(60 degrees) = 6


def test_beam_along_an_edge_meets_the_corner():
    segments = np.array([[1.0, 0.0, 2.0, 0.0], [2.0, 0.0, 2.0, 1.0], [1.0, 0.0, 1.0, 1.0]])
    assert cast([0, 0], [0.0], segments=segments) == pytest.approx([1.0])


def test_empty_world_gives_inf_for_every_beam():
    ranges = cast([0, 0], np.linspace(0, 6, 7))
    assert ranges.shape == (7,)
    assert np.all(np.isinf(ranges))


@settings(deadline=None)
@given(x=st.floats(-0.99, 0.99), y=st.floats(-0.99, 0.99))
def test_no_beam_slips_through_a_corner(x, y):
    corners = UNIT_SQUARE[:, :2]
    angles = np.arctan2(corners[:, 1] - y, corners[:, 0] - x)
    ranges = cast([x, y], angles, segments=UNIT_SQUARE)
    expected = np.hypot(corners[:, 0] - x, corners[:, 1] - y)
    assert ranges == pytest.approx(expected)


@settings(deadline=None)
@given(seed=st.integers(0, 50), x=coordinates, y=coordinates)
def test_a_hit_lies_on_what_was_hit_and_nothing_before_it(seed, x, y):
    segments, circles = random_world(seed)
    start, angles = np.array([x, y]), np.linspace(-3.0, 3.0, 50)
    ranges = cast([x, y], angles, segments=segments, circles=circles)
    for angle, distance in zip(angles, ranges, strict=True):
        ahead = np.array([math.cos(angle), math.sin(angle)])
        if math.isfinite(distance):
            assert distance_to_nearest(start + distance * ahead, segments, circles) < 1e-6
        end = start + min(distance * (1 - 1e-6), 20.0) * ahead
        for segment in segments:
            assert not crosses(start, end, segment)


@settings(deadline=None)
@given(seed=st.integers(0, 50), turn=st.floats(-3.0, 3.0))
def test_turning_world_and_beams_together_changes_nothing(seed, turn):
    segments, circles = random_world(seed)
    angles = np.linspace(-3.0, 3.0, 20)
    cos, sin = math.cos(turn), math.sin(turn)
    rotation = np.array([[cos, -sin], [sin, cos]])
    turned_segments = np.hstack([segments[:, :2] @ rotation.T, segments[:, 2:] @ rotation.T])
    turned_circles = np.column_stack([circles[:, :2] @ rotation.T, circles[:, 2]])
    ranges = cast([0, 0], angles, segments=segments, circles=circles)
    turned = cast([0, 0], angles + turn, segments=turned_segments, circles=turned_circles)
    # Only a beam within rounding of an end could meet a thing in one of the worlds alone.
    assert turned == pytest.approx(ranges, rel=1e-6)


def test_mirrored_world_gives_the_same_ranges_bit_for_bit():
    segments, circles = random_world(3)
    angles = np.linspace(-3.0, 3.0, 200)
    ranges = cast([0.5, 0.25], angles, segments=segments, circles=circles)
    flip_segments, flip_circles = np.array([1, -1, 1, -1]), np.array([1, -1, 1])
    mirrored = cast(
        [0.5, -0.25], -angles, segments=segments * flip_segments, circles=circles * flip_circles
    )
    np.testing.assert_array_equal(mirrored, ranges)


def test_inputs_stay_unchanged():
    segments, circles = random_world(0)
    angles = np.linspace(-3.0, 3.0, 20)
    before = [a.copy() for a in (segments, circles, angles)]
    cast_rays(np.zeros(2), angles, segments, circles, 10.0)
    for array, copy in zip((segments, circles, angles), before, strict=True):
        np.testing.assert_array_equal(array, copy)


def distance_to_nearest(point, segments, circles):
    """Distance from a point to the nearest segment or rim, by projection."""
    distances = [abs(np.hypot(*(point - c[:2])) - c[2]) for c in circles]
    for segment in segments:
        start, edge = segment[:2], segment[2:] - segment[:2]
        along = np.clip(np.dot(point - start, edge) / np.dot(edge, edge), 0.0, 1.0)
        distances.append(np.hypot(*(point - start - along * edge)))
    return min(distances)


def crosses(start, end, segment):
    """Whether two segments cross, by solving for both parameters."""
    edge, ray = segment[2:] - segment[:2], end - start
    matrix = np.column_stack([ray, -edge])
    if abs(np.linalg.det(matrix)) < 1e-9:
        return False
    s, u = np.linalg.solve(matrix, segment[:2] - start)
    return 0.0 < s < 1.0 and 1e-6 < u < 1.0 - 1e-6


def test_ranges_beyond_both_limits_are_reported_as_infinite():
    measured = np.array([0.04, 0.05, 12.0, 12.1, np.inf, np.nan])
    reported = reported_ranges(measured, 0.05, 12.0)
    assert reported.dtype == np.float32
    expected = np.array([-np.inf, 0.05, 12.0, np.inf, np.inf, np.nan], np.float32)
    np.testing.assert_array_equal(reported, expected)
