import numpy as np
import pytest
from harmony_scenes import problem, straight

from drake_navbench.controllers.harmony.motion import (
    JERK,
    advance,
    plan_of_velocities,
    roll_out,
    shifted,
    slopes_of_advance,
    stage_at,
)
from drake_navbench.controllers.harmony.rating import cost_of_motion
from drake_navbench.controllers.harmony.riccati import feedback_gains
from drake_navbench.controllers.harmony.scene import heading_wanted, make_start, velocity_bounds
from drake_navbench.kernels.read_only import read_only

DT = 0.1


def random_plan(seed=1, steps=12):
    random = np.random.default_rng(seed)
    plan = np.zeros((steps + 1, 9))
    plan[0, :7] = random.uniform(-0.5, 0.5, 7)
    plan[:-1, JERK:] = random.uniform(-1.0, 1.0, (steps, 2))
    roll_out(plan, DT)
    return plan


def test_a_step_follows_the_laws_of_constant_jerk():
    stage, there = np.zeros(9), np.zeros(9)
    stage[:] = [1.0, 2.0, 0.0, 0.4, 0.0, 0.5, 0.0, 3.0, 0.0]
    advance(stage, DT, there)
    # 0.4 * 0.1 + 0.5 * 0.01 / 2 + 3 * 0.001 / 6 = 0.043 m; 0.4 + 0.05 + 0.015; 0.5 + 0.3.
    np.testing.assert_allclose(there[:7], [1.043, 2.0, 0.0, 0.465, 0.0, 0.8, 0.0], atol=1e-15)


def test_a_turn_moves_along_the_chord_of_its_arc():
    stage, there = np.zeros(9), np.zeros(9)
    stage[3], stage[4] = 0.5, 1.0
    advance(stage, DT, there)
    # The chord of an arc points half the turn to the side; its length is the arc's to 0.05%.
    assert np.arctan2(there[1], there[0]) == pytest.approx(0.05)
    assert np.hypot(there[0], there[1]) == pytest.approx(2.0 * 0.5 * np.sin(0.05), rel=5e-4)


def test_the_slopes_of_a_step_are_its_derivatives():
    stage = random_plan()[3]
    slopes, there, moved = np.empty((7, 9)), np.zeros(9), np.zeros(9)
    slopes_of_advance(stage, DT, slopes)
    for column in range(9):
        ahead, behind = stage.copy(), stage.copy()
        ahead[column] += 1e-6
        behind[column] -= 1e-6
        advance(ahead, DT, moved)
        advance(behind, DT, there)
        np.testing.assert_allclose(slopes[:, column], (moved - there)[:7] / 2e-6, atol=1e-8)


def test_a_plan_between_two_stages_is_the_motion_there():
    plan = random_plan()
    np.testing.assert_allclose(stage_at(plan, DT, 0.3)[:7], plan[3, :7])
    halfway = np.zeros(9)
    advance(plan[3], 0.05, halfway)
    np.testing.assert_allclose(stage_at(plan, DT, 0.35)[:7], halfway[:7])


def test_behind_its_end_a_plan_rests_there():
    plan = random_plan()
    stage = stage_at(plan, DT, 100.0)
    np.testing.assert_array_equal(stage[:3], plan[-1, :3])
    assert not stage[3:].any()


def test_the_rest_of_a_plan_is_the_plan_from_there_on():
    plan = random_plan()
    rest = shifted(plan, DT, 0.3, plan[3])
    np.testing.assert_allclose(rest[:9, :7], plan[3:12, :7], atol=1e-12)


def test_a_plan_of_velocities_drives_at_about_these():
    velocities = np.zeros((31, 2))
    velocities[:, 0] = np.minimum(0.4, 0.4 * np.arange(30, -1, -1) / 10)
    plan = plan_of_velocities(velocities, DT, make_start(np.zeros(3), 0.4, 0.0))
    assert np.abs(plan[:, 3] - velocities[:, 0]).max() < 0.04


