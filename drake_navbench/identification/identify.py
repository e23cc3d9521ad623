"""Identification from a request to its files: searches, held-out predictions, page."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from drake_navbench import __version__
from drake_navbench.analysis.identification_page import RESULT_NAME, write_identification_page
from drake_navbench.errors import InputError
from drake_navbench.identification.budget import parse_budget
from drake_navbench.identification.driving import Driver
from drake_navbench.identification.folds import Fit, Fitter, Fold, folds_of, shares_of
from drake_navbench.identification.prediction import (
    BOTH,
    SHIPPED,
    Predictions,
    Predictor,
    ceilings,
    scores_by,
)
from drake_navbench.identification.profile import Profile, profiles
from drake_navbench.identification.scores import Score, score
from drake_navbench.identification.search import SOBOL_POINTS, Searches
from drake_navbench.identification.targets import Targets, published_targets, read_targets
from drake_navbench.identification.unknowns import Block, Unknowns, load_unknowns
from drake_navbench.results import file_name, write_text
from drake_navbench.tuning.outputs import write_preset_file

LOGS, PROPOSED = "logs", "proposed"


@dataclass(frozen=True)
class IdentificationRequest:
    """What is asked for; `command` is what the files say they were made by.

    tables, unknowns: files, None for the published and the shipped one. leave_out: patterns of
    cells that nothing is fitted to. trials: of each prediction. rounds: in which all is searched.
    """

    tables: Path | None
    unknowns: Path | None
    scenarios: tuple[str, ...]
    controllers: tuple[str, ...]
    leave_out: tuple[str, ...]
    budget: str
    trials: int
    rounds: int
    seed: int
    robot: str
    jobs: int
    out: Path
    command: str


def identify(request: IdentificationRequest, tell: Callable[[str], None]) -> None:
    """Searches, predicts and writes; tell: is given each line for the user.

    What is in the folder already is gone on with. Raises InputError.
    """
    budget = parse_budget(request.budget)
    source = published_targets() if request.tables is None else read_targets(request.tables)
    targets = source.only(request.scenarios, request.controllers)
    fit_cells = targets.without(request.leave_out)
    if not fit_cells.values:
        raise InputError("identify: every cell is left out; expected some to fit to")
    unknowns = load_unknowns(request.unknowns, targets, request.robot)
    shares = shares_of(unknowns, fit_cells, budget, rounds=request.rounds)
    driver = Driver(unknowns, request.out / LOGS, jobs=request.jobs)
    fitter = Fitter(
        unknowns,
        fit_cells,
        targets,
        driver,
        Searches(request.out, request.seed),
        shares=shares,
        rounds=request.rounds,
        seed=request.seed,
        tell=tell,
    )
    fits = {fold: fitter.fit(fold) for fold in folds_of(fit_cells)}
    tell("Driving what was found ...")
    predictor = Predictor(
        unknowns, targets, fit_cells, driver, trials=request.trials, seed=request.seed
    )
    found = predictor.predictions(fits)
    result = _result(request, unknowns, targets, fit_cells, fits, found)
    result["proposed"] = _propose(request, unknowns, targets, fits[Fold()], found)
    write_text(request.out / RESULT_NAME, json.dumps(_plain(result), indent=1) + "\n")
    tell(f"{driver.driven_count} trials driven")
    tell(f"Open {write_identification_page(request.out)}")


def _result(
    request: IdentificationRequest,
    unknowns: Unknowns,
    targets: Targets,
    fit_cells: Targets,
    fits: Mapping[Fold, Fit],
    found: Predictions,
) -> dict[str, Any]:
    whole = fits[Fold()]
    return {
        "drake_navbench": __version__,
        "command": request.command,
        "budget": request.budget,
        "seed": request.seed,
        "trials": request.trials,
        "rounds": request.rounds,
        "sobol_points": SOBOL_POINTS,
        "scenarios": list(targets.scenarios),
        "controllers": {c: unknowns.file.controllers[c].preset for c in targets.controllers},
        "blind": {c: unknowns.file.controllers[c].blind for c in targets.controllers},
        "cells": len(targets.values),
        "fitted_cells": len(fit_cells.values),
        "evaluations": sum(len(s.evaluations) for fit in fits.values() for s in fit.searched),
        "blocks": [
            _block(
                searched.block,
                profiles(searched.block.dimensions, searched.evaluations),
                [
                    values
                    for fold, fit in fits.items()
                    if fold != Fold() and (values := fit.settings.of_block(searched.block))
                ],
                len(searched.evaluations),
            )
            for searched in whole.searched
        ],
        "scores": {
            kind: {
                "together": _score_data(scores_by(found, kind, targets, place=None)[""]),
                "scenarios": _scores_data(scores_by(found, kind, targets, place=0)),
                "controllers": _scores_data(scores_by(found, kind, targets, place=2)),
            }
            for kind in found.numbers
        },
        "ceilings": _scores_data(ceilings(found, targets)),
        "table": [
            {
                "scenario": cell.scenario,
                "metric": cell.metric,
                "controller": cell.controller,
                "target": value,
                "is_fitted": cell in fit_cells.values,
                "ours": {
                    kind: numbers[cell]
                    for kind, numbers in found.numbers.items()
                    if cell in numbers
                },
            }
            for cell, value in targets.values.items()
        ],
        "settings": {
            f"{fold.scenario}{fold.controller}": fit.settings.as_data()
            for fold, fit in fits.items()
        },
    }


def _block(
    block: Block, found: list[Profile], in_folds: list[Mapping[str, Any]], evaluations: int
) -> dict[str, Any]:
    searched = {d.name: d for d in block.dimensions}
    return {
        "title": block.title,
        "kind": block.kind,
        "evaluations": evaluations,
        "values": [
            {
                "name": profile.name,
                "shipped": block.shipped[profile.name],
                "found": profile.found,
                "low": profile.low,
                "high": profile.high,
                "as_good": list(profile.as_good),
                "searched": list(searched[profile.name].choices)
                or [searched[profile.name].low, searched[profile.name].high],
                "is_choice": bool(searched[profile.name].choices),
                "is_told": profile.is_told,
                "in_folds": [values[profile.name] for values in in_folds],
            }
            for profile in found
        ],
    }


def _propose(
    request: IdentificationRequest,
    unknowns: Unknowns,
    targets: Targets,
    whole: Fit,
    found: Predictions,
) -> list[dict[str, Any]]:
    """Compares the shipped presets with what was found, on cells that the latter was not fitted to.

    Where it is the better one, its preset is written beside the result; nothing that ships changes.
    """
    for path in (request.out / PROPOSED).glob("*_identified.yaml"):
        path.unlink()
    rows = []
    for controller in targets.controllers:
        cells = [c for c in found.numbers.get(BOTH, {}) if c.controller == controller]
        if not cells or controller not in whole.settings.own:
            continue
        ours = score(cells, found.numbers[BOTH], targets)
        shipped = score(cells, found.numbers[SHIPPED], targets)
        is_better = (
            ours.mean_error < shipped.mean_error and ours.median_error <= shipped.median_error
        )
        preset = unknowns.preset(controller, whole.settings)
        name = f"{unknowns.file.controllers[controller].preset}_identified"
        if is_better:
            column = replace(preset, name=name, description=f"{controller}, identified")
            remarks = [f"made by: {request.command}"]
            write_preset_file(column, request.out / PROPOSED / f"{file_name(name)}.yaml", remarks)
        rows.append(
            {
                "controller": controller,
                "preset": unknowns.file.controllers[controller].preset,
                "identified": _score_data(ours),
                "shipped": _score_data(shipped),
                "is_better": is_better,
                "values": dict(whole.settings.own[controller]),
            }
        )
    return rows


def _scores_data(scores: Mapping[str, Score]) -> dict[str, Any]:
    return {name or "together": _score_data(found) for name, found in scores.items()}


def _score_data(found: Score) -> dict[str, Any]:
    return {**found._asdict(), "concordance": found.concordance}


def _plain(value: Any) -> Any:
    """Returns what JSON can hold: no value where there is none."""
    if isinstance(value, Mapping):
        return {name: _plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
