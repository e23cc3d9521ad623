"""What moves is found in successive costmaps, and a band keeps off where it will be."""

import math
from dataclasses import replace

import numpy as np
import pytest
from controller_scenes import make_setup, observe
from hypothesis import given, settings
from hypothesis import strategies as st
from teb_bands import (
    LIMITS,
    PACE,
    WEIGHTS,
    make_scene,
    numeric_jacobian,
    of_size,
    random_band,
    solved,
)
from teb_closed_loop import plan_from_elements, window

from drake_navbench.controllers.teb import TimedElasticBand
from drake_navbench.controllers.teb.band import initialise
from drake_navbench.controllers.teb.constraints import band_constraints, sparsity_pattern
from drake_navbench.controllers.teb.curvature import (
    add_lagrangian_curvature,
    band_positions,
)
from drake_navbench.controllers.teb.ipopt_program import SolverSettings
from drake_navbench.controllers.teb.layout import pack_band, row_count
from drake_navbench.controllers.teb.memory import TebMemory
from drake_navbench.controllers.teb.motion_of_cells import farthest_free_cell
from drake_navbench.controllers.teb.obstacle_tracking import Track, Tracking, track_obstacles
from drake_navbench.controllers.teb.predicted import encounters_of, moving_fields
from drake_navbench.controllers.teb.program import BandProgram
from drake_navbench.inputs.presets import load_preset
from drake_navbench.kernels.band_cholesky import BANDWIDTH
from drake_navbench.kernels.distance_field import distance_field

PERIOD_S = 0.2
WALLS = [(-5.0, 2.0, 9.0, 2.15), (-5.0, -2.15, 9.0, -2.0)]


def costmap_at(time_s, boxes, robot):
    return replace(window(boxes, robot[0], robot[1]), stamp_s=time_s)


def tracked(boxes_at, robot_at, count=12):
    """Returns the tracking after `count` costmaps; boxes and robot (3,) as functions of time."""
    tracking = Tracking()
    for step in range(count):
        time_s = PERIOD_S * step
        robot = np.array(robot_at(time_s), dtype=float)
        costmap = costmap_at(time_s, boxes_at(time_s), robot)
        tracking = track_obstacles(tracking, costmap, distance_field(costmap), robot)
    return tracking


@pytest.mark.parametrize("velocity", [(0.0, 0.6), (-0.4, 0.0), (0.5, 0.5), (0.2, -0.1), (1.2, 0.0)])
def test_the_velocity_of_a_box_is_found_while_the_robot_drives(velocity):
    start = -1.2 * np.array(velocity) + [1.0, 0.2]

    def boxes_at(time_s):
        x, y = start + time_s * np.array(velocity)
        return [*WALLS, (x - 0.3, y - 0.2, x + 0.3, y + 0.2)]

    (thing,) = tracked(boxes_at, lambda time_s: (0.3 * time_s - 1.0, 0.0, 0.0)).moving()
    assert thing.velocity == pytest.approx(velocity, abs=0.12)
    where = start + 11 * PERIOD_S * np.array(velocity)
    assert thing.cells.mean(axis=0) == pytest.approx(where, abs=0.03)


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_nothing_moves_in_a_world_that_stands(seed):
    rng = np.random.default_rng(seed)
    corners = rng.uniform([-2.0, -2.5], [5.0, 2.5], (8, 2))
    boxes = [*WALLS, *(np.hstack([low, low + rng.uniform(0.05, 0.8, 2)]) for low in corners)]
    turn = rng.uniform(-0.5, 0.5)

    def robot_at(time_s):
        noise = rng.normal(0.0, 0.005, 3)
        return noise + np.array(
            [0.5 * time_s * math.cos(turn), 0.5 * time_s * math.sin(turn), turn]
        )

    assert tracked(lambda _: boxes, robot_at, count=20).moving() == []


def test_a_thing_that_stops_stands_again():
    def boxes_at(time_s):
        x = 0.5 * min(time_s, 2.0)
        return [(x, 0.8, x + 0.4, 1.2)]

    assert tracked(boxes_at, lambda _: (0, 0, 0), count=10).moving()
    assert not tracked(boxes_at, lambda _: (0, 0, 0), count=24).moving()


def test_a_costmap_is_looked_at_once():
    costmap = costmap_at(0.0, WALLS, (0, 0))
    field = distance_field(costmap)
    tracking = track_obstacles(Tracking(), costmap, field, np.zeros(3))
    assert track_obstacles(tracking, costmap, field, np.zeros(3)) is tracking


def disc_track(x, y, radius, velocity):
    """Returns the track of a round thing."""
    steps = np.arange(-20, 21) * 0.05 + 0.025
    cells = np.array([(x + i, y + j) for i in steps for j in steps if math.hypot(i, j) <= radius])
    return Track(cells, np.array(velocity, dtype=float), 9)


def meeting(scene, poses, time_steps, track):
    fields = moving_fields([track], 0.0, resolution=0.05, reach_m=1.0)
    encounters = encounters_of(fields, scene.discs, poses, time_steps)
    return scene._replace(encounters=encounters)