def test_feedback_gains_solve_the_linear_quadratic_problem():
    random = np.random.default_rng(5)
    steps = 4
    plan = random_plan(steps=steps)
    slopes = np.empty((steps, 7, 9))
    for k in range(steps):
        slopes_of_advance(plan[k], DT, slopes[k])
    factors = random.normal(size=(steps + 1, 9, 9))
    hessians = factors @ factors.transpose(0, 2, 1) + np.eye(9)
    gradients = random.normal(size=(steps + 1, 9))
    offsets, gains = np.zeros((steps, 2)), np.zeros((steps, 2, 7))
    predicted, is_convex = feedback_gains(hessians, gradients, slopes, 0.0, offsets, gains)
    assert is_convex
    # The same by condensing: stages as a linear function of all inputs, one dense system.
    state, stages = np.zeros((7, 2 * steps)), []
    for k in range(steps):
        inputs = np.zeros((2, 2 * steps))
        inputs[0, 2 * k] = inputs[1, 2 * k + 1] = 1.0
        stages.append(np.vstack([state, inputs]))
        state = slopes[k] @ stages[-1]
    stages.append(np.vstack([state, np.zeros((2, 2 * steps))]))
    matrix = sum(s.T @ h @ s for s, h in zip(stages, hessians, strict=True))
    vector = sum(s.T @ g for s, g in zip(stages, gradients, strict=True))
    dense = -np.linalg.solve(matrix, vector)
    step = np.zeros(7)
    for k in range(steps):
        inputs = offsets[k] + gains[k] @ step
        np.testing.assert_allclose(inputs, dense[2 * k : 2 * k + 2], atol=1e-9)
        step = slopes[k] @ np.concatenate([step, inputs])
    assert predicted == pytest.approx(0.5 * vector @ dense)


def test_a_plan_turns_to_the_goals_heading_on_the_way():
    scene, _ = problem(goal=(1.2, 0.0, 0.6), path=straight(1.2))
    assert heading_wanted(scene, -0.3, 0.0, 0.1) == pytest.approx(0.1)
    # Half of the last 1.5 m is left: half of the way from 0.1 rad to 0.6 rad.
    assert heading_wanted(scene, 0.45, 0.0, 0.1) == pytest.approx(0.35)
    assert heading_wanted(scene, 1.2, 0.0, 0.1) == pytest.approx(0.6)
    beyond, _ = problem(goal=(9.0, 0.0, 0.6))
    assert heading_wanted(beyond, 1.4, 0.0, 0.1) == pytest.approx(0.1)


def test_a_guess_needs_the_room_of_plans_but_half_a_cell():
    scene, _ = problem(boxes=[(-3.0, 0.45, 3.0, 0.6)])
    assert scene.required[0] == pytest.approx(0.05)
    at_rest, motion = np.zeros((31, 2)), np.empty((31, 3))
    # At y = 0.05 m the cell's centre is at 0.075 m: 0.45 - 0.075 - 0.341 = 0.034 m, where 0.05 m
    # less half a cell, 0.025 m, will do. At y = 0.1 m it is 0.05 m less. The map ends at x = 3 m.
    for (x, y), has_room in {(0.0, 0.05): True, (0.0, 0.1): False, (2.5, 0.0): False}.items():
        start = make_start(np.array([x, y, 0.0]), 0.0, 0.0)
        cost = cost_of_motion(scene, scene, read_only(straight()), at_rest, start, 20, motion)
        assert np.isfinite(cost) == has_room
        np.testing.assert_array_equal(motion[-1], [x, y, 0.0])


def test_bounds_let_a_start_beyond_them_brake(limits):
    low, high = velocity_bounds(make_start(np.zeros(3), 0.8, 0.0), limits, DT, 31)
    assert high[0, 0] == pytest.approx(0.8, abs=2e-3)
    assert (np.diff(high[:, 0]) <= 0.0).all()
    assert high[-1, 0] == 0.5
    np.testing.assert_array_equal(low[1:, 0], -0.2)
