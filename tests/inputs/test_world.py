"""Obstacles as regions, edges and circles."""

import numpy as np
import pytest
import shapely

from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.inputs.task_check import check_task
from drake_navbench.inputs.world import Box, Cylinder, Polygon, Wall, World
from drake_navbench.kernels.poses import place_outline
from drake_navbench.typed_files.typed_yaml import validate

BOX = Box(type="box", min=(1.0, 2.0), max=(3.0, 5.0))


def test_a_box_has_four_edges_and_its_area():
    world = World((BOX,))
    assert world.segments.shape == (4, 4)
    assert BOX.region.area == pytest.approx(2.0 * 3.0)


def test_a_wall_lies_half_its_thickness_to_either_side_of_its_centre_line():
    wall = Wall(type="wall", start=(0.0, 0.0), end=(0.0, 4.0), thickness_m=0.2)
    assert wall.region.bounds == pytest.approx((-0.1, 0.0, 0.1, 4.0))


def test_outlines_run_counter_clockwise_however_they_were_given():
    clockwise = Polygon(type="polygon", vertices=[(0, 0), (0, 1), (1, 1), (1, 0)])
    for shape in (BOX, clockwise, Cylinder(type="cylinder", centre=(0, 0), radius_m=1.0)):
        assert shapely.LinearRing(shape.outline).is_ccw


def test_a_cylinder_is_a_circle_to_the_lidar_and_nearly_its_area_on_a_map():
    cylinder = Cylinder(type="cylinder", centre=(1.0, -1.0), radius_m=0.5)
    world = World((cylinder,))
    np.testing.assert_array_equal(world.circles, [[1.0, -1.0, 0.5]])
    assert world.segments.shape == (0, 4)
    assert cylinder.region.area == pytest.approx(np.pi * 0.25, rel=2e-3)


def test_a_polygon_that_crosses_itself_is_refused():
    with pytest.raises(ValueError, match="does not cross itself"):
        Polygon(type="polygon", vertices=[(0, 0), (1, 1), (1, 0), (0, 1)])


def test_an_empty_world_is_bounded_by_start_and_goal():
    bounds = World(()).bounds([(0.0, 0.0, 0.0), (7.5, 0.0, 0.0)], margin_m=2.0)
    assert bounds == pytest.approx((-2.0, -2.0, 9.5, 2.0))


def test_a_footprint_turned_left_by_a_right_angle_points_along_y():
    footprint = np.array([[0.85, 0.3], [-0.25, 0.3]])
    placed = place_outline(footprint, (1.0, 2.0, np.pi / 2))
    np.testing.assert_allclose(placed, [[0.7, 2.85], [0.7, 1.75]])


def task(**changes) -> Scenario:
    data = {
        "name": "task",
        "description": "a task",
        "world": {"obstacles": [{"type": "box", "min": [2.0, -1.0], "max": [3.0, 1.0]}]},
        "goal": [5.0, 0.0, 0.0],
    }
    return validate(Scenario, data | changes, "task.yaml")


ROBOT = Robot(description="round", robot_radius=0.5)


def test_a_task_with_room_at_the_start_and_a_free_goal_passes():
    check_task(task(), ROBOT)


def test_a_start_where_the_footprint_overlaps_an_obstacle_is_refused():
    with pytest.raises(InputError, match=r"start: the robot's footprint at .* overlaps"):
        check_task(task(start=[1.6, 0.0, 0.0]), ROBOT)


def test_a_goal_inside_an_obstacle_is_refused():
    with pytest.raises(InputError, match=r"goal: .* lies inside an obstacle"):
        check_task(task(goal=[2.5, 0.0, 0.0]), ROBOT)


def test_trials_start_where_their_seed_says_whatever_the_controller():
    scenario = task(variation={"start_xy_std_m": 0.1, "start_yaw_std_rad": 0.1})
    np.testing.assert_array_equal(scenario.start_pose(3), scenario.start_pose(3))
    assert not np.allclose(scenario.start_pose(3), scenario.start_pose(4))
