"""The sampler's parts against the worked examples, and the controller as a whole."""

from __future__ import annotations

import numpy as np
import pytest
from mppi_scenes import BRINGUP, observe, round_robot, scene_of
from pydantic import ValidationError
from scenes import straight_plan

from drake_navbench.controller import NoValidControl, SpeedLimit
from drake_navbench.controllers.mppi import ModelPredictivePathIntegral, MppiParameters
from drake_navbench.controllers.mppi.controller import limited
from drake_navbench.controllers.mppi.float32_math import sin_cos, wrap32
from drake_navbench.controllers.mppi.lanes import pack, unpack
from drake_navbench.controllers.mppi.motion_models import (
    constrain_axis,
    delay_lanes,
    reachable,
    velocity_lanes,
)
from drake_navbench.controllers.mppi.noise import Noise, fill_normal
from drake_navbench.controllers.mppi.roll_out import softmax_weights
from drake_navbench.controllers.mppi.sampler import Sampler
from drake_navbench.controllers.mppi.sequence_rules import limits_of, smooth
from drake_navbench.errors import InputError

F32 = np.float32


def controller_of(setup=None, **changes):
    return ModelPredictivePathIntegral(
        MppiParameters(**{**BRINGUP, **changes}), setup or round_robot()
    )


def test_packing_keeps_every_sample():
    samples = np.arange(70 * 5, dtype=np.float32).reshape(70, 5)
    np.testing.assert_array_equal(unpack(pack(samples), 70), samples)


@pytest.mark.parametrize("angle", [0.0, 0.5, -2.0, 3.1, 7.9, -40.0])
def test_float32_sine_and_cosine_agree_with_libm(angle):
    sine, cosine = sin_cos(F32(angle))
    assert sine == pytest.approx(np.sin(float(F32(angle))), abs=2e-7)
    assert cosine == pytest.approx(np.cos(float(F32(angle))), abs=2e-7)


def test_wrapping_follows_the_remainder():
    assert wrap32(F32(3.5)) == pytest.approx(3.5 - 2 * np.pi, abs=1e-6)
    assert wrap32(F32(-3.5)) == pytest.approx(2 * np.pi - 3.5, abs=1e-6)


def test_noise_is_standard_normal_and_a_function_of_its_key():
    first, second, other = (np.zeros((32, 56, 64), np.float32) for _ in range(3))
    fill_normal((1, 2, 3), 0.5, first)
    fill_normal((1, 2, 3), 0.5, second)
    fill_normal((1, 2, 4), 0.5, other)
    np.testing.assert_array_equal(first, second)
    # Standard errors with 114688 numbers: mean 0.0015, deviation 0.001, correlation 0.003.
    assert abs(first.mean()) < 0.007
    assert first.std() == pytest.approx(0.5, abs=0.006)
    assert abs(np.corrcoef(first.ravel(), other.ravel())[0, 1]) < 0.015


@pytest.mark.parametrize(
    ("previous", "lowest", "highest"), [(0.3, 0.1, 0.4), (-0.3, -0.4, -0.1), (0.0, -0.2, 0.1)]
)
def test_reachable_velocities_of_the_sequence(previous, lowest, highest):
    # a_max = 1, a_min = -2, h = 0.1.
    arguments = (F32(0.1), F32(-0.2))
    assert reachable(F32(previous), F32(-9), *arguments) == pytest.approx(lowest)
    assert reachable(F32(previous), F32(9), *arguments) == pytest.approx(highest)


def test_a_standing_robot_rolls_out_as_if_it_moved_backward():
    # Unlike the sequence's window, the roll-out's at standstill is [-0.1, 0.2].
    velocities = np.zeros((2, 64), np.float32)
    noise = np.zeros((2, 64), np.float32)
    noise[0, 0], noise[0, 1] = 9, -9
    velocity_lanes(F32(0), F32(0.1), F32(-0.2), np.zeros(2, np.float32), noise, velocities)
    assert velocities[1, :2] == pytest.approx([0.2, -0.1])


def test_delay_inserts_earlier_commands():
    velocities = np.repeat(np.array([[0.0], [0.1], [0.2], [0.3], [0.4], [0.5]], F32), 64, axis=1)
    delay_lanes(velocities, np.array([0.7, 0.8, 0.9], F32))
    assert velocities[:, 0] == pytest.approx([0.0, 0.8, 0.9, 0.1, 0.2, 0.3])


def test_constraint_chain_brakes_from_overspeed_at_the_allowed_rate():
    controls = np.array([0.7, 0.5, 0.5, 0.5], np.float32)
    rise = F32(0.05)
    constrain_axis(controls, F32(0.7), F32(-0.35), F32(0.5), rise, -rise, F32(1))
    assert controls == pytest.approx([0.65, 0.6, 0.55, 0.5])


def test_softmax_of_two_costs():
    weights = softmax_weights(np.array([1.0, 1.3], np.float32), F32(0.3))
    assert weights == pytest.approx([0.7311, 0.2689], abs=1e-4)


def test_smoothing_against_an_empty_history():
    controls = np.ones((3, 56), np.float32)
    smoothed = smooth(controls, np.zeros((3, 4), np.float32), order=2)
    expected = [145 / 231, 199 / 231, 238 / 231, 252 / 231, 1.0]
    assert smoothed[0, :5] == pytest.approx(expected, rel=1e-5)


def test_short_sequences_are_not_smoothed():
    controls = np.arange(60, dtype=np.float32).reshape(3, 20)
    assert smooth(controls, np.zeros((3, 4), np.float32), order=2) is controls