def test_rows_of_moving_things_have_their_derivatives():
    m = 7
    z, scene = random_band(np.random.default_rng(4), m)
    poses = np.vstack([scene.start, z[m:-1].reshape(3, m - 1).T, scene.goal])
    track = disc_track(*poses[3, :2] + [0.3, 0.5], 0.25, (0.1, -0.2))
    scene = meeting(scene, poses, z[:m], track)
    values, jacobian = band_constraints(z, m, scene)
    assert len(values) == row_count(m, len(scene.discs), False, True)
    slopes = numeric_jacobian(lambda at: band_constraints(at, m, scene)[0], z)
    np.testing.assert_allclose(jacobian, slopes, atol=1e-6)
    declared = np.zeros(jacobian.shape, dtype=bool)
    declared[tuple(sparsity_pattern(m, len(scene.discs), False, True).T)] = True
    assert declared[jacobian != 0.0].all()
    moving = slice(row_count(m, len(scene.discs)), None)
    assert np.abs(jacobian[moving]).max() > 0.5

    multipliers = np.zeros(len(values))
    multipliers[moving] = np.linspace(0.5, 2.0, len(values[moving]))
    positions = band_positions(m)

    def band_matrix(pulls):
        matrix = np.zeros((4 * m - 3, BANDWIDTH + 1))
        add_lagrangian_curvature(z, m, scene, WEIGHTS, pulls, positions, matrix)
        return matrix

    bends = band_matrix(multipliers) - band_matrix(np.zeros(len(values)))
    numeric = numeric_jacobian(
        lambda at: band_constraints(at, m, scene)[1].T @ multipliers, z, step=1e-7
    )
    for column in range(len(z) - 1):
        for other in range(len(z) - 1):
            row, line = positions[column], positions[other]
            if 0 <= row - line <= BANDWIDTH:
                assert bends[row, row - line] == pytest.approx(numeric[column, other], abs=1e-4)


def test_a_band_keeps_off_where_a_thing_will_be_and_drives_through_where_it_is():
    # It stands on the way at first, and is 1.2 m beside it when the robot gets there.
    scene = make_scene((0.0, 0.0, 0.0), (2.5, 0.0, 0.0))
    guess = initialise(np.empty((0, 2)), scene.start, scene.goal, pace=PACE)
    count = len(guess.time_steps)
    scene = of_size(scene._replace(goal=guess.poses[-1].copy()), count)

    def kept(velocity):
        track = disc_track(1.8, 0.05, 0.3, velocity)
        met = meeting(scene, guess.poses, guess.time_steps, track)
        program = BandProgram(count, 2, settings=SolverSettings(), meets_moving=True)
        z = pack_band(guess.poses, guess.time_steps, 0.0)
        solution = solved(program, z, met, iterations=200)
        assert solution.violation < 1e-3
        times = np.cumsum(guess.time_steps)[:-1]
        gaps = [
            np.hypot(
                pose[0] + offset * math.cos(pose[2]) - 1.8 - time * velocity[0],
                pose[1] + offset * math.sin(pose[2]) - 0.05 - time * velocity[1],
            )
            for pose, time in zip(solution.poses[1:-1], times, strict=True)
            for offset, _ in scene.discs
        ]
        return solution, min(gaps) - 0.3 - 0.3

    going, gap = kept((0.0, 0.6))
    assert np.abs(going.poses[:, 1]).max() < 0.1
    assert gap > LIMITS.clearance
    staying, gap = kept((0.0, 0.0))
    assert np.abs(staying.poses[:, 1]).max() > 0.5
    assert gap > LIMITS.clearance - staying.slack - 0.03


def drive_decisions(include, boxes_at, count=30):
    """Returns the commands of a robot that stands while costmaps come five times a second."""
    parameters = load_preset("teb").parameters.model_copy(
        update={"include_dynamic_obstacles": include}
    )
    controller = TimedElasticBand(parameters, make_setup())
    plan = plan_from_elements([("s", 4.5)])
    memory, commands = TebMemory(), []
    for step in range(count):
        time_s = 0.05 * step
        stamp_s = PERIOD_S * math.floor(time_s / PERIOD_S + 1e-9)
        costmap = costmap_at(stamp_s, boxes_at(stamp_s), (0.0, 0.0))
        observation = observe(plan[plan[:, 0] < 2.5], time_s=time_s, costmap=costmap, goal=plan[-1])
        decision = controller.step(observation, memory)
        memory = decision.memory
        commands.append(decision.command)
    return np.array(commands), memory


def test_where_nothing_moves_the_parameter_changes_nothing():
    boxes = [*WALLS, (1.6, 0.2, 2.0, 0.9)]
    off, memory = drive_decisions(False, lambda _: boxes)
    on, tracking = drive_decisions(True, lambda _: boxes)
    np.testing.assert_array_equal(on, off)
    assert memory.tracking == Tracking()
    assert len(tracking.tracking.snapshots) > 1


def test_what_leaves_the_way_is_not_driven_around():
    # After 1.2 s it covers the plan, 0.65 m ahead; 1.5 s later it is a metre beside it.
    def boxes_at(time_s):
        y = -0.8 + 0.5 * time_s
        return [(1.5, y, 2.0, y + 0.5)]

    on, _ = drive_decisions(True, boxes_at, count=24)
    off, _ = drive_decisions(False, boxes_at, count=24)
    # Taken as standing, it is passed on the side that it goes to.
    assert off[-6:, 1].max() > 0.3
    assert np.abs(on[-6:, 1]).max() < 0.5 * off[-6:, 1].max()


def test_what_lies_behind_a_slanted_surface_was_not_in_sight():
    # Cells that meet at their corners alone: a line of sight that is thin enough slips through.
    lethal = np.zeros((30, 30), dtype=bool)
    lethal[np.arange(30), np.arange(30)] = True
    corner, robot = np.zeros(2, dtype=np.int64), np.array([4.5, 25.5])
    others = np.array([[5, 5]])

    def found(cell):
        return farthest_free_cell(np.array([cell]), others, lethal, corner, robot, 40.0)[0]

    assert found((24, 5)) == 0.0
    assert found((5, 20)) == 15.0
