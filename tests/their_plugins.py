"""One plugin of each kind that surrounds a controller, as a package of somebody else has them.

Tests install this text as a package; nothing imports it from here.
"""

import math

import numpy as np
from py_trees.common import Status
from pydantic import Field

from drake_navbench.navigation.behavior import Step
from drake_navbench.navigation.behavior_tree.leaves import Leaf
from drake_navbench.navigation.costmaps.layer_plugin import LayerParameters, Observed
from drake_navbench.navigation.goal_check import GoalCheck
from drake_navbench.navigation.progress_checkers import ProgressCheck
from drake_navbench.plugins.parameters import PluginParameters


class DetourParameters(PluginParameters):
    offset_m: float = Field(0.5, description="How far left of the straight line its middle is [m].")
    spacing_m: float = Field(0.05, gt=0.0, description="Between poses along the straight line [m].")


class Detour:
    """A planner that looks at nothing: half a sine wave from start to goal."""

    Parameters = DetourParameters

    def __init__(self, parameters, footprint):
        self._parameters = parameters

    def plan(self, costmap, start, goal):
        start, goal = np.asarray(start, float), np.asarray(goal, float)
        ahead = goal[:2] - start[:2]
        length = math.hypot(*ahead)
        left = np.array([-ahead[1], ahead[0]]) / length
        s = np.linspace(0.0, 1.0, 1 + math.ceil(length / self._parameters.spacing_m))[:, None]
        points = start[:2] + s * ahead + self._parameters.offset_m * np.sin(math.pi * s) * left
        steps = np.diff(points, axis=0)
        yaws = np.append(np.arctan2(steps[:, 1], steps[:, 0]), goal[2])
        return np.column_stack([points, yaws])


class ThinParameters(PluginParameters):
    every: int = Field(2, ge=1, description="Each so manieth pose stays [poses].")


class Thin:
    """A smoother that leaves poses out, but not the last."""

    Parameters = ThinParameters

    def __init__(self, parameters):
        self._every = parameters.every

    def smooth(self, path, costmap):
        kept = path[:: self._every]
        return kept if len(path) % self._every == 1 else np.vstack([kept, path[-1:]])


class PuddleParameters(LayerParameters):
    centre: tuple[float, float] = Field(description="x [m], y [m].")
    radius_m: float = Field(0.3, gt=0.0, description="Radius [m].")
    cost: int = Field(77, ge=0, le=252, description="Cost of the cells in it.")


class Puddle:
    """A layer that writes a disc from its second cycle on; its state counts them."""

    Parameters = PuddleParameters

    def __init__(self, parameters, setup):
        self._parameters = parameters

    def initial_state(self):
        return 0

    def observe(self, state, seen):
        (x, y), radius = self._parameters.centre, self._parameters.radius_m
        return Observed(state + 1, (x - radius, y - radius, x + radius, y + radius))

    def write(self, state, grid, seen):
        if state < 2:
            return grid.costs
        rows, columns = np.indices(grid.costs.shape)
        x = grid.origin_x + (columns + 0.5) * grid.resolution
        y = grid.origin_y + (rows + 0.5) * grid.resolution
        centre = self._parameters.centre
        is_wet = np.hypot(x - centre[0], y - centre[1]) < self._parameters.radius_m
        grid.costs[is_wet] = np.maximum(grid.costs[is_wet], self._parameters.cost)
        return grid.costs


class WithinParameters(PluginParameters):
    reach_m: float = Field(0.8, gt=0.0, description="Near enough [m].")


class Within:
    """A goal checker: near enough, however the robot stands."""

    Parameters = WithinParameters

    def __init__(self, parameters):
        self._reach_m = parameters.reach_m

    @property
    def xy_tolerance_m(self):
        return self._reach_m

    @property
    def yaw_tolerance_rad(self):
        return math.pi

    def initial_state(self):
        return None

    def check(self, state, *, pose, goal, twist, local_plan):
        is_near = math.hypot(goal[0] - pose[0], goal[1] - pose[1]) <= self._reach_m
        return GoalCheck(is_near, is_near, state)


class TiredParameters(PluginParameters):
    from_s: float = Field(description="When it begins [s].")
    until_s: float = Field(description="When it ends [s].")


class Tired:
    """A progress checker that sees no progress for a while, whatever the robot does."""

    Parameters = TiredParameters

    def __init__(self, parameters):
        self._parameters = parameters

    def initial_state(self):
        return None

    def check(self, state, *, pose, time_s):
        is_tired = self._parameters.from_s <= time_s <= self._parameters.until_s
        return ProgressCheck(not is_tired, state)


class ShuffleParameters(PluginParameters):
    distance_m: float = Field(0.2, gt=0.0, description="Way back [m].")
    speed_mps: float = Field(0.1, gt=0.0, description="Speed [m/s].")


class Shuffle:
    """A behaviour: back by a distance; its state is where it began."""

    Parameters = ShuffleParameters
    invalid_input_code = 800

    def __init__(self, parameters, server):
        self._parameters = parameters

    def start(self, arguments, pose, time_s):
        return float(pose[0]), float(pose[1])

    def step(self, state, pose, time_s, surroundings):
        driven_m = math.hypot(pose[0] - state[0], pose[1] - state[1])
        if driven_m >= self._parameters.distance_m:
            return Step(state, (0.0, 0.0), is_done=True)
        return Step(state, (-self._parameters.speed_mps, 0.0))


class AlwaysParameters(PluginParameters):
    succeeds: bool = Field(True, description="What it ends with.")


class Always(Leaf):
    """A node that ends at once."""

    Parameters = AlwaysParameters

    def __init__(self, name, board, parameters):
        super().__init__(name, board)
        self._result = Status.SUCCESS if parameters.succeeds else Status.FAILURE

    def update(self):
        return self._result
