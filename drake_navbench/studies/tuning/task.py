"""The task of a tuning study. A process can join a study only if its task is equal."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from pydantic import ConfigDict, Field

from drake_navbench.campaign.request import MAX_TRIALS
from drake_navbench.errors import InputError, printable
from drake_navbench.inputs.presets import Preset
from drake_navbench.processes.version import __version__
from drake_navbench.typed_files.typed_yaml import FrozenModel, validate

# The most characters of a value in an error.
MOST_SHOWN = 120


class TuningTask(FrozenModel):
    """The search space, the scenarios and the rules of a tuning study.

    baseline: the name of the preset; `parameters` holds all its parameters. searched: the
    dimensions of the search space as texts. guards: scenarios in which only touches count.
    most_pairs: the largest number of pairs that a configuration drives; a pair is a scenario with a
    seed. seed: the seed from which the seeds of all pairs are drawn.
    """

    model_config = ConfigDict(extra="forbid")

    drake_navbench: str
    baseline: str
    parameters: dict[str, Any]
    searched: tuple[str, ...]
    scenarios: tuple[str, ...] = Field(min_length=1)
    guards: tuple[str, ...]
    robot: str
    objectives: tuple[str, ...] = Field(min_length=1)
    most_pairs: int = Field(ge=1, le=MAX_TRIALS)
    seed: int = Field(ge=0)

    @property
    def digest(self) -> str:
        """A digest of the task, different for every other task."""
        text = json.dumps(self.model_dump(mode="json"), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def tuning_task(
    baseline: Preset, of_file: Mapping[str, Any] | None = None, **options: Any
) -> TuningTask:
    """Returns the task of a preset.

    of_file: for a column of a Nav2 file, further values that define its parameters. options: the
    other fields. Raises InputError.
    """
    own = {
        "drake_navbench": __version__,
        "baseline": baseline.name,
        "parameters": baseline.parameters.model_dump(mode="json") | dict(of_file or {}),
    }
    return validate(TuningTask, own | options, "command line")


def require_same_task(task: TuningTask, begun: dict[str, Any], where: str) -> None:
    """Raises InputError where a study was begun with another version, or for another task."""
    version = begun.get("drake_navbench")
    if version != task.drake_navbench:
        raise InputError(
            f"{where}: a study of version {version}, this is {task.drake_navbench}; "
            "name a new --out"
        )
    for name, value in task.model_dump(mode="json").items():
        if begun.get(name) != value:
            before, got = (printable(json.dumps(v), MOST_SHOWN) for v in (begun.get(name), value))
            raise InputError(
                f"{where}: a study of another task, {name} was {before}; expected that or a new "
                f"--out, got {got}"
            )
