"""Messages arrive late, in the order of their sending, or never."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from drake_navbench.inputs.timeline import Timeline
from drake_navbench.inputs.timing import TimingSettings
from drake_navbench.trial.systems.delays import CommandLink, LateOdometry
from drake_navbench.trial.systems.mailbox import Mailbox


def seen(system, size, times_s, *, seed=0):
    """Returns what leaves a system at some times where every input is the time itself."""
    builder = DiagramBuilder()
    ends = np.array([np.zeros(size), np.full(size, 100.0)]).T
    clock = builder.AddSystem(TrajectorySource(PiecewisePolynomial.FirstOrderHold([0, 100], ends)))
    builder.AddSystem(system)
    builder.Connect(clock.get_output_port(), system.get_input_port())
    simulator = Simulator(builder.Build())
    context = system.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    context.get_mutable_abstract_parameter(system.seed_parameter).set_value(seed)
    values = []
    for time_s in times_s:
        simulator.AdvanceTo(time_s)
        values.append(system.get_output_port().Eval(context)[0])
    return values


def link(**timing):
    return CommandLink(Timeline.constant(TimingSettings(**timing)), period_s=0.05, offset_s=0.0)


def odometry(**timing):
    return LateOdometry(Timeline.constant(TimingSettings(**timing)), offset_s=0.0)


def test_a_command_arrives_after_its_latency():
    # Sent at 0, 0.05, 0.10 ...: at 0.33 the newest that is 0.2 s old is that of 0.10.
    values = seen(link(command_latency_s=0.2), 3, [0.19, 0.33, 0.36])
    assert values == pytest.approx([0.0, 0.10, 0.15])


def test_pose_and_velocity_arrive_after_their_latency():
    # Sent every 0.025 s; before the first arrives, the robot knows where it stands.
    values = seen(odometry(odometry_latency_s=0.1), 6, [0.09, 0.1301, 0.5101])
    assert values == pytest.approx([0.0, 0.025, 0.4])


def test_jitter_never_brings_an_older_message_back():
    times_s = np.arange(0.01, 3.0, 0.01)
    for system, size in (
        (link(command_latency_s=0.1, command_jitter_s=0.3), 3),
        (odometry(odometry_latency_s=0.1, odometry_jitter_s=0.3), 6),
    ):
        values = np.array(seen(system, size, times_s))
        assert np.all(np.diff(values) >= 0.0)
        late = times_s[60:] - values[60:]
        assert late.min() >= 0.1 - 1e-9
        assert late.max() <= 0.4 + 0.06
        assert late.std() > 0.01


def test_lost_commands_never_arrive_and_the_wheels_stop_after_their_timeout():
    assert seen(link(command_loss_probability=1.0), 3, [1.0]) == [0.0]
    lossy = link(command_loss_probability=0.7, command_timeout_s=0.1)
    values = np.array(seen(lossy, 3, np.arange(0.01, 20.0, 0.01)))
    stopped = (values[100:] == 0.0).mean()
    # Standstill from the third loss in a row on, but for arrivals: 0.7 ** 2 of the time.
    assert stopped == pytest.approx(0.49, abs=0.1)


def test_the_seed_alone_decides_which_are_lost():
    runs = [
        seen(link(command_loss_probability=0.5), 3, np.arange(0.1, 3.0, 0.1), seed=seed)
        for seed in (1, 1, 2)
    ]
    assert runs[0] == runs[1] != runs[2]


def test_a_mailbox_forgets_what_nobody_will_see():
    mailbox = Mailbox()
    for step in range(50):
        mailbox = mailbox.with_message(step, 0.1 * step + 0.25, 0.1 * step)
    assert mailbox.newest(4.9) == (pytest.approx(4.85), 46)
    assert len(mailbox.messages) == 4
