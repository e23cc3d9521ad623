"""The roll-out of sampled twists."""

import math

import dwb_reference
import numpy as np
import pytest
from dwb_cases import parameters
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_navbench.controllers.dwb.kinematics import Kinematics
from drake_navbench.controllers.dwb.trajectories import TrajectoryGenerator

ORIGIN = (0.0, 0.0, 0.0)
REST = (0.0, 0.0, 0.0)
# One forward and, with it, three yaw rates: (0.26, 0, -1), (0.26, 0, 0), (0.26, 0, 1) among them.
FEW = {"vx_samples": 2, "vtheta_samples": 3}


def generate(p, *, pose=ORIGIN, twist=REST):
    return TrajectoryGenerator(p, 0.05).generate(pose, twist, Kinematics.from_parameters(p))


def find(window, twist):
    (k,) = np.flatnonzero(np.isclose(window.twists, twist, rtol=0, atol=1e-9).all(axis=1))
    return k, window.poses[k, : window.pose_counts[k]]


def test_straight_bringup_trajectory():
    # 0.26 * 1.7 / 0.05 = 8.84: 9 steps of 1.7 / 9 s; with start and repeated end 11 poses.
    # The first step already reaches 0.26 (2.5 * 0.189 = 0.47): the end is 0.26 * 1.7 = 0.442.
    window = generate(parameters(**FEW))
    k, poses = find(window, (0.26, 0.0, 0.0))
    assert window.step_counts[k] == 9
    assert window.step_s[k] == pytest.approx(0.188889, abs=1e-6)
    assert len(poses) == 11
    np.testing.assert_allclose(poses[-1], [0.442, 0.0, 0.0], rtol=0, atol=1e-12)
    np.testing.assert_array_equal(poses[-1], poses[-2])


def test_turning_bringup_trajectory():
    # 1.0 * 1.7 / 0.025 = 68 steps of 0.025 s. After the first, v = 2.5 * 0.025 = 0.0625 and
    # w = 3.2 * 0.025 = 0.08: x = 0.0625 * 0.025 = 0.0015625, yaw = 0.08 * 0.025 = 0.002.
    window = generate(parameters(**FEW))
    k, poses = find(window, (0.26, 0.0, 1.0))
    assert window.step_counts[k] == 68
    assert len(poses) == 70
    np.testing.assert_allclose(poses[1], [0.0015625, 0.0, 0.002], rtol=0, atol=1e-12)
    np.testing.assert_allclose(poses[2], [0.00468749, 6.25e-6, 0.006], rtol=0, atol=1e-8)
    np.testing.assert_allclose(poses[-1], [0.290192, 0.253930, 1.556], rtol=0, atol=1e-6)


def test_command_is_the_sample_or_the_first_simulated_velocity():
    window = generate(parameters(**FEW))
    np.testing.assert_array_equal(window.velocities, window.twists)
    window = generate(parameters(**FEW, limit_vel_cmd_in_traj=True))
    k, _ = find(window, (0.26, 0.0, 1.0))
    np.testing.assert_allclose(window.velocities[k], [0.0625, 0.0, 0.08], rtol=0, atol=1e-12)
    k, _ = find(window, (0.26, 0.0, 0.0))
    np.testing.assert_allclose(window.velocities[k], [0.26, 0.0, 0.0], rtol=0, atol=1e-12)


def test_limited_accel_generator_has_the_sampled_velocity_at_once():
    p = parameters(**FEW, trajectory_generator_name="LimitedAccelGenerator")
    window = generate(p, twist=(0.2, 0.0, 0.0))
    k = len(window.twists) // 2
    v, _, w = window.twists[k]
    step_s = window.step_s[k]
    np.testing.assert_allclose(window.poses[k, 1], [v * step_s, 0.0, w * step_s], atol=1e-15)


def test_end_pose_is_not_repeated_where_it_is_not_wanted():
    window = generate(parameters(**FEW, include_last_point=False))
    np.testing.assert_array_equal(window.pose_counts, window.step_counts + 1)


