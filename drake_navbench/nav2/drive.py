"""Sets the limits of the base so that it can drive as the controllers of a Nav2 file command."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from drake_navbench.controller import AskedSpeeds
from drake_navbench.inputs.drive import AckermannDrive, OmnidirectionalDrive, as_omnidirectional
from drake_navbench.inputs.robot import Robot

Fields = dict[str, Any]


def drive_for(
    data: Fields,
    needed: Sequence[AskedSpeeds],
    base: Robot,
    base_name: str,
    *,
    spin_radps: float = 0.0,
) -> tuple[Fields, dict[str, str]]:
    """Returns the fields of a drive with the needed speeds, and a remark for each changed field.

    data: the fields of the base robot. needed: the speeds that each controller needs. spin_radps:
    the yaw rate that the spin needs. The drive becomes omnidirectional where a controller moves
    sideways. Remarks have the field's name as key.
    """
    drive = base.drive
    remarks = {}
    speeds = _speeds(needed, spin_radps, base)
    if "max_lateral_velocity_mps" in speeds and not isinstance(drive, OmnidirectionalDrive):
        data = as_omnidirectional(drive)
        remarks["type"] = f"omnidirectional, as the controllers ask; {base_name} is not"
    for name, value in speeds.items():
        own = getattr(drive, name, None)
        if value != own:
            has = f"{base_name} has {'none' if own is None else f'{own:g}'}"
            if name not in drive.model_fields_set:
                has = f"{base_name} tells none"
            remarks[name] = f"{value:g}, as the controllers ask; {has}"
    for name, most in _accelerations(needed).items():
        own = getattr(drive, name, None)
        if own is not None and most > own:
            of = f"that of {base_name}" if name in drive.model_fields_set else "the default"
            remarks[name] = f"{own:g}, {of}; a controller counts on {most:g}"
    return {**data, **speeds}, remarks


def _speeds(needed: Sequence[AskedSpeeds], spin_radps: float, base: Robot) -> dict[str, float]:
    """Returns the largest needed limits by the drive's names.

    For a controller that needs no limit, that of the base counts.
    """
    drive = base.drive
    needed = needed or [AskedSpeeds()]
    forward = [s.max_linear_mps or drive.max_linear_velocity_mps for s in needed]
    backward = [s.min_linear_mps or 0.0 for s in needed]
    turning = [s.max_angular_radps or drive.max_angular_velocity_radps for s in needed]
    sideways = max(s.max_lateral_mps or 0.0 for s in needed)
    speeds = {
        "max_linear_velocity_mps": max(forward),
        "min_linear_velocity_mps": min(drive.min_linear_velocity_mps, *backward),
        "max_angular_velocity_radps": max(*turning, spin_radps),
    }
    if sideways > 0.0:
        speeds["max_lateral_velocity_mps"] = sideways
    elif isinstance(drive, AckermannDrive):
        del speeds["max_angular_velocity_radps"]
    return speeds


def _accelerations(needed: Sequence[AskedSpeeds]) -> dict[str, float]:
    linear = [s.linear_acceleration_mps2 or 0.0 for s in needed]
    angular = [s.angular_acceleration_radps2 or 0.0 for s in needed]
    return {
        "max_linear_acceleration_mps2": max(linear, default=0.0),
        "max_angular_acceleration_radps2": max(angular, default=0.0),
    }
