"""The state of the controller server, and how a task ends or waits in it."""

from __future__ import annotations

import traceback
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import (
    Controller,
    ControllerError,
    NoValidControl,
)
from drake_navbench.errors import as_line, one_line
from drake_navbench.inputs.navigation_settings import PATIENT_FOR_EVER
from drake_navbench.inputs.timeline import SLACK_S
from drake_navbench.kernels.read_only import read_only
from drake_navbench.navigation.task import TaskState, TaskStatus
from drake_navbench.trial.systems.ports import COMMAND_SIZE

PATIENCE_EXCEEDED = 104
CONTROLLER_TIMED_OUT = 107
NANOSECOND_DIGITS = 9
STANDSTILL = read_only(np.zeros(COMMAND_SIZE))


class ServerState(NamedTuple):
    """The state of the controller server.

    command: (3,) last command published, v m/s, w rad/s, vy m/s. cycle_count: cycles computed so
    far. compute_time_ms, compute_cpu_time_ms: wall-clock time of the last call of the controller,
    and the time for which its thread had a processor. diagnostics: diagnostics of the controller in
    that cycle. waiting_since_s: when the wait for a current costmap began, s; None without a wait.
    controller: a listener's replacement of the server's own, None until there is one. Where cycles
    take time: next_cycle_s: earliest start of the next cycle; command_due_s: when the command is
    published; earlier_command: the command in force until then.
    """

    status: TaskStatus = TaskStatus()
    plan_id: int = 0
    path: Any = None
    goal_check: Any = None
    progress_check: Any = None
    memory: Any = None
    last_valid_time_s: float = 0.0
    command: NDArray[np.float64] = STANDSTILL
    cycle_count: int = 0
    compute_time_ms: float = 0.0
    compute_cpu_time_ms: float = 0.0
    diagnostics: Mapping[str, Any] = MappingProxyType({})
    waiting_since_s: float | None = None
    controller: Controller | None = None
    next_cycle_s: float = 0.0
    command_due_s: float = 0.0
    earlier_command: NDArray[np.float64] = STANDSTILL

    def command_at(self, time_s: float) -> NDArray[np.float64]:
        """Returns the command in force: the last one, unless its cycle is not over yet."""
        return self.command if time_s >= self.command_due_s - SLACK_S else self.earlier_command

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Returns itself: a state never changes, so Drake's copies cost nothing."""
        return self

    def ended(
        self,
        state: TaskState,
        code: int,
        reason: str,
        details: Mapping[str, Any] | None = None,
    ) -> ServerState:
        """Returns the state at the end of the task, with the base at rest."""
        status = replace(
            self.status,
            state=state,
            error_code=code,
            reason=as_line(reason),
            details=dict(details or {}),
        )
        return self._replace(status=status, command=STANDSTILL)

    def broken(self, task_id: int, error: BaseException) -> ServerState:
        """Returns the end of the task of a plugin that broke."""
        ended = self.ended(TaskState.ERROR, ControllerError.code, one_line(error))
        text = "".join(traceback.format_exception(error))
        return ended._replace(status=replace(ended.status, task_id=task_id, traceback=text))

    def waiting_for_costmap(self, now_s: float, timeout_s: float) -> ServerState:
        """Keeps the last command while the costmap is not current, up to a limit; 0: not at all."""
        since_s = now_s if self.waiting_since_s is None else self.waiting_since_s
        if timeout_s <= 0.0 or round(now_s - since_s, NANOSECOND_DIGITS) > timeout_s:
            reason = f"no current costmap for {now_s - since_s:.2f} s"
            return self.ended(TaskState.ABORTED, CONTROLLER_TIMED_OUT, reason)
        return self._replace(waiting_since_s=since_s)

    def without_control(
        self, error: NoValidControl, now_s: float, tolerance_s: float
    ) -> ServerState:
        """Stops for a cycle without control, or gives up where the patience has run out.

        tolerance_s: the patience; 0: none, PATIENT_FOR_EVER: without an end.
        """
        if tolerance_s <= 0.0 and tolerance_s != PATIENT_FOR_EVER:
            return self.ended(TaskState.ABORTED, error.code, str(error), error.details)
        # ROS keeps time in whole nanoseconds; without rounding 0.32 - 0.02 may exceed 0.3.
        waited_s = round(now_s - self.last_valid_time_s, NANOSECOND_DIGITS)
        if tolerance_s != PATIENT_FOR_EVER and waited_s > tolerance_s:
            reason = f"no valid control for {waited_s:.2f} s: {error}"
            return self.ended(TaskState.ABORTED, PATIENCE_EXCEEDED, reason, error.details)
        return self._replace(command=STANDSTILL)
