"""How close the robot is to the obstacles: the truth, and as the publication measures it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.geometry import QueryObject
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_navbench.kernels.grid import nearest_distance
from drake_navbench.kernels.layer_grid import place_outline
from drake_navbench.kernels.outline_distance import outline_to_edges
from drake_navbench.systems.ports import declare_object_input

# Pairs farther apart are not looked at; the clearance then reads +inf.
MAX_DISTANCE_M = 5.0
# Asked for first: where something is that near, what is farther need not be measured.
NEAR_DISTANCE_M = 1.0
# To an obstacle, to the centre of a cell, to the corner of a cell.
DISTANCE_COUNT = 3


class Clearance(LeafSystem):
    """Measures the distance to obstacles at the start, at `offset_s`, and once a period from then.

    Inputs `geometry_query` (SceneGraph), `state` [x m, y m, ...] and `costmap` (Costmap or None).
    Output `distances` [m]: first the signed distance between the footprint's geometry and the
    nearest obstacle (negative when they overlap), the truth about collisions; then the distance
    from the reference point to the nearest of the lethal cells' centres; then that to the nearest
    of their lower left corners, the published measure. +inf where nothing is near.

    wall_edges: (N, 4) x0, y0, x1, y1 m of the walls of a map, which SceneGraph does not measure;
        a footprint that overlaps one is at 0. footprint: (K, 2) true outline, base frame, m.
    """

    def __init__(
        self,
        *,
        footprint: NDArray[np.float64],
        wall_edges: NDArray[np.float64],
        period_s: float,
        offset_s: float,
    ) -> None:
        super().__init__()
        self._footprint = np.ascontiguousarray(footprint)
        self._wall_edges = wall_edges
        self._query_port = self.DeclareAbstractInputPort(
            "geometry_query", AbstractValue.Make(QueryObject())
        )
        self._state_port = self.DeclareVectorInputPort("state", 5)
        self._costmap_port = declare_object_input(self, "costmap")
        self._distances = self.DeclareDiscreteState([math.inf] * DISTANCE_COUNT)
        self.DeclareStateOutputPort("distances", self._distances)
        self.DeclareInitializationDiscreteUpdateEvent(self._on_period)
        self.DeclarePeriodicDiscreteUpdateEvent(period_s, offset_s, self._on_period)

    def _on_period(self, context: Context, discrete_state: DiscreteValues) -> None:
        clearance = _nearest_geometry(self._query_port.Eval(context))
        pose = self._state_port.Eval(context)[:3]
        if len(self._wall_edges):
            outline = place_outline(self._footprint, pose)
            to_walls = outline_to_edges(outline, self._wall_edges, MAX_DISTANCE_M)
            clearance = min(clearance, to_walls)
        costmap = self._costmap_port.Eval(context)
        to_centre = to_corner = math.inf
        if costmap is not None and len(costmap.lethal_centres):
            to_centre = nearest_distance(costmap.lethal_centres, pose[:2])
            # Corners half a cell to the lower left, or the robot as much to the upper right.
            to_corner = nearest_distance(
                costmap.lethal_centres, pose[:2] + 0.5 * costmap.resolution
            )
        distances = [clearance, to_centre, to_corner]
        discrete_state.get_mutable_vector(self._distances).SetFromVector(distances)


def _nearest_geometry(query: QueryObject) -> float:
    """Returns the signed distance of the nearest pair of geometries, m; inf where none is near."""
    for reach_m in (NEAR_DISTANCE_M, MAX_DISTANCE_M):
        pairs = query.ComputeSignedDistancePairwiseClosestPoints(reach_m)
        if pairs:
            return min(pair.distance for pair in pairs)
    return math.inf
