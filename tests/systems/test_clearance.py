"""Clearance is the distance of the footprint to the nearest thing, however far."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from scenes import WHEELCHAIR

from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.inputs.world import Box, Cylinder, World
from drake_navbench.kernels.grid import LETHAL, Costmap
from drake_navbench.kernels.poses import place_outline
from drake_navbench.trial.systems.clearance import MAX_DISTANCE_M, Clearance
from drake_navbench.trial.systems.ports import value_to_store

# The front reaches 0.85 m ahead of the reference point, which stands at the origin.
FRONT_M = 0.85
# Two arms ahead, 0.5 m apart, about a notch whose bottom lies at x = 0.1 m.
FORK = np.array(
    [
        [-0.3, -0.4],
        [0.6, -0.4],
        [0.6, -0.25],
        [0.1, -0.25],
        [0.1, 0.25],
        [0.6, 0.25],
        [0.6, 0.4],
        [-0.3, 0.4],
    ]
)
SLALOM = load_scenario("static_obstacles").true_world


def distances(*obstacles, walls=(), costmap=None, footprint=WHEELCHAIR):
    """Returns what is measured at the start."""
    return distances_at((0.0, 0.0, 0.0), World(obstacles, walls), footprint, costmap)


def distances_at(pose, world, footprint=WHEELCHAIR, costmap=None):
    builder = DiagramBuilder()
    clearance = builder.AddSystem(
        Clearance(world, footprint=footprint, period_s=0.05, offset_s=0.02)
    )
    state = builder.AddSystem(ConstantVectorSource([*pose, 0.0, 0.0, 0.0]))
    builder.Connect(state.get_output_port(), clearance.GetInputPort("state"))
    simulator = Simulator(builder.Build())
    own = clearance.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    clearance.GetInputPort("costmap").FixValue(own, AbstractValue.Make(value_to_store(costmap)))
    simulator.Initialize()
    return clearance.GetOutputPort("distances").Eval(own)


def box_ahead(gap_m):
    """Returns a box whose near face lies a gap ahead of the front."""
    return Box(
        type="box", min=(FRONT_M + gap_m, -1.0), max=(FRONT_M + gap_m + 0.5, 1.0), height_m=1.0
    )


@pytest.mark.parametrize("gap_m", [0.01, 0.5, 2.0, 4.9])
def test_the_gap_ahead_is_measured_near_and_far(gap_m):
    assert distances(box_ahead(gap_m))[0] == pytest.approx(gap_m)


def test_the_nearest_of_several_counts():
    pillar = Cylinder(type="cylinder", centre=(0.0, 0.3 + 0.2 + 0.4), radius_m=0.2)
    assert distances(box_ahead(3.0), pillar, box_ahead(0.6))[0] == pytest.approx(0.4)


def test_an_overlap_is_zero():
    assert distances(box_ahead(-0.05))[0] == 0.0


def test_beyond_reach_there_is_nothing():
    assert distances(box_ahead(MAX_DISTANCE_M + 0.1))[0] == np.inf
    assert distances()[0] == np.inf


def test_a_wall_of_a_map_counts_as_an_obstacle_does():
    assert distances(box_ahead(0.8), walls=(box_ahead(0.3),))[0] == pytest.approx(0.3)


def post(low_y_m):
    """Returns a post of 0.1 x 0.1 m in the fork's notch, 0.2 m from its bottom."""
    return Box(type="box", min=(0.3, low_y_m), max=(0.4, low_y_m + 0.1))


# 0.2 m to the bottom; then 0.25 - 0.15 m to the left arm; then overlapping that arm by 0.05 m.
@pytest.mark.parametrize(("low_y_m", "gap_m"), [(-0.05, 0.2), (0.05, 0.1), (0.2, 0.0)])
def test_a_post_in_a_notch_of_the_footprint_is_measured_to_the_outline(low_y_m, gap_m):
    assert distances(post(low_y_m), footprint=FORK)[0] == pytest.approx(gap_m)
    assert distances(walls=(post(low_y_m),), footprint=FORK)[0] == pytest.approx(gap_m)


@given(x=st.floats(-1.0, 16.0), y=st.floats(-4.0, 4.0), yaw=st.floats(-3.1, 3.1))
def test_among_obstacles_it_is_the_distance_of_the_areas(x, y, yaw):
    # SceneGraph, which used to measure it, is wrong at one such pose in fifty.
    body = shapely.Polygon(place_outline(WHEELCHAIR, (x, y, yaw)))
    expected = shapely.distance(SLALOM.regions, body).min()
    expected = expected if expected <= MAX_DISTANCE_M else np.inf
    assert distances_at((x, y, yaw), SLALOM)[0] == pytest.approx(expected, abs=1e-9)


def costmap_with_a_wall(column):
    """Returns a map of 1 x 1 m around the robot with one column of lethal cells."""
    costs = np.zeros((20, 20), np.uint8)
    costs[:, column] = LETHAL
    return Costmap(costs, -0.5, -0.5, 0.05)


def test_distances_to_a_cell_are_those_to_its_centre_and_to_its_lower_left_corner():
    costs = np.zeros((20, 20), np.uint8)
    costs[10, 13] = LETHAL
    costmap = Costmap(costs, -0.5, -0.5, 0.05)
    # The cell's corner: x = -0.5 + 13 * 0.05 = 0.15, y = -0.5 + 10 * 0.05 = 0.
    _, to_centre, to_corner = distances(costmap=costmap)
    assert to_centre == pytest.approx(np.hypot(0.175, 0.025))
    assert to_corner == pytest.approx(0.15)
    assert list(distances()[1:]) == [np.inf, np.inf]


def test_to_its_corner_a_wall_ahead_is_nearer_and_one_behind_farther():
    # Cells from 0.25 to 0.3 m ahead, and from 0.3 to 0.25 m behind; corners at y = 0 exist.
    ahead, behind = (
        distances(costmap=costmap_with_a_wall(15)),
        distances(costmap=costmap_with_a_wall(4)),
    )
    assert (ahead[2], behind[2]) == pytest.approx((0.25, 0.3))


def test_the_nearest_corner_may_be_that_of_another_cell_than_the_nearest_centre():
    costs = np.zeros((20, 20), np.uint8)
    costs[10, [15, 5]] = LETHAL
    # From x = -0.51: centres at 0.265 and -0.235 m, corners at 0.24 and -0.26 m, all at y = 0.
    costmap = Costmap(costs, -0.51, -0.525, 0.05)
    assert distances(costmap=costmap)[1] == pytest.approx(0.235)
    costmap = Costmap(costs, -0.51, -0.5, 0.05)
    assert distances(costmap=costmap)[2] == pytest.approx(0.24)
