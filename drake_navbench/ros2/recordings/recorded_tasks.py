"""Cuts a recording into tasks: by the states of the navigation's goals, or by hand."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from drake_navbench.errors import InputError
from drake_navbench.kernels.arrays import Array
from drake_navbench.logs.outcome import Outcome
from drake_navbench.ros2.recordings.recorded_columns import Column

# The states of a goal in action_msgs/GoalStatus.
ACCEPTED, EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = 1, 2, 3, 4, 5, 6
ENDINGS = {
    SUCCEEDED: (Outcome.SUCCEEDED, "goal reached, as the navigation said"),
    CANCELED: (Outcome.ABORTED, "the goal was cancelled"),
    ABORTED: (Outcome.ABORTED, "the navigation gave up"),
}
# A goal that ended sooner than this was replaced before the robot drove to it, s.
SHORTEST_TASK_S = 0.1


class RecordedTask(NamedTuple):
    """A piece of a recording. Times are in seconds on the clock of the recording.

    begin_s: the beginning of the log. start_s: the time at which the robot began to work on it.
    outcome: None where the recording does not tell it; then the distance to the goal decides.
    """

    begin_s: float
    start_s: float
    end_s: float
    outcome: Outcome | None
    reason: str


def tasks_by_status(path: Path, column: Column, time_s: Array, end_s: float) -> list[RecordedTask]:
    """Returns a task for every goal that was worked on, in order.

    column: the states. time_s: the time of each. end_s: the end of the recording. Goals that had
    ended before the recording began are left out. Raises InputError where there is none.
    """
    begun: dict[str, tuple[float, float | None]] = {}
    tasks: list[RecordedTask] = []
    ended: set[str] = set()
    for now, (goal, status) in zip(time_s.tolist(), column.values, strict=True):
        if goal in ended:
            continue
        if status in ENDINGS:
            ended.add(goal)
            begin_s, start_s = begun.pop(goal, (now, None))
            if now - begin_s >= SHORTEST_TASK_S:
                start_s = begin_s if start_s is None else start_s
                tasks.append(RecordedTask(begin_s, start_s, now, *ENDINGS[status]))
        else:
            begin_s, start_s = begun.get(goal, (now, None))
            if status == EXECUTING and start_s is None:
                start_s = now
            begun[goal] = (begin_s, start_s)
    for begin_s, start_s in begun.values():
        if end_s - begin_s >= SHORTEST_TASK_S:
            reason = "the recording ended before the task"
            start_s = begin_s if start_s is None else start_s
            tasks.append(RecordedTask(begin_s, start_s, end_s, Outcome.TIMED_OUT, reason))
    if not tasks:
        raise InputError(
            f"{path}: its goals have no state of being driven to; cut a task by hand with "
            "--start and --end"
        )
    return sorted(tasks)


def task_by_hand(path: Path, begin_s: float, end_s: float) -> RecordedTask:
    """Returns the task between two times; raises InputError where too little lies between them."""
    if end_s - begin_s < SHORTEST_TASK_S:
        raise InputError(
            f"{path}: --start and --end leave {max(end_s - begin_s, 0.0):.3f} s, expected at least "
            f"{SHORTEST_TASK_S:g} s"
        )
    return RecordedTask(begin_s, begin_s, end_s, None, "")
