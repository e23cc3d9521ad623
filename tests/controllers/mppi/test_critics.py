"""Each critic alone, against numbers worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from mppi_scenes import batch_of, costmap, critic_of, round_robot, scene_of
from scenes import straight_plan

from drake_navbench.controllers.mppi.critics.batch import Scene


def test_a_scene_wraps_headings_beyond_half_a_turn_as_quaternions_do():
    # 4 - 2 pi = -2.2832, 2 pi - 3.5 = 2.7832, 7 - 2 pi = 0.7168 rad; -0.5 rad stays as it is.
    scene = Scene.from_plan(
        [[0.0, 0.0, 4.0], [1.0, 0.0, -0.5]],
        pose=[0.0, 0.0, -3.5],
        costmap=costmap(),
        straight_goal=np.array([1.0, 0.0, 7.0]),
    )
    assert scene.path_yaw == pytest.approx([-2.2832, -0.5], abs=1e-4)
    assert scene.pose[2] == pytest.approx(2.7832, abs=1e-4)
    assert scene.goal[2] == pytest.approx(0.7168, abs=1e-4)


def score(critic, batch):
    costs, fail = critic.score(batch)
    return float(costs[0]), fail


def test_constraint_integrates_the_excess_over_the_limits():
    # 0.05 s (0.2 + 0 + 0.15) m/s = 0.0175 m, times 4.
    batch = batch_of(scene_of(straight_plan(1.45)), x=np.zeros(3), vx=[0.7, 0.1, -0.5])
    assert score(critic_of("ConstraintCritic", steps=3), batch)[0] == pytest.approx(0.07, rel=1e-5)


def test_prefer_forward_integrates_reverse_velocity():
    # 0.05 s (0.1 + 0.3) m/s = 0.02 m, times 5.
    batch = batch_of(scene_of(straight_plan(1.45)), x=np.zeros(3), vx=[-0.1, 0.2, -0.3])
    cost, _ = score(critic_of("PreferForwardCritic", steps=3), batch)
    assert cost == pytest.approx(0.1, rel=1e-5)


def test_twirling_is_the_mean_turn_rate():
    # (0.3 + 0.6) / 3 = 0.3 rad/s, times 10.
    batch = batch_of(scene_of(straight_plan(1.45)), x=np.zeros(3), wz=[0.3, -0.6, 0.0])
    assert score(critic_of("TwirlingCritic", steps=3), batch)[0] == pytest.approx(3.0, rel=1e-5)


def test_velocity_deadband_integrates_what_lacks_to_the_deadband():
    # vx: 0.05 + 0, wz: 0.1 + 0.05; 0.05 s x 0.2 = 0.01, times 35.
    critic = critic_of("VelocityDeadbandCritic", steps=2, deadband_velocities=(0.1, 0.0, 0.2))
    batch = batch_of(scene_of(straight_plan(1.45)), x=np.zeros(2), vx=[0.05, -0.3], wz=[0.1, 0.15])
    assert score(critic, batch)[0] == pytest.approx(0.35, rel=1e-5)


def test_goal_is_the_mean_distance_to_the_end_of_the_local_plan():
    # Goal (1, 0); distances 1 and 0.5: mean 0.75, times 5.
    batch = batch_of(scene_of(straight_plan(1.0)), x=[0.0, 0.5])
    assert score(critic_of("GoalCritic", steps=2), batch)[0] == pytest.approx(3.75, rel=1e-5)


def test_goal_is_silent_while_the_plan_is_long():
    batch = batch_of(scene_of(straight_plan(1.45)), x=[0.0, 0.5])
    assert score(critic_of("GoalCritic", steps=2), batch)[0] == 0.0


def test_goal_angle_wraps_and_may_accept_the_reverse():
    # Yaws 3.0 and -3.0 against 0: 3.0 each; against pi: pi - 3 each. Times 3.
    batch = batch_of(scene_of(straight_plan(0.4)), x=[0.0, 0.0], yaw=[3.0, -3.0])
    one_sided = critic_of("GoalAngleCritic", steps=2)
    two_sided = critic_of("GoalAngleCritic", steps=2, symmetric_yaw_tolerance=True)
    assert score(one_sided, batch)[0] == pytest.approx(9.0, rel=1e-5)
    assert score(two_sided, batch)[0] == pytest.approx(3 * (math.pi - 3), rel=1e-4)


def test_path_follow_aims_at_the_free_point_ahead_of_the_furthest():
    # Furthest 2, offset 6: point 8 at x = 0.40; occupied, so point 9 at 0.45.
    costs = np.zeros((60, 60), np.uint8)
    costs[:, 38] = 254  # x in [0.40, 0.45)
    plan = straight_plan(1.45) + np.array([0.01, 0.0, 0.0])
    batch = batch_of(scene_of(plan, costs=costs), x=[0.0, 0.1], furthest=2)
    # Point 9 is at 0.46, 0.36 m ahead of the end; times 5.
    assert score(critic_of("PathFollowCritic", steps=2, threshold_to_consider=1.0), batch)[
        0
    ] == pytest.approx(1.8, rel=1e-4)


def test_path_align_compares_by_arc_length():
    # F = 5: points at 0, 0.1 .. 0.4. Columns 0, 0.12, 0.16, 0.37, 0.60 at y = 0.05 meet the points
    # 1, 2, 4, 4: distances 0.05385, 0.06403, 0.05831, 0.20616, mean 0.09559, times 14.
    x = np.arange(16) * 0.1
    plan = np.column_stack([x, 0 * x, 0 * x])
    critic = critic_of(
        "PathAlignCritic",
        steps=5,
        cost_weight=14.0,
        trajectory_point_step=1,
        offset_from_furthest=0,
    )
    batch = batch_of(scene_of(plan), x=[0.0, 0.12, 0.16, 0.37, 0.60], y=0.05, furthest=5)
    assert score(critic, batch)[0] == pytest.approx(1.3382, abs=1e-4)


def test_path_angle_acts_beyond_its_gate_and_by_its_mode():
    # Target (1, 0); robot yaw 1.2 opens the gate. End (0.2, 0.1): bearing -0.12435.
    plan = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
    scene = scene_of(plan, pose=(0.0, 0.0, 1.2))
    forward = critic_of("PathAngleCritic", steps=2, cost_weight=2.0)
    either = critic_of("PathAngleCritic", steps=2, cost_weight=2.0, mode=1)
    by_path = critic_of("PathAngleCritic", steps=2, cost_weight=2.0, mode=2)
    slight = batch_of(scene, x=[0.0, 0.2], y=[0.0, 0.1], yaw=[0.0, 0.5], furthest=0)
    reversed_ = batch_of(scene, x=[0.0, 0.2], y=[0.0, 0.1], yaw=[0.0, 3.0], furthest=0)
    assert score(forward, slight)[0] == pytest.approx(1.2487, abs=1e-4)
    assert score(either, reversed_)[0] == pytest.approx(2 * 0.01724, abs=1e-4)
    assert score(by_path, reversed_)[0] == pytest.approx(2 * 3.12435, abs=1e-4)
    aligned = batch_of(scene_of(plan), x=[0.0, 0.2], yaw=[0.0, 0.5], furthest=0)
    assert score(forward, aligned)[0] == 0.0


def test_cost_sums_cell_values_over_every_second_column():
    # 28 columns on cells of 100: 28 x 100 x 3.81 / 254 / 28 = 1.5.
    costs = np.full((60, 60), 100, np.uint8)
    batch = batch_of(scene_of(straight_plan(1.45), costs=costs), x=np.zeros(56))
    assert score(critic_of("CostCritic"), batch) == (pytest.approx(1.5, rel=1e-5), False)


def test_cost_of_a_collision_replaces_the_sum_and_fails_if_all_collide():
    # 1e6 x 3.81 / 254 / 28 = 535.71.
    costs = np.zeros((60, 60), np.uint8)
    costs[30, 40] = 254  # x in [0.50, 0.55), y in [0, 0.05)
    scene = scene_of(straight_plan(1.45), costs=costs)
    x = np.linspace(0.0, 1.2, 56)
    x[20] = 0.52
    assert score(critic_of("CostCritic"), batch_of(scene, x=x, y=0.02)) == (
        pytest.approx(535.71, rel=1e-4),
        True,
    )


def test_cost_takes_leaving_the_map_for_a_collision():
    batch = batch_of(scene_of(straight_plan(1.45)), x=np.linspace(0.0, 3.0, 56))
    assert score(critic_of("CostCritic"), batch) == (pytest.approx(535.71, rel=1e-4), True)


def test_obstacles_reads_distances_back_from_the_costs():
    # One column on 252: d = 0.00132 m, margin shortfall 0.09868, times 20; the repulsion of a
    # single sample is its own minimum and counts nothing.
    costs = np.zeros((60, 60), np.uint8)
    costs[30, 30] = 252
    setup = round_robot(inflation_radius_m=0.7, inflation_cost_scaling_factor=3.0)
    batch = batch_of(scene_of(straight_plan(1.45), costs=costs), x=[0.02, 1.0], y=0.02)
    cost, fail = score(critic_of("ObstaclesCritic", setup=setup, steps=2), batch)
    assert cost == pytest.approx(20 * 0.09868, rel=1e-4)
    assert not fail


def test_power_applies_to_the_weighted_term():
    batch = batch_of(scene_of(straight_plan(1.0)), x=[0.0, 0.5])
    cost, _ = score(critic_of("GoalCritic", steps=2, cost_power=2), batch)
    assert cost == pytest.approx(3.75**2, rel=1e-5)


def test_furthest_point_is_bounded_by_the_length_driven():
    # Out along x = 0 .. 0.5 and back at y = 0.02: a sample of length 0.281 ends nearer to the
    # return leg, but may use points up to 3 only.
    out = [[0.1 * k, 0.0, 0.0] for k in range(6)]
    back = [[0.4 - 0.1 * k, 0.02, math.pi] for k in range(5)]
    batch = batch_of(scene_of(out + back), x=[0.0, 0.28], y=[0.0, 0.02])
    assert batch.furthest == 3
