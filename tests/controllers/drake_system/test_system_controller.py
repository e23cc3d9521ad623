"""A Drake System as a controller: its ports, its time, its states and its errors."""

import numpy as np
import pytest
from controller_scenes import observe, setup_of
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import Integrator, ZeroOrderHold

from drake_navbench import run_trial
from drake_navbench.controller import ControllerParameters, NoValidControl
from drake_navbench.controllers.drake_system import SystemController
from drake_navbench.errors import InputError
from drake_navbench.kernels.grid import Costmap
from drake_navbench.logs.outcome import Outcome

PERIOD_S = 0.05
SETUP = setup_of(np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]]))
NO_PLAN, NO_COSTMAP = np.empty((0, 3)), Costmap(np.zeros((4, 4), np.uint8), 0.0, 0.0, 0.05)


def seen(cycle, *, twist=(0.0, 0.0), vy=0.0, costs=None):
    """The observation of a cycle; cycle 0 begins at 0.02 s."""
    return observe(
        [[1.0, 2.0, 0.5], [3.0, 2.0, 0.0]],
        time_s=0.02 + PERIOD_S * cycle,
        pose=(1.0, 2.0, 0.5),
        twist=twist,
        vy_mps=vy,
        costmap=NO_COSTMAP if costs is None else Costmap(costs, 0.0, 0.0, 0.05),
    )


def controller_of(make):
    """A controller whose system is what `make()` returns."""

    class Made(SystemController):
        def make_system(self, parameters, setup):
            return make()

    return Made(ControllerParameters(), SETUP)


def drive(controller, observations):
    """Returns the command of each cycle."""
    memory, commands = controller.initial_memory(), []
    for observation in observations:
        decision = controller.step(observation, memory)
        memory = decision.memory
        commands.append(decision.command.tolist())
    return commands


