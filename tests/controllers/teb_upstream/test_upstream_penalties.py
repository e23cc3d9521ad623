"""Costs by hand and by the original, slopes by finite differences."""

import math

import numpy as np
import pytest
from upstream_scenes import OBSTACLES, around, evaluate, record_of, straight

from drake_navbench.controllers.teb_upstream.association import attach
from drake_navbench.controllers.teb_upstream.normal_equations import (
    OBSTACLE_COST,
    OTHER_COST,
    STRIDE,
    TIME_COST,
    VIA_POINT_COST,
    excess_outside,
)
from drake_navbench.controllers.teb_upstream.robot_models import circles, model_distance, outline

# The boxes and circles of the cases that the original was asked for.
BOX = outline(np.array([[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2]]))
CIRCLES = circles(np.array([[0.2, 0.2], [-0.1, 0.15]]))


def bent_band():
    poses = straight()
    poses[1:-1, 1:] = 0.1, 0.05
    return poses, np.full(8, 0.5)


def costs_of(poses, steps, scene, multiplier=1.0, **values):
    record = record_of(**values)
    attached = attach(poses, len(poses), scene, record)
    return evaluate(poses, steps, record, scene, attached, multiplier)[0]


def test_slow_steady_motion_costs_its_squared_time_steps_and_the_hard_start_and_stop():
    # 0.25 m in 1 s: the sign of the speed is 25 / 26, so that it is 0.2404 m/s.
    speed = 0.25 * 25.0 / 26.0
    # From rest and to rest within a whole step of 1 s, below 0.5 - 0.05 m/s^2.
    costs = costs_of(straight(), np.ones(8), around())
    assert costs[TIME_COST] == pytest.approx(8.0)
    assert costs[OTHER_COST] == 0.0
    # In steps of 0.5 s the speed is above 0.4 - 0.05 m/s, and so are both accelerations.
    costs = costs_of(straight(), np.full(8, 0.5), around())
    excess = 2.0 * speed - 0.35
    jump = 2.0 * speed / 0.5 - 0.45
    assert costs[TIME_COST] == pytest.approx(2.0)
    assert costs[OTHER_COST] == pytest.approx(8 * 2.0 * excess**2 + 2 * jump**2)


def test_an_obstacle_costs_the_missing_distance_and_the_inflation():
    poses = straight(1.0, 0.5)
    scene = around(obstacles=np.array([[0.5, 0.3]]), via_points=np.array([[0.5, 0.2]]))
    costs = costs_of(poses, np.full(2, 2.0), scene, multiplier=4.0)
    # 0.3 m instead of 0.55 m and of 0.6 m.
    assert costs[OBSTACLE_COST] == pytest.approx(4.0 * 50.0 * 0.25**2 + 0.1 * 0.3**2)
    assert costs[VIA_POINT_COST] == pytest.approx(0.2**2)


def test_costs_are_those_of_the_original():
    """The numbers come from teb_local_planner (ros2-master) with g2o."""
    poses, steps = bent_band()
    scene = around(
        twist=(0.2, 0.1),
        obstacles=OBSTACLES,
        via_points=np.array([[1.0, -0.2]]),
        robot=BOX,
        preferred_turn=1.0,
    )
    assert costs_of(poses, steps, scene, 2.0).sum() == pytest.approx(318.7008010570478, rel=1e-12)
    scene = around(twist=(0.2, 0.1), obstacles=OBSTACLES, robot=CIRCLES)
    total = costs_of(
        poses,
        steps,
        scene,
        min_turning_radius=0.5,
        exact_arc_length=True,
        weight_shortest_path=0.5,
        obstacle_cost_exponent=2.0,
        weight_velocity_obstacle_ratio=2.0,
    ).sum()
    assert total == pytest.approx(177.4057339681052, rel=1e-12)


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"exact_arc_length": True, "weight_shortest_path": 0.7, "obstacle_cost_exponent": 2.5},
        {"min_turning_radius": 0.5, "weight_velocity_obstacle_ratio": 3.0},
        {"min_turning_radius": 0.5, "exact_arc_length": True, "free_goal_vel": True},
    ],
)
@pytest.mark.parametrize("robot", [BOX, CIRCLES])
def test_slopes_agree_with_finite_differences(values, robot):
    rng = np.random.default_rng(4)
    record = record_of(**values)
    count = 9
    poses = straight() + rng.normal(0.0, 0.05, (count, 3))
    steps = rng.uniform(0.3, 1.0, count - 1)
    scene = around(
        twist=(0.1, -0.2),
        obstacles=OBSTACLES,
        via_points=np.array([[0.6, 0.1]]),
        robot=robot,
        stops_at_goal=not values.get("free_goal_vel", False),
        preferred_turn=-1.0,
    )
    attached = attach(poses, count, scene, record)

    def total(columns):
        table = columns.reshape(count, STRIDE)
        moved = np.ascontiguousarray(table[:, :3])
        return evaluate(moved, table[:-1, 3], record, scene, attached, 2.0)[0].sum()

    columns = np.column_stack([poses, np.append(steps, 0.0)]).ravel()
    _, system = evaluate(poses, steps, record, scene, attached, 2.0)
    for column in range(3, len(columns) - 5):
        step = np.zeros(len(columns))
        step[column] = 1e-6
        numeric = (total(columns + step) - total(columns - step)) / 2e-6
        # The right side is minus half of the gradient.
        assert -2.0 * system.right[column] == pytest.approx(numeric, rel=1e-5, abs=1e-4)


