"""The costs of guessed motions, by the terms and by the room that the motions have.

The program mends a guess, so its cost may be rough: every ROOM_STRIDE-th stage is checked for room
(a robot moves about two cells between them), every STRIDE-th one is rated by the terms, and the
inflation is looked up in the cells of the discs' centres.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.controllers.harmony.motion import STAGE_SIZE, YAW, A, V, W, X, Y, fill
from drake_navbench.controllers.harmony.scene import REFERENCE_SIZE, heading_wanted, nearest_on_path
from drake_navbench.controllers.harmony.terms import COSTMAP_COST, INFLATION_M, stage_cost
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.grid import world_to_cell

ROOM_STRIDE, STRIDE = 2, 5


@njit(cache=True)
def _room(scene, stage, cosine, sine, required):
    """Returns (whether a stage has the required clearance, its cost of inflation).

    Half a cell less will do: a gap that is wide enough for the program must not look closed.
    """
    field = scene.field
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
        inside = max(1.0 - clearance / INFLATION_M, 0.0)
        cost += inside * inside
    return True, cost


@njit(cache=True)
def cost_of_motion(scene, without_costmap, path, velocities, start, window, motion):
    """Returns the cost of a motion, inf where it comes too near to obstacles or leaves the map.

    without_costmap: the scene without the weight of that term. path: (P, 3). velocities: (N + 1, 2)
    m/s, rad/s. motion: (N + 1, 3), filled with its poses; from one without room on with that one.
    """
    count, dt = velocities.shape[0], scene.dt
    stage, reference = start.copy(), np.empty(REFERENCE_SIZE)
    gradient, hessian = np.zeros(STAGE_SIZE), np.zeros((STAGE_SIZE, STAGE_SIZE))
    index, cost = np.int64(0), 0.0
    inflation_weight = dt * scene.weights[COSTMAP_COST]
    fill(motion[0], start)
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
        fill(motion[k], stage)
        if k % ROOM_STRIDE == 0 or k == count - 1:
            has_room, inflation = _room(scene, stage, cosine, sine, scene.required[k])
            if not has_room:
                for later in range(k + 1, count):
                    fill(motion[later], stage)
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
                without_costmap, k, count - 1, stage, reference, gradient, hessian
            )
    return cost
