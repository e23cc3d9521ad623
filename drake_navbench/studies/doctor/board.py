"""The slowness of the robot's computer: cycle times measured there and here.

Both are of the controller as it is here, not of Nav2's C++; their ratio is that of the computers.
The trials then take `compute_time: scaled`, by which late cycles come as on the robot.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.rows_of_trials import drive_each
from drake_navbench.errors import InputError, writing
from drake_navbench.logs.log import TrialLog
from drake_navbench.studies.doctor.driving import Row
from drake_navbench.studies.doctor.files import Patient, speed_asked
from drake_navbench.studies.doctor.probes import probes_for
from drake_navbench.typed_files.typed_yaml import FrozenModel, read_yaml, validate
from drake_navbench.typed_files.yaml_loader import dump_yaml

# Probes in which cycles are timed: free, and with walls to look at.
TIMED = ("straight", "corridor")
# The first cycles are left out: they load and compile.
WARM_UP_CYCLES = 5
LEAST_CYCLES = 20
# The file with the cycle times of this computer, in the visit's folder.
HERE = "this_computer.yaml"


class CycleTimes(FrozenModel):
    """The contents of a file of cycle times."""

    controller: str = Field(description="Name of the controller in the Nav2 file.")
    parameters: dict[str, float | int | bool | str | None] = Field(
        description="Those of its parameters that a cycle's work depends on."
    )
    period_ms: float = Field(gt=0.0, description="Period of the controller server [ms].")
    cycles: int = Field(ge=LEAST_CYCLES, description="Number of cycles that were timed.")
    median_ms: float = Field(gt=0.0, description="Half of the cycles take longer [ms].")
    p95_ms: float = Field(gt=0.0, description="One in twenty takes longer [ms].")
    late_share: float = Field(ge=0.0, le=1.0, description="Share of cycles longer than the period.")

    @property
    def told(self) -> str:
        """The times in one sentence."""
        return (
            f"half of the cycles of {self.controller} take more than {self.median_ms:.3g} ms, one "
            f"in twenty more than {self.p95_ms:.3g} ms; the period is {self.period_ms:.3g} ms, and "
            f"{100 * self.late_share:.0f}% are late"
        )


def measured_here(patient: Patient) -> CycleTimes:
    """Returns the cycle times of a file's controller on this computer, by two probes alone."""
    columns = patient.columns()
    preset, facts = patient.chosen(columns), patient.facts()
    robot = columns.setup.robot
    probes = probes_for(robot, speed_asked(facts, robot))
    specs = plan_campaign(
        [probes[name] for name in TIMED], [preset], trials=1, robot=patient.robot,
        keeps_costmaps=False,
    ).specs  # fmt: skip
    rows = drive_each(specs, cycle_row, jobs=1)
    times = np.array([ms for row in rows for ms in row["cycle_ms"]])
    if len(times) < LEAST_CYCLES:
        raise InputError(
            f"--measure-board: {len(times)} cycles were driven, expected at least {LEAST_CYCLES}"
        )
    period_ms = 1000.0 * facts.period_s
    return CycleTimes(
        controller=facts.plugin,
        parameters=_work_of(preset.parameters.model_dump(mode="json")),
        period_ms=round(period_ms, 3),
        cycles=len(times),
        median_ms=round(float(np.median(times)), 4),
        p95_ms=round(float(np.quantile(times, 0.95)), 4),
        late_share=round(float((times > period_ms).mean()), 4),
    )


def cycle_row(log: TrialLog) -> Row:
    """Returns the times of a trial's cycles, ms, without the first ones."""
    samples = log.samples
    is_new = samples["cycle_count"].diff() > 0
    times = samples["compute_time_ms"][is_new].to_numpy(dtype=float)[WARM_UP_CYCLES:]
    return {"cycle_ms": [float(ms) for ms in times if np.isfinite(ms)]}


def overrides_of_board(patient: Patient, path: Path, folder: Path) -> tuple[dict[str, Any], str]:
    """Returns the robot's fields for the computer of `--board`, and a sentence on them.

    folder: keeps the times of this computer, so that the same command drives the same trials.
    Raises InputError where the board's file is wrong or of another Nav2 file.
    """
    board, here_path = read_times(path), folder / HERE
    here = read_times(here_path) if here_path.exists() else measured_here(patient)
    scale = slowness(board, here, path)
    write_times(here, here_path)
    remark = (
        f"Cycles take {scale:g} times as long as here: on the robot's computer {board.told} "
        f"({path.name}). The times are of this program's controller, not of Nav2's C++."
    )
    return {"timing": {"compute_time": "scaled", "compute_time_scale": scale}}, remark


def slowness(board: CycleTimes, here: CycleTimes, path: Path) -> float:
    """Returns the robot's cycle time over this computer's, to two digits; raises InputError."""
    for name in ("controller", "parameters"):
        there, own = getattr(board, name), getattr(here, name)
        if there != own:
            raise InputError(
                f"--board {path}: {name}: got {there}, expected {own} as in the Nav2 file; measure "
                "again"
            )
    return float(f"{board.median_ms / here.median_ms:.2g}")


def read_times(path: Path) -> CycleTimes:
    """Returns the contents of a file of cycle times; raises InputError."""
    return validate(CycleTimes, read_yaml(path), str(path))


def write_times(times: CycleTimes, path: Path) -> None:
    """Writes a file of cycle times; raises CannotBeWritten."""
    with writing(path):
        path.write_text(dump_yaml(times.model_dump(), sort_keys=False), encoding="utf-8")


def _work_of(parameters: dict[str, object]) -> dict[str, float | int | bool | str | None]:
    """Returns the parameters with a single value, no lists and no blocks."""
    return {
        name: value
        for name, value in parameters.items()
        if value is None or isinstance(value, bool | int | float | str)
    }
