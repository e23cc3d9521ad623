"""What the tests of Regulated Pure Pursuit have in common."""

from __future__ import annotations

import numpy as np
import pytest
from controller_scenes import observe as observe_plan
from controller_scenes import setup_of

from drake_navbench.controllers.rpp import RegulatedPurePursuit, RegulatedPurePursuitParameters
from drake_navbench.kernels.footprint import circle_footprint, pad_footprint
from drake_navbench.kernels.grid import Costmap

RESOLUTION = 0.05
CELLS = 80
ORIGIN = -2.0


@pytest.fixture
def setup():
    """A round robot of radius 0.22 m at 20 Hz, as in nav2_bringup."""
    return setup_of(pad_footprint(circle_footprint(0.22), 0.01))


@pytest.fixture
def make_controller(setup):
    """Returns a controller with the given parameters, others at their defaults."""

    def make(**parameters):
        return RegulatedPurePursuit(RegulatedPurePursuitParameters(**parameters), setup)

    return make


@pytest.fixture
def make_costmap():
    """Returns a costmap of one cost, from -2 to 2 m, with lethal cells at the given points."""

    def make(cost=0, *, lethal=(), tracks_unknown=False):
        costs = np.full((CELLS, CELLS), cost, np.uint8)
        for x, y in lethal:
            costs[int((y - ORIGIN) / RESOLUTION), int((x - ORIGIN) / RESOLUTION)] = 254
        return Costmap(costs, ORIGIN, ORIGIN, RESOLUTION, tracks_unknown=tracks_unknown)

    return make


@pytest.fixture
def observe(make_costmap):
    """Returns an observation: the robot at the origin, at rest, on a free map.

    The plan is that of the worked examples: 0.3 m to the left, straight ahead, a pose every 0.3 m.
    """

    def make(plan=None, **fields):
        if plan is None:
            plan = [[0.3 * i, 0.3, 0.0] for i in range(6)]
        return observe_plan(plan, **{"costmap": make_costmap()} | fields)

    return make
