"""Samples the robot's distance to obstacles: the true clearance, and the publication's measure."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.framework import Context, DiscreteValues, State

from drake_navbench.inputs.world import World
from drake_navbench.kernels.grid import distances_to_lethal
from drake_navbench.kernels.poses import compose
from drake_navbench.kernels.swept_contact import clearance_at
from drake_navbench.navigation.mission import FloorSwitch
from drake_navbench.trial.systems.floor_aware import FloorAware, FloorClock
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import (
    POSE_SIZE,
    STATE_SIZE,
    declare_object_input,
    value_or_none,
)

# The clearance beyond this distance, m, reads +inf.
MAX_DISTANCE_M = 5.0
# The number of distances: to an obstacle, to the centre of a cell, to the corner of a cell.
DISTANCE_COUNT = 3


class Clearance(FloorAware):
    """Measures the distance to obstacles at the start, at `offset_s`, and once a period from then.

    Inputs `state` [x m, y m, yaw rad, ...], `costmap` (Costmap or None; need not be connected),
    `odometry_from_world` (3,), the world's pose in the costmap's frame (not connected: they are
    one), and `moving` (edges (E, 4) and circles (D, 3) of moving bodies, m; need not be connected).
    Output `distances` [m]: first the distance between the footprint and the nearest thing that
    stands or moves in the world, 0 where they overlap; then the distance from the reference point
    to the nearest of the lethal cells' centres; then that to the nearest of their lower left
    corners, the published measure. +inf where nothing is near. Touches between two samples are
    found by ContactWatch.

    The distance is exact in the plane. SceneGraph's is not: between prisms on one floor FCL's
    general algorithm is now and then too large by up to metres (flexible-collision-library/fcl,
    issue 508).

    footprint: (K, 2) true outline, base frame, m. floor_clock: for several floors; on a new floor
    all distances are +inf until the next measurement.
    """

    def __init__(
        self,
        world: World,
        *,
        footprint: NDArray[np.float64],
        period_s: float,
        offset_s: float,
        floor_clock: FloorClock | None = None,
    ) -> None:
        super().__init__()
        if floor_clock is not None:
            self._declare_floors(floor_clock)
        self._footprint = np.ascontiguousarray(footprint)
        self._edges, self._circles = world.segments, world.circles
        self._state_port = self.DeclareVectorInputPort("state", STATE_SIZE)
        self._costmap_port = declare_object_input(self, "costmap")
        self._frame_port = self.DeclareVectorInputPort("odometry_from_world", POSE_SIZE)
        self._moving_port = declare_object_input(self, "moving")
        self._distances = self.DeclareDiscreteState([math.inf] * DISTANCE_COUNT)
        self.DeclareStateOutputPort("distances", self._distances)
        self.DeclareInitializationDiscreteUpdateEvent(weakly_bound(self._on_period))
        self.DeclarePeriodicDiscreteUpdateEvent(period_s, offset_s, weakly_bound(self._on_period))

    def set_contact(self, context: Context) -> None:
        """Sets the clearance to 0, as it is at a touch."""
        context.get_mutable_discrete_state(self._distances)[0] = 0.0

    def _on_floor(self, context: Context, state: State, switch: FloorSwitch) -> None:
        nothing = [math.inf] * DISTANCE_COUNT
        state.get_mutable_discrete_state(self._distances).SetFromVector(nothing)

    def _on_period(self, context: Context, discrete_state: DiscreteValues) -> None:
        pose = self._state_port.Eval(context).tolist()[:3]
        x, y, yaw = pose
        clearance = clearance_at(
            self._footprint, x, y, yaw, self._edges, self._circles, MAX_DISTANCE_M
        )
        moving = value_or_none(self._moving_port, context)
        if moving is not None:
            edges, circles = moving
            to_moving = clearance_at(self._footprint, x, y, yaw, edges, circles, MAX_DISTANCE_M)
            clearance = min(clearance, to_moving)
        costmap = value_or_none(self._costmap_port, context)
        to_centre = to_corner = math.inf
        if costmap is not None:
            frame = value_or_none(self._frame_port, context)
            if frame is not None:
                x, y, _ = compose(frame, pose).tolist()
            to_centre, to_corner = distances_to_lethal(costmap.grid, x, y)
        distances = np.array([clearance, to_centre, to_corner])
        discrete_state.set_value(self._distances, distances)
