"""Random motions around the seeds, scored by the terms of the cost, without any averaging.

The noise is a pure function of a key: hashed counters (Steele, Lea, Flood: Fast splittable
pseudorandom number generators, 2014) give the values at a few knots, straight lines those
between. Samples come in pairs that turn to opposite sides, so that a mirrored world has the
mirrored samples, those around the two ways along walls excepted.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.controllers.harmony.motion import STAGE_SIZE, YAW, A, V, W, X, Y
from drake_navbench.controllers.harmony.scene import REFERENCE_SIZE, heading_wanted, nearest_on_path
from drake_navbench.controllers.harmony.seeds import within_limits
from drake_navbench.controllers.harmony.terms import COSTMAP_COST, stage_cost
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.grid import world_to_cell

KNOTS = 6
# Every ROOM_STRIDE-th stage is checked for room, since a robot moves about two cells between them;
# every STRIDE-th stage is rated by the terms.
ROOM_STRIDE, STRIDE = 2, 5
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST_MIX = np.uint64(0xBF58476D1CE4E5B9)
_SECOND_MIX = np.uint64(0x94D049BB133111EB)
_SHIFTS = (np.uint64(30), np.uint64(27), np.uint64(31))
_PARTS, _PART_BITS, _PART_MASK = 4, np.uint64(16), np.uint64(0xFFFF)
# Mean and standard deviation of the sum of four numbers that are uniform on 0..65535.
_MEAN_OF_PARTS, _DEVIATION_OF_PARTS = 2.0 * 65535.0, math.sqrt((65536.0**2 - 1.0) / 3.0)


@njit(cache=True)
def _normal(key, counter):
    """Returns a nearly normal number that depends on a key and a counter alone (splitmix64).

    The sum of the four 16-bit parts of one word, within 3.5 deviations of 0.
    """
    word = key + np.uint64(counter + 1) * _GOLDEN
    word = (word ^ (word >> _SHIFTS[0])) * _FIRST_MIX
    word = (word ^ (word >> _SHIFTS[1])) * _SECOND_MIX
    word = word ^ (word >> _SHIFTS[2])
    total = np.int64(0)
    for _ in range(_PARTS):
        total += np.int64(word & _PART_MASK)
        word = word >> _PART_BITS
    return (float(total) - _MEAN_OF_PARTS) / _DEVIATION_OF_PARTS


@njit(cache=True)
def _room(scene, stage, cosine, sine, required):
    """Returns (whether a stage has the required clearance, its cost of inflation).

    The distance of a disc is that of its centre's cell. The check allows half a cell: a gap that is
    wide enough for the program must not look closed.
    """
    field, reach = scene.field, scene.shape.inflation_dist
    required -= 0.5 * field.resolution
    rows, columns = field.distances.shape
    cost = 0.0
    for d in range(scene.discs.shape[0]):
        along = scene.discs[d, 0]
        column, row = world_to_cell(
            stage[X] + along * cosine,
            stage[Y] + along * sine,
            field.origin_x,
            field.origin_y,
            field.resolution,
            columns,
            rows,
        )
        if column < 0:
            return False, cost
        clearance = field.distances[row, column] - scene.discs[d, 1]
        if clearance < required:
            return False, cost
        inside = max(1.0 - clearance / reach, 0.0)
        cost += inside * inside
    return True, cost


@njit(cache=True)
def score(scene, path, velocities, start, window, motion, gradient, hessian):
    """Returns the cost of a motion, inf where it comes too near to obstacles.

    The inflation is looked up, not interpolated. velocities: (N + 1, 2). path: (P, 3). motion:
    (N + 1, 3), filled with its poses. gradient (9,), hessian (9, 9): scratch.
    """
    count, dt = velocities.shape[0], scene.dt
    stage, reference = start.copy(), np.empty(REFERENCE_SIZE)
    index, cost = np.int64(0), 0.0
    inflation_weight = dt * scene.weights[COSTMAP_COST]
    motion[0, 0], motion[0, 1], motion[0, 2] = start[X], start[Y], start[YAW]
    cosine, sine = math.cos(start[YAW]), math.sin(start[YAW])
    for k in range(1, count):
        v, w = velocities[k, 0], velocities[k, 1]
        before_v, before_w = velocities[k - 1, 0], velocities[k - 1, 1]
        turn, way = 0.5 * dt * (w + before_w), 0.5 * dt * (v + before_v)
        # The chord of the arc, by the heading in its middle to the second order.
        stage[X] += way * (cosine - 0.5 * turn * sine)
        stage[Y] += way * (sine + 0.5 * turn * cosine)
        stage[YAW] += turn
        cosine, sine = math.cos(stage[YAW]), math.sin(stage[YAW])
        motion[k, 0], motion[k, 1], motion[k, 2] = stage[X], stage[Y], stage[YAW]
        if k % ROOM_STRIDE == 0 or k == count - 1:
            has_room, inflation = _room(scene, stage, cosine, sine, scene.required[k])
            if not has_room:
                motion[k + 1 :] = motion[k]
                return math.inf
            cost += ROOM_STRIDE * inflation_weight * inflation
        if k % STRIDE == 0 or k == count - 1:
            index, x, y, yaw = nearest_on_path(path, stage[X], stage[Y], index, window)
            reference[0], reference[1] = x, y
            wanted = heading_wanted(scene, x, y, yaw)
            reference[2] = stage[YAW] + wrap(wanted - stage[YAW])
            reference[3] = scene.references[k, 3]
            stage[V], stage[W], stage[A] = v, w, (v - before_v) / dt
            share = 1.0 if k == count - 1 else float(STRIDE)
            cost += share * stage_cost(
                scene, k, count - 1, stage, reference, gradient, hessian, np.bool_(False)
            )
    return cost


@njit(cache=True)
def draw_samples(scene, path, seeds, start, key, count, v_deviation, w_deviation, window):
    """Returns (velocities, motions, costs) of samples: (K, N + 1, 2), (K, N + 1, 3), (K,).

    seeds: (S, N + 1, 2); the first S samples are the seeds themselves, the others come around them
    in turn, in pairs. key: 64 bits that name the noise. Costs are inf where a motion is blocked.
    """
    seed_count, stages = seeds.shape[0], seeds.shape[1]
    total = seed_count + 2 * (count // 2)
    velocities = np.empty((total, stages, 2))
    motions = np.empty((total, stages, 3))
    costs = np.empty(total)
    noise = np.zeros((KNOTS, 2))
    limits, dt = scene.limits, scene.dt
    gradient, hessian = np.zeros(STAGE_SIZE), np.zeros((STAGE_SIZE, STAGE_SIZE))
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
        costs[k] = score(scene, path, velocities[k], start, window, motions[k], gradient, hessian)
    return velocities, motions, costs