def test_steps_of_equal_time():
    # 1.7 / 0.5 = 3.4: 4 steps for every sample.
    window = generate(parameters(**FEW, discretize_by_time=True))
    np.testing.assert_array_equal(window.step_counts, 4)
    np.testing.assert_array_equal(window.step_s, 1.7 / 4)


def test_lateral_velocity_moves_to_the_left_of_the_heading():
    p = parameters(
        min_vel_y=0.2, max_vel_y=0.2, acc_lim_y=1e3, max_vel_x=0.0, max_speed_xy=-1.0, **FEW
    )
    window = generate(p, pose=(1.0, 2.0, math.pi / 6), twist=(0.0, 0.2, 0.0))
    _, poses = find(window, (0.0, 0.2, 0.0))
    # Left of 30 degrees is 120 degrees: 0.2 * 1.7 = 0.34 m along (-0.5, sqrt(3) / 2).
    expected = [1.0 - 0.34 * 0.5, 2.0 + 0.34 * math.sqrt(3) / 2, math.pi / 6]
    np.testing.assert_allclose(poses[-1], expected, rtol=0, atol=1e-12)


def test_with_a_deceleration_of_the_wrong_sign_a_robot_at_rest_turns_faster_and_faster():
    # The lowest turn rate, 3.0 * 1.7 = 5.1 rad/s, lies above the highest, 1.0: Nav2 tries it alone.
    window = generate(parameters(**FEW, decel_lim_theta=3.0))
    np.testing.assert_allclose(window.twists[:, 2], 5.1, rtol=0, atol=1e-12)
    assert {round(v, 9) for v in window.twists[:, 0].tolist()} == {0.0, 0.26}


def test_yaw_stays_wrapped():
    window = generate(parameters(**FEW), pose=(0.0, 0.0, 3.0))
    _, poses = find(window, (0.26, 0.0, 1.0))
    assert poses[-1, 2] == pytest.approx(3.0 + 1.556 - 2 * math.pi, abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(
    x=st.floats(-5, 5),
    yaw=st.floats(-math.pi, math.pi),
    vx=st.floats(-0.1, 0.5),
    vy=st.floats(-0.3, 0.3),
    wz=st.floats(-1.5, 1.5),
)
def test_every_pose_agrees_with_a_scalar_roll_out(x, yaw, vx, vy, wz):
    p = parameters(
        min_vel_x=-0.1,
        max_vel_x=0.5,
        min_vel_y=-0.2,
        max_vel_y=0.2,
        max_speed_xy=-1.0,
        acc_lim_y=1.0,
        decel_lim_y=-0.5,
        vx_samples=4,
        vy_samples=2,
        vtheta_samples=5,
    )
    window = generate(p, pose=(x, 1.0, yaw), twist=(vx, vy, wz))
    for k, sample in enumerate(window.twists):
        _, expected = dwb_reference.roll_out((x, 1.0, yaw), (vx, vy, wz), sample, p)
        poses = window.poses[k, : window.pose_counts[k]]
        np.testing.assert_allclose(poses[:, :2], np.array(expected)[:, :2], rtol=0, atol=1e-12)
        turned = np.exp(1j * poses[:, 2]) - np.exp(1j * np.array(expected)[:, 2])
        assert np.abs(turned).max() < 1e-12


def test_a_larger_window_later_does_not_disturb_the_buffers():
    p = parameters()
    generator = TrajectoryGenerator(p, 0.05)
    kinematics = Kinematics.from_parameters(p)
    first = generator.generate(ORIGIN, REST, kinematics).poses.copy()
    faster = kinematics._replace(max_vel_x=0.5, max_speed_xy=0.5, max_vel_theta=2.0)
    generator.generate(ORIGIN, REST, faster)
    again = generator.generate(ORIGIN, REST, kinematics)
    for k, count in enumerate(again.pose_counts):
        np.testing.assert_array_equal(again.poses[k, :count], first[k, :count])
