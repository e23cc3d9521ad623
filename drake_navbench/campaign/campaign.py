"""The campaign: the table of all trials of a benchmark, made from a request."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from typing import Any

import numpy as np

from drake_navbench.campaign.sweep import SweptScenario, expand
from drake_navbench.errors import InputError
from drake_navbench.inputs.check import Check
from drake_navbench.inputs.presets import Preset, default_presets, load_preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS, Scenario, load_scenario
from drake_navbench.inputs.task_check import check_task, warn_of_column
from drake_navbench.nav2.whole_files import FileColumns
from drake_navbench.trial.column_controller import check_controller
from drake_navbench.trial.plugin_check import check_plugins, check_running_stack
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.task_cost import check_cost
from drake_navbench.trial.trial import DEFAULT_ROBOT

DEFAULT_TRIALS = 4


@dataclass(frozen=True)
class Campaign:
    """Every trial of a benchmark, in the order of its table, all input checked.

    nav2: the setups of the whole Nav2 files, if any. model: the check of the robot's model (URDF,
    SDF), if there is no robot file. sweep: {} without a sweep; else {"scenarios": ...,
    "controllers": ...}, each by the name of a variant: {"of": name of the original, "values": swept
    value by field}.
    """

    specs: tuple[TrialSpec, ...]
    nav2: tuple[FileColumns, ...] = ()
    model: Check | None = None
    sweep: dict[str, dict[str, Any]] = field(default_factory=dict)

    @property
    def scenarios(self) -> list[str]:
        """Names of the scenarios, in order."""
        return list(dict.fromkeys(spec.scenario.name for spec in self.specs))

    @property
    def suites(self) -> dict[str, str]:
        """The suite of each scenario that is in one, by the scenario's name."""
        return {
            spec.scenario.name: spec.scenario.suite.name
            for spec in self.specs
            if spec.scenario.suite is not None
        }

    @property
    def clean_of(self) -> dict[str, str]:
        """The clean scenario of each harsher scenario, by the latter's name."""
        return {
            spec.scenario.name: spec.scenario.clean_scenario
            for spec in self.specs
            if spec.scenario.clean_scenario is not None
        }

    @property
    def presets(self) -> list[Preset]:
        """The presets, in order."""
        return list({spec.preset.name: spec.preset for spec in self.specs}.values())

    @property
    def columns(self) -> list[str]:
        """Names of the presets, in order."""
        return [preset.name for preset in self.presets]

    @property
    def foreign_code(self) -> dict[str, str]:
        """The plugins of other packages: package and version by the plugin's kind and name."""
        return {name: origin for spec in self.specs for name, origin in spec.foreign_code.items()}

    @property
    def identity(self) -> str:
        """A digest of all its trials; campaigns with different trials have different digests."""
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
    keeps_costmaps: bool = True,
    points: Sequence[Mapping[str, Any]] = ({},),
) -> Campaign:
    """Returns every trial of a campaign, all input checked; raises InputError.

    points: the points of a sweep, values by field; one empty point without a sweep. Without
    scenarios or presets the five published scenarios or the default presets drive. An input given
    twice runs once; different inputs of the same name are refused.
    """
    entries = tuple({str(entry): entry for entry in scenarios}.values()) or PUBLISHED_SCENARIOS
    loaded = [entry if isinstance(entry, Scenario) else load_scenario(entry) for entry in entries]
    _require_different_names(
        "scenario",
        [
            (found.name, entry if isinstance(entry, str) else found.description)
            for found, entry in zip(loaded, entries, strict=True)
        ],
    )
    columns = [
        preset if isinstance(preset, Preset) else load_preset(preset)
        for preset in dict.fromkeys(presets or default_presets())
    ]
    _require_different_names("controller", [(preset.name, preset.source) for preset in columns])
    swept = list(expand(points, loaded, columns, robot))
    specs = []
    checked: list[tuple[Preset, Robot]] = []
    for entry in swept:
        paired_with = entry.scenario.clean_scenario or entry.base
        firsts = [
            TrialSpec(
                entry.scenario,
                loaded_robot,
                preset,
                seed=trial_seed(seed, paired_with, 0),
                wants_diagnostics=wants_diagnostics,
                keeps_costmaps=keeps_costmaps,
            )
            for preset, loaded_robot in _checked_drivers(entry, robot, checked)
        ]
        specs += firsts
        for trial in range(1, trials):
            trials_own_seed = trial_seed(seed, paired_with, trial)
            specs += [first.numbered(trial, trials_own_seed) for first in firsts]
    return Campaign(tuple(specs), sweep=_origins(swept) if any(points) else {})


def _checked_drivers(
    entry: SweptScenario, robot: str | Robot, checked: list[tuple[Preset, Robot]]
) -> list[tuple[Preset, Robot]]:
    """Returns each column with its robot in a scenario, all of it checked; raises InputError.

    checked: the columns and robots that were checked before; those of this scenario are added.
    """
    scenario = entry.scenario
    robots = _robots_of(scenario, [preset for preset, _, _ in entry.columns], robot)
    for loaded_robot in {id(found): found for found in robots.values()}.values():
        check_task(scenario, loaded_robot)
        check_cost(scenario, loaded_robot)
        check_plugins(scenario, loaded_robot)
    fitted = [preset.for_robot(robots[preset]) for preset, _, _ in entry.columns]
    drivers = list(zip(fitted, robots.values(), strict=True))
    for preset, loaded_robot in drivers:
        # Some parameters are wrong only for this robot or its control period. A controller in
        # another process is started for the check, so that a robot of many scenarios is checked
        # once.
        if (preset, loaded_robot) not in checked:
            check_controller(preset, loaded_robot)
            checked.append((preset, loaded_robot))
        check_running_stack(scenario, preset)
        warn_of_column(preset, loaded_robot)
    return drivers


def _robots_of(
    scenario: Scenario, presets: Sequence[Preset], robot: str | Robot
) -> dict[Preset, Robot]:
    """Returns each column's robot in a scenario: that of the column's file, or the run's."""
    own = {id(preset.stack): preset.stack for preset in presets}
    loaded = {key: scenario.load_robot(stack or robot) for key, stack in own.items()}
    return {preset: loaded[id(preset.stack)] for preset in presets}


def _origins(swept: Sequence[SweptScenario]) -> dict[str, dict[str, Any]]:
    """Returns the origin of each scenario and column of a sweep; see `Campaign.sweep`."""
    return {
        "scenarios": {
            entry.scenario.name: {"of": entry.base, "values": dict(entry.values)} for entry in swept
        },
        "controllers": {
            preset.name: {"of": base, "values": dict(values)}
            for entry in swept
            for preset, base, values in entry.columns
        },
    }


def _require_different_names(kind: str, names_and_sources: Iterable[tuple[str, str]]) -> None:
    """Raises InputError where two have the same name, as their logs would overwrite each other."""
    sources: dict[str, str] = {}
    for name, source in names_and_sources:
        if not name.isprintable():
            raise InputError(f"{kind} {name!r}: expected a name of printable characters")
        if name in sources:
            raise InputError(
                f"{kind} {name!r}: expected one of this name, got {sources[name]} and {source}"
            )
        sources[name] = source
