"""Symptoms in an existing log: of a trial, or of an imported recording."""

from __future__ import annotations

from pathlib import Path

from drake_navbench.errors import InputError
from drake_navbench.logs.log import TrialLog
from drake_navbench.studies.doctor.detectors import DETECTORS
from drake_navbench.studies.doctor.drives import drive_of
from drake_navbench.studies.doctor.symptoms import LOOKS_LIKE

LEAST_SAMPLES = 3


def told_of_log(path: Path) -> list[str]:
    """Returns a line for each symptom that a log shows, with number and threshold; InputError."""
    log = TrialLog.read(path)
    if len(log.samples) < LEAST_SAMPLES:
        raise InputError(f"{path}: expected a drive, got {len(log.samples)} samples")
    return told_of(log)


def told_of(log: TrialLog) -> list[str]:
    """Returns a line for each symptom that a log shows, with number and threshold."""
    drive = drive_of(log)
    if len(drive.time_s) < LEAST_SAMPLES:
        return ["the robot does not move"]
    lines = []
    for detector in DETECTORS:
        value = float(detector.measure(drive))
        if value > detector.threshold:
            lines.append(
                f"{detector.symptom}: the robot {LOOKS_LIKE[detector.symptom]}: {value:.3g} "
                f"{detector.unit}, threshold {detector.threshold:g} ({detector.reason})"
            )
    return lines or ["no symptom"]