class Echo(LeafSystem):
    """Its command is computed from all inputs, without a state."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("pose", 3)
        self.DeclareVectorInputPort("twist", 3)
        self.DeclareVectorInputPort("goal", 3)
        self.DeclareAbstractInputPort("plan", AbstractValue.Make(NO_PLAN))
        self.DeclareAbstractInputPort("costmap", AbstractValue.Make(NO_COSTMAP))
        self.DeclareVectorOutputPort("command", 3, self.calc)

    def value(self, name, context):
        return self.GetInputPort(name).Eval(context)

    def calc(self, context, output):
        if self.value("costmap", context).lethal_centres.size:
            raise NoValidControl("a cell is lethal")
        way = self.value("goal", context) - self.value("pose", context)
        length = len(self.value("plan", context))
        output.SetFromVector([way[0], length, self.value("twist", context)[2]])


def test_the_command_is_computed_from_the_inputs_of_the_same_cycle():
    # 3 - 1 m ahead, two poses in the plan, 0.3 m/s to the left.
    assert drive(controller_of(Echo), [seen(0, vy=0.3)]) == [[2.0, 2.0, 0.3]]


def test_an_error_of_the_contract_is_that_of_the_cycle():
    lethal = np.full((4, 4), 254, np.uint8)
    with pytest.raises(NoValidControl, match="a cell is lethal"):
        drive(controller_of(Echo), [seen(0, costs=lethal)])


def integrating():
    """A Diagram that integrates the measured speed: v is the way driven since the first cycle."""
    builder = DiagramBuilder()
    integrator = builder.AddSystem(Integrator(3))
    builder.ExportInput(integrator.get_input_port(), "twist")
    builder.ExportOutput(integrator.get_output_port(), "command")
    return builder.Build()


def test_a_continuous_state_goes_on_from_cycle_to_cycle_with_the_inputs_of_the_cycle_before():
    commands = drive(
        controller_of(integrating),
        [seen(k, twist=(speed, 0.0)) for k, speed in enumerate((1, 2, 0))],
    )
    # 1 m/s for 0.05 s, then 2 m/s for 0.05 s.
    np.testing.assert_allclose([one[0] for one in commands], [0.0, 0.05, 0.15], atol=1e-12)


def test_a_periodic_event_of_a_cycles_instant_happens_once_and_sees_its_inputs():
    def holding():
        builder = DiagramBuilder()
        hold = builder.AddSystem(ZeroOrderHold(PERIOD_S, 3, offset_sec=0.02))
        builder.ExportInput(hold.get_input_port(), "twist")
        builder.ExportOutput(hold.get_output_port(), "command")
        return builder.Build()

    commands = drive(controller_of(holding), [seen(k, twist=(k + 1.0, 0.0)) for k in range(4)])
    assert [one[0] for one in commands] == [1.0, 2.0, 3.0, 4.0]


class Counter(LeafSystem):
    """Counts cycles by a forced event, and events of a clock of 0.02 s."""

    def __init__(self):
        super().__init__()
        self.DeclareDiscreteState(2)
        self.DeclareForcedDiscreteUpdateEvent(self.count_cycle)
        self.DeclarePeriodicDiscreteUpdateEvent(0.02, 0.0, self.count_tick)
        self.DeclareVectorOutputPort("counts", 2, self.calc)

    def counted(self, context, discrete, index):
        counts = context.get_discrete_state(0).CopyToVector()
        counts[index] += 1.0
        discrete.set_value(0, counts)

    def count_cycle(self, context, discrete):
        self.counted(context, discrete, 0)

    def count_tick(self, context, discrete):
        self.counted(context, discrete, 1)

    def calc(self, context, output):
        output.SetFromVector(context.get_discrete_state(0).CopyToVector())


def counting():
    builder = DiagramBuilder()
    counter = builder.AddSystem(Counter())
    builder.ExportOutput(counter.GetOutputPort("counts"), "command")
    return builder.Build()


def test_a_forced_event_happens_once_a_cycle_and_a_clock_of_its_own_goes_on():
    # Cycles at 0.02, 0.07, 0.12 s; ticks at 0.02, then 0.04, 0.06, then 0.08, 0.10, 0.12 s.
    assert drive(controller_of(counting), map(seen, range(3))) == [[1, 1], [2, 3], [3, 6]]


def test_a_step_changes_neither_the_memory_nor_its_own_answer():
    controller = controller_of(counting)
    memory = controller.step(seen(0), None).memory
    first = controller.step(seen(1), memory)
    again = controller.step(seen(1), memory)
    np.testing.assert_array_equal(first.command, again.command)
    assert memory.get_time() < 0.0201


def with_ports(declare):
    class Declared(LeafSystem):
        def __init__(self):
            super().__init__()
            declare(self)

    return Declared


def command_of(size):
    return lambda system: system.DeclareVectorOutputPort("command", size, lambda *_: None)


@pytest.mark.parametrize(
    ("declare", "message"),
    [
        (lambda system: None, "Made: expected an output port 'command'"),
        (command_of(4), "output port 'command': got 4 numbers, expected 2 or 3"),
        (
            lambda system: (command_of(2)(system), system.DeclareVectorInputPort("scan", 9)),
            "input port 'scan': expected one of pose, twist, goal, plan, global_plan, costmap, obs",
        ),
        (
            lambda system: (command_of(2)(system), system.DeclareVectorInputPort("pose", 2)),
            "input port 'pose': got 2 numbers, expected 3",
        ),
        (
            lambda system: (command_of(2)(system), system.DeclareVectorInputPort("plan", 6)),
            "input port 'plan': expected it to be abstract",
        ),
        (
            lambda system: (
                command_of(2)(system),
                system.DeclareAbstractInputPort("twist", AbstractValue.Make(0)),
            ),
            "input port 'twist': expected it to be a vector of 3 numbers",
        ),
    ],
)
def test_ports_that_no_observation_has_are_refused_in_one_line(declare, message):
    with pytest.raises(InputError, match=message):
        controller_of(with_ports(declare))


def test_what_is_no_system_is_refused_in_one_line():
    with pytest.raises(InputError, match="make_system: got int, expected a System of Drake"):
        controller_of(lambda: 3)


FILE = """
import numpy as np
from pydantic import Field
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_navbench.controller import ControllerParameters
from drake_navbench.controllers.drake_system import SystemController


class Parameters(ControllerParameters):
    speed: float = Field(0.2, gt=0.0, description="Forward speed [m/s].")


class Straight(SystemController):
    Parameters = Parameters

    def make_system(self, parameters, setup):
        builder = DiagramBuilder()
        source = builder.AddSystem(ConstantVectorSource([parameters.speed, 0.0]))
        builder.ExportOutput(source.get_output_port(), "command")
        return builder.Build()
"""


def test_a_class_in_a_file_drives_a_trial_with_its_parameters(tmp_path):
    (tmp_path / "mine.py").write_text(FILE)
    log = run_trial("empty", f"{tmp_path}/mine.py:Straight:speed=0.4")
    assert log.outcome is Outcome.SUCCEEDED
    # The base answers with a lag of 0.1 s: after 2 s it drives as commanded.
    assert log.samples.set_index("time_s")["v_mps"].loc[2.0] == pytest.approx(0.4, abs=1e-6)
