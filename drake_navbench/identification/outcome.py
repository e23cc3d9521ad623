"""What an identification comes to, as plain values: fitted values, scores, every cell, presets."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from drake_navbench.analysis.statistics import mean_interval
from drake_navbench.identification.folds import Fit, Fold
from drake_navbench.identification.prediction import (
    BOTH,
    CONTROLLER_PLACE,
    SCENARIO_PLACE,
    SHIPPED,
    Predictions,
    ceilings,
    scores_by,
)
from drake_navbench.identification.profile import Profile, profiles
from drake_navbench.identification.scores import Score, error_of, score
from drake_navbench.identification.targets import Cell, Targets
from drake_navbench.identification.unknowns import Block, Unknowns
from drake_navbench.results import file_name
from drake_navbench.tuning.outputs import write_preset_file
from drake_navbench.tuning.search_space import Dimension

Data = dict[str, Any]


@dataclass(frozen=True)
class Identified:
    """Everything that was found with one seed.

    fit_cells: of the targets those that may be fitted to. fits: by what was held out.
    """

    seed: int
    unknowns: Unknowns
    targets: Targets
    fit_cells: Targets
    fits: Mapping[Fold, Fit]
    found: Predictions

    @property
    def whole(self) -> Fit:
        """The fit without anything held out."""
        return self.fits[Fold()]

    @cached_property
    def profiles(self) -> list[list[Profile]]:
        """What is known of every value of every block of the whole fit, in their order."""
        blocks = self.unknowns.blocks
        return [profiles(blocks, block, self.whole) for block in self.whole.blocks]


def problem(unknowns: Unknowns, targets: Targets, fit_cells: Targets) -> Data:
    """Returns what is the same for every seed, as JSON can hold it."""
    told = unknowns.file.controllers
    return {
        "scenarios": list(targets.scenarios),
        "controllers": {name: told[name].preset for name in targets.controllers},
        "blind": {name: told[name].blind for name in targets.controllers},
        "cells": len(targets.values),
        "fitted_cells": len(fit_cells.values),
    }


def outcome(identified: Identified) -> Data:
    """Returns what a seed comes to, as JSON can hold it."""
    targets, fits = identified.targets, identified.fits
    data: Data = as_plain(
        {
            "seed": identified.seed,
            "driven_settings": len(identified.whole.emulator.driven.points),
            "mean_error": identified.whole.error,
            "blocks": [
                _block(block, known, fits)
                for block, known in zip(identified.whole.blocks, identified.profiles, strict=True)
            ],
            "scores": {kind: _scores(identified, kind) for kind in identified.found.numbers},
            "ceilings": _by_name(ceilings(identified.found, targets)),
            "table": [_cell(identified, cell) for cell in targets.values],
            "settings": {
                f"{fold.scenario}{fold.controller}": fit.settings.as_data()
                for fold, fit in fits.items()
            },
            "presets": _judged_presets(identified),
        }
    )
    return data


def propose(
    identified: Identified, controllers: Sequence[str], folder: Path, remarks: list[str]
) -> None:
    """Writes what was found for some controllers as presets; nothing that ships changes."""
    for path in folder.glob("*_identified.yaml"):
        path.unlink()
    for controller in controllers:
        preset = identified.unknowns.file.controllers[controller].preset
        name = f"{file_name(preset)}_identified"
        column = replace(
            identified.unknowns.preset(controller, identified.whole.settings),
            name=name,
            description=f"{preset} with what the published tables tell",
        )
        write_preset_file(column, folder / f"{name}.yaml", remarks)


def _judged_presets(identified: Identified) -> list[Data]:
    """Compares the shipped presets with what was found, on cells that the latter was not fitted to.

    That is better where it is shown to be, over the cells as a sample.
    """
    found, targets = identified.found, identified.targets
    settings = identified.whole.settings
    rows = []
    for controller in targets.controllers:
        cells = [cell for cell in found.numbers.get(BOTH, {}) if cell.controller == controller]
        if not cells or controller not in settings.own:
            continue
        ours = score(cells, found.numbers[BOTH], targets)
        shipped = score(cells, found.numbers[SHIPPED], targets)
        both, as_shipped = found.numbers[BOTH], found.numbers[SHIPPED]
        differences = [
            error_of(cell, both[cell], targets) - error_of(cell, as_shipped[cell], targets)
            for cell in cells
        ]
        difference = mean_interval(np.array(differences))
        rows.append(
            {
                "controller": controller,
                "preset": identified.unknowns.file.controllers[controller].preset,
                "identified": _score(ours),
                "shipped": _score(shipped),
                "difference": list(difference),
                "is_better": difference.high < 0.0,
                "values": dict(settings.own[controller]),
            }
        )
    return rows


def as_plain(value: Any) -> Any:
    """Returns what JSON can hold: None for a number that is not there."""
    if isinstance(value, Mapping):
        return {name: as_plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [as_plain(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _block(block: Block, known: list[Profile], fits: Mapping[Fold, Fit]) -> Data:
    in_folds = [
        values
        for fold, fit in fits.items()
        if fold != Fold() and (values := fit.settings.of_block(block))
    ]
    return {
        "title": block.title,
        "kind": block.kind,
        "values": [
            _value(block, dimension, profile, in_folds)
            for dimension, profile in zip(block.dimensions, known, strict=True)
        ],
    }


def _value(
    block: Block, dimension: Dimension, profile: Profile, in_folds: list[Mapping[str, Any]]
) -> Data:
    return {
        "name": profile.name,
        "shipped": block.shipped[profile.name],
        "found": profile.found,
        "low": profile.low,
        "high": profile.high,
        "as_good": list(profile.as_good),
        "searched": list(dimension.choices) or [dimension.low, dimension.high],
        "is_choice": bool(dimension.choices),
        "is_told": profile.is_told,
        "in_folds": [values[profile.name] for values in in_folds],
    }


def _cell(identified: Identified, cell: Cell) -> Data:
    return {
        **cell._asdict(),
        "target": identified.targets.values[cell],
        "is_fitted": cell in identified.fit_cells.values,
        "ours": {
            kind: numbers[cell]
            for kind, numbers in identified.found.numbers.items()
            if cell in numbers
        },
    }


def _scores(identified: Identified, kind: str) -> Data:
    found, targets = identified.found, identified.targets
    return {
        "together": _score(scores_by(found, kind, targets, place=None)[""]),
        "scenarios": _by_name(scores_by(found, kind, targets, place=SCENARIO_PLACE)),
        "controllers": _by_name(scores_by(found, kind, targets, place=CONTROLLER_PLACE)),
    }


def _by_name(scores: Mapping[str, Score]) -> Data:
    return {name or "together": _score(found) for name, found in scores.items()}


def _score(found: Score) -> Data:
    return {**found._asdict(), "concordance": found.concordance}
