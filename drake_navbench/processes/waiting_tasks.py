"""The tasks that no worker has begun, and which of them comes next."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

from drake_navbench.processes.tasks import Task


class WaitingTasks:
    """The tasks that no worker has begun.

    The time to find the next task does not depend on how many wait: it is always the first one of
    some owner and kind.
    """

    def __init__(self, tasks: Sequence[Task]) -> None:
        self._awaited = {before for task in tasks for before in task.after} & set(tasks)
        self._places = {task: place for place, task in enumerate(tasks)}
        self._queues: dict[tuple[str, str], deque[Task]] = {}
        self._times_s: dict[str, float] = {}
        for task in tasks:
            self._queue_of(task).append(task)

    def __bool__(self) -> bool:
        return any(self._queues.values())

    def take(self, owner: str | None = None) -> Task | None:
        """Removes and returns the task to begin first; None where none may begin.

        A task of a kind that was never timed comes first, as it may be the longest. owner: only
        tasks of this owner; None: of any.
        """
        queues = [
            queue
            for (own, _), queue in self._queues.items()
            if queue and owner in (None, own) and self._awaited.isdisjoint(queue[0].after)
        ]
        first = min(queues, key=lambda queue: self._urgency(queue[0]), default=None)
        return None if first is None else first.popleft()

    def has_some_of(self, owner: str) -> bool:
        """Returns whether tasks of an owner wait, even if they may not begin yet."""
        return any(queue for (own, _), queue in self._queues.items() if own == owner)

    def end(self, task: Task) -> None:
        """Notes that a task has ended, so that tasks waiting for it may begin."""
        self._awaited.discard(task)

    def put_back(self, task: Task) -> None:
        """Puts a task back that was not begun after all."""
        self._queue_of(task).appendleft(task)

    def learn(self, task: Task, time_s: float) -> None:
        """Records the duration of a task, as an estimate for tasks of its kind."""
        self._times_s[task.kind] = time_s

    def _queue_of(self, task: Task) -> deque[Task]:
        return self._queues.setdefault((task.owner, task.kind), deque())

    def _urgency(self, task: Task) -> tuple[bool, float, int]:
        time_s = self._times_s.get(task.kind, math.inf)
        return not task.is_urgent, -time_s, self._places[task]
