"""The program: its limits hold, it rests at its end, and it finds what IPOPT finds."""

from __future__ import annotations

import math

import numpy as np
import pytest
from harmony_ipopt import IpoptProgram, cost_and_gradient, rows_and_jacobian
from harmony_scenes import DISCS, arc, problem

from drake_navbench.controllers.harmony.interior_point import SolverSettings, solve
from drake_navbench.controllers.harmony.motion import ALPHA, ANGULAR_JERK, JERK, A, V, W, roll_out
from drake_navbench.controllers.harmony.rows import (
    FIRST_DISC_ROW,
    SLOPES_A_ROW,
    row_count,
    stage_rows,
)
from drake_navbench.kernels.distance_field import path_clearance

SETTINGS = SolverSettings(200, 0.1, 1e-6, 1e-3)
BOX = (0.9, -0.15, 1.3, 0.9)


def random_problem(seed, **parameters):
    """A box or two beside or on a bent or straight path, from a random velocity."""
    random = np.random.default_rng(seed)
    boxes = []
    for _ in range(int(random.integers(1, 3))):
        x, y = random.uniform(1.3, 2.2), random.choice([-1.0, 1.0]) * random.uniform(0.35, 1.0)
        boxes.append((x, y, x + 0.3, y + 0.3))
    path = arc(radius_m=random.uniform(0.8, 3.0), angle=1.2) if random.random() < 0.5 else None
    return problem(
        path=path,
        boxes=boxes,
        start=(0.0, random.uniform(-0.15, 0.15), random.uniform(-0.3, 0.3)),
        speed=random.uniform(0.0, 0.45),
        turn_rate=random.uniform(-0.3, 0.3),
        **parameters,
    )


@pytest.mark.parametrize("seed", range(6))
def test_a_plan_obeys_its_limits_and_rests_at_its_end(seed):
    scene, guess = random_problem(seed)
    solution = solve(scene, guess, SETTINGS)
    assert solution.solved
    plan, limits, slack = solution.plan, scene.limits, 1e-3
    assert plan[:, V].max() <= limits.forward_speed * (1.0 + slack)
    assert plan[:, V].min() >= -limits.backward_speed - slack
    assert np.abs(plan[:, W]).max() <= limits.turn_rate * (1.0 + slack)
    assert np.abs(plan[:, A]).max() <= limits.acceleration * (1.0 + slack)
    assert np.abs(plan[:, ALPHA]).max() <= limits.angular_acceleration * (1.0 + slack)
    assert np.abs(plan[:-1, JERK]).max() <= limits.jerk * (1.0 + slack)
    assert np.abs(plan[:-1, ANGULAR_JERK]).max() <= limits.angular_jerk * (1.0 + slack)
    wheels = np.abs(plan[:, V]) + limits.half_track * np.abs(plan[:, W])
    assert wheels.max() <= limits.wheel_speed * (1.0 + slack)
    assert np.abs(plan[:, V] * plan[:, W]).max() <= limits.lateral_acceleration * (1.0 + slack)
    clearances = path_clearance(scene.field, DISCS, plan[:, :3])
    assert (clearances[1:] >= scene.required[1:] - 1e-3).all()
    np.testing.assert_allclose(plan[-1, V:JERK], 0.0, atol=1e-3)


def test_a_turn_takes_more_room():
    scene, guess = problem(boxes=[BOX])
    sweeping = scene._replace(limits=scene.limits._replace(sweep=0.2))
    stage = guess[5].copy()
    rows = []
    for one, turn_rate in ((scene, 0.5), (sweeping, 0.0), (sweeping, 0.5), (sweeping, -0.5)):
        stage[W] = turn_rate
        values = np.empty(row_count(one))
        columns = np.zeros((len(values), SLOPES_A_ROW), dtype=np.int64)
        stage_rows(one, 5, stage, values, columns, np.empty(columns.shape))
        rows.append(values[FIRST_DISC_ROW:])
    np.testing.assert_allclose(rows[1], rows[0], atol=1e-12)
    # 0.2 m for each rad/s, rounded off below 0.1 rad/s: sqrt(0.5^2 + 0.1^2) - 0.1 = 0.4099 rad/s.
    # A row counts in parts of 0.1 m.
    for turning in rows[2:]:
        np.testing.assert_allclose(rows[0] - turning, 0.8198, atol=1e-4)


def test_a_plan_is_the_motion_of_its_inputs_whenever_the_method_stops():
    scene, guess = problem(boxes=[BOX])
    for iterations in (1, 3, 8):
        plan = solve(scene, guess, SolverSettings(iterations, 1e-2, 1e-6, 1e-3)).plan
        driven = plan.copy()
        roll_out(driven, scene.dt)
        np.testing.assert_allclose(driven, plan, atol=1e-12)


def cost_gap(seed):
    """How much more our plan costs than IPOPT's, as a part; None where IPOPT finds no plan, inf
    where ours finds none.

    A way past either side is a minimum of its own: IPOPT begins where ours ended, and ours once
    more, roughly, where IPOPT ended, so that both end in the same one. Where that comes to no
    solution, ours is the one that IPOPT began with.
    """
    scene, guess = random_problem(seed, time_step=0.2)
    first = solve(scene, guess, SETTINGS)
    ipopt = IpoptProgram(len(guess) - 1, len(DISCS))
    theirs = ipopt.solve(scene, first.plan, SolverSettings(200, 0.0, 0.0, 1e-3))
    near = theirs.plan.copy()
    near[:-1, JERK:] *= 0.9
    roll_out(near, scene.dt)
    if not theirs.solved:
        return None
    solved = [found for found in (solve(scene, near, SETTINGS), first) if found.solved]
    return (solved[0].cost - theirs.cost) / theirs.cost if solved else math.inf


def test_the_cost_is_within_a_percent_of_what_ipopt_finds():
    assert abs(cost_gap(0)) < 0.01


@pytest.mark.long
def test_the_cost_is_within_a_percent_of_what_ipopt_finds_in_many_problems():
    gaps = np.array([gap for gap in map(cost_gap, range(1000)) if gap is not None])
    assert len(gaps) > 900
    # Now and then one of the two ends in a worse minimum, or ours in none.
    assert np.mean(np.abs(gaps) < 0.01) > 0.99


def test_the_derivatives_that_ipopt_gets_are_those_of_the_numbers():
    scene, guess = problem(boxes=[BOX], time_step=0.2)
    plan = guess.copy()
    plan[:-1, JERK:] += np.random.default_rng(1).normal(0.0, 0.5, (len(plan) - 1, 2))
    roll_out(plan, scene.dt)
    _, gradient = cost_and_gradient(scene, plan)
    _, jacobian = rows_and_jacobian(scene, plan)
    for column in range(0, 2 * (len(plan) - 1), 5):
        values = []
        for step in (1e-6, -1e-6):
            moved = plan.copy()
            moved[column // 2, JERK + column % 2] += step
            roll_out(moved, scene.dt)
            values.append((cost_and_gradient(scene, moved)[0], rows_and_jacobian(scene, moved)[0]))
        by_cost, by_rows = ((one - other) / 2e-6 for one, other in zip(*values, strict=True))
        assert gradient[column] == pytest.approx(by_cost, abs=1e-5)
        np.testing.assert_allclose(jacobian[:, column], by_rows, atol=1e-5)
