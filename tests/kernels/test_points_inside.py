"""Points in shapes, and the time until a moving shape holds some."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_navbench.kernels.points_inside import NO_COLLISION, count_inside, time_to_collision

SQUARE = np.array([[0.5, 0.5], [0.5, -0.5], [-0.5, -0.5], [-0.5, 0.5]])
NO_VERTICES = np.empty((0, 2))
# An arrow head, not convex: the notch at (0, 0) is outside.
ARROW = np.array([[1.0, 0.0], [-1.0, 1.0], [0.0, 0.0], [-1.0, -1.0]])


def points(*pairs):
    return np.array(pairs, dtype=float).reshape(-1, 2)


def test_points_inside_a_square_are_counted():
    assert count_inside(points((0, 0), (0.49, 0.49), (0.51, 0), (0, -0.6)), SQUARE, 0.0) == 2


def test_a_notch_is_outside():
    assert count_inside(points((-0.5, 0.0)), ARROW, 0.0) == 0
    assert count_inside(points((0.5, 0.0), (-0.5, 0.6)), ARROW, 0.0) == 2


def test_a_point_on_an_edge_is_outside():
    # 0.8 m up the edge from (-1, -0.25) to (0, 1.25) is x = -0.3 m; by its slope, 1 / 1.5,
    # rounding would put the edge beyond the point.
    edge = np.array([[0.0, 1.25], [-1.0, -0.25], [-2.0, -0.25], [-2.0, 1.25]])
    assert count_inside(points((-0.3, 0.8)), edge, 0.0) == 0


def test_a_circle_is_open():
    assert count_inside(points((0.3, 0.0), (0.0, 0.5), (0.0, 0.51)), NO_VERTICES, 0.5) == 1


def first_hit(point, v, w, *, limit=2.0, step=0.1):
    return time_to_collision(points(point), SQUARE, 0.0, 1, (v, w, 0.0), limit, step)


def test_points_inside_already_are_a_collision_now():
    assert first_hit((0.0, 0.0), 0.0, 0.0) == 0.0


def test_the_time_is_one_step_short_of_the_pose_that_collides():
    # The front at 0.5 m reaches 0.96 m in the fifth step of 0.1 m; the time is that of the fourth.
    assert first_hit((0.96, 0.0), 1.0, 0.0) == pytest.approx(0.4)


def test_a_collision_in_the_first_step_has_no_time_left():
    assert first_hit((0.55, 0.0), 1.0, 0.0) == 0.0


@pytest.mark.parametrize(("limit", "tests"), [(1.2, 13), (2.0, 20)])
def test_floating_point_decides_on_the_last_step_as_in_nav2(limit, tests):
    # The last pose tested is `tests` steps ahead: a point just before it is seen, one after not.
    reach = 0.5 + 0.1 * tests
    assert first_hit((reach - 0.01, 0.0), 1.0, 0.0, limit=limit) >= 0.0
    assert first_hit((reach + 0.01, 0.0), 1.0, 0.0, limit=limit) == NO_COLLISION


def test_turning_in_place_sweeps_the_corners():
    # The corner at 45 deg, 0.707 m, is turned onto a point ahead at 0.69 m after pi / 4.
    time = first_hit((0.69, 0.0), 0.0, -1.0)
    assert 0.5 < time < np.pi / 4


# Off the lattice of the steps and edges: an edge belongs to the square on two of its sides only.
OFF_EDGES = st.integers(-15, 14).map(lambda k: 0.1 * k + 0.037)


@given(
    x=st.integers(6, 20).map(lambda k: 0.1 * k + 0.023),
    y=OFF_EDGES,
    v=st.integers(0, 10).map(lambda k: 0.1 * k),
    w=st.integers(-10, 10).map(lambda k: 0.1 * k),
)
def test_a_mirrored_world_takes_as_long(x, y, v, w):
    assert first_hit((x, -y), v, -w) == first_hit((x, y), v, w)
