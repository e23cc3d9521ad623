"""Hosts a controller that runs in a process of its own."""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import ControllerSetup, Decision, Observation
from drake_navbench.controllers.external.client_process import (
    ClientProcess,
    ExternalControllerFailed,
)
from drake_navbench.controllers.external.messages import (
    PROTOCOL_VERSION,
    command_of,
    compute_message,
    configure_message,
    diagnostics_of,
    failure_of,
    not_read_of,
    set_plan_message,
)
from drake_navbench.controllers.external.parameters import ExternalParameters
from drake_navbench.errors import InputError


class ExternalMemory(NamedTuple):
    """The memory of an external controller: the client's own, any value that its protocol can hold.

    is_at_rest: whether a cancelled client with graceful cancelling said in its last answer that it
    is at rest.
    """

    client: Any = None
    is_at_rest: bool = False


class ExternalController:
    """One client from `configure` to `shutdown`, asked once a cycle.

    The constructor starts the client and `close` ends it, so that every trial has a fresh one. The
    client may return its memory as `memory`; then a decision is a function of the message alone.
    not_read: names of the given parameters that the client does not know. Raises InputError where
    there is no such program or the client refuses to be configured.
    """

    Parameters: ClassVar[type[ExternalParameters]] = ExternalParameters
    nav2_plugin: ClassVar[str | None] = None

    def __init__(self, parameters: ExternalParameters, setup: ControllerSetup) -> None:
        self._deadline_s = parameters.deadline_s
        self._wants_arrays = setup.wants_diagnostics
        self._known_plan: tuple[int, NDArray[np.float64]] | None = None
        self._client = ClientProcess(parameters.words, shows_output=parameters.shows_output)
        message = configure_message(setup, parameters.client)
        try:
            answer = self._client.ask(message, deadline_s=parameters.start_deadline_s)
            self._require_understood(answer)
        except ExternalControllerFailed as error:
            raise InputError(str(error).splitlines()[0]) from error
        self._is_graceful = answer.get("is_graceful") is True
        self._cuts_plan = answer.get("cuts_plan") is True
        self.not_read = not_read_of(answer)

    @property
    def cuts_plan(self) -> bool:
        """Whether the client cuts the plan itself, as originals of Nav2 do up to Kilted."""
        return self._cuts_plan

    def initial_memory(self) -> ExternalMemory:
        """Tells the client to forget the last task.

        Returns the client's memory at the start of the next one.
        """
        self._known_plan = None
        answer = self._ask({"call": "reset"})
        return ExternalMemory(answer.get("memory"))

    def step(self, observation: Observation, memory: ExternalMemory) -> Decision:
        """Returns the client's decision; raises the ControllerError that it answers with.

        Raises ExternalControllerFailed where it dies, hangs or answers something else.
        """
        self._tell_plan(observation)
        answer = self._ask(compute_message(observation, memory.client))
        after = ExternalMemory(answer.get("memory"), answer.get("is_at_rest") is True)
        try:
            failure = failure_of(answer, after)
            if failure is None:
                command = command_of(answer)
                notes = diagnostics_of(answer, wants_arrays=self._wants_arrays)
        except ValueError as error:
            self._client.fail(f"its answer to compute is wrong: {error}")
        if failure is not None:
            raise failure
        return Decision(command, after, notes)

    def is_at_rest(self, memory: ExternalMemory) -> bool:
        """Tells whether a cancelled client has come to rest; True without graceful cancelling."""
        return not self._is_graceful or memory.is_at_rest

    def close(self) -> None:
        """Asks the client to shut down, and kills it if it does not."""
        self._client.stop()

    def _tell_plan(self, observation: Observation) -> None:
        """Sends the global plan to the client, unless the client has it."""
        known = self._known_plan
        plan_id, plan = observation.plan_id, observation.global_plan
        if known is None or known[0] != plan_id or known[1] is not plan:
            self._ask(set_plan_message(observation))
            self._known_plan = (plan_id, plan)

    def _ask(self, message: dict[str, Any]) -> dict[str, Any]:
        answer = self._client.ask(message, deadline_s=self._deadline_s)
        if "error" in answer:
            self._client.fail(f"answered {message['call']} with the error {answer['error']!r}")
        return answer

    def _require_understood(self, answer: dict[str, Any]) -> None:
        """Raises ExternalControllerFailed unless the client speaks our version of the protocol."""
        if "error" in answer:
            self._client.fail(f"refused to be configured: {answer['error']}")
        if answer.get("protocol") != PROTOCOL_VERSION:
            self._client.fail(
                f"speaks protocol {answer.get('protocol')!r}, expected {PROTOCOL_VERSION}"
            )
