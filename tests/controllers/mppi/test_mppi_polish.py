"""The polish: its gradient, its solver, its limits and when it is dropped."""

from __future__ import annotations

import numpy as np
import pytest
from mppi_scenes import BRINGUP, observe, round_robot

from drake_navbench.controllers.mppi import ModelPredictivePathIntegral, MppiParameters
from drake_navbench.controllers.mppi import polish as polish_module
from drake_navbench.controllers.mppi.objective import (
    PolishSituation,
    Weights,
    add_pose_curvature,
    cost_field,
    interpolate,
    objective,
)
from drake_navbench.controllers.mppi.polish import Polish
from drake_navbench.controllers.mppi.refinement import path_references
from drake_navbench.controllers.mppi.sequence_rules import limits_of
from drake_navbench.kernels.grid import Grid
from drake_navbench.kernels.read_only import read_only

STEPS, DT = 56, 0.05
WEIGHTS = Weights(
    path=20.0,
    heading=2.0,
    obstacle=2.0,
    progress=2.0,
    linear_deviation=0.5 / 0.2**2,
    angular_deviation=0.5 / 0.4**2,
    linear_jerk=0.01,
    angular_jerk=0.002,
)
LIMITS = limits_of(MppiParameters())
# Accelerations that bind nothing, as in the preset.
FREE = LIMITS._replace(ax_max=np.float32(1e3), ax_min=np.float32(-1e3), az_max=np.float32(1e3))


def situation_of(seed=0, *, starts_now=True) -> PolishSituation:
    """A bend beside a smooth hump of cost, with a rough sampled sequence."""
    random = np.random.default_rng(seed)
    t = np.arange(STEPS) * DT
    sampled = np.column_stack([0.4 + 0.05 * random.normal(size=STEPS), 0.3 * np.sin(t)])
    references = np.column_stack([0.4 * t, 0.05 * t**2, 0.1 * t])
    y, x = np.mgrid[0:60, 0:60] * 0.05 - 1.475
    costs = (200 * np.exp(-4 * ((x - 0.6) ** 2 + (y + 0.2) ** 2))).astype(np.uint8)
    return PolishSituation(
        pose=read_only([0.013, 0.021, 0.05]),
        speed=np.array([0.35, 0.02]),
        earlier_speed=read_only([0.33, 0.05]),
        references=references,
        carrot=np.array([1.2, 0.4]),
        sampled=sampled,
        field=cost_field(Grid(costs, -1.5, -1.5, 0.05), tracks_unknown=False),
        dt=DT,
        starts_now=starts_now,
    )


def polish_of(**changes) -> Polish:
    settings = {
        "first_time_s": 0.0,
        "knot_count": 8,
        "max_iterations": 5,
        "weights": WEIGHTS,
        "limits": LIMITS,
    }
    return Polish(STEPS, DT, **{**settings, **changes})


