"""Rays that rise and fall meet sides, tops and the floor."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from drake_navbench.inputs.world import Box, Cylinder, World
from drake_navbench.kernels.depth_casting import cast_cone
from drake_navbench.kernels.ray_casting import cast_rays

# A table 0.5 m high from 2 m to 3 m ahead, and a wall 2 m high behind it.
TABLE = Box(type="box", min=(2.0, -1.0), max=(3.0, 1.0), height_m=0.5)
WALL = Box(type="box", min=(4.0, -5.0), max=(4.2, 5.0), height_m=2.0)
EYE = np.array([0.0, 0.0, 1.0])


def along(slope, *obstacles, origin=EYE, heading=0.0, sees_floor=False):
    """Returns how far a ray goes along the floor."""
    solids = World(obstacles).solids
    (distance,) = cast_cone(
        np.array(origin), np.array([heading]), np.array([[slope]]), solids, sees_floor=sees_floor
    )[0]
    return distance


def test_a_level_ray_passes_over_what_is_lower():
    assert along(0.0, TABLE, WALL) == pytest.approx(4.0)
    assert along(0.0, TABLE) == np.inf


def test_a_falling_ray_meets_the_top():
    # From 1 m down to 0.5 m at 0.2 m a metre: after 2.5 m.
    assert along(-0.2, TABLE, WALL) == pytest.approx(2.5)


def test_a_steeper_ray_meets_the_side():
    assert along(-0.3, TABLE) == pytest.approx(2.0)


def test_a_ray_over_the_far_edge_goes_on():
    # 0.5 m high after 3.125 m, where the table ends; 0.36 m high at the wall.
    assert along(-0.16, TABLE, WALL) == pytest.approx(4.0)


def test_a_rising_ray_goes_over_the_wall():
    assert along(0.2, WALL) == pytest.approx(4.0)
    assert along(0.26, WALL) == np.inf


def test_the_floor_is_seen_only_where_it_is_asked_for():
    assert along(-0.5) == np.inf
    assert along(-0.5, sees_floor=True) == pytest.approx(2.0)
    # Nearer than the table's side.
    assert along(-0.6, TABLE, sees_floor=True) == pytest.approx(1.0 / 0.6)


# A table top from 0.7 m to 0.75 m, and a round one as high.
BOARD = Box(type="box", min=(2.0, -1.0), max=(3.0, 1.0), bottom_m=0.7, height_m=0.75)
ROUND = Cylinder(type="cylinder", centre=(2.5, 0.0), radius_m=0.5, bottom_m=0.7, height_m=0.75)
LOW = np.array([0.0, 0.0, 0.3])


@pytest.mark.parametrize("hanging", [BOARD, ROUND])
def test_a_ray_passes_under_what_hangs_and_meets_its_side_and_underside(hanging):
    assert along(0.0, hanging, WALL, origin=LOW) == pytest.approx(4.0)
    # 0.7 m high after 2.5 m, in the middle of the board.
    assert along(0.16, hanging, origin=LOW) == pytest.approx(2.5)
    # 0.72 m high where the board begins.
    assert along(0.21, hanging, origin=LOW) == pytest.approx(2.0)
    # 0.78 m high there.
    assert along(0.24, hanging, WALL, origin=LOW) == pytest.approx(4.0)
    # From above down onto its top, and down below it.
    assert along(-0.1, hanging) == pytest.approx(2.5)
    assert along(-0.16, hanging, sees_floor=True) == pytest.approx(1.0 / 0.16)


def test_a_cylinder_has_a_top_as_well():
    post = Cylinder(type="cylinder", centre=(2.5, 0.0), radius_m=0.5, height_m=0.5)
    assert along(-0.2, post) == pytest.approx(2.5)
    assert along(-0.25, post) == pytest.approx(2.0)
    assert along(-0.1, post) == np.inf


def test_a_gap_between_two_tops_is_none():
    arms = [
        Box(type="box", min=(2.0, -1.0), max=(2.4, 1.0), height_m=0.5),
        Box(type="box", min=(2.8, -1.0), max=(3.0, 1.0), height_m=0.5),
    ]
    # 0.5 m high after 2.5 m, between the two: on to the second one's side.
    assert along(-0.2, *arms) == pytest.approx(2.8)


@given(
    heading=st.floats(-np.pi, np.pi),
    corner=st.tuples(st.floats(0.6, 4.0), st.floats(-4.0, 4.0)),
    size=st.tuples(st.floats(0.1, 2.0), st.floats(0.1, 2.0)),
)
@settings(max_examples=200, deadline=None)
# Almost along a side of the box: cross products of 1e-163, whose product is 0.
@example(heading=5.6e-163, corner=(1.0, 0.0), size=(1.0, 1.0))
def test_level_rays_see_what_the_lidar_sees(heading, corner, size):
    box = Box(type="box", min=corner, max=(corner[0] + size[0], corner[1] + size[1]), height_m=2.0)
    post = Cylinder(type="cylinder", centre=(-2.0, 0.5), radius_m=0.4, height_m=2.0)
    world = World((box, post))
    level = along(0.0, box, post, heading=heading)
    flat = cast_rays(np.zeros(2), np.array([heading]), world.segments, world.circles, 1e3)[0]
    assert level == pytest.approx(flat, abs=1e-9) or (np.isinf(level) and np.isinf(flat))
