"""A recording of the robot: the symptoms in it, and the base that the probes should drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from drake_navbench.errors import InputError, as_line
from drake_navbench.inputs.robot import Robot, load_robot
from drake_navbench.ros2.recordings.drive_fit import AxisFit, DriveFit, fit_drive
from drake_navbench.ros2.recordings.import_bags import (
    Imported,
    ImportRequest,
    NoTasks,
    read_recording,
)
from drake_navbench.studies.doctor.detectors import severities
from drake_navbench.studies.doctor.log_symptoms import told_of
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.visit import BY_WEIGHT

DIGITS = 3
# The share of a velocity's variance that the commands must explain.
LEAST_EXPLAINED = 0.5
NO_GOAL = (
    "{} has no goal: whether Nav2 or a person drove is not known, so a stop or a way backward may "
    "have been wanted."
)


class BagReport(NamedTuple):
    """The findings of a recording.

    severity: of each symptom, the largest over its tasks. lines: for the terminal. overrides: of
    the robot file, the base that was fitted; empty where the recording does not show it. remarks:
    how the base was found, a sentence each.
    """

    severity: dict[Symptom, float]
    lines: list[str]
    overrides: dict[str, Any]
    remarks: tuple[str, ...]

    @property
    def weightiest(self) -> Symptom | None:
        """The symptom to treat if the user names none; None if the recording shows none."""
        return next((s for s in BY_WEIGHT if self.severity.get(s, 0.0) > 1.0), None)


def report_on(
    path: Path, robot: str, topics: Mapping[str, str], packages: Sequence[Path] = ()
) -> BagReport:
    """Returns the symptoms in a recording and the base that is fitted to it; raises InputError.

    robot: name or file, for its outline and limits. topics: of the recording, by role. packages:
    folders searched for the packages that a robot's model names.
    """
    request = ImportRequest(robot=robot, topics=topics, packages=tuple(packages))
    imported = _read(path, request)
    severity: dict[Symptom, float] = {}
    count = len(imported.logs)
    lines = [f"{path.name} contains {count} drive{'s' * (count != 1)}, which show:"]
    for log in imported.logs:
        lines += [f"- {line}" for line in told_of(log)]
        for name, value in severities(log).items():
            symptom = Symptom(name)
            severity[symptom] = max(severity.get(symptom, 0.0), value)
    overrides, remarks = _base(path, imported, load_robot(robot, packages=packages))
    if any("goal" in log.info.get("missing", {}) for log in imported.logs):
        remarks = (NO_GOAL.format(path.name), *remarks)
    return BagReport(severity, [as_line(line) for line in lines], overrides, remarks)


def _read(path: Path, request: ImportRequest) -> Imported:
    """Returns the tasks of a recording; a recording without tasks counts as one task."""
    try:
        return read_recording(path, request)
    except NoTasks:
        return read_recording(path, replace(request, start_s=0.0))


def _base(path: Path, imported: Imported, robot: Robot) -> tuple[dict[str, Any], tuple[str, ...]]:
    if robot.drive.turning_radius_m:
        return {}, (
            "The base is the robot file's: the doctor does not fit a car's base to a recording.",
        )
    if imported.drive is None:
        return {}, (f"{path.name} has no commands: the base's lag is the robot file's.",)
    try:
        fit = fit_drive(imported.drive)
    except InputError as error:
        return {}, (f"The base's lag is the robot file's: {error}.",)
    moved = [axis for axis in (fit.linear, fit.angular) if axis.least_command]
    explained = max(axis.explained for axis in moved)
    if explained < LEAST_EXPLAINED:
        return {}, (
            f"The base's lag is the robot file's: the commands in {path.name} explain "
            f"{max(explained, 0.0):.0%} of the motion, expected {LEAST_EXPLAINED:.0%} at least.",
        )
    fit = replace(fit, linear=_seen(fit.linear), angular=_seen(fit.angular))
    return overrides_of(fit), (f"The base is fitted to {path.name}: {_told(fit)}.",)


def _seen(axis: AxisFit) -> AxisFit:
    """Returns an axis of the fit, without limits if the commands do not explain its motion."""
    is_explained = axis.explained >= LEAST_EXPLAINED
    return axis if is_explained else replace(axis, acceleration=None, deadband=None)


def overrides_of(fit: DriveFit) -> dict[str, Any]:
    """Returns the fields of a robot file for a fitted base; what was not seen is left out."""
    drive: dict[str, Any] = {"response_time_constant_s": _rounded(fit.response_time_constant_s)}
    if fit.linear.acceleration is not None:
        drive["max_linear_acceleration_mps2"] = _rounded(fit.linear.acceleration)
    if fit.angular.acceleration is not None:
        drive["max_angular_acceleration_radps2"] = _rounded(fit.angular.acceleration)
    found: dict[str, Any] = {
        "drive": drive,
        "timing": {"command_latency_s": _rounded(fit.dead_time_s)},
    }
    if fit.linear.deadband is not None:
        found["actuators"] = {"deadband_mps": _rounded(fit.linear.deadband)}
    return found


def _told(fit: DriveFit) -> str:
    parts = [f"lag {fit.response_time_constant_s:.2f} s", f"latency {fit.dead_time_s:.2f} s"]
    for axis, unit in ((fit.linear, "m/s"), (fit.angular, "rad/s")):
        if axis.acceleration is not None:
            parts.append(f"at most {axis.acceleration:.2g} {unit}^2")
        if axis.deadband is not None:
            parts.append(f"no motion below {axis.deadband:.2g} {unit}")
    return ", ".join(parts)


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
