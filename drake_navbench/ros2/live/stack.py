"""The column `live`: a ROS 2 stack that runs beside the benchmark and is reached over DDS.

Its libraries are imported when a trial begins, so that columns can be listed without them.
"""

from __future__ import annotations

import signal
import threading
from types import FrameType
from typing import TYPE_CHECKING, Any, ClassVar

from drake_navbench.controller import ControllerSetup, Decision, Observation
from drake_navbench.errors import InputError
from drake_navbench.ros2.live.live_extra import require_live_libraries
from drake_navbench.ros2.live.parameters import LiveParameters

if TYPE_CHECKING:
    from drake_navbench.ros2.live.session import LiveSession
    from drake_navbench.trial.systems.running_stack import RobotReadings, StackAnswer, StackTask


class LiveStack:
    """A running stack as a column; one is built for each trial.

    It has no control cycles here, so that metrics of a controller's cycles are undefined. Raises
    InputError where the libraries are not installed.
    """

    Parameters: ClassVar[type[LiveParameters]] = LiveParameters
    nav2_plugin: ClassVar[str | None] = None
    is_running_stack: ClassVar[bool] = True

    def __init__(self, parameters: LiveParameters, setup: ControllerSetup) -> None:
        require_live_libraries()
        self._parameters = parameters
        self._session: LiveSession | None = None
        self._interrupted: Any = None
        self.step_s = parameters.clock_period_s

    def initial_memory(self) -> Any:
        """Returns None: the stack keeps its own memory."""
        return None

    def step(self, observation: Observation, memory: Any) -> Decision:
        """Raises InputError: a stack drives whole trials and gives no single commands."""
        raise InputError("live: a running stack drives whole trials; expected a controller here")

    def begin(self, task: StackTask, sensed: RobotReadings) -> StackAnswer:
        """Opens the domain and waits until the stack has taken the first goal."""
        from drake_navbench.ros2.live.session import LiveSession

        self._session = LiveSession(self._parameters, task)
        if not self._parameters.sends_goal and _is_main_thread():
            self._interrupted = signal.signal(signal.SIGINT, self._on_interrupt)
        return self._session.begin(sensed)

    def advance(self, sensed: RobotReadings) -> StackAnswer:
        """Advances by one step of the clock."""
        if self._session is None:
            raise InputError("live: the trial has not begun; expected begin() before advance()")
        return self._session.advance(sensed)

    def facts(self) -> dict[str, Any]:
        """Returns the facts of the conversation, for the log."""
        return {} if self._session is None else self._session.facts()

    def close(self) -> None:
        """Leaves the domain."""
        if self._interrupted is not None:
            signal.signal(signal.SIGINT, self._interrupted)
            self._interrupted = None
        if self._session is not None:
            self._session.close()

    def _on_interrupt(self, number: int, frame: FrameType | None) -> None:
        """Ends the trial, with a log, not the process; a second Ctrl-C ends the process."""
        if self._session is None or self._session.ended:
            raise KeyboardInterrupt
        self._session.ended = True


def _is_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()
