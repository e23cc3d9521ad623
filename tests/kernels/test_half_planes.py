"""The nearest velocity within half-planes is found, and where there is none the least bad one."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from drake_navbench.kernels.half_planes import allowed_velocity

# Allowed is what is to the right of x = 0.5, that is to the left of the line going down.
RIGHT_OF_HALF = [0.5, 0.0, 0.0, -1.0]
LEFT_OF_MINUS_HALF = [-0.5, 0.0, 0.0, 1.0]


def allowed(planes, wished, *, hard=0, top_speed=2.0):
    rows = np.array(planes, dtype=float).reshape(-1, 4)
    return np.array(allowed_velocity(rows, len(rows), hard, top_speed, *wished))


def excesses(planes, velocity):
    """Returns (..., N) how far velocities (..., 2) are outside each half-plane."""
    rows = np.array(planes, dtype=float).reshape(-1, 4)
    off = rows[:, :2] - np.asarray(velocity)[..., None, :]
    return rows[:, 2] * off[..., 1] - rows[:, 3] * off[..., 0]


def test_what_is_allowed_is_kept_and_else_cut_to_the_top_speed():
    np.testing.assert_allclose(allowed([], (1.0, 1.0)), [1.0, 1.0])
    np.testing.assert_allclose(allowed([], (3.0, 4.0)), [1.2, 1.6])
    np.testing.assert_allclose(allowed([RIGHT_OF_HALF], (1.0, 0.3)), [1.0, 0.3])


def test_the_nearest_on_an_edge_and_in_a_corner():
    np.testing.assert_allclose(allowed([RIGHT_OF_HALF], (0.0, 0.3)), [0.5, 0.3])
    above_one = [0.0, 1.0, 1.0, 0.0]
    np.testing.assert_allclose(allowed([RIGHT_OF_HALF, above_one], (0.0, 0.0)), [0.5, 1.0])


def test_where_none_is_allowed_both_are_broken_alike():
    chosen = allowed([RIGHT_OF_HALF, LEFT_OF_MINUS_HALF], (0.0, 0.7))
    np.testing.assert_allclose(excesses([RIGHT_OF_HALF, LEFT_OF_MINUS_HALF], chosen), 0.5)


def test_the_hard_ones_are_kept_where_none_is_allowed():
    chosen = allowed([RIGHT_OF_HALF, LEFT_OF_MINUS_HALF], (0.0, 0.7), hard=1)
    np.testing.assert_allclose(excesses([RIGHT_OF_HALF, LEFT_OF_MINUS_HALF], chosen), [0.0, 1.0])


angles = st.floats(-math.pi, math.pi)
half_planes = st.builds(
    lambda out, angle: [
        out * math.sin(angle), -out * math.cos(angle), math.cos(angle), math.sin(angle)
    ],
    st.floats(-0.9, 0.9),
    angles,
)  # fmt: skip
# Between -0.5 and 0 m/s along y, but for 1e-9: found by chance.
ALMOST_PARALLEL = [
    [0.0, -0.5, 1.0, 0.0],
    [0.0, -3.7e-9, -1.0, -1.9e-9],
    [0.0, 0.0, -1.0, 1.9e-9],
    [0.0, 0.0, 1.0, 0.0],
]
GRID = np.stack(np.meshgrid(*2 * [np.linspace(-1.0, 1.0, 41)]), axis=-1).reshape(-1, 2)
GRID = GRID[np.hypot(*GRID.T) <= 1.0]


@settings(max_examples=100)
@given(st.lists(half_planes, max_size=6), st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
@example(ALMOST_PARALLEL, 1.0, 0.0)
def test_no_point_of_a_grid_is_better(planes, x, y):
    chosen = allowed(planes, (x, y), top_speed=1.0)
    assert np.hypot(*chosen) <= 1.0 + 1e-9
    worst = excesses(planes, chosen).max(initial=0.0)
    on_grid = excesses(planes, GRID).max(axis=-1, initial=0.0)
    if worst > 1e-6:
        # None is allowed: the largest excess is as small as can be.
        assert worst <= on_grid.min() + 1e-6
    else:
        allowed_there = GRID[on_grid <= 0.0]
        away = np.hypot(*(chosen - [x, y]))
        assert away <= np.hypot(*(allowed_there - [x, y]).T).min(initial=np.inf) + 1e-6


def test_parallel_ones_that_say_the_same_do_not_matter_twice():
    once = allowed([RIGHT_OF_HALF], (0.1, -0.4))
    assert once == pytest.approx(allowed([RIGHT_OF_HALF, RIGHT_OF_HALF], (0.1, -0.4)))
