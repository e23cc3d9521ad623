"""What was asked for: the part of a manifest from which a run can be resumed."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from drake_navbench.campaign.campaign import Campaign, plan_campaign
from drake_navbench.inputs.parameter_files import load_parameter_file
from drake_navbench.inputs.presets import Preset
from drake_navbench.typed_yaml import FrozenModel

# Of each scenario and controller.
MAX_TRIALS = 100_000
MAX_SEED = 2**64 - 1


class Request(FrozenModel):
    """What was asked for; it is kept in the manifest, so that a run can be resumed.

    controllers: presets and variants by name. parameter_files: more columns, from files.
    """

    scenarios: tuple[str, ...]
    controllers: tuple[str, ...]
    parameter_files: tuple[str, ...]
    trials: int = Field(ge=1, le=MAX_TRIALS)
    seed: int = Field(ge=0, le=MAX_SEED)
    robot: str
    replay: Literal["race", "each", "none"]
    figures: Literal["none", "key", "all"] = "key"

    def campaign(self) -> Campaign:
        """Returns the trials of this request, all input checked; raises InputError."""
        presets: list[str | Preset] = list(self.controllers)
        for path in dict.fromkeys(self.parameter_files):
            presets += load_parameter_file(Path(path))
        return plan_campaign(
            self.scenarios,
            presets,
            trials=self.trials,
            seed=self.seed,
            robot=self.robot,
            wants_diagnostics=self.replay == "each",
        )