def test_one_sample_without_noise_returns_the_warm_start():
    parameters = MppiParameters(batch_size=1, gamma=0.0)
    sampler = Sampler(parameters, round_robot())
    controls = np.zeros((3, 56), np.float32)
    controls[0] = 0.3
    start = sampler.initial_state()._replace(
        controls=controls,
        history=np.repeat(np.array([[0.3], [0.0], [0.0]], F32), 4, axis=1),
        last_command=np.array([0.3, 0.0, 0.0]),
    )
    silence = Noise.empty(1, 56, holonomic=False)
    result = sampler.run(
        scene_of(straight_plan(1.45)), (0.3, 0.0, 0.0), start, draw=lambda resets, index: silence
    )
    np.testing.assert_allclose(result.controls, controls, atol=1e-6)
    assert result.command == pytest.approx([0.3, 0.0, 0.0], abs=1e-6)


def drive_straight(controller, *, cycles):
    memory, twist, commands = controller.initial_memory(), np.zeros(2), []
    for step in range(cycles):
        decision = controller.step(observe(twist=twist, step=step), memory)
        memory, twist = decision.memory, decision.command
        commands.append(decision.command)
    return np.array(commands)


def test_a_free_straight_path_is_driven_at_full_speed_without_turning():
    # Without the control cost nothing holds the robot back.
    commands = drive_straight(controller_of(gamma=0.0), cycles=40)
    assert commands[-10:, 0] == pytest.approx(0.5, abs=0.02)
    assert abs(commands[-10:, 1].mean()) < 0.05


def test_the_control_cost_holds_a_free_straight_path_at_nine_tenths_of_full_speed():
    # The original does the same with the same noise: 0.447 m/s in a closed loop.
    commands = drive_straight(controller_of(), cycles=60)
    assert commands[-20:, 0].mean() == pytest.approx(0.447, abs=0.015)
    assert abs(commands[-20:, 1].mean()) < 0.02


def test_equal_keys_give_equal_commands_whatever_ran_before():
    fresh, used = controller_of(), controller_of()
    drive_straight(used, cycles=5)
    first = fresh.step(observe(step=7), fresh.initial_memory())
    second = used.step(observe(step=7), used.initial_memory())
    np.testing.assert_array_equal(first.command, second.command)
    np.testing.assert_array_equal(first.memory.sampler.controls, second.memory.sampler.controls)


def test_a_mirrored_world_and_mirrored_noise_give_the_mirrored_sequence():
    sampler = Sampler(MppiParameters(**BRINGUP), round_robot())
    noise = Noise.empty(2000, 56, holonomic=False)
    noise.draw((3, 1), (0.2, 0.0, 0.4))
    mirrored_noise = Noise(noise.vx, noise.vy, -noise.wz)
    costs = np.zeros((60, 60), np.uint8)
    costs[33:40, 36:44] = 120
    plan = straight_plan(1.45)
    # The plan lies off the cells' edges, so that mirroring maps cells to cells.
    original = scene_of(plan, pose=(0.01, 0.013, 0.1), costs=costs)
    mirrored = scene_of(plan, pose=(0.01, -0.013, -0.1), costs=costs[::-1])
    speed = (0.3, 0.0, 0.0)
    left = sampler.run(original, speed, sampler.initial_state(), draw=lambda *_: noise)
    right = sampler.run(mirrored, speed, sampler.initial_state(), draw=lambda *_: mirrored_noise)
    np.testing.assert_allclose(left.controls[0], right.controls[0], atol=1e-4)
    np.testing.assert_allclose(left.controls[2], -right.controls[2], atol=1e-4)
    assert np.abs(left.controls[2]).max() > 0.01


def test_no_control_is_valid_where_every_sample_collides():
    controller = controller_of()
    costs = np.full((60, 60), 254, np.uint8)
    with pytest.raises(NoValidControl, match="every sample collides") as caught:
        controller.step(observe(costs=costs), controller.initial_memory())
    # One reset for each of the two attempts, each of which redraws the fixed noise.
    assert caught.value.memory.sampler.reset_count == 2
    assert not caught.value.memory.sampler.controls.any()


def test_a_speed_limit_scales_velocities_and_not_accelerations():
    base = limits_of(MppiParameters())
    half = limited(base, SpeedLimit(50.0, is_percentage=True))
    assert half.vx_max == pytest.approx(0.25)
    assert half.wz_max == pytest.approx(0.95)
    assert half.ax_max == base.ax_max
    assert limited(base, SpeedLimit(0.25)) == half


@pytest.mark.parametrize(
    ("parameters", "named"),
    [
        ({"batch_size": 0}, "batch_size"),
        ({"time_steps": 0}, "time_steps"),
        ({"temperature": 0.0}, "temperature"),
        ({"motion_model": "Hover"}, "motion_model"),
        ({"GoalCritic": {"cost_wieght": 1.0}}, "cost_wieght"),
        ({"critics": ["GoalCritic", "GoalCritic"]}, "critics"),
    ],
)
def test_bad_parameters_are_named(parameters, named):
    with pytest.raises(ValidationError, match=named):
        MppiParameters(**parameters)


def test_a_step_below_the_control_period_is_refused():
    with pytest.raises(InputError, match="model_dt"):
        controller_of(model_dt=0.04)


def test_nav2_names_of_motion_models_are_understood():
    parameters = MppiParameters.model_validate(
        {
            "motion_model": "car",
            "car": {"plugin": "mppi::AckermannMotionModel", "min_turning_r": 0.6},
        }
    )
    assert parameters.motion_model == "Ackermann"
    assert parameters.AckermannConstraints.min_turning_r == 0.6
    assert MppiParameters(**parameters.model_dump()) == parameters
