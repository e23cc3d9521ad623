"""Known optima, and that whatever the solver accepts obeys every limit."""

import math

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

from drake_navbench.controllers.teb import ipopt_program
from drake_navbench.controllers.teb.band import initialise
from drake_navbench.controllers.teb.constraints import band_constraints
from drake_navbench.controllers.teb.ipopt_program import SolverSettings
from drake_navbench.controllers.teb.layout import pack_band, row_slices
from drake_navbench.controllers.teb.program import BandProgram

# As good as the solver gets: the default stops a little above the minimum, to save time.
PRECISE = SolverSettings(tolerance=1e-4, violation_tolerance=1e-6, barrier_start=1e-4)
RANDOM_PROBLEMS = 60
ENOUGH_ITERATIONS = 300


def solve(scene, path=None, *, weights=WEIGHTS, limits=LIMITS, settings=PRECISE, iterations=None):
    """Returns (solution, values of all rows) from the first guess along a path."""
    path = np.empty((0, 2)) if path is None else np.array(path, dtype=float)
    guess = initialise(path, scene.start, scene.goal, pace=PACE)
    count = len(guess.time_steps)
    scene = of_size(scene._replace(goal=guess.poses[-1].copy()), count)
    program = BandProgram(count, len(scene.discs), settings=settings)
    z = pack_band(guess.poses, guess.time_steps, 0.0)
    iterations = iterations or ENOUGH_ITERATIONS
    solution = solved(program, z, scene, weights=weights, limits=limits, iterations=iterations)
    z = pack_band(solution.poses, solution.time_steps, solution.slack)
    return solution, band_constraints(z, count, scene)[0]


@pytest.mark.parametrize("settings", [PRECISE, SolverSettings()])
@pytest.mark.parametrize("distance", [2.0, 5.0])
def test_straight_run_takes_the_time_of_the_trapezoidal_profile(distance, settings):
    solution, _ = solve(make_scene((0, 0, 0), (distance, 0, 0)), settings=settings)
    # Rest to rest at 0.5 m/s and 0.5 m/s^2: distance / speed + speed / acceleration.
    expected = distance / 0.5 + 0.5 / 0.5
    assert solution.time_steps.sum() == pytest.approx(expected, rel=0.02)


def test_turn_on_the_spot_takes_the_time_of_the_trapezoidal_profile():
    solution, _ = solve(make_scene((0, 0, 0), (0, 0, 2.0)))
    # 2 rad at 1 rad/s and 1 rad/s^2: 2 / 1 + 1 / 1 s, and the robot stays where it is.
    assert solution.time_steps.sum() == pytest.approx(3.0, rel=0.03)
    assert np.abs(solution.poses[:, :2]).max() < 0.01


def test_round_obstacle_is_passed_at_the_least_clearance():
    scene = make_scene((-1.5, 0.05, 0), (1.5, 0.05, 0), field=round_obstacles_field([(0, 0, 0.3)]))
    weights = WEIGHTS._replace(inflation=0.0, smoothness=0.0)
    solution, values = solve(scene, [(0.0, 0.85)], weights=weights)
    clearance = values[row_slices(len(solution.time_steps), 2)["clearance"]]
    assert clearance.min() == pytest.approx(LIMITS.clearance, abs=1e-3)
    assert solution.slack == pytest.approx(0.0, abs=1e-4)
    # Held by the true distance as well, not only by the field's: the cells are 5 cm wide.
    discs = [
        solution.poses[1:-1, :2]
        + offset
        * np.column_stack([np.cos(solution.poses[1:-1, 2]), np.sin(solution.poses[1:-1, 2])])
        for offset in scene.discs[:, 0]
    ]
    true_clearance = min(np.hypot(*disc.T).min() for disc in discs) - 0.3 - 0.3
    assert true_clearance == pytest.approx(LIMITS.clearance, abs=1e-3)


def test_start_and_goal_twist_are_joined_within_the_acceleration():
    # Arriving at 0.5 m/s and told to go on: nothing but cruising, 1.5 m in 3 s.
    scene = make_scene((0, 0, 0), (1.5, 0, 0), start_twist=(0.5, 0), goal_twist=(0.5, 0))
    solution, _ = solve(scene)
    assert solution.time_steps.sum() == pytest.approx(3.0, rel=0.02)


def test_slack_opens_a_passage_that_is_too_narrow_by_what_is_missing():
    # Between two discs of radius 0.5 at y = +-1.0: half a gap of 0.5 m; the robot needs
    # 0.3 + 0.25 m, so 0.05 m are missing.
    field = round_obstacles_field([(0.0, 1.0, 0.5), (0.0, -1.0, 0.5)])
    scene = make_scene((-1.2, 0, 0), (1.2, 0, 0), field=field)
    solution, _ = solve(scene)
    # Poses may straddle the narrowest place; they cannot gain more than a centimetre by that.
    assert 0.04 < solution.slack < 0.0505


