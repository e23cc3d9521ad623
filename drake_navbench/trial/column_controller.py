"""The controller of a column, built for a robot and closed after its use."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from drake_navbench.controller import ClosableController, Controller, ControllerSetup
from drake_navbench.errors import InputError, InputWarning, is_machine_fault, one_line
from drake_navbench.inputs.foreign_code import runs_foreign_code
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot


def make_controller(preset: Preset, robot: Robot, *, wants_diagnostics: bool = False) -> Controller:
    """Returns a column's controller; raises InputError where it cannot be built for the robot."""
    setup = controller_setup(robot, wants_diagnostics)
    with _plugin_faults_as_input_errors(preset):
        return preset.controller_class(preset.parameters, setup)


@contextmanager
def _plugin_faults_as_input_errors(preset: Preset) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise InputError(f"{preset.source}: {error}") from error
    except BaseException as error:
        # A plugin may break in any way; Drake reports a failed C++ check as SystemExit.
        is_interrupt = isinstance(error, KeyboardInterrupt) and not runs_foreign_code(preset)
        if is_interrupt or is_machine_fault(error):
            raise
        raise InputError(f"{preset.source}: {one_line(error)}") from error


@contextmanager
def built_controller(
    preset: Preset, robot: Robot, *, wants_diagnostics: bool = False
) -> Iterator[Controller]:
    """Builds a column's controller, and closes it at the end of the block; raises InputError."""
    controller = make_controller(preset, robot, wants_diagnostics=wants_diagnostics)
    try:
        yield controller
    finally:
        if isinstance(controller, ClosableController):
            with _plugin_faults_as_input_errors(preset):
                controller.close()


def check_controller(preset: Preset, robot: Robot) -> None:
    """Raises InputError where a column's controller cannot be built for a robot.

    Warns of parameters that the controller does not know, where only the controller can tell.
    """
    with built_controller(preset, preset.robot(robot)) as controller:
        not_read = getattr(controller, "not_read", ())
    if not_read:
        names = ", ".join(not_read)
        warnings.warn(f"{preset.source}: does not read {names}", InputWarning, stacklevel=2)


def controller_setup(robot: Robot, wants_diagnostics: bool = False) -> ControllerSetup:
    """Returns the facts about robot and costmap that a controller gets when it is built."""
    inscribed, circumscribed = robot.radii
    costmap = robot.navigation.local_costmap
    return ControllerSetup(
        control_period_s=1.0 / robot.navigation.controller_server.controller_frequency,
        footprint=np.ascontiguousarray(robot.padded_outline),
        inscribed_radius_m=inscribed,
        circumscribed_radius_m=circumscribed,
        footprint_is_circle=robot.is_circle,
        max_linear_velocity_mps=robot.drive.max_linear_velocity_mps,
        max_angular_velocity_radps=robot.drive.max_angular_velocity_radps,
        max_lateral_velocity_mps=robot.drive.lateral_speed_mps,
        min_turning_radius_m=robot.drive.turning_radius_m,
        response_time_constant_s=robot.drive.response_time_constant_s,
        max_linear_acceleration_mps2=robot.drive.bounds.acceleration_mps2,
        max_angular_acceleration_radps2=robot.drive.bounds.yaw_acceleration_radps2,
        costmap_resolution_m=costmap.resolution,
        costmap_size_m=float(max(costmap.width, costmap.height)),
        inflation_radius_m=costmap.inflation_layer.inflation_radius,
        inflation_cost_scaling_factor=costmap.inflation_layer.cost_scaling_factor,
        tracks_unknown_space=costmap.track_unknown_space,
        wants_diagnostics=wants_diagnostics,
    )
