"""Bands, scenes and limits that the tests of TEB share."""

from __future__ import annotations

import numpy as np

from drake_navbench.controllers.teb.band import Pace
from drake_navbench.controllers.teb.constraints import BandScene
from drake_navbench.controllers.teb.layout import pack_band
from drake_navbench.controllers.teb.objective import Weights
from drake_navbench.controllers.teb.program import BandLimits, BandProgram, BandSolution
from drake_navbench.kernels.distance_field import DistanceField
from drake_navbench.kernels.grid import FREE, LETHAL, Costmap
from drake_navbench.kernels.read_only import read_only

WHEELCHAIR_DISCS = np.array([[0.05, 0.30], [0.55, 0.30]])
CELLS = 120
RESOLUTION = 0.05
MOST_INNER_POSES = 100

LIMITS = BandLimits(
    forward_speed=0.5,
    backward_speed=0.2,
    turn_rate=1.0,
    acceleration=0.5,
    angular_acceleration=1.0,
    clearance=0.25,
    shortest_step=0.06,
    longest_step=1.2,
    largest_slack=0.35,
)
PACE = Pace(
    speed=0.5,
    turn_rate=1.0,
    acceleration=0.5,
    dt_ref=0.3,
    dt_hysteresis=0.1,
    fewest=3,
    most=60,
)
ZERO_WEIGHTS = Weights(
    time=0.0,
    length=0.0,
    backwards=0.0,
    via_point=0.0,
    inflation=0.0,
    inflation_dist=0.6,
    smoothness=0.0,
    slack=0.0,
)
WEIGHTS = ZERO_WEIGHTS._replace(
    time=1.0, backwards=1.0, via_point=1.0, inflation=0.1, smoothness=0.1, slack=100.0
)


def cell_centres(origin: float = -3.0) -> np.ndarray:
    """Returns the coordinates of the cell centres along one axis of the field."""
    return origin + (np.arange(CELLS) + 0.5) * RESOLUTION


def map_of(boxes=()) -> Costmap:
    """Returns a 6 x 6 m map about the origin with lethal boxes (x0, y0, x1, y1), m."""
    centres = cell_centres()
    costs = np.full((CELLS, CELLS), FREE, dtype=np.uint8)
    for x0, y0, x1, y1 in boxes:
        costs[np.ix_((centres > y0) & (centres < y1), (centres > x0) & (centres < x1))] = LETHAL
    return Costmap(costs, -3.0, -3.0, RESOLUTION)


def round_obstacles_field(obstacles, origin_x: float = -3.0, origin_y: float = -3.0):
    """Returns the exact distance field of round obstacles (x, y, radius), sampled at cells."""
    x = cell_centres(origin_x)[None, :]
    y = cell_centres(origin_y)[:, None]
    distances = np.full((CELLS, CELLS), 100.0)
    for centre_x, centre_y, radius in obstacles:
        distances = np.minimum(distances, np.hypot(x - centre_x, y - centre_y) - radius)
    return DistanceField(read_only(distances), origin_x, origin_y, RESOLUTION)


def make_scene(
    start, goal, *, field=None, start_twist=(0.0, 0.0), goal_twist=(0.0, 0.0), discs=None
) -> BandScene:
    """Returns a scene without via-points; without a field there is no obstacle.

    Every pose of a band, however long, keeps all of the clearance.
    """
    return BandScene(
        start=read_only(start),
        goal=np.array(goal, dtype=float),
        start_twist=np.array(start_twist, dtype=float),
        goal_twist=np.array(goal_twist, dtype=float),
        discs=WHEELCHAIR_DISCS if discs is None else discs,
        field=round_obstacles_field([]) if field is None else field,
        clearance_shares=np.ones(MOST_INNER_POSES),
        via_points=np.empty((0, 2)),
        via_poses=np.empty(0, dtype=np.int64),
    )


def solved(
    program: BandProgram,
    guess,
    scene,
    *,
    iterations,
    weights=WEIGHTS,
    limits=LIMITS,
    is_confirmed=True,
) -> BandSolution:
    """Returns IPOPT's solution from where Newton's method ends on a guess (N,).

    is_confirmed: False spares IPOPT what Newton's method solves.
    """
    newton = program.run_newton(guess, scene=scene, weights=weights, limits=limits)
    if newton.descent.converged and not is_confirmed:
        return program.unconfirmed(newton)
    return program.confirm(newton, iterations)


def of_size(scene: BandScene, interval_count: int) -> BandScene:
    """Returns the scene of `make_scene` for a band of m intervals."""
    return scene._replace(clearance_shares=scene.clearance_shares[: interval_count - 1])


def random_band(rng: np.random.Generator, interval_count: int):
    """Returns (z, scene): a crooked band among round obstacles, with via-points."""
    steps = rng.uniform(0.2, 0.4, interval_count)
    moves = np.column_stack(
        [
            rng.uniform(-0.1, 0.2, interval_count),
            rng.uniform(-0.1, 0.1, interval_count),
            rng.uniform(-0.5, 0.5, interval_count),
        ]
    )
    moves[0, 2] = 1e-5  # a turn in the range of the series of arc_ratio
    first = np.append(rng.uniform(-0.5, 0.5, 2), rng.uniform(-3.0, 3.0))
    poses = first + np.vstack([np.zeros(3), np.cumsum(moves, axis=0)])
    scene = make_scene(
        poses[0],
        poses[-1],
        field=round_obstacles_field(rng.uniform([-2, -2, 0.1], [2, 2, 0.4], (5, 3))),
        start_twist=rng.uniform(-0.5, 0.5, 2),
        goal_twist=rng.uniform(-0.2, 0.2, 2),
    )
    scene = scene._replace(
        via_points=rng.uniform(-1.0, 1.0, (3, 2)),
        via_poses=rng.integers(1, interval_count, 3),
        clearance_shares=rng.uniform(0.1, 1.0, interval_count - 1),
    )
    return pack_band(poses, steps, 0.05), scene


def random_problem(seed):
    """Returns (scene, path): start, goal, twist and obstacles that leave the straight line free."""
    rng = np.random.default_rng(seed)
    goal = np.array([rng.uniform(1.0, 2.5), 0.0, rng.uniform(-0.6, 0.6)])
    obstacles = []
    for _ in range(int(rng.integers(0, 6))):
        radius = rng.uniform(0.1, 0.4)
        side = rng.choice([-1.0, 1.0])
        # Beyond the half width, the clearance, and what turning at the goal may need.
        offset = 0.3 + LIMITS.clearance + 0.35 + radius + rng.uniform(0.0, 0.5)
        obstacles.append((rng.uniform(-0.5, 3.0), side * offset, radius))
    speed = rng.uniform(0.0, 0.4)
    scene = make_scene(
        (0.0, 0.0, rng.uniform(-0.4, 0.4)),
        goal,
        field=round_obstacles_field(obstacles),
        start_twist=(speed, rng.uniform(-0.2, 0.2)),
    )
    return scene, [(0.5 * goal[0], 0.0)]


def numeric_jacobian(function, z: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """Returns the Jacobian of a vector function by central differences."""
    columns = []
    for i in range(len(z)):
        ahead, behind = z.copy(), z.copy()
        ahead[i] += step
        behind[i] -= step
        columns.append(np.atleast_1d(function(ahead)) - np.atleast_1d(function(behind)))
    return np.stack(columns, axis=1) / (2.0 * step)