def test_at_a_limit_the_slope_is_half_as_central_differences_say():
    poses = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.25], [0.0, 0.0, 0.5]])
    record = record_of(weight_acc_lim_x=0.0, weight_acc_lim_theta=0.0, penalty_epsilon=0.0)
    scene = around()
    attached = attach(poses, 3, scene, record)
    _, system = evaluate(poses, np.full(2, 0.25 / 0.3), record, scene, attached)
    step = 0.25 / 0.3
    # Half the slope 0.3 / step of the turn rate, squared; one from the time step itself.
    assert system.matrix[3, 0] == pytest.approx(1.0 + (0.5 * 0.3 / step) ** 2)
    assert math.isclose(system.right[3], -step, abs_tol=1e-9)


def matrix_of(poses, scene, **values):
    record = record_of(**values)
    attached = attach(poses, len(poses), scene, record)
    return evaluate(poses, np.ones(len(poses) - 1), record, scene, attached)[1].matrix


def test_going_straight_the_preferred_side_has_half_its_slope():
    # Pose 1 takes part in two intervals without a turn: 50 (0.5^2 + 0.5^2).
    yaw_1 = STRIDE + 2
    without, preferred = (
        matrix_of(straight(), around(preferred_turn=side))[yaw_1, 0] for side in (0.0, 1.0)
    )
    assert preferred - without == pytest.approx(25.0)


@pytest.mark.parametrize(("radius", "slope"), [(0.0, 2.0), (0.5, 2.0e-3)])
def test_the_arc_condition_of_a_car_has_next_to_no_slope_on_a_straight_band(radius, slope):
    poses = straight(1.0, 0.5)
    # The condition is off by 2e-12, a thousandth of what g2o's step of 1e-9 changes it by.
    poses[1, 1] = 1e-12
    y_1 = STRIDE + 1
    without, with_arc = (
        matrix_of(poses, around(), min_turning_radius=radius, weight_kinematics_nh=weight)[y_1, 0]
        for weight in (0.0, 1000.0)
    )
    assert with_arc - without == pytest.approx(2 * 1000.0 * slope**2, rel=1e-3)


def test_a_via_point_on_a_pose_has_next_to_no_slope():
    poses = straight(1.0, 0.5)
    # The pose is off by 1e-12 m, a thousandth of g2o's step of 1e-9.
    poses[1, 1] = 1e-12
    y_1 = STRIDE + 1
    without, attracted = (
        matrix_of(poses, around(via_points=points))[y_1, 0]
        for points in (np.empty((0, 2)), np.array([[poses[1, 0], 0.0]]))
    )
    assert attracted - without == pytest.approx(1e-3**2, rel=1e-3)


def test_between_two_edges_as_near_the_slope_is_the_mean_of_both():
    def slopes(x, y):
        return model_distance(BOX, 0.0, 0.0, 1.0, 0.0, x, y)

    # In the middle both sides are 0.2 m away, and a step to either brings one nearer.
    assert slopes(0.0, 0.0) == pytest.approx((0.2, 0.0, 0.0, 0.0), abs=1e-6)
    # On the bisector of a corner: the front has slopes (1, 0, -0.1), the left side (0, 1, 0.2).
    assert slopes(0.2, 0.1) == pytest.approx((0.1, 0.5, 0.5, 0.05), abs=1e-6)
    assert slopes(0.2, 0.1 - 1e-6) == pytest.approx((0.1, 1.0, 0.0, -0.1), abs=1e-5)
    # A corner is one feature, though two edges end there.
    assert slopes(0.6, 0.6) == pytest.approx((0.5, -0.6, -0.8, -0.12))


def test_a_limit_below_the_margin_costs_what_the_original_says():
    # The interval from -0.02 to 0.02, narrowed by 0.05 on each side, is judged from below first.
    assert excess_outside(0.01, -0.02, 0.02, 0.05) == pytest.approx((0.02, -1.0))
    assert excess_outside(0.04, -0.02, 0.02, 0.05) == pytest.approx((0.07, 1.0))
