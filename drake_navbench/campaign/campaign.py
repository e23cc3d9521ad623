"""The table of trials: which there are, who runs them, what comes of them."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from hashlib import sha256

import numpy as np

from drake_navbench.errors import InputError
from drake_navbench.inputs.nav2_robot import Nav2Setup
from drake_navbench.inputs.presets import Preset, default_presets, load_preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS, Scenario, load_scenario
from drake_navbench.inputs.task_check import check_task
from drake_navbench.trial.column_controller import check_controller
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.task_cost import check_cost
from drake_navbench.trial.trial import DEFAULT_ROBOT

DEFAULT_TRIALS = 4


@dataclass(frozen=True)
class Campaign:
    """Every trial of a benchmark, in the order of its table, all input checked.

    nav2: what whole Nav2 files made of it, where there were any.
    """

    specs: tuple[TrialSpec, ...]
    nav2: Nav2Setup | None = None

    @property
    def scenarios(self) -> list[str]:
        """Names of the scenarios, in order."""
        return list(dict.fromkeys(spec.scenario.name for spec in self.specs))

    @property
    def presets(self) -> list[Preset]:
        """The presets, in order."""
        return list({spec.preset.name: spec.preset for spec in self.specs}.values())

    @property
    def columns(self) -> list[str]:
        """Names of the presets, in order."""
        return [preset.name for preset in self.presets]

    @property
    def identity(self) -> str:
        """A digest of all its trials; what belongs to another campaign differs in it."""
        return sha256("".join(spec.identity for spec in self.specs).encode()).hexdigest()


def trial_seed(seed: int, scenario: str, trial: int) -> int:
    """Returns the seed of a trial: the same for every controller, so that trials are paired."""
    entropy = [seed, zlib.crc32(scenario.encode()), trial]
    return int(np.random.SeedSequence(entropy).generate_state(1)[0])


def plan_campaign(
    scenarios: Sequence[str | Scenario] = (),
    presets: Sequence[str | Preset] = (),
    *,
    trials: int = DEFAULT_TRIALS,
    seed: int = 0,
    robot: str | Robot = DEFAULT_ROBOT,
    wants_diagnostics: bool = False,
) -> Campaign:
    """Returns every trial of a campaign, all input checked; raises InputError.

    Empty sequences stand for the five published scenarios and the default presets. What is given
    twice runs once; different ones of the same name are refused.
    """
    asked = tuple({str(entry): entry for entry in scenarios}.values()) or PUBLISHED_SCENARIOS
    loaded = [entry if isinstance(entry, Scenario) else load_scenario(entry) for entry in asked]
    _require_different_names(
        "scenario",
        [
            (found.name, entry if isinstance(entry, str) else found.description)
            for found, entry in zip(loaded, asked, strict=True)
        ],
    )
    columns = [
        preset if isinstance(preset, Preset) else load_preset(preset)
        for preset in dict.fromkeys(presets or default_presets())
    ]
    _require_different_names("controller", [(preset.name, preset.source) for preset in columns])
    specs = []
    for scenario in loaded:
        loaded_robot = scenario.load_robot(robot)
        check_task(scenario, loaded_robot)
        check_cost(scenario, loaded_robot)
        fitted = [preset.for_robot(loaded_robot) for preset in columns]
        for preset in fitted:
            # Some parameters are wrong only for this robot or its control period.
            check_controller(preset, loaded_robot)
        for trial in range(trials):
            for preset in fitted:
                specs.append(
                    TrialSpec(
                        scenario,
                        loaded_robot,
                        preset,
                        seed=trial_seed(seed, scenario.name, trial),
                        trial=trial,
                        wants_diagnostics=wants_diagnostics,
                    )
                )
    return Campaign(tuple(specs))


def _require_different_names(kind: str, names_and_sources: Iterable[tuple[str, str]]) -> None:
    """Raises InputError where two have one name: their logs would overwrite each other."""
    sources: dict[str, str] = {}
    for name, source in names_and_sources:
        if not name.isprintable():
            raise InputError(f"{kind} {name!r}: expected a name of printable characters")
        if name in sources:
            raise InputError(
                f"{kind} {name!r}: expected one of this name, got {sources[name]} and {source}"
            )
        sources[name] = source
