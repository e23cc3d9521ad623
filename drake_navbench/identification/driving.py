"""Drives settings and tells the numbers of their cells; every trial is driven once only.

Logs lie in a folder by the digest of all that their trial is a function of: who asks for a trial
again gets it from there, also after an interruption.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from drake_navbench.analysis.published import published_metrics
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.errors import InputError
from drake_navbench.identification.layouts import with_layout
from drake_navbench.identification.targets import Cell, Pair
from drake_navbench.identification.unknowns import Settings, Unknowns
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.log import Outcome, TrialLog
from drake_navbench.results import write_whole
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.tuning.pairs import drive_each

Metrics = dict[str, Any]


class Driver:
    """Drives trials, unless their logs are there already.

    folder: of the logs. jobs: parallel workers.
    """

    def __init__(self, unknowns: Unknowns, folder: Path, *, jobs: int) -> None:
        self._unknowns, self._folder, self._jobs = unknowns, folder, jobs
        self._known: dict[str, Metrics] = {}
        self._scenarios: dict[str, Scenario] = {}
        self.driven_count = 0

    def means_of_each(
        self, tried: Sequence[tuple[Settings, Sequence[Pair]]], *, trials: Sequence[int], seed: int
    ) -> list[dict[Cell, float]]:
        """Returns the means over some trials of each settings in its pairs, by cell.

        trials: their numbers. A cell without a value is NaN; those of a scenario that the settings
        cannot be driven in are left out. All are driven together.
        """
        specs = [
            [
                self._specs_if_possible(
                    settings, [p for p in pairs if p.scenario == name], trials, seed
                )
                for name in dict.fromkeys(pair.scenario for pair in pairs)
            ]
            for settings, pairs in tried
        ]
        self._drive_missing([spec for parts in specs for part in parts for _, spec in part])
        return [means_of(self._rows([pair for part in parts for pair in part])) for parts in specs]

    def rows(
        self, settings: Settings, pairs: Sequence[Pair], *, trials: Sequence[int], seed: int
    ) -> dict[Pair, list[Metrics]]:
        """Returns the published metrics of every trial, in the order of the trials.

        Raises InputError where the settings cannot be driven.
        """
        specs = self._specs(settings, pairs, trials, seed)
        self._drive_missing([spec for _, spec in specs])
        return self._rows(specs)

    def _rows(self, specs: Sequence[tuple[Pair, TrialSpec]]) -> dict[Pair, list[Metrics]]:
        rows: dict[Pair, list[Metrics]] = defaultdict(list)
        for pair, spec in specs:
            rows[pair].append(self._known[spec.identity])
        return dict(rows)

    def _specs_if_possible(
        self, settings: Settings, pairs: Sequence[Pair], trials: Sequence[int], seed: int
    ) -> list[tuple[Pair, TrialSpec]]:
        """Returns none for settings that cannot be driven."""
        try:
            return self._specs(settings, pairs, trials, seed)
        except InputError:
            return []

    def _specs(
        self, settings: Settings, pairs: Sequence[Pair], trials: Sequence[int], seed: int
    ) -> list[tuple[Pair, TrialSpec]]:
        by_scenario: dict[str, list[str]] = defaultdict(list)
        for pair in pairs:
            by_scenario[pair.scenario].append(pair.controller)
        return [
            (Pair(scenario, controller), spec)
            for scenario, controllers in by_scenario.items()
            for controller, spec in self._specs_in(scenario, controllers, settings, trials, seed)
        ]

    def _specs_in(
        self,
        name: str,
        controllers: Sequence[str],
        settings: Settings,
        trials: Sequence[int],
        seed: int,
    ) -> list[tuple[str, TrialSpec]]:
        shipped = self._scenario(name)
        layout = with_layout(shipped, settings.layouts.get(name, {}))
        scenario = self._unknowns.scenario(shipped, settings, layout)
        presets = {c: self._unknowns.preset(c, settings) for c in controllers}
        campaign = plan_campaign(
            [scenario],
            list({preset.name: preset for preset in presets.values()}.values()),
            trials=max(trials) + 1,
            seed=seed,
            robot=self._unknowns.robot,
            keeps_costmaps=False,
        )
        return [
            (controller, spec)
            for controller, preset in presets.items()
            for spec in campaign.specs
            if spec.preset.name == preset.name and spec.trial in trials
        ]

    def _scenario(self, name: str) -> Scenario:
        if name not in self._scenarios:
            self._scenarios[name] = load_scenario(name)
        return self._scenarios[name]

    def _drive_missing(self, specs: Sequence[TrialSpec]) -> None:
        missing: dict[str, TrialSpec] = {}
        for spec in specs:
            identity = spec.identity
            if identity in self._known or identity in missing:
                continue
            found = self._read(identity)
            if found is None:
                missing[identity] = spec
            else:
                self._known[identity] = found
        if not missing:
            return
        kept_of = partial(_write_and_measure, folder=self._folder)
        rows = drive_each(list(missing.values()), kept_of, jobs=self._jobs)
        self._known |= dict(zip(missing, rows, strict=True))
        self.driven_count += len(missing)

    def _read(self, identity: str) -> Metrics | None:
        path = _log_path(self._folder, identity)
        if not path.is_file():
            return None
        try:
            return dict(published_metrics(TrialLog.read(path)))
        except InputError:
            # Cut off when it was written, or of another version: it is driven again.
            return None


def means_of(rows: Mapping[Pair, Sequence[Metrics]]) -> dict[Cell, float]:
    """Returns the means over trials that have a value, by cell; NaN for cells without any."""
    values = {
        Cell(pair.scenario, metric, pair.controller): [
            row[metric] for row in found if math.isfinite(row[metric])
        ]
        for pair, found in rows.items()
        for metric in found[0]
    }
    return {cell: float(np.mean(known)) if known else math.nan for cell, known in values.items()}


def _write_and_measure(log: TrialLog, folder: Path) -> Metrics:
    """Keeps a log, without its scans, which no published metric asks for.

    That of a trial that came to no end is not kept: another time it might.
    """
    bare = replace(log, scans=())
    if log.outcome is not Outcome.ERROR:
        write_whole(_log_path(folder, str(log.info["identity"])), bare.write)
    return dict(published_metrics(bare))


def _log_path(folder: Path, identity: str) -> Path:
    return folder / identity[:2] / f"{identity}.parquet"
