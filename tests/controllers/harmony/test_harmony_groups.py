"""Samples: the same for the same key, in mirrored pairs, and told apart by the side they pass."""

from __future__ import annotations

import numpy as np
from harmony_scenes import DISCS, problem, straight

from drake_navbench.controllers.harmony.groups import group_of, nearest_anchors
from drake_navbench.controllers.harmony.planner import noise_word
from drake_navbench.controllers.harmony.sampler import draw_samples
from drake_navbench.controllers.harmony.scene import make_start
from drake_navbench.controllers.harmony.seeds import LEFT, RIGHT, along_wall, pursuit, stop
from drake_navbench.kernels.distance_field import path_clearance
from drake_navbench.noise import NoiseKey

TARGET = np.array([2.0, 0.0, 0.0])
START = make_start(np.zeros(3), 0.2, 0.0)


def bend(side):
    """A motion that passes (1, 0) at a distance of 0.5 m."""
    x = np.linspace(0.0, 1.6, 31)
    return np.column_stack([x, side * 0.5 * np.sin(np.pi * x / 2.0), np.zeros(31)])


def test_motions_past_either_side_of_an_obstacle_are_in_two_groups():
    anchors = np.array([[1.0, 0.0]])
    left, right = (group_of(bend(side), 3, anchors, TARGET) for side in (1.0, -1.0))
    assert left != right
    assert group_of(0.5 * bend(1.0), 3, anchors, TARGET) != right


def test_an_obstacle_beside_the_way_makes_no_group():
    anchors = np.array([[1.0, 2.0], [1.0, -2.0]])
    assert group_of(bend(1.0), 3, anchors, TARGET) == group_of(bend(-1.0), 3, anchors, TARGET)


def test_the_nearest_anchors_come_first():
    anchors = np.array([[3.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    np.testing.assert_array_equal(nearest_anchors(anchors, np.zeros(3))[:, 0], [1.0, 2.0, 3.0])


def samples(step=1, boxes=(), count=200):
    scene, _ = problem(boxes=boxes, speed=0.2)
    limits, dt = scene.limits, scene.dt
    seeds = np.stack(
        [pursuit(straight(), START, TARGET, 0.0, limits, dt, 31, 20), stop(START, limits, dt, 31)]
    )
    key = noise_word(NoiseKey(7, 4, step))
    anchors = np.array([[1.05, 0.0]])
    beyond = TARGET[:2]
    return scene, draw_samples(
        scene, straight(), seeds, START, anchors, beyond, key, count, 0.1, 0.3, 20
    )


def test_samples_are_a_function_of_their_key():
    _, (first, *_) = samples()
    _, (again, *_) = samples()
    _, (other, *_) = samples(step=2)
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_samples_obey_speeds_and_accelerations_and_end_at_rest():
    scene, (velocities, *_) = samples()
    limits = scene.limits
    assert np.abs(np.diff(velocities[:, :, 0], axis=1)).max() <= limits.acceleration * scene.dt
    assert np.abs(np.diff(velocities[:, :, 1], axis=1)).max() <= (
        limits.angular_acceleration * scene.dt
    )
    assert velocities[:, :, 0].max() <= limits.forward_speed
    assert velocities[:, :, 0].min() >= -limits.backward_speed
    assert np.abs(velocities[:, :, 1]).max() <= limits.turn_rate
    np.testing.assert_allclose(velocities[:, -1], 0.0, atol=1e-9)


def test_samples_come_in_pairs_that_turn_to_opposite_sides():
    _, (velocities, *_) = samples()
    # The seeds go straight, so that a pair is mirrored.
    np.testing.assert_allclose(velocities[2::2, :, 0], velocities[3::2, :, 0])
    np.testing.assert_allclose(velocities[2::2, :, 1], -velocities[3::2, :, 1])


def test_a_motion_without_a_cost_is_one_that_hits_something():
    box = (1.3, -0.1, 1.5, 0.1)
    scene, (_, motions, costs, groups) = samples(boxes=[box], count=600)
    free = np.isfinite(costs)
    assert 0 < free.sum() < len(costs)
    # What is asked for, but half a cell and what a motion does between two looks.
    least = np.array([path_clearance(scene.field, DISCS, motion).min() for motion in motions])
    asked = scene.limits.clearance
    assert least[free].min() > asked - 0.05
    assert least[~free].max() < asked + 0.025
    assert set(groups[~free]) == {0}


def test_ways_along_a_wall_keep_it_to_their_side():
    scene, _ = problem(boxes=[(1.6, -1.0, 1.7, 1.0)], speed=0.2)
    for side in (LEFT, RIGHT):
        way = along_wall(scene.field, side, 0.6, START, TARGET, scene.limits, scene.dt, 31, 0.72)
        assert side * way[:, 1].sum() > 0.1
