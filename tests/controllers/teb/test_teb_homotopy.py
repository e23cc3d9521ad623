import math

import numpy as np
import pytest
from teb_bands import map_of

from drake_navbench.controllers.teb.homotopy import (
    LEFT,
    RIGHT,
    _cut,
    class_name,
    find_clusters,
    path_past_cluster,
    same_class,
    swept_angles,
)
from drake_navbench.kernels.distance_field import distance_field
from drake_navbench.kernels.path_geometry import path_length

CLEARANCE_M = 0.4
START, GOAL = np.array([-2.0, 0.0]), np.array([2.0, 0.0])


def field_of(boxes):
    return distance_field(map_of(boxes))


def ways(boxes, cluster=0):
    field = field_of(boxes)
    clusters = find_clusters(field, CLEARANCE_M)
    return clusters, {
        side: path_past_cluster(field, clusters, cluster=cluster, side=side, start=START, goal=GOAL)
        for side in (LEFT, RIGHT)
    }


def test_obstacles_with_a_gap_too_narrow_are_one_cluster():
    # Faces 0.7 m and 0.9 m apart, for a robot that needs 0.8 m.
    assert len(find_clusters(field_of([(-1, -1, 0, 0), (0.7, -1, 1, 0)]), CLEARANCE_M).anchors) == 1
    assert len(find_clusters(field_of([(-1, -1, 0, 0), (0.9, -1, 1, 0)]), CLEARANCE_M).anchors) == 2


def test_anchor_of_a_cluster_is_inside_the_obstacle_even_where_its_centroid_is_not():
    # An L: its centroid is free.
    field = field_of([(-1, -1, -0.7, 1), (-1, -1, 1, -0.7)])
    anchor = find_clusters(field, CLEARANCE_M).anchors[0]
    assert anchor[0] < -0.7 or anchor[1] < -0.7


@pytest.mark.parametrize("ahead_m", [0.0, 1e-9, 0.05])
def test_there_is_no_way_past_anything_to_a_goal_where_the_robot_stands(ahead_m):
    field = field_of([(-0.3, -0.5, 0.3, 0.5)])
    clusters = find_clusters(field, CLEARANCE_M)
    goal = START + np.array([ahead_m, 0.0])
    assert path_past_cluster(field, clusters, cluster=0, side=LEFT, start=START, goal=goal) is None


def test_ways_past_a_box_pass_it_on_the_named_side_and_keep_clear():
    clusters, found = ways([(-0.3, -0.5, 0.3, 0.5)])
    assert found[LEFT][:, 1].max() > 0.5 + CLEARANCE_M
    assert found[RIGHT][:, 1].min() < -0.5 - CLEARANCE_M
    assert found[LEFT][:, 1].min() > -0.1
    angles = [swept_angles(np.vstack([START, p, GOAL]), clusters.anchors) for p in found.values()]
    assert not same_class(*angles)
    assert angles[0][0] - angles[1][0] == pytest.approx(-2.0 * math.pi)


def test_the_longer_way_is_found_too():
    _, found = ways([(-0.3, -0.2, 0.3, 1.5)])
    assert path_length(found[LEFT]) > path_length(found[RIGHT]) + 0.5


def test_no_way_leads_past_a_wall_across_the_map_or_past_its_closed_side():
    assert ways([(0, -3, 0.2, 3)])[1] == {LEFT: None, RIGHT: None}
    one_open = ways([(0, -1, 0.2, 3)])[1]
    assert one_open[LEFT] is None
    assert one_open[RIGHT] is not None


def test_paths_that_differ_only_in_shape_are_of_one_class():
    anchors = np.array([[0.0, 0.0]])
    wide = np.array([START, [0.0, 2.0], GOAL])
    near = np.array([START, [-0.5, 0.6], [0.5, 0.6], GOAL])
    below = np.array([START, [0.0, -0.6], GOAL])
    assert same_class(swept_angles(wide, anchors), swept_angles(near, anchors))
    assert not same_class(swept_angles(wide, anchors), swept_angles(below, anchors))


def test_class_name_counts_turns_about_each_cluster():
    anchors = np.array([[0.0, 0.0], [0.0, 5.0]])
    above = swept_angles(np.array([START, [0.0, 1.0], GOAL]), anchors)
    below = swept_angles(np.array([START, [0.0, -1.0], GOAL]), anchors)
    assert class_name(above, above) == "0 0"
    assert class_name(below, above) == "1 0"


def test_without_obstacles_there_is_no_cluster_and_one_class():
    clusters = find_clusters(field_of([]), CLEARANCE_M)
    assert len(clusters.anchors) == 0
    angles = swept_angles(np.array([START, GOAL]), clusters.anchors)
    assert same_class(angles, angles)


def test_a_cut_blocks_every_cell_that_it_crosses_and_those_above_and_to_the_right():
    # From row 0.95, column 0.5 in steps of 0.3 and 0.4: cells (0, 0), (1, 0), (1, 1) and (2, 2);
    # steps twice as long would leap over the corner of (1, 0).
    passable = np.ones((3, 4), dtype=bool)
    _cut(passable, 0.95, 0.5, 0.6, 0.8)
    rows = ["".join(".#"[not free] for free in row) for row in passable]
    assert rows == ["##..", "###.", "####"]
