"""Paths from straights, arcs and polylines."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_navbench.kernels.path_geometry import (
    path_from_elements,
    path_from_polyline,
    path_length,
)

ORIGIN = (0.0, 0.0, 0.0)
ONE_OBSTACLE = [
    {"s": 6.922},
    {"arc": 45, "r": 0.5},
    {"s": 1.3},
    {"arc": 45, "r": 0.5},
    {"s": 6.922},
]
STATIC_OBSTACLES = [
    {"s": 2.7},
    {"arc": 45, "r": 0.7},
    {"s": 1.2},
    {"arc": -45, "r": 0.7},
    {"s": 1.4},
    {"arc": -45, "r": 0.7},
    {"s": 2.1},
    {"arc": 45, "r": 0.7},
    {"s": 0.8},
    {"arc": 45, "r": 0.7},
    {"s": 1.2},
    {"arc": -45, "r": 0.7},
    {"s": 2.65},
]


def element_lengths(elements):
    return [e["s"] if "s" in e else e["r"] * math.radians(abs(e["arc"])) for e in elements]


elements_strategy = st.lists(
    st.one_of(
        st.builds(lambda s: {"s": s}, st.floats(0.1, 5.0)),
        st.builds(
            lambda arc, sign, r: {"arc": sign * arc, "r": r},
            st.floats(5.0, 180.0),
            st.sampled_from([-1.0, 1.0]),
            st.floats(0.3, 3.0),
        ),
    ),
    min_size=1,
    max_size=6,
)


def test_the_published_plan_around_one_obstacle_ends_at_its_goal_with_its_length():
    path = path_from_elements(ORIGIN, ONE_OBSTACLE, 0.05)
    # 2 x 6.922 + 1.3 + 2 x 0.5 x pi / 4 = 15.929; the goal is published to 1 mm.
    assert path[-1, :2] == pytest.approx([8.342, 8.342], abs=1e-3)
    assert path[-1, 2] == pytest.approx(math.pi / 2, abs=1e-12)
    assert sum(element_lengths(ONE_OBSTACLE)) == pytest.approx(15.93, abs=5e-3)
    assert path_length(path) == pytest.approx(15.93, abs=5e-3)


def test_the_published_plan_through_static_obstacles_ends_at_its_goal_with_its_length():
    path = path_from_elements(ORIGIN, STATIC_OBSTACLES, 0.05)
    assert path[-1] == pytest.approx([13.702, 0.622, 0.0], abs=1e-3)
    # 12.05 m of straights and 6 x 0.7 x pi / 4 = 3.299 m of arcs.
    assert path_length(path) == pytest.approx(15.35, abs=5e-3)


def test_a_straight_of_one_metre_is_sampled_every_spacing_with_a_short_last_interval():
    path = path_from_elements((1.0, 2.0, math.pi / 2), [{"s": 1.0}], 0.3)
    assert path[:, 1] == pytest.approx([2.0, 2.3, 2.6, 2.9, 3.0])
    assert path[:, 0] == pytest.approx([1.0] * 5)
    assert path[:, 2] == pytest.approx([math.pi / 2] * 5)


def test_a_spacing_that_divides_the_length_leaves_no_sliver_at_the_end():
    path = path_from_elements(ORIGIN, [{"s": 0.3}, {"s": 0.3}], 0.1)
    assert np.diff(path[:, 0]) == pytest.approx([0.1] * 6)


@pytest.mark.parametrize(("sign", "side"), [(1, "left"), (-1, "right")])
def test_an_arc_turns_left_for_a_positive_angle(sign, side):
    path = path_from_elements(ORIGIN, [{"arc": sign * 90, "r": 2.0}], 0.1)
    assert path[-1] == pytest.approx([2.0, sign * 2.0, sign * math.pi / 2])
    # Every point lies on the circle about (0, +-2).
    assert np.hypot(path[:, 0], path[:, 1] - sign * 2.0) == pytest.approx(np.full(len(path), 2.0))
    # Equal arc length 0.1 m at radius 2 m is equal turns of 0.05 rad.
    assert sign * np.diff(path[:-1, 2]) == pytest.approx(np.full(len(path) - 2, 0.05))


@given(elements=elements_strategy, spacing=st.floats(0.05, 0.5))
def test_samples_lie_at_multiples_of_the_spacing(elements, spacing):
    total = sum(element_lengths(elements))
    path = path_from_elements(ORIGIN, elements, spacing)
    assert len(path) == math.ceil(total / spacing - 1e-9) + 1
    chords = np.hypot(*np.diff(path[:, :2], axis=0).T)
    assert np.all(chords <= spacing + 1e-12)
    # The sharpest arc has r = 0.3 m: a chord of its arc d is 2 r sin(d / 2r).
    shortest = min(2 * r * math.sin(min(spacing / (2 * r), math.pi / 2)) for r in (0.3,))
    assert np.all(chords[:-1] >= shortest - 1e-12)


@given(
    elements=elements_strategy,
    x=st.floats(-10, 10),
    y=st.floats(-10, 10),
    yaw=st.floats(-3, 3),
)
def test_a_moved_start_moves_the_whole_path(elements, x, y, yaw):
    at_origin = path_from_elements(ORIGIN, elements, 0.2)
    moved = path_from_elements((x, y, yaw), elements, 0.2)
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    rotation = np.array([[cos_yaw, -sin_yaw], [sin_yaw, cos_yaw]])
    np.testing.assert_allclose(moved[:, :2], at_origin[:, :2] @ rotation.T + [x, y], atol=1e-9)
    assert np.exp(1j * moved[:, 2]) == pytest.approx(np.exp(1j * (at_origin[:, 2] + yaw)))


@given(elements=elements_strategy)
def test_mirrored_arcs_give_the_mirrored_path(elements):
    mirrored = [{**e, "arc": -e["arc"]} if "arc" in e else e for e in elements]
    path = path_from_elements(ORIGIN, elements, 0.2)
    reflection = path_from_elements(ORIGIN, mirrored, 0.2)
    np.testing.assert_allclose(reflection[:, :2], path[:, :2] * [1.0, -1.0], atol=1e-12)


@pytest.mark.parametrize(
    ("elements", "text"),
    [
        ([], "got none"),
        ([{"s": 0.0}], "path element 0, s: got 0.0"),
        ([{"s": 1.0}, {"arc": 45}], "path element 1: got fields"),
        ([{"arc": 45, "r": -1.0}], "r: got -1.0"),
        ([{"arc": 0.0, "r": 1.0}], "arc"),
        ([{"s": math.nan}], "finite"),
    ],
)
def test_a_wrong_element_is_named(elements, text):
    with pytest.raises(ValueError, match=text):
        path_from_elements(ORIGIN, elements, 0.05)


def test_a_spacing_of_zero_is_refused():
    with pytest.raises(ValueError, match=r"spacing_m: got 0\.0"):
        path_from_elements(ORIGIN, [{"s": 1.0}], 0.0)


def test_a_polyline_is_sampled_across_its_corner():
    path = path_from_polyline([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], 0.4)
    # Stations 0, 0.4, 0.8 on the first leg; 1.2, 1.6 and the end 2.0 on the second.
    expected = [(0, 0, 0), (0.4, 0, 0), (0.8, 0, 0)]
    expected += [(1, y, math.pi / 2) for y in (0.2, 0.6, 1.0)]
    np.testing.assert_allclose(path, expected, atol=1e-12)


def test_a_sample_on_a_corner_heads_along_the_next_leg():
    path = path_from_polyline([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], 0.5)
    np.testing.assert_allclose(path[2], [1.0, 0.0, math.pi / 2], atol=1e-12)


def test_repeated_points_of_a_polyline_are_dropped():
    points = [[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [1.0, 0.0]]
    np.testing.assert_array_equal(
        path_from_polyline(points, 0.25), path_from_polyline([[0.0, 0.0], [1.0, 0.0]], 0.25)
    )


@pytest.mark.parametrize("points", [[[0.0, 0.0]], [[1.0, 1.0], [1.0, 1.0]], [0.0, 1.0]])
def test_a_polyline_without_two_points_is_refused(points):
    with pytest.raises(ValueError, match="polyline: got"):
        path_from_polyline(points, 0.1)


def test_the_length_of_a_path_is_the_sum_of_its_chords():
    assert path_length([[0.0, 0.0], [3.0, 4.0], [3.0, 6.0]]) == 7.0
    assert path_length([[1.0, 1.0, 0.0]]) == 0.0
