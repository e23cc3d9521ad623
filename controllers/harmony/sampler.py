"""Random motions around the seeds, scored by the terms of the cost, without any averaging.

The noise is a pure function of a key: hashed counters (Steele, Lea, Flood: Fast splittable
pseudorandom number generators, 2014) give the values at a few knots, straight lines the values
between. Samples come in pairs that turn to opposite sides, so that a mirrored world has the
mirrored samples.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.controllers.harmony.groups import group_of
from drake_navbench.controllers.harmony.motion import STAGE_SIZE, YAW, A, V, W, X, Y
from drake_navbench.controllers.harmony.scene import REFERENCE_SIZE, nearest_on_path
from drake_navbench.controllers.harmony.seeds import within_limits
from drake_navbench.controllers.harmony.terms import stage_cost
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.grid import world_to_cell

KNOTS = 6
# Scored is every so many-th stage; between two the robot moves by less than a cell or two.
STRIDE = 3
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST_MIX = np.uint64(0xBF58476D1CE4E5B9)
_SECOND_MIX = np.uint64(0x94D049BB133111EB)
_SHIFTS = (np.uint64(30), np.uint64(27), np.uint64(31))
_TO_UNIT = 2.0**-53
_UNUSED_BITS = np.uint64(11)


@njit(cache=True)
def _uniform(key, counter):
    """Returns a number in [0, 1) that depends on a key and a counter alone (splitmix64)."""
    word = key + np.uint64(counter + 1) * _GOLDEN
    word = (word ^ (word >> _SHIFTS[0])) * _FIRST_MIX
    word = (word ^ (word >> _SHIFTS[1])) * _SECOND_MIX
    word = word ^ (word >> _SHIFTS[2])
    return float(word >> _UNUSED_BITS) * _TO_UNIT


@njit(cache=True)
def _normal(key, counter):
    """Returns a normal number, by Box and Muller's transform of two uniform ones."""
    radius = math.sqrt(-2.0 * math.log(1.0 - _uniform(key, 2 * counter)))
    return radius * math.cos(2.0 * math.pi * _uniform(key, 2 * counter + 1))


@njit(cache=True)
def _disc_is_blocked(scene, x, y, required):
    """Returns whether a disc's centre is too near to a lethal cell, by the field's nearest cell."""
    field = scene.field
    rows, columns = field.distances.shape
    column, row = world_to_cell(
        x, y, field.origin_x, field.origin_y, field.resolution, columns, rows
    )
    return column < 0 or field.distances[row, column] < required


@njit(cache=True)
def _is_blocked(scene, stage, required):
    cosine, sine = math.cos(stage[YAW]), math.sin(stage[YAW])
    for d in range(scene.discs.shape[0]):
        x, y = stage[X] + scene.discs[d, 0] * cosine, stage[Y] + scene.discs[d, 0] * sine
        if _disc_is_blocked(scene, x, y, scene.discs[d, 1] + required):
            return True
    return False


@njit(cache=True)
def score(scene, path, velocities, start, window, motion):
    """Returns the cost of a motion, inf where it comes too near to obstacles.

    velocities: (N + 1, 2). path: (P, 3). motion: (N + 1, 3), filled with its poses, as far as it
    is looked at.
    """
    count, dt = velocities.shape[0], scene.dt
    stage, reference = start.copy(), np.empty(REFERENCE_SIZE)
    gradient, hessian = np.zeros(STAGE_SIZE), np.zeros((STAGE_SIZE, STAGE_SIZE))
    index, cost = 0, 0.0
    motion[0, 0], motion[0, 1], motion[0, 2] = start[X], start[Y], start[YAW]
    for k in range(1, count):
        v, w = velocities[k, 0], velocities[k, 1]
        before_v, before_w = velocities[k - 1, 0], velocities[k - 1, 1]
        turn, way = 0.5 * dt * (w + before_w), 0.5 * dt * (v + before_v)
        stage[X] += way * math.cos(stage[YAW] + 0.5 * turn)
        stage[Y] += way * math.sin(stage[YAW] + 0.5 * turn)
        stage[YAW] += turn
        motion[k, 0], motion[k, 1], motion[k, 2] = stage[X], stage[Y], stage[YAW]
        if k % STRIDE and k < count - 1:
            continue
        if _is_blocked(scene, stage, scene.required[k]):
            motion[k:] = motion[k]
            return math.inf
        index, x, y, yaw = nearest_on_path(path, stage[X], stage[Y], index, window)
        reference[0], reference[1] = x, y
        reference[2] = stage[YAW] + wrap(yaw - stage[YAW])
        reference[3] = scene.references[k, 3]
        stage[V], stage[W], stage[A] = v, w, (v - before_v) / dt
        cost += STRIDE * stage_cost(
            scene, min(k, count - 2), count - 1, stage, reference, gradient, hessian
        )
    stage[V], stage[W], stage[A] = 0.0, 0.0, 0.0
    cost += stage_cost(scene, count - 1, count - 1, stage, reference, gradient, hessian)
    return cost


@njit(cache=True)
def draw_samples(scene, path, seeds, start, anchors, key, count, v_deviation, w_deviation, window):
    """Returns (velocities, motions, costs, groups) of samples: (K, N + 1, 2), (K, N + 1, 3), (K,).

    seeds: (S, N + 1, 2); the first S samples are the seeds themselves, the others come around them
    in turn, in pairs. key: 64 bits that name the noise. Costs are inf where a motion is blocked.
    """
    seed_count, stages = seeds.shape[0], seeds.shape[1]
    total = seed_count + 2 * (count // 2)
    velocities = np.empty((total, stages, 2))
    motions = np.empty((total, stages, 3))
    costs, groups = np.empty(total), np.zeros(total, dtype=np.int64)
    noise = np.zeros((KNOTS, 2))
    limits, dt = scene.limits, scene.dt
    for k in range(total):
        seed = k if k < seed_count else ((k - seed_count) // 2) % seed_count
        pair = (k - seed_count) // 2
        mirror = -1.0 if k >= seed_count and (k - seed_count) % 2 else 1.0
        if k < seed_count:
            velocities[k] = seeds[k]
        else:
            for knot in range(KNOTS):
                place = 2 * (pair * KNOTS + knot)
                noise[knot, 0] = v_deviation * _normal(key, place)
                noise[knot, 1] = mirror * w_deviation * _normal(key, place + 1)
            v, w = start[V], start[W]
            velocities[k, 0, 0], velocities[k, 0, 1] = v, w
            for i in range(1, stages):
                at = (i - 1) * (KNOTS - 1) / (stages - 2)
                knot = min(int(at), KNOTS - 2)
                share = at - knot
                more_v = (1.0 - share) * noise[knot, 0] + share * noise[knot + 1, 0]
                more_w = (1.0 - share) * noise[knot, 1] + share * noise[knot + 1, 1]
                v, w = within_limits(
                    limits,
                    dt,
                    (stages - 1 - i) * dt,
                    v,
                    w,
                    seeds[seed, i, 0] + more_v,
                    seeds[seed, i, 1] + more_w,
                )
                velocities[k, i, 0], velocities[k, i, 1] = v, w
        costs[k] = score(scene, path, velocities[k], start, window, motions[k])
        if costs[k] < math.inf:
            groups[k] = group_of(motions[k], anchors, start[X], start[Y], scene.target)
    return velocities, motions, costs, groups
