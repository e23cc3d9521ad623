"""The robot's pose in the world when lifts carry it from one floor to another."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import FramePoseVector
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import BasicVector, Context, State

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.poses import carrier_pose, placed_state
from drake_navbench.navigation.mission import FloorSwitch
from drake_navbench.trial.systems.floor_aware import FloorAware, FloorClock
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import POSE_SIZE, STATE_SIZE

SAME_FRAME = np.zeros(POSE_SIZE)
NO_NOISE = np.zeros(STATE_SIZE)


class FloorTransport(FloorAware):
    """Places the plane on which a base drives in the world; a lift moves that plane.

    The base knows nothing of floors: its motion goes on evenly, as its wheels do. Inputs
    `base_state` [x m, y m, yaw rad, v m/s, w rad/s, vy m/s] and `base_geometry_pose`
    (FramePoseVector) in the base's plane, `floor_switch`. Outputs `state` and `geometry_pose`, the
    same two in the world. At a change of floor the robot's pose relative to the lift's stop stays
    the same, with the stop of the new floor in place of the old. `world_from_base_plane` is the
    discrete state (3,) x m, y m, yaw rad; it begins as the identity.
    """

    def __init__(self, clock: FloorClock) -> None:
        super().__init__()
        self.world_from_base_plane = self.DeclareDiscreteState(POSE_SIZE)
        self._base_port = self.DeclareVectorInputPort("base_state", STATE_SIZE)
        self._pose_port = self.DeclareAbstractInputPort(
            "base_geometry_pose", AbstractValue.Make(FramePoseVector())
        )
        plane = self.discrete_state_ticket(self.world_from_base_plane)
        self.DeclareVectorOutputPort(
            "state",
            STATE_SIZE,
            weakly_bound(self._calc_state),
            prerequisites_of_calc={plane, self.input_port_ticket(self._base_port.get_index())},
        )
        self.DeclareAbstractOutputPort(
            "geometry_pose",
            lambda: AbstractValue.Make(FramePoseVector()),
            weakly_bound(self._calc_geometry_pose),
            prerequisites_of_calc={plane, self.input_port_ticket(self._pose_port.get_index())},
        )
        self._declare_floors(clock)

    def base_state(self, context: Context, state: Array) -> Array:
        """Returns (6,) the state in the base's plane of one in the world."""
        plane = context.get_discrete_state(self.world_from_base_plane).value()
        inverse = carrier_pose(SAME_FRAME, plane)
        return np.asarray(
            placed_state(np.asarray(state, dtype=float), inverse, NO_NOISE, SAME_FRAME)
        )

    def _on_floor(self, context: Context, state: State, switch: FloorSwitch) -> None:
        base_pose = self._base_port.Eval(context)[:POSE_SIZE]
        plane = context.get_discrete_state(self.world_from_base_plane).value()
        here = placed_state(self._base_port.Eval(context), plane, NO_NOISE, SAME_FRAME)
        moved = carrier_pose(switch.carried(here[:POSE_SIZE]), base_pose)
        state.get_mutable_discrete_state(self.world_from_base_plane).SetFromVector(moved)

    def _calc_state(self, context: Context, output: BasicVector) -> None:
        plane = context.get_discrete_state(self.world_from_base_plane).value()
        placed = placed_state(self._base_port.Eval(context), plane, NO_NOISE, SAME_FRAME)
        output.SetFromVector(placed)

    def _calc_geometry_pose(self, context: Context, output: AbstractValue) -> None:
        x, y, yaw = context.get_discrete_state(self.world_from_base_plane).value()
        plane = RigidTransform(RotationMatrix.MakeZRotation(yaw), [x, y, 0.0])
        poses: FramePoseVector = self._pose_port.Eval(context)
        placed = output.get_mutable_value()
        placed.clear()
        for frame in poses.ids():
            placed.set_value(frame, plane @ poses.value(frame))
