"""Hosts a navigation stack that runs outside: it gets the sensors' readings, drives the base.

In a trial it stands in place of the navigator, the controller server and the costmaps. What the
stack remembers is not in the Context, so such a trial is no function of its inputs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple, Protocol, Self, runtime_checkable

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from drake_navbench.errors import NavbenchError, as_line
from drake_navbench.inputs.robot import Robot
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.poses import carrier_pose
from drake_navbench.kernels.read_only import read_only
from drake_navbench.kernels.scan import Scan
from drake_navbench.logs.plans import Plan
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.navigation.costmaps.point_cloud import PointCloud
from drake_navbench.navigation.task import GlobalPlan, Leg, TaskState, TaskStatus
from drake_navbench.trial.systems.controller_server_state import ServerState
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import (
    COMMAND_SIZE,
    POSE_SIZE,
    STATE_SIZE,
    declare_object_input,
    declare_state_part_output,
    read_object,
    value_or_none,
)

STANDSTILL = read_only(np.zeros(COMMAND_SIZE))
NOT_BEGUN = TaskStatus()
NO_FRAME = read_only(np.zeros(POSE_SIZE))


class StackTask(NamedTuple):
    """The facts of a trial that a running stack is told before it begins.

    goals: one after another, x m, y m, yaw rad. start_pose: (3,) x m, y m, yaw rad. Both are in the
    map frame. known_map: the map that the robot has of its world.
    """

    robot: Robot
    goals: tuple[tuple[float, float, float], ...]
    start_pose: Array
    known_map: OccupancyMap


class RobotReadings(NamedTuple):
    """The readings of the robot's own parts at one time.

    odometry: (6,) x m, y m, yaw rad in the odometry frame, v m/s, w rad/s, vy m/s.
    map_from_odometry: (3,) pose of the odometry frame in the map frame, as the robot's own
    localization has it. scan: the newest, None before the first. clouds: the newest of each depth
    sensor by its name, in the world frame. state: (6,) the true state in the world frame.
    """

    time_s: float
    odometry: Array
    map_from_odometry: Array
    scan: Scan | None
    clouds: Mapping[str, PointCloud]
    state: Array


class StackAnswer(NamedTuple):
    """The state of a running stack after a step.

    command: (3,) v m/s, w rad/s, vy m/s. status: status of the whole task. plan: the newest, None
    before there is one. plans: all of them. legs: the drives that have ended.
    """

    command: Array = STANDSTILL
    status: TaskStatus = NOT_BEGUN
    plan: GlobalPlan | None = None
    plans: tuple[Plan, ...] = ()
    legs: tuple[Leg, ...] = ()

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Returns itself: an answer never changes, so Drake's copies cost nothing."""
        return self


@runtime_checkable
class RunningStack(Protocol):
    """A plugin that is a whole navigation stack, not a controller within our stack.

    step_s: simulated time between two calls of `advance`, s.
    """

    step_s: float

    def begin(self, task: StackTask, sensed: RobotReadings) -> StackAnswer:
        """Waits until the stack has taken the first goal; the robot stands still meanwhile.

        Raises NavbenchError where it does not.
        """
        ...

    def advance(self, sensed: RobotReadings) -> StackAnswer:
        """Tells the stack the readings, waits for it as agreed, and returns its state."""
        ...

    def facts(self) -> dict[str, Any]:
        """Returns facts about the stack for the trial's log, as JSON values."""
        ...


class RunningStackSystem(LeafSystem):
    """Calls a running stack once a step, the first time one step after the start.

    Inputs `state` and `estimate` [x m, y m, yaw rad, v m/s, w rad/s, vy m/s], `scan` (Scan or None)
    and `clouds` (by name; need not be connected). Where the odometry has a frame of its own,
    `odometry_estimate`, in that frame, and `map_from_odometry` (3,), its pose in the map frame;
    where these are not connected, the odometry frame is the world, and the localization's error
    lies between it and the map. Outputs `command` [v m/s, w rad/s, vy m/s],
    `server_state` (ServerState without cycles), `plan` (GlobalPlan or None), `task_status`
    (TaskStatus) and `answer` (StackAnswer).
    """

    def __init__(self, stack: RunningStack, task: StackTask) -> None:
        super().__init__()
        self._stack = stack
        self._task = task
        self._state_port = self.DeclareVectorInputPort("state", STATE_SIZE)
        self._estimate_port = self.DeclareVectorInputPort("estimate", STATE_SIZE)
        self._odometry_port = self.DeclareVectorInputPort("odometry_estimate", STATE_SIZE)
        self._frame_port = self.DeclareVectorInputPort("map_from_odometry", POSE_SIZE)
        self._scan_port = declare_object_input(self, "scan")
        self._clouds_port = declare_object_input(self, "clouds")
        self._answer = self.DeclareAbstractState(AbstractValue.Make(StackAnswer()))
        self.DeclareVectorOutputPort(
            "command",
            COMMAND_SIZE,
            weakly_bound(self._calc_command),
            prerequisites_of_calc={self.abstract_state_ticket(self._answer)},
        )
        for name, select in (
            ("server_state", _server_state),
            ("plan", lambda answer: answer.plan),
            ("task_status", lambda answer: answer.status),
            ("answer", lambda answer: answer),
        ):
            declare_state_part_output(self, name, self._answer, select)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            stack.step_s, stack.step_s, weakly_bound(self._on_step)
        )

    def facts(self) -> dict[str, Any]:
        """Returns facts about the stack for the trial's log."""
        return self._stack.facts()

    def _calc_command(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_abstract_state(self._answer).get_value().command)

    def _on_step(self, context: Context, state: State) -> None:
        before: StackAnswer = context.get_abstract_state(self._answer).get_value()
        if before.status.state.is_final:
            return
        sensed = self._sensed(context)
        try:
            if before.status.state is TaskState.IDLE:
                after = self._stack.begin(self._task, sensed)
            else:
                after = self._stack.advance(sensed)
        except NavbenchError as error:
            status = TaskStatus(TaskState.ERROR, reason=as_line(str(error)))
            after = before._replace(command=STANDSTILL, status=status)
        if after.status.state.is_final:
            status = replace(after.status, time_s=sensed.time_s)
            after = after._replace(command=STANDSTILL, status=status)
        state.get_mutable_abstract_state(self._answer).set_value(after)

    def _sensed(self, context: Context) -> RobotReadings:
        state = self._state_port.Eval(context)
        odometry = value_or_none(self._odometry_port, context)
        if odometry is None:
            estimate = self._estimate_port.Eval(context)
            odometry = np.append(state[:3], estimate[3:])
            is_exact = np.array_equal(estimate[:3], state[:3])
            frame = NO_FRAME if is_exact else carrier_pose(estimate[:3], state[:3])
        else:
            frame = self._frame_port.Eval(context)
        return RobotReadings(
            context.get_time(),
            odometry,
            frame,
            read_object(self._scan_port, context),
            value_or_none(self._clouds_port, context) or {},
            state,
        )


def _server_state(answer: StackAnswer) -> ServerState:
    """Returns the state of a server without cycles, for the recorder and the viewer."""
    return ServerState(status=answer.status, command=answer.command)
