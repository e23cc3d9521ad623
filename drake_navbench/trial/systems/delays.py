"""Messages that arrive late, or never, between two parts of a robot."""

from __future__ import annotations

import math

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem, State

from drake_navbench.inputs.timeline import SLACK_S, Timeline
from drake_navbench.inputs.timing import TimingSettings
from drake_navbench.kernels.noise import NoiseKey, NoiseStream
from drake_navbench.navigation.mission import FloorSwitch
from drake_navbench.trial.systems.floor_aware import FloorAware, FloorClock
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.mailbox import Mailbox
from drake_navbench.trial.systems.ports import COMMAND_SIZE, STATE_SIZE

# The period of the odometry's messages: every control cycle of 20 Hz falls on one.
ODOMETRY_MESSAGE_PERIOD_S = 0.025


class LateOdometry(FloorAware):
    """Outputs the newest odometry message that has arrived; before any has, the first one sent.

    Input `estimate` and output `late_estimate` [x m, y m, yaw rad, v m/s, w rad/s, vy m/s]. A
    message is sent every 0.025 s from `offset_s` on; its latency follows from the seed and the
    message's number, so two such systems delay alike. Parameter `seed_parameter` holds the trial's
    seed.

    floor_clock: for several floors; messages of one floor are forgotten on the next.
    """

    def __init__(
        self,
        timing: Timeline[TimingSettings],
        *,
        offset_s: float,
        floor_clock: FloorClock | None = None,
    ) -> None:
        super().__init__()
        if floor_clock is not None:
            self._declare_floors(floor_clock)
        self._timing = timing
        self._offset_s = offset_s
        self.seed_parameter = self.DeclareAbstractParameter(AbstractValue.Make(0))
        self._estimate_port = self.DeclareVectorInputPort("estimate", STATE_SIZE)
        self._mailbox = self.DeclareAbstractState(AbstractValue.Make(Mailbox()))
        self.DeclareVectorOutputPort(
            "late_estimate",
            STATE_SIZE,
            weakly_bound(self._calc_arrived),
            prerequisites_of_calc={
                self.time_ticket(),
                self.abstract_state_ticket(self._mailbox),
                self.input_port_ticket(self._estimate_port.get_index()),
            },
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            ODOMETRY_MESSAGE_PERIOD_S, offset_s, weakly_bound(self._on_message)
        )

    def _on_message(self, context: Context, state: State) -> None:
        now_s = context.get_time()
        timing = self._timing.at(now_s)
        late_s = timing.odometry_latency_s
        if timing.odometry_jitter_s > 0.0:
            seed = context.get_abstract_parameter(self.seed_parameter).get_value()
            step = round((now_s - self._offset_s) / ODOMETRY_MESSAGE_PERIOD_S)
            drawn = NoiseKey(seed, NoiseStream.ODOMETRY_DELAY, step).generator().random()
            late_s += timing.odometry_jitter_s * drawn
        before: Mailbox = context.get_abstract_state(self._mailbox).get_value()
        after = before.with_message(self._estimate_port.Eval(context), now_s + late_s, now_s)
        state.get_mutable_abstract_state(self._mailbox).set_value(after)

    def _on_floor(self, context: Context, state: State, switch: FloorSwitch) -> None:
        state.get_mutable_abstract_state(self._mailbox).set_value(Mailbox())

    def _calc_arrived(self, context: Context, output: BasicVector) -> None:
        mailbox: Mailbox = context.get_abstract_state(self._mailbox).get_value()
        arrived = mailbox.newest(context.get_time())
        if arrived is None:
            # The robot stands until the first command, so its start is the first pose sent.
            arrived = mailbox.messages[0] if mailbox.messages else None
        values = self._estimate_port.Eval(context) if arrived is None else arrived[1]
        output.SetFromVector(values)


class CommandLink(LeafSystem):
    """The link that carries commands to the wheels: late, with losses, with a timeout at its end.

    Input `command` and output `arrived` [v m/s, w rad/s, vy m/s]: of the commands that have
    arrived, the one sent last; 0 before any has arrived. A command is sent every `period_s` from
    `offset_s` on, after the stage that makes it has run. Parameter `seed_parameter` holds the
    trial's seed. An arrival within a step of the integrator acts from about the middle of that step
    on.
    """

    def __init__(
        self, timing: Timeline[TimingSettings], *, period_s: float, offset_s: float
    ) -> None:
        super().__init__()
        self._timing = timing
        self._period_s = period_s
        self._offset_s = offset_s
        self.seed_parameter = self.DeclareAbstractParameter(AbstractValue.Make(0))
        self._command_port = self.DeclareVectorInputPort("command", COMMAND_SIZE)
        longest_s = max(
            settings.command_latency_s + settings.command_jitter_s for settings in timing.settings
        )
        # Rows (due s, command): commands on their way and the last one that arrived, newest first.
        # The state is discrete: unlike an abstract state, it may take the command of this very
        # instant.
        none = np.zeros((math.ceil(longest_s / period_s) + 2, 1 + COMMAND_SIZE))
        none[:, 0] = -math.inf
        self._messages = self.DeclareDiscreteState(none.ravel())
        self.DeclareVectorOutputPort(
            "arrived",
            COMMAND_SIZE,
            weakly_bound(self._calc_arrived),
            prerequisites_of_calc={
                self.time_ticket(),
                self.discrete_state_ticket(self._messages),
            },
        )
        self.DeclarePeriodicDiscreteUpdateEvent(period_s, offset_s, weakly_bound(self._on_command))

    def _on_command(self, context: Context, discrete_state: DiscreteValues) -> None:
        now_s = context.get_time()
        timing = self._timing.at(now_s)
        lost = drawn = 0.0
        if timing.command_loss_probability > 0.0 or timing.command_jitter_s > 0.0:
            seed = context.get_abstract_parameter(self.seed_parameter).get_value()
            step = round((now_s - self._offset_s) / self._period_s)
            lost, drawn = NoiseKey(seed, NoiseStream.COMMAND_DELAY, step).generator().random(2)
        if lost < timing.command_loss_probability:
            return
        due_s = now_s + timing.command_latency_s + timing.command_jitter_s * drawn
        sent = np.array([due_s, *self._command_port.Eval(context)])
        earlier = context.get_discrete_state(self._messages).value()[: -sent.size]
        messages = np.concatenate([sent, earlier])
        discrete_state.get_mutable_vector(self._messages).SetFromVector(messages)

    def _calc_arrived(self, context: Context, output: BasicVector) -> None:
        # The integrator asks several times a step; finding the message takes most of this system's
        # time.
        now_s = context.get_time()
        messages = context.get_discrete_state(self._messages).value().tolist()
        place = 0
        while messages[place] > now_s + SLACK_S:
            place += 1 + COMMAND_SIZE
        due_s, *command = messages[place : place + 1 + COMMAND_SIZE]
        timeout_s = self._timing.at(now_s).command_timeout_s
        if timeout_s is not None and now_s - due_s > timeout_s:
            command = [0.0] * COMMAND_SIZE
        output.SetFromVector(command)
