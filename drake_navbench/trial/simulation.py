"""One built trial: its Diagram, Context and Simulator, driven to its end or to a time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from pydrake.systems.analysis import (
    ApplySimulatorConfig,
    Simulator,
    SimulatorConfig,
)
from pydrake.systems.framework import Context, Diagram, EventStatus

from drake_navbench.controller import Controller
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import Costmap
from drake_navbench.logs.log import TrialLog
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.navigation.task import TaskStatus
from drake_navbench.trial.contact_watch import Contact, ContactWatch
from drake_navbench.trial.diagram import Observers, TrialDiagram, TrialMaps, build_trial_diagram
from drake_navbench.trial.floors import trial_floors
from drake_navbench.trial.planning import global_layers, known_map, make_plan
from drake_navbench.trial.spec import FollowPlan, NavigateToPoses, TrialSpec
from drake_navbench.trial.systems.lifetime import release
from drake_navbench.trial.systems.running_stack import StackTask
from drake_navbench.trial.timing import MAX_STEP_S
from drake_navbench.trial.trial_log import make_log

# A fixed step without error control: drawing or logging more often must not move the numbers.
INTEGRATION = SimulatorConfig(
    integration_scheme="runge_kutta2", max_step_size=MAX_STEP_S, use_error_control=False
)


class TrialSimulation:
    """A trial with its robot at the start, ready to be driven.

    diagram: the trial's systems. context: the Context of the diagram, with the start pose and the
    seed set. simulator: a Simulator with the fixed steps of every trial, whose monitor ends the
    trial at a touch or when the task is over.
    """

    def __init__(self, spec: TrialSpec, trial: TrialDiagram) -> None:
        self._spec, self._trial = spec, trial
        self.diagram: Diagram = trial.diagram
        self.context: Context = trial.create_context(spec.scenario.start_pose(spec.seed), spec.seed)
        self._contact_watch = ContactWatch(
            spec.robot.drive,
            spec.scenario.true_world,
            footprint=spec.robot.outline,
            max_step_s=MAX_STEP_S,
        )
        self.simulator = Simulator(self.diagram, self.context)
        ApplySimulatorConfig(INTEGRATION, self.simulator)
        self.simulator.set_monitor(_end_of_trial(trial, self.context, self._contact_watch))
        self._is_put_back = False
        self.simulator.Initialize()

    @property
    def has_ended(self) -> bool:
        """Whether the robot touched something, its task is over, or the scenario's time is."""
        if self._contact_watch.contact is not None:
            return True
        navigator = self._trial.navigator
        status = navigator.GetOutputPort("task_status").Eval(
            navigator.GetMyContextFromRoot(self.context)
        )
        is_late = self.context.get_time() >= self._spec.scenario.timeout_s
        return bool(status.state.is_final or is_late)

    def advance_to(self, time_s: float = math.inf) -> None:
        """Drives to a time [s], or to the end of the trial where that is earlier."""
        if not self.has_ended:
            self.simulator.AdvanceTo(min(time_s, self._spec.scenario.timeout_s))
        self._put_back_to_touch()

    def log(self) -> TrialLog:
        """Returns the log of the trial as far as it was driven."""
        self._put_back_to_touch()
        return make_log(self._spec, self._trial, self.context, self._contact_watch)

    def _put_back_to_touch(self) -> None:
        """Puts Context and recording back from the end of the last step to a touch in it."""
        contact = self._contact_watch.contact
        if contact is None or self._is_put_back:
            return
        self._is_put_back = True
        _put_back_to_contact(self._trial, self.context, contact)


@contextmanager
def built_simulation(
    controller: Controller, spec: TrialSpec, observers: Observers
) -> Iterator[TrialSimulation]:
    """Builds the simulation of a trial with a built controller, and frees it after the block.

    spec: with the robot as the column drives it.
    """
    trial = build_trial_diagram(
        spec.robot,
        spec.scenario.true_world,
        controller,
        task=trial_task(spec),
        maps=TrialMaps(_static_map(spec), _known_map(spec), spec.scenario.places[0].filter_masks),
        conditions=spec.scenario.conditions(spec.robot),
        compute_times_ms=spec.compute_times_ms,
        observers=observers,
    )
    try:
        yield TrialSimulation(spec, trial)
    finally:
        release(trial.own_systems)


