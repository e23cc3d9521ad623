"""Whole cycles: motion models, several passes, the validator, users' critics and diagnostics."""

from __future__ import annotations

import numpy as np
import pytest
from mppi_scenes import BRINGUP, observe, round_robot, scene_of
from pydantic import ValidationError
from scenes import straight_plan

from drake_navbench.controller import NoValidControl
from drake_navbench.controllers.mppi import ModelPredictivePathIntegral, MppiParameters
from drake_navbench.controllers.mppi.noise import Noise
from drake_navbench.controllers.mppi.sampler import Sampler

STEPS = 56
LETHAL = 254


def sampler_of(**parameters) -> Sampler:
    """One sample around the warm start, which is smoothed to itself where it is constant."""
    return Sampler(
        MppiParameters(batch_size=1, gamma=0.0, **parameters), round_robot(), keeps_samples=True
    )


def run_from(sampler, velocity, *, scene=None):
    """One cycle without noise from a warm start at constant velocity (vx, vy, wz)."""
    steady = np.repeat(np.asarray(velocity, np.float32)[:, None], STEPS, axis=1)
    start = sampler.initial_state()._replace(
        controls=steady, history=steady[:, :4].copy(), last_command=np.asarray(velocity, float)
    )
    silence = Noise.empty(1, STEPS, holonomic=sampler.rules.holonomic)
    scene = scene_of(straight_plan(1.45)) if scene is None else scene
    return sampler.run(scene, velocity, start, draw=lambda resets, index: silence)


def test_an_omnidirectional_robot_slides_sideways():
    # Heading along y, its left is -x: 0.2 m/s x 0.05 s = 0.01 m a step.
    scene = scene_of(straight_plan(1.45), pose=(0.0, 0.0, np.pi / 2))
    result = run_from(sampler_of(motion_model="Omni"), (0.0, 0.2, 0.0), scene=scene)
    slid = -0.01 * np.arange(1, STEPS + 1)
    np.testing.assert_allclose(result.batch.poses[0, :, 0], slid, atol=1e-5)
    np.testing.assert_allclose(result.batch.poses[0, :, 1], 0.0, atol=1e-5)
    np.testing.assert_allclose(result.trajectory[:, 0], slid, atol=1e-5)
    assert result.command == pytest.approx([0.0, 0.2, 0.0], abs=1e-6)


def test_a_differential_robot_never_slides():
    result = run_from(sampler_of(), (0.3, 0.0, 0.0))
    assert not result.batch.velocities[0, :, 1].any()


def test_an_ackermann_robot_turns_no_tighter_than_its_radius():
    # 0.3 m/s on a radius of 0.6 m is 0.5 rad/s.
    sampler = sampler_of(
        motion_model="Ackermann", AckermannConstraints={"min_turning_r": 0.6}, az_max=1000.0
    )
    result = run_from(sampler, (0.3, 0.0, 1.0))
    np.testing.assert_allclose(np.abs(result.controls[2]), 0.5, atol=1e-6)


def test_an_ackermann_robot_without_a_turning_radius_is_refused():
    with pytest.raises(ValidationError, match="min_turning_r"):
        sampler_of(motion_model="Ackermann", AckermannConstraints={"min_turning_r": 0.0})


def test_costs_add_up_over_the_passes_of_a_cycle():
    # Without noise every pass samples the same trajectory and pays its price again.
    once = run_from(sampler_of(critics=["PathFollowCritic"]), (0.3, 0.0, 0.0))
    thrice = run_from(sampler_of(critics=["PathFollowCritic"], iteration_count=3), (0.3, 0.0, 0.0))
    assert once.costs[0] > 0.1
    assert thrice.costs[0] == pytest.approx(3 * once.costs[0], rel=1e-5)


def wall_ahead():
    """A wall 0.4 m ahead of the robot."""
    costs = np.zeros((60, 60), np.uint8)
    costs[:, 38] = LETHAL  # x in [0.40, 0.45)
    return scene_of(straight_plan(1.45), costs=costs)


def test_a_colliding_average_is_optimised_anew_from_rest():
    # The warm start meets the wall after 0.8 s; without noise the second attempt stands still.
    result = run_from(sampler_of(), (0.5, 0.0, 0.0), scene=wall_ahead())
    assert result.retry_count == 1
    assert result.state.reset_count == 1
    # It brakes at 3 m/s^2: 0.5 - 0.15 after the first step.
    assert result.command[0] == pytest.approx(0.35, abs=1e-6)


def test_without_retries_a_colliding_average_is_no_valid_control():
    sampler = sampler_of(retry_attempt_limit=0)
    with pytest.raises(NoValidControl, match="averaged trajectory collides"):
        run_from(sampler, (0.5, 0.0, 0.0), scene=wall_ahead())


def test_the_validator_looks_no_further_than_its_time():
    sampler = sampler_of(TrajectoryValidator={"collision_lookahead_time": 0.5})
    assert run_from(sampler, (0.5, 0.0, 0.0), scene=wall_ahead()).retry_count == 0


def test_diagnostics_carry_what_a_replay_draws():
    controller = ModelPredictivePathIntegral(
        MppiParameters(**BRINGUP), round_robot(wants_diagnostics=True)
    )
    decision = controller.step(observe(), controller.initial_memory())
    shown = decision.diagnostics
    # Every fifth of 2000 samples.
    assert shown["sampled_trajectories"].shape == (400, STEPS, 3)
    assert shown["predicted_trajectory"].shape == (STEPS, 3)
    assert shown["sampled_step"] == 5
    assert shown["retry_count"] == 0
    by_critic = sum(shown[f"critic_cost_{name}"] for name in BRINGUP["critics"])
    # What is left of the total is MPPI's control cost, zero around a sequence at rest.
    np.testing.assert_allclose(by_critic, shown["sampled_costs"], rtol=1e-5)
    assert shown["least_cost"] <= shown["sampled_costs"].min()


def test_without_a_wish_diagnostics_are_numbers_only():
    controller = ModelPredictivePathIntegral(MppiParameters(**BRINGUP), round_robot())
    decision = controller.step(observe(), controller.initial_memory())
    assert set(decision.diagnostics) == {"retry_count", "least_cost"}
