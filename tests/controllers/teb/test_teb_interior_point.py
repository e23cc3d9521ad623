"""Newton's method against IPOPT on the same programs, and where there is no solution."""

import numpy as np
import pytest
from teb_bands import (
    LIMITS,
    PACE,
    WEIGHTS,
    make_scene,
    of_size,
    random_problem,
    round_obstacles_field,
    solved,
)

from drake_navbench.controllers.teb.band import initialise
from drake_navbench.controllers.teb.continuation import STAGES, descend_from
from drake_navbench.controllers.teb.interior_point import DescentSettings
from drake_navbench.controllers.teb.ipopt_program import SolverSettings
from drake_navbench.controllers.teb.layout import pack_band
from drake_navbench.controllers.teb.program import BandProgram

ORACLE = SolverSettings(newton_iterations=0)
RANDOM_PROBLEMS = 40
ENOUGH_ITERATIONS = 300


def solve(scene, path, *, settings=None, is_confirmed=False, limits=LIMITS, is_car=False):
    """Returns the solution from the first guess along a path."""
    guess = initialise(np.array(path, dtype=float), scene.start, scene.goal, pace=PACE)
    count = len(guess.time_steps)
    scene = of_size(scene._replace(goal=guess.poses[-1].copy()), count)
    if is_car:
        scene = scene._replace(turning_radius=0.5, directions=np.ones(count))
    settings = settings or SolverSettings()
    program = BandProgram(count, len(scene.discs), settings=settings, is_car=is_car)
    z = pack_band(guess.poses, guess.time_steps, 0.0)
    asked = {"iterations": ENOUGH_ITERATIONS, "is_confirmed": is_confirmed}
    return solved(program, z, scene, limits=limits, **asked)


def cost_gaps(seeds):
    """Returns by which share each cost exceeds IPOPT's, from the same first guess."""
    gaps = []
    for seed in seeds:
        scene, path = random_problem(seed)
        alone, oracle = solve(scene, path), solve(scene, path, settings=ORACLE)
        assert alone.status == oracle.status == "kSolutionFound", f"problem {seed}"
        assert alone.violation < 1e-4, f"problem {seed}"
        gaps.append(alone.cost / oracle.cost - 1.0)
    return np.array(gaps)


def test_it_costs_what_ipopts_bands_cost():
    assert cost_gaps(range(RANDOM_PROBLEMS)).max() < 0.01


@pytest.mark.long
def test_it_costs_what_ipopts_bands_cost_in_a_thousand_problems():
    assert cost_gaps(range(1000)).max() < 0.01


def test_ipopt_finds_nothing_left_to_do():
    evaluations = []
    for seed in range(20):
        scene, path = random_problem(seed)
        evaluations.append(solve(scene, path, is_confirmed=True).evaluations)
    # Values once, and values with their slopes once: no step.
    assert np.median(evaluations) == 2
    assert max(evaluations) <= 6


def test_a_clearance_that_may_not_be_missed_is_kept():
    # No room for the slack at all: its bounds are equal.
    scene = make_scene((-1.5, 0.05, 0), (1.5, 0.05, 0), field=round_obstacles_field([(0, 0, 0.3)]))
    limits = LIMITS._replace(largest_slack=0.0)
    solution = solve(scene, [(0.0, 0.85)], limits=limits)
    assert solution.status == "kSolutionFound"
    assert solution.violation < 1e-4
    assert solution.slack == pytest.approx(0.0, abs=1e-7)


def test_a_car_turns_no_sharper_than_it_can():
    scene = make_scene((0, 0, 0), (1.5, 1.0, 1.2))
    solution = solve(scene, [(0.8, 0.3)], is_car=True)
    assert solution.status == "kSolutionFound"
    assert solution.violation < 1e-4
    steps = np.diff(solution.poses, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    assert np.all(np.abs(steps[:, 2]) * 0.5 <= 1.01 * lengths + 1e-4)


@pytest.mark.parametrize("is_confirmed", [True, False])
def test_ipopt_has_the_guess_where_newtons_method_fails(is_confirmed):
    # Three steps of at most 1.2 s cannot cover 10 m.
    poses = np.column_stack([np.linspace(0, 10, 4), np.zeros(4), np.zeros(4)])
    scene = of_size(make_scene(poses[0], poses[-1]), 3)
    program, z = BandProgram(3, 2, settings=SolverSettings()), pack_band(poses, np.ones(3), 0.0)
    solution = solved(program, z, scene, iterations=20, is_confirmed=is_confirmed)
    assert solution.status != "kSolutionFound"
    assert solution.evaluations > 2
    assert solution.newton_steps > 0
    assert solution.violation > 0.1


def test_without_confirmation_ipopt_is_spared_what_newtons_method_solves():
    scene, path = random_problem(0)
    assert solve(scene, path).evaluations == 0


def detour_over(height_m, radius, offset):
    """Returns (guess, scene) of a way over two round obstacles that lie on the straight one."""
    field = round_obstacles_field([(1.25, offset, radius), (1.25, offset - 0.5, radius)])
    scene = make_scene((0, 0, 0), (2.5, 0, 0), field=field)
    band = initialise(np.array([(1.25, height_m)]), scene.start, scene.goal, pace=PACE)
    scene = of_size(scene._replace(goal=band.poses[-1].copy()), len(band.time_steps))
    return pack_band(band.poses, band.time_steps, 0.0), scene


@pytest.mark.parametrize(
    ("height_m", "radius", "offset"), [(0.6, 0.3, 0.3), (0.8, 0.4, 0.3), (1.1, 0.4, 0.2)]
)
def test_a_detour_that_newtons_method_fails_at_is_found_by_way_of_higher_barriers(
    height_m, radius, offset
):
    guess, scene = detour_over(height_m, radius, offset)
    count = len(scene.clearance_shares) + 1
    program = BandProgram(count, 2, settings=SolverSettings())
    newton = program.run_newton(guess, scene=scene, weights=WEIGHTS, limits=LIMITS)
    straight = descend_from(
        newton.problem, guess, DescentSettings(iterations=SolverSettings().newton_iterations)
    )
    assert not straight.converged
    assert newton.descent.converged
    solution = program.unconfirmed(newton)
    assert solution.violation < 1e-4
    confirmed = program.confirm(newton, 20)
    assert confirmed.status == "kSolutionFound"
    assert confirmed.evaluations <= 6
    np.testing.assert_allclose(confirmed.poses, solution.poses, atol=1e-3)


def test_a_guess_without_a_band_is_given_up_before_the_last_stage():
    # Three steps of at most 1.2 s cannot cover 10 m.
    poses = np.column_stack([np.linspace(0, 10, 4), np.zeros(4), np.zeros(4)])
    scene = of_size(make_scene(poses[0], poses[-1]), 3)
    program = BandProgram(3, 2, settings=SolverSettings())
    guess = pack_band(poses, np.ones(3), 0.0)
    newton = program.run_newton(guess, scene=scene, weights=WEIGHTS, limits=LIMITS)
    assert not newton.descent.converged
    stages = sum(stage.iterations for stage in STAGES)
    assert newton.descent.iterations <= SolverSettings().newton_iterations + stages
