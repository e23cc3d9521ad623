"""The messages between systems of the navigation stack: tasks, their status and requests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.immutable import Immutable


class TaskState(Enum):
    """The stages of a task: of the whole trial's, the controller server's or a behaviour's."""

    IDLE = auto()
    RUNNING = auto()
    SUCCEEDED = auto()
    ABORTED = auto()
    CANCELED = auto()
    ERROR = auto()

    @property
    def is_final(self) -> bool:
        """Whether the task has ended."""
        return self not in _UNFINISHED


# A tuple of the module: looking up two members of an Enum at each call takes longer.
_UNFINISHED = (TaskState.IDLE, TaskState.RUNNING)


@dataclass(frozen=True)
class TaskStatus(Immutable):
    """The status of a task.

    error_code: Nav2's code, 0 where there is none. reason: one line for people.
    details: numbers behind the reason. traceback: traceback of a controller that broke.
    time_s: when the task ended. task_id: the task's number, given by the system that asked for it.
    """

    state: TaskState = TaskState.IDLE
    error_code: int = 0
    reason: str = ""
    details: dict[str, Any] | None = None
    traceback: str = ""
    time_s: float = 0.0
    task_id: int = 0


@dataclass(frozen=True, eq=False)
class GlobalPlan(Immutable):
    """A plan as handed to the controller server: Nav2's FollowPath goal.

    plan_id: grows with every new plan. poses: (N, 3) x m, y m, yaw rad.
    task_id: a plan with the same task_id as the one before preempts it, a new one starts afresh.
    cancel_requested: the task is to end.
    """

    plan_id: int
    poses: NDArray[np.float64]
    task_id: int = 1
    cancel_requested: bool = False


@dataclass(frozen=True)
class BehaviorGoal(Immutable):
    """A request for a behaviour: Nav2's Spin, BackUp, DriveOnHeading and Wait goals.

    behavior: its name in `behaviors.BEHAVIORS`. arguments: arguments of that behaviour.
    """

    task_id: int
    behavior: str
    arguments: Mapping[str, float] = field(default_factory=dict)
    cancel_requested: bool = False


@dataclass(frozen=True)
class ClearRequest(Immutable):
    """A request that a costmap forget its marks; time_s: of the request."""

    time_s: float


class PoseState(Enum):
    """The states of a pose of NavigateThroughPoses: Nav2's waypoint statuses."""

    PENDING = auto()
    PASSED = auto()
    SKIPPED = auto()


@dataclass(frozen=True)
class TaskPose(Immutable):
    """A pose of NavigateThroughPoses, x m, y m, yaw rad, and its state."""

    pose: tuple[float, float, float]
    state: PoseState = PoseState.PENDING


@dataclass(frozen=True)
class Leg(Immutable):
    """The course of the drive to one goal.

    goal: x m, y m, yaw rad. status: its result. start_time_s, end_time_s: its span.
    recovery_count: number of recovery actions started, as Nav2's feedback counts them.
    """

    goal: tuple[float, float, float]
    status: TaskStatus
    start_time_s: float
    end_time_s: float
    recovery_count: int = 0

    def as_plain(self) -> dict[str, Any]:
        """Returns the leg as JSON values, for the log."""
        return {
            "goal": list(self.goal),
            "outcome": self.status.state.name.lower(),
            "error_code": self.status.error_code,
            "reason": self.status.reason,
            "start_time_s": self.start_time_s,
            "end_time_s": self.end_time_s,
            "recovery_count": self.recovery_count,
        }
