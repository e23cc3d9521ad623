"""How close the robot is to the obstacles, sampled: truly, and as the publication measures it."""

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

# Pairs farther apart are not looked at; the clearance then reads +inf.
MAX_DISTANCE_M = 5.0
# Asked for first: where something is that near, what is farther need not be measured.
NEAR_DISTANCE_M = 1.0


class Clearance(LeafSystem):
    """Measures the distance to obstacles at the start, at `offset_s`, and once a period from then.

    Inputs `geometry_query` (SceneGraph), `state` [x m, y m, ...] and `costmap` (Costmap or None).
    Output `distances` [m]: first the signed distance between the footprint's geometry and the
    nearest obstacle (negative when they overlap); then the distance from the reference point to the
    nearest lethal cell's centre, the published measure. +inf where nothing is near. Whether they
    touch between two samples is for ContactWatch to say.

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
        self._costmap_port = self.DeclareAbstractInputPort("costmap", AbstractValue.Make(object()))
        self._distances = self.DeclareDiscreteState([math.inf, math.inf])
        self.DeclareStateOutputPort("distances", self._distances)
        self.DeclareInitializationDiscreteUpdateEvent(self._on_period)
        self.DeclarePeriodicDiscreteUpdateEvent(period_s, offset_s, self._on_period)

    def set_contact(self, context: Context) -> None:
        """Sets the clearance to 0, as it is at a contact; an overlap at the start stays one."""
        distances = context.get_mutable_discrete_state(self._distances)
        distances[0] = min(distances[0], 0.0)

    def _on_period(self, context: Context, discrete_state: DiscreteValues) -> None:
        clearance = _nearest_geometry(self._query_port.Eval(context))
        pose = self._state_port.Eval(context)[:3]
        if len(self._wall_edges):
            outline = place_outline(self._footprint, pose)
            to_walls = outline_to_edges(outline, self._wall_edges, MAX_DISTANCE_M)
            clearance = min(clearance, to_walls)
        costmap = self._costmap_port.Eval(context)
        cell_distance = math.inf
        if costmap is not None and len(costmap.lethal_centres):
            cell_distance = nearest_distance(costmap.lethal_centres, pose[:2])
        discrete_state.get_mutable_vector(self._distances).SetFromVector([clearance, cell_distance])


def _nearest_geometry(query: QueryObject) -> float:
    """Returns the signed distance of the nearest pair of geometries, m; inf where none is near."""
    for reach_m in (NEAR_DISTANCE_M, MAX_DISTANCE_M):
        pairs = query.ComputeSignedDistancePairwiseClosestPoints(reach_m)
        if pairs:
            return min(pair.distance for pair in pairs)
    return math.inf
