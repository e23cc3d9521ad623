"""The wiring of a navigation stack that runs outside, in place of all of ours."""

from __future__ import annotations

from pydrake.systems.framework import DiagramBuilder

from drake_navbench.controller import Controller
from drake_navbench.systems.running_stack import RunningStack, RunningStackSystem, StackTask
from drake_navbench.trial.navigation_wiring import Signals, connect_inputs
from drake_navbench.trial.spec import FollowPlan, NavigateToPoses


def add_running_stack(
    builder: DiagramBuilder,
    stack: Controller | RunningStack,
    task: FollowPlan | NavigateToPoses | StackTask,
    signals: Signals,
) -> RunningStackSystem:
    """Adds the system that tells a running stack what the robot senses and obeys its commands."""
    if not (isinstance(stack, RunningStack) and isinstance(task, StackTask)):
        raise TypeError("a running stack and its task belong together")
    system = builder.AddNamedSystem("running_stack", RunningStackSystem(stack, task))
    connect_inputs(
        builder, system, state=signals.state, estimate=signals.estimate, scan=signals.scan
    )
    if signals.map_from_odometry is not None:
        connect_inputs(
            builder,
            system,
            odometry_estimate=signals.odometry_estimate,
            map_from_odometry=signals.map_from_odometry,
        )
    if signals.clouds is not None:
        connect_inputs(builder, system, clouds=signals.clouds)
    return system