@pytest.mark.parametrize("starts_now", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_gradient_agrees_with_central_differences(seed, starts_now):
    situation = situation_of(seed, starts_now=starts_now)
    polish = polish_of()
    points = polish.fit(situation)
    _, gradient = polish.value_and_gradient(situation, points)
    # Small enough that no pose crosses a line between cell centres, where the field has a kink.
    step = 1e-7
    for k in range(points.size):
        moved = np.zeros_like(points)
        moved[k] = step
        above, _ = polish.value_and_gradient(situation, points + moved)
        below, _ = polish.value_and_gradient(situation, points - moved)
        assert gradient[k] == pytest.approx((above - below) / (2 * step), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_second_derivatives_agree_with_differences_of_the_gradient(seed):
    situation = situation_of(seed)
    alone = WEIGHTS._replace(
        linear_deviation=0.0, angular_deviation=0.0, linear_jerk=0.0, angular_jerk=0.0
    )
    spline = np.random.default_rng(seed).normal(size=(2 * STEPS, 5))
    middle = situation.sampled.ravel()

    def gradient(variables):
        sequence = (middle + spline @ variables).reshape(-1, 2)
        return objective(situation, alone, sequence)[1].ravel() @ spline

    # Small enough that no pose crosses a line between cell centres, where the field has a kink.
    step = 1e-7
    differences = np.array([gradient(step * e) - gradient(-step * e) for e in np.eye(5)]) / step / 2
    curvature = np.zeros((5, 5))
    add_pose_curvature(situation, alone, situation.sampled, spline, curvature)
    np.testing.assert_allclose(
        np.tril(curvature), np.tril(differences), atol=1e-5 * np.abs(differences).max()
    )


@pytest.mark.parametrize("starts_now", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_ipopt_has_next_to_nothing_left_to_do_behind_newtons_method(seed, starts_now):
    situation = situation_of(seed, starts_now=starts_now)
    led = polish_of(limits=FREE).solve(situation, FREE)
    assert led.found
    assert led.evaluation_count <= 3


@pytest.mark.parametrize("seed", range(4))
def test_newtons_method_ends_where_ipopt_alone_does(seed, monkeypatch):
    situation = situation_of(seed)
    led = polish_of(limits=FREE, max_iterations=300).solve(situation, FREE).sequence
    monkeypatch.setattr(polish_module, "descend", lambda *arguments: (arguments[3], False))
    alone = polish_of(limits=FREE, max_iterations=300).solve(situation, FREE)
    assert alone.evaluation_count > 3
    before, by_newton, by_ipopt = (
        objective(situation, WEIGHTS, np.ascontiguousarray(sequence))[0]
        for sequence in (situation.sampled, led, alone.sequence)
    )
    assert by_newton == pytest.approx(by_ipopt, abs=1e-3 * (before - by_ipopt))
    np.testing.assert_allclose(led, alone.sequence, atol=0.01)


def test_velocities_stay_within_their_limits_where_these_bind():
    slow = FREE._replace(vx_max=np.float32(0.2), wz_max=np.float32(0.1))
    situation = situation_of()._replace(speed=np.array([0.15, 0.0]))
    sequence = polish_of(limits=FREE).solve(situation, slow).sequence
    assert sequence[:, 0].max() == pytest.approx(0.2, abs=1e-3)
    assert sequence[:, 0].max() <= 0.2 + 1e-6
    assert np.abs(sequence[:, 1]).max() <= 0.1 + 1e-6


def test_a_robot_that_must_not_move_has_no_room_for_a_barrier():
    still = FREE._replace(vx_max=np.float32(0.0), vx_min=np.float32(0.0), wz_max=np.float32(0.0))
    situation = situation_of()._replace(speed=np.zeros(2))
    sequence = polish_of(limits=FREE).solve(situation, still).sequence
    np.testing.assert_allclose(sequence, 0.0, atol=1e-6)


def test_interpolation_is_exact_on_a_plane():
    y, x = np.mgrid[0:4, 0:5] + 0.5
    value, by_x, by_y = interpolate(Grid(0.1 * x + 0.3 * y, 0.0, 0.0, 1.0), 2.2, 1.9)
    assert (value, by_x, by_y) == pytest.approx((0.1 * 2.2 + 0.3 * 1.9, 0.1, 0.3))


def test_references_are_the_nearest_path_points_with_the_heading_of_the_chord():
    # Along x, then up: around the corner (1, 0) the chord from (0, 0) to (1, 1) points 45 degrees.
    path = np.array([[0.0, 0.0, 9.0], [1.0, 0.0, 9.0], [1.0, 1.0, 9.0], [1.0, 2.0, 9.0]])
    trajectory = np.array([[0.1, 0.1, 0.0], [0.9, 0.2, 0.7], [1.2, 0.9, 1.5]])
    references, last = path_references(path, trajectory)
    expected = [[0.0, 0.0, 0.0], [1.0, 0.0, np.pi / 4], [1.0, 1.0, np.pi / 2]]
    assert references == pytest.approx(np.array(expected))
    assert last == 2


def test_at_the_goal_the_reference_has_the_goals_yaw_and_is_not_turned_around():
    # The path arrives at 45 degrees, the goal looks along x.
    path = np.array([[0.0, 0.0, 0.8], [1.0, 1.0, 0.0]])
    references, _ = path_references(path, np.array([[1.1, 0.9, 0.7], [1.0, 1.0, 2.0]]))
    assert references == pytest.approx(np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0]]))


def test_references_turn_around_where_the_robot_drives_backward():
    path = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    references, _ = path_references(path, np.array([[0.9, 0.0, 3.0]]))
    assert references[0] == pytest.approx([1.0, 0.0, np.pi])


def test_between_equally_near_points_the_earlier_one_is_the_reference():
    path = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    references, last = path_references(path, np.array([[0.5, 0.0, 0.0]]))
    assert references[0] == pytest.approx([0.0, 0.0, 0.0])
    assert last == 0


def test_a_path_of_one_point_keeps_its_yaw():
    references, last = path_references(np.array([[1.0, 2.0, 0.3]]), np.array([[0.0, 0.0, 0.2]]))
    assert references[0] == pytest.approx([1.0, 2.0, 0.3])
    assert last == 0


