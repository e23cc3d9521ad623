"""Lineups: which presets and scenarios of ours stand for those of the publication."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from drake_navbench.analysis.reproduction.publication import PUBLISHED_CONTROLLERS, published_table

# Some findings are about "all" scenarios; the publication means those whose goal can be reached.
ALL_SCENARIOS = "all"
GOAL_SCENARIOS = ("empty", "static_obstacles", "one_obstacle")


@dataclass(frozen=True)
class Lineup:
    """The presets and scenarios whose trials are compared with the publication.

    presets: published controller -> our preset. scenarios: published scenario -> our scenario,
    where ours has another name.
    """

    name: str
    description: str
    presets: Mapping[str, str]
    scenarios: Mapping[str, str] = field(default_factory=dict)

    def scenario(self, published: str) -> str:
        """Returns the scenario that stands for a published one."""
        return self.scenarios.get(published, published)

    def differs(self, other: Lineup, scenario: str, controller: str) -> bool:
        """Whether another preset or scenario than in the other lineup stands for a published cell.

        scenario: a published one or 'all'.
        """
        wanted = GOAL_SCENARIOS if scenario == ALL_SCENARIOS else (scenario,)
        return self.presets[controller] != other.presets[controller] or any(
            self.scenario(name) != other.scenario(name) for name in wanted
        )


_PUBLISHED_PRESETS = {"dwb": "dwb", "rpp": "rpp", "teb": "teb_upstream", "mppi": "mppi_nav2"}
PUBLISHED_SETTINGS = Lineup(
    "published settings",
    "the settings that fit the publication; TEB is the original's penalties, MPPI the sampler"
    " alone, as Nav2's",
    _PUBLISHED_PRESETS,
)
LINEUPS = (
    PUBLISHED_SETTINGS,
    Lineup(
        "noise at the wall",
        "the same presets; the restricted scenarios with the pose noise of the others",
        _PUBLISHED_PRESETS,
        {name: f"{name}_noisy" for name in ("restricted_small", "restricted_large")},
    ),
    Lineup(
        "constrained TEB",
        "as published settings, but TEB's limits are constraints of a nonlinear program",
        _PUBLISHED_PRESETS | {"teb": "teb"},
    ),
    Lineup(
        "polished MPPI",
        "as published settings, but MPPI's command is polished by a nonlinear program",
        _PUBLISHED_PRESETS | {"mppi": "mppi"},
    ),
    Lineup(
        "bringup settings",
        "what nav2_bringup ships (DWB: until Iron); TEB is no part of Nav2 and stays as it is",
        _PUBLISHED_PRESETS | {"dwb": "dwb_bringup", "rpp": "rpp_bringup", "mppi": "mppi_bringup"},
    ),
)


def present_lineups(trials: pd.DataFrame) -> list[Lineup]:
    """Returns the published lineup and each other one with driven trials of its own."""
    driven = set(zip(trials["scenario"], trials["controller"], strict=True))
    scenarios = published_table()["scenario"].unique()

    def has_own_trials(lineup: Lineup) -> bool:
        return any(
            (lineup.scenario(scenario), lineup.presets[controller]) in driven
            for scenario in scenarios
            for controller in PUBLISHED_CONTROLLERS
            if lineup.differs(PUBLISHED_SETTINGS, scenario, controller)
        )

    return [PUBLISHED_SETTINGS, *filter(has_own_trials, LINEUPS[1:])]


def trial_values(
    trials: pd.DataFrame, scenario: str, metric: str, lineup: Lineup = PUBLISHED_SETTINGS
) -> pd.DataFrame:
    """Returns one row a trial number and one column a published controller; NaN without a value.

    Trials of one number have the same seed in a scenario, so that each row is a pair. For 'all' the
    value is the mean over the goal scenarios, NaN where one is missing.
    """
    if scenario == ALL_SCENARIOS:
        parts = [trial_values(trials, name, metric, lineup) for name in GOAL_SCENARIOS]
        total = parts[0]
        for part in parts[1:]:
            total = total + part
        return total / len(parts)
    # As arrays: selecting rows of a frame copies all of its columns.
    values = trials[metric].to_numpy(float) if metric in trials else np.full(len(trials), math.nan)
    is_own = trials["scenario"].to_numpy(object) == lineup.scenario(scenario)
    numbers, controllers = trials["trial"].to_numpy(), trials["controller"].to_numpy(object)
    columns = {}
    for name, preset in lineup.presets.items():
        rows = is_own & (controllers == preset)
        columns[name] = numbers[rows], values[rows]
    return _side_by_side(columns)


def _side_by_side(columns: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> pd.DataFrame:
    """Returns a frame of columns given by trial numbers and values; NaN where one has no value."""
    index = next((found for found, _ in columns.values() if len(found)), np.empty(0, int))
    if any(len(found) and not np.array_equal(found, index) for found, _ in columns.values()):
        series = {name: pd.Series(values, index=found) for name, (found, values) in columns.items()}
        return pd.DataFrame(series, columns=list(columns), dtype=float)
    # The usual case, with hundreds of calls in a report; pandas aligns the columns ten times as
    # slowly.
    table = np.full((len(index), len(columns)), math.nan)
    for place, (found, values) in enumerate(columns.values()):
        if len(found):
            table[:, place] = values
    return pd.DataFrame(table, index=index, columns=list(columns))


def repeated_in(
    repeated: frozenset[tuple[str, str]], scenario: str, lineup: Lineup = PUBLISHED_SETTINGS
) -> frozenset[str]:
    """Returns the published controllers whose trials in a scenario (or 'all') are all equal.

    repeated: as from `repeats.repeated_cells`.
    """
    wanted = GOAL_SCENARIOS if scenario == ALL_SCENARIOS else (scenario,)
    return frozenset(
        name
        for name, preset in lineup.presets.items()
        if all((lineup.scenario(one), preset) in repeated for one in wanted)
    )
