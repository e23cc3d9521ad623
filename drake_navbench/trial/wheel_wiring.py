"""The wiring of optional parts between the last command and the wheels."""

from __future__ import annotations

from pydrake.systems.framework import DiagramBuilder, OutputPort

from drake_navbench.inputs.faults import Conditions
from drake_navbench.inputs.robot import Robot
from drake_navbench.systems.actuators import LimitedForce, SlippingWheels
from drake_navbench.systems.delays import CommandLink
from drake_navbench.trial.navigation_wiring import command_clock, connect_inputs
from drake_navbench.trial.timing import CONTROLLER_OFFSET_S


def add_way_to_wheels(
    builder: DiagramBuilder,
    robot: Robot,
    conditions: Conditions,
    command: OutputPort,
    state: OutputPort,
) -> tuple[OutputPort, tuple[CommandLink | SlippingWheels, ...]]:
    """Adds the link, the motors and the wheels that a command goes through.

    Returns the port of the command that the base obeys, and the systems that draw with a seed.
    """
    seeded: list[CommandLink | SlippingWheels] = []
    if conditions.timing.any(lambda timing: timing.touches_commands):
        period_s, offset_s = command_clock(robot)
        link = CommandLink(conditions.timing, period_s=period_s, offset_s=offset_s)
        seeded.append(builder.AddNamedSystem("command_link", link))
        connect_inputs(builder, link, command=command)
        command = link.GetOutputPort("arrived")
    if conditions.actuators.any(lambda part: part.touches_wheels):
        wheels = SlippingWheels(conditions.actuators)
        seeded.append(builder.AddNamedSystem("wheels", wheels))
        connect_inputs(builder, wheels, command=command)
        command = wheels.GetOutputPort("obeyed")
    if conditions.actuators.any(lambda part: part.limits_force):
        motors = LimitedForce(
            conditions.actuators,
            mass_kg=robot.mass_kg or 0.0,
            bounds=robot.drive.bounds,
            offset_s=CONTROLLER_OFFSET_S,
        )
        builder.AddNamedSystem("motors", motors)
        connect_inputs(builder, motors, command=command, state=state)
        command = motors.GetOutputPort("reached")
    return command, tuple(seeded)