def simulate_with(
    controller: Controller,
    spec: TrialSpec,
    observers: Observers,
    *,
    until_s: float = math.inf,
) -> TrialLog:
    """Drives a trial with a built controller, without a rehearsal; its log ends at `until_s`.

    spec: with the robot as the column drives it.
    """
    with built_simulation(controller, spec, observers) as simulation:
        simulation.advance_to(until_s)
        return simulation.log()


def trial_task(spec: TrialSpec) -> FollowPlan | NavigateToPoses | StackTask:
    """Returns the robot's task in the scenario's navigation mode, or for a running stack."""
    scenario, robot = spec.scenario, spec.robot
    if spec.preset.is_running_stack:
        return _stack_task(spec)
    if scenario.navigation_mode == "follow_path":
        return FollowPlan(partial(make_plan, scenario, robot))

    def plan(start: Array, goal: Array, costmap: Costmap) -> Array:
        return make_plan(scenario, robot, start, goal, costmap=costmap)

    return NavigateToPoses(
        goals=scenario.goals,
        make_plan=plan,
        global_layers=global_layers(scenario.places[0], robot),
        start_pose=scenario.start_pose(spec.seed),
        floors=trial_floors(scenario, robot, spec.seed),
        navigator=scenario.navigation_mode,
    )


def _stack_task(spec: TrialSpec) -> StackTask:
    """Returns the task of a running stack."""
    scenario, robot = spec.scenario, spec.robot
    start = scenario.start_pose(spec.seed)
    return StackTask(robot, scenario.goals, start, known_map(scenario.places[0], robot))


def _static_map(spec: TrialSpec) -> OccupancyMap | None:
    """Returns the map for the static layer of the local costmap, None without such a layer."""
    settings = spec.robot.navigation.local_costmap
    return (
        known_map(spec.scenario.places[0], spec.robot)
        if settings.is_active("static_layer")
        else None
    )


def _known_map(spec: TrialSpec) -> OccupancyMap | None:
    """Returns AMCL's map, None where AMCL does not localize the robot."""
    if spec.robot.localization.amcl is None:
        return None
    return known_map(spec.scenario.places[0], spec.robot)


def _end_of_trial(
    trial: TrialDiagram, root_context: Context, contact_watch: ContactWatch
) -> Callable[[Context], EventStatus | None]:
    """Returns the monitor that stops the simulation after a touch or when the task is over."""
    state_port, transport = trial.state_port, trial.transport
    status_port = trial.navigator.GetOutputPort("task_status")
    # The simulator hands the same context to every call.
    state_context = trial.state_system.GetMyContextFromRoot(root_context)
    navigator_context = trial.navigator.GetMyContextFromRoot(root_context)
    moving_world = trial.moving_world
    moving_context = moving_world and moving_world.GetMyContextFromRoot(root_context)
    # The last status that was not final: most steps see it again.
    running: TaskStatus | None = None

    def monitor(context: Context) -> EventStatus | None:
        nonlocal running
        time_s = context.get_time()
        status = status_port.Eval(navigator_context)
        if status is running and transport is None and time_s < contact_watch.idle_until_s:
            return None
        # A task that ended in the updates before this step was over before the step's touch.
        is_over = status.state.is_final and status.time_s < time_s
        if transport is not None:
            contact_watch.come_to_floor(transport.floor_changes(state_context))
        if time_s >= contact_watch.idle_until_s and not is_over:
            people = moving_world.people_at(moving_context)[:, :3] if moving_world else None
            contact_watch.look(time_s, state_port.Eval(state_context), people)
            if contact_watch.contact is not None:
                return EventStatus.ReachedTermination(trial.diagram, "collided")
        if status.state.is_final:
            return EventStatus.ReachedTermination(trial.diagram, status.reason)
        running = status
        return None

    return monitor


def _put_back_to_contact(trial: TrialDiagram, context: Context, contact: Contact) -> None:
    """Puts a Context, and the recording in it, back from the end of a step to the touch in it."""
    context.SetTime(contact.time_s)
    state, transport = contact.state, trial.transport
    if transport is not None:
        state = transport.base_state(transport.GetMyContextFromRoot(context), state)
    trial.base.set_state(trial.base.GetMyMutableContextFromRoot(context), state)
    trial.clearance.set_contact(trial.clearance.GetMyMutableContextFromRoot(context))
    recorder_context = trial.recorder.GetMyContextFromRoot(context)
    trial.recorder.find_recording(recorder_context).forget_after(contact.time_s)