def test_jerk_of_a_constant_acceleration_costs_nothing():
    ramp = np.column_stack([0.35 + 0.02 * np.arange(STEPS), np.full(STEPS, 0.02)])
    situation = situation_of()._replace(
        sampled=ramp, earlier_speed=read_only([0.33, 0.02]), speed=np.array([0.35, 0.02])
    )
    alone = Weights(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0)
    assert objective(situation, alone, ramp)[0] == pytest.approx(0.0, abs=1e-18)


def test_ipopt_is_what_ran_and_it_improves_the_sequence():
    situation = situation_of()
    outcome = polish_of().solve(situation, LIMITS)
    assert outcome.solver == "Ipopt"
    assert outcome.found
    before, _ = objective(situation, WEIGHTS, situation.sampled)
    after, _ = objective(situation, WEIGHTS, outcome.sequence)
    assert after < 0.5 * before


def test_five_iterations_reach_nearly_all_of_a_converged_solve():
    situation = situation_of()
    before, short, long = (
        objective(situation, WEIGHTS, sequence)[0]
        for sequence in (
            situation.sampled,
            polish_of().solve(situation, LIMITS).sequence,
            polish_of(max_iterations=300).solve(situation, LIMITS).sequence,
        )
    )
    assert before - short > 0.995 * (before - long)


def test_polished_sequence_obeys_velocity_and_acceleration_limits():
    tight = LIMITS._replace(ax_max=np.float32(0.2), ax_min=np.float32(-0.2), az_max=np.float32(0.3))
    sequence = polish_of(limits=tight).solve(situation_of(), tight).sequence
    assert sequence[:, 0].max() <= 0.5 + 1e-4
    assert np.abs(np.diff(sequence[:, 0])).max() <= 0.2 * DT + 1e-4 * DT
    assert np.abs(np.diff(sequence[:, 1])).max() <= 0.3 * DT + 1e-4 * DT
    assert sequence[0] == pytest.approx([0.35, 0.02])


def test_accelerations_out_of_reach_are_no_constraints():
    # Within its limits v changes by at most 0.85 m/s: how far out of reach a bound is, is the same.
    far, farther = (
        LIMITS._replace(ax_max=np.float32(a), ax_min=np.float32(-a), az_max=np.float32(a))
        for a in (1e3, 1e6)
    )
    np.testing.assert_array_equal(
        polish_of(limits=far).solve(situation_of(), far).sequence,
        polish_of(limits=farther).solve(situation_of(), farther).sequence,
    )


def test_solves_do_not_depend_on_what_was_solved_before():
    fresh, used = polish_of(), polish_of()
    used.solve(situation_of(5), LIMITS)
    np.testing.assert_array_equal(
        fresh.solve(situation_of(), LIMITS).sequence, used.solve(situation_of(), LIMITS).sequence
    )


def test_limits_that_cannot_be_met_keep_the_sampled_sequence():
    # The speed now is 0.35 m/s; the first knots cannot be at -5 m/s.
    beyond = LIMITS._replace(vx_max=np.float32(-5.0), vx_min=np.float32(-6.0))
    situation = situation_of()
    outcome = polish_of().solve(situation, beyond)
    assert not outcome.found
    np.testing.assert_array_equal(outcome.sequence, situation.sampled)


def test_controller_reports_the_polish_and_counts_what_it_dropped():
    parameters = MppiParameters(**{**BRINGUP, "polish": {"enabled": True}})
    controller = ModelPredictivePathIntegral(parameters, round_robot())
    decision = controller.step(observe(), controller.initial_memory())
    assert decision.diagnostics["polish_solver"] == "Ipopt"
    assert decision.diagnostics["polish_status"] == "accepted"
    assert decision.diagnostics["polish_fallback_count"] == 0

    # A weightless objective is zero everywhere, so no sequence is better than the sampled one.
    nothing = dict.fromkeys(
        (
            "path_weight",
            "heading_weight",
            "obstacle_weight",
            "progress_weight",
            "deviation_weight",
            "jerk_weight",
            "angular_jerk_weight",
        ),
        0.0,
    )
    idle = ModelPredictivePathIntegral(
        MppiParameters(**{**BRINGUP, "polish": {"enabled": True, **nothing}}), round_robot()
    )
    plain = ModelPredictivePathIntegral(MppiParameters(**BRINGUP), round_robot())
    dropped = idle.step(observe(), idle.initial_memory())
    assert dropped.diagnostics["polish_fallback_count"] == 1
    np.testing.assert_array_equal(
        dropped.command, plain.step(observe(), plain.initial_memory()).command
    )
