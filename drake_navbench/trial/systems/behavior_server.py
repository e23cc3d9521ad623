"""Runs the behaviours of the recoveries, and puts their commands before the controller's."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from drake_navbench.kernels.immutable import Immutable
from drake_navbench.navigation.behavior import BehaviorServerParameters, Step, Surroundings
from drake_navbench.navigation.behaviors import make_behaviors
from drake_navbench.navigation.task import BehaviorGoal, TaskState, TaskStatus
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import (
    COMMAND_SIZE,
    STATE_SIZE,
    declare_object_input,
    declare_state_part_output,
    read_object,
)


@dataclass(frozen=True, eq=False)
class _Activity(Immutable):
    """The state of the present task.

    behavior_state: state of the behaviour. command: (3,) v m/s, w rad/s, vy m/s, None where the
    behaviour publishes nothing.
    """

    status: TaskStatus = field(default_factory=TaskStatus)
    behavior_state: Any = None
    command: NDArray[np.float64] | None = None


class BehaviorServer(LeafSystem):
    """Nav2's behaviour server, as one unrestricted update a cycle.

    Inputs `odometry_estimate` [x m, y m, yaw rad, v m/s, w rad/s, vy m/s] and `costmap` (Costmap or
    None), both in the odometry frame, `goal` (BehaviorGoal or None) and `controller_command` [v
    m/s, w rad/s, vy m/s]. Outputs `command` (of the running behaviour where it moves the robot,
    otherwise of the controller) and `status` (TaskStatus).

    Cycles run at cycle_frequency from `offset_s` on. A new task starts with the next cycle, so less
    than a cycle later than in Nav2, which starts a loop for it at once. Both servers of Nav2 write
    to one topic; a behaviour runs only while no controller does.

    footprint: (K, 2) padded outline in the base frame, m.
    """

    def __init__(
        self,
        parameters: BehaviorServerParameters,
        *,
        footprint: NDArray[np.float64],
        offset_s: float,
    ) -> None:
        super().__init__()
        self._footprint = np.ascontiguousarray(footprint)
        self._behaviors = make_behaviors(parameters)
        self._activity = self.DeclareAbstractState(AbstractValue.Make(_Activity()))
        self._estimate_port = self.DeclareVectorInputPort("odometry_estimate", STATE_SIZE)
        self._costmap_port = declare_object_input(self, "costmap")
        self._goal_port = declare_object_input(self, "goal")
        self._command_port = self.DeclareVectorInputPort("controller_command", COMMAND_SIZE)
        state_ticket = self.abstract_state_ticket(self._activity)
        self.DeclareVectorOutputPort(
            "command",
            COMMAND_SIZE,
            weakly_bound(self._calc_command),
            prerequisites_of_calc={
                state_ticket,
                self.input_port_ticket(self._command_port.get_index()),
            },
        )
        declare_state_part_output(self, "status", self._activity, lambda activity: activity.status)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            1.0 / parameters.cycle_frequency, offset_s, weakly_bound(self._on_cycle)
        )

    def _calc_command(self, context: Context, output: BasicVector) -> None:
        own = context.get_abstract_state(self._activity).get_value().command
        output.SetFromVector(self._command_port.Eval(context) if own is None else own)

    def _on_cycle(self, context: Context, state: State) -> None:
        goal: BehaviorGoal | None = read_object(self._goal_port, context)
        activity: _Activity = context.get_abstract_state(self._activity).get_value()
        is_new = goal is not None and goal.task_id != activity.status.task_id
        if goal is None or (not is_new and activity.status.state.is_final):
            return
        new = self._cycle(
            goal,
            activity,
            pose=self._estimate_port.Eval(context)[:3],
            surroundings=Surroundings(read_object(self._costmap_port, context), self._footprint),
            now_s=context.get_time(),
        )
        state.get_mutable_abstract_state(self._activity).set_value(new)

    def _cycle(
        self,
        goal: BehaviorGoal,
        activity: _Activity,
        *,
        pose: NDArray[np.float64],
        surroundings: Surroundings,
        now_s: float,
    ) -> _Activity:
        behavior = self._behaviors[goal.behavior]
        behavior_state = activity.behavior_state
        if goal.cancel_requested:
            return _ended(goal, TaskState.CANCELED, now_s)
        if goal.task_id != activity.status.task_id:
            try:
                behavior_state = behavior.start(goal.arguments, pose, now_s)
            except ValueError as error:
                code = behavior.invalid_input_code
                return _ended(goal, TaskState.ABORTED, now_s, code=code, reason=str(error))
        step = behavior.step(behavior_state, pose, now_s, surroundings)
        _require_step(goal.behavior, step)
        if step.is_final:
            ended = TaskState.SUCCEEDED if step.is_done else TaskState.ABORTED
            return _ended(goal, ended, now_s, code=step.error_code, reason=step.reason)
        running = TaskStatus(TaskState.RUNNING, task_id=goal.task_id)
        command = None if step.command is None else np.array([*step.command, 0.0])
        return _Activity(running, step.state, command)


def _require_step(behavior: str, step: Any) -> None:
    """Raises ValueError where a behaviour, which may be a plugin's, returned no valid Step."""
    if not isinstance(step, Step):
        raise ValueError(f"behavior {behavior}: got {step!r}, expected a Step")
    if step.command is not None and (
        np.shape(step.command) != (2,) or not np.all(np.isfinite(step.command))
    ):
        raise ValueError(
            f"behavior {behavior}: got the command {step.command!r}, expected two finite "
            "numbers, v m/s and w rad/s"
        )


def _ended(
    goal: BehaviorGoal, state: TaskState, now_s: float, *, code: int = 0, reason: str = ""
) -> _Activity:
    """Returns the end of a task; then the command is the controller's, which is a stop."""
    return _Activity(TaskStatus(state, code, reason, time_s=now_s, task_id=goal.task_id))