def test_a_pose_gives_up_as_large_a_share_of_the_slack_as_it_keeps_of_the_clearance():
    # The same passage: poses that shall keep 0.6 of 0.25 m have 0.15 m, and 0.05 m to spare; those
    # that shall keep all of it miss a fifth, and so does a pose that shall keep 0.9 of it: 0.025 m.
    field = round_obstacles_field([(0.0, 1.0, 0.5), (0.0, -1.0, 0.5)])
    scene = make_scene((-1.2, 0, 0), (1.2, 0, 0), field=field)
    wide = scene._replace(clearance_shares=np.full(100, 0.6))
    assert solve(wide)[0].slack == pytest.approx(0.0, abs=1e-3)
    narrow = scene._replace(clearance_shares=np.full(100, 0.9))
    solution, values = solve(narrow)
    clearance = values[row_slices(len(solution.time_steps), 2)["clearance"]]
    assert clearance.min() == pytest.approx(0.9 * LIMITS.clearance, abs=1e-3)
    assert 0.9 * solution.slack == pytest.approx(0.025, abs=0.01)


def excesses(values, solution):
    """Returns by how much each kind of row and the time steps exceed their limits."""
    rows = row_slices(len(solution.time_steps), 2)
    speed = values[rows["speed"]]
    return {
        "arc": np.abs(values[rows["arc"]]).max(),
        "forward_speed": speed.max() - LIMITS.forward_speed,
        "backward_speed": -speed.min() - LIMITS.backward_speed,
        "turn_rate": np.abs(values[rows["turn_rate"]]).max() - LIMITS.turn_rate,
        "acceleration": np.abs(values[rows["acceleration"]]).max() - LIMITS.acceleration,
        "angular_acceleration": np.abs(values[rows["angular_acceleration"]]).max()
        - LIMITS.angular_acceleration,
        "clearance": LIMITS.clearance - values[rows["clearance"]].min(),
        "slack": solution.slack - 1e-3,
        "shortest_step": LIMITS.shortest_step - solution.time_steps.min(),
        "longest_step": solution.time_steps.max() - LIMITS.longest_step,
    }


def test_random_feasible_problems_are_solved_within_every_limit():
    for seed in range(RANDOM_PROBLEMS):
        scene, path = random_problem(seed)
        solution, values = solve(scene, path, settings=SolverSettings())
        worst = max(excesses(values, solution).items(), key=lambda item: item[1])
        assert worst[1] < 1e-3, f"problem {seed}: {worst} {solution.status}"


def test_mirrored_scene_gives_the_mirrored_band():
    obstacles = [(0.9, 0.75, 0.3), (1.6, -0.9, 0.25)]
    scene = make_scene((0, 0, 0.1), (2.2, 0.1, 0.2), field=round_obstacles_field(obstacles))
    mirrored = make_scene(
        (0, 0, -0.1),
        (2.2, -0.1, -0.2),
        field=round_obstacles_field([(x, -y, radius) for x, y, radius in obstacles]),
    )
    first, _ = solve(scene)
    second, _ = solve(mirrored)
    # Rounding differs between the two, and the solver amplifies it.
    np.testing.assert_allclose(second.poses * [1, -1, -1], first.poses, atol=1e-4)
    np.testing.assert_allclose(second.time_steps, first.time_steps, atol=1e-4)


def test_the_solver_is_ipopt_and_its_iterations_are_bounded(monkeypatch):
    names = []

    class Watched(ipopt_program.IpoptSolver):
        def Solve(self, *args):
            result = super().Solve(*args)
            names.append(result.get_solver_id().name())
            return result

    monkeypatch.setattr(ipopt_program, "IpoptSolver", Watched)
    solution, _ = solve(make_scene((0, 0, 0), (2, 1, 0)), iterations=2)
    assert names == ["Ipopt"]
    assert solution.status == "kIterationLimit"


def test_a_program_forgets_its_last_solve():
    near = make_scene((0, 0, 0), (2, 0, 0), field=round_obstacles_field([(1, 0.7, 0.3)]))
    far = make_scene((0, 0, 0), (2, 0, 0))
    guess = initialise(np.empty((0, 2)), near.start, near.goal, pace=PACE)
    count = len(guess.time_steps)
    z = pack_band(guess.poses, guess.time_steps, 0.0)

    def run(program, scene):
        scene = of_size(scene, count)
        return solved(program, z, scene, iterations=20)

    used = BandProgram(count, 2, settings=SolverSettings())
    run(used, far)
    fresh = BandProgram(count, 2, settings=SolverSettings())
    np.testing.assert_array_equal(run(used, near).poses, run(fresh, near).poses)


def test_an_impossible_start_is_reported_as_violated():
    # Three steps of at most 1.2 s cannot cover 10 m.
    program = BandProgram(3, 2, settings=SolverSettings())
    poses = np.column_stack([np.linspace(0, 10, 4), np.zeros(4), np.zeros(4)])
    scene = of_size(make_scene(poses[0], poses[-1]), 3)
    solution = solved(program, pack_band(poses, np.ones(3), 0.0), scene, iterations=50)
    assert not math.isnan(solution.violation)
    assert solution.violation > 0.1
