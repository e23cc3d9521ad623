"""Identification from a request to its files: searches, held-out predictions, page."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from drake_navbench import __version__
from drake_navbench.analysis.identification_page import RESULT_NAME, write_identification_page
from drake_navbench.errors import InputError
from drake_navbench.identification.budget import check_budget, drive_design, parse_budget
from drake_navbench.identification.design import design_points, settings_at
from drake_navbench.identification.driving import Driver
from drake_navbench.identification.folds import SEARCH_TRIALS, Fit, Fold, fits_of, folds_of
from drake_navbench.identification.outcome import Identified, outcome, problem, propose
from drake_navbench.identification.prediction import Predictor
from drake_navbench.identification.seeds import agreement, parse_seeds
from drake_navbench.identification.targets import Targets, pairs_of, published_targets, read_targets
from drake_navbench.identification.unknowns import Unknowns, load_unknowns
from drake_navbench.results import only_run_in, write_text

LOGS, PROPOSED = "logs", "proposed"


@dataclass(frozen=True)
class IdentificationRequest:
    """What is asked for; `command` is what the files say they were made by.

    tables, unknowns: files, None for the published and the shipped one. leave_out: patterns of
    cells that nothing is fitted to. budget: of each seed. trials: of each prediction. rounds: of
    settings that each fit has driven for itself. seeds: 0, or 0,1: everything once with each.
    """

    tables: Path | None
    unknowns: Path | None
    scenarios: tuple[str, ...]
    controllers: tuple[str, ...]
    leave_out: tuple[str, ...]
    budget: str
    trials: int
    rounds: int
    seeds: str
    robot: str
    jobs: int
    out: Path
    command: str


def identify(request: IdentificationRequest, tell: Callable[[str], None]) -> None:
    """Searches, predicts and writes; tell: is given each line for the user.

    What is in the folder already is gone on with. Raises InputError.
    """
    seeds = parse_seeds(request.seeds)
    source = published_targets() if request.tables is None else read_targets(request.tables)
    targets = source.only(request.scenarios, request.controllers)
    fit_cells = targets.without(request.leave_out)
    if not fit_cells.values:
        raise InputError("identify: every cell is left out; expected some to fit to")
    unknowns = load_unknowns(request.unknowns, targets, request.robot)
    if not any(block.is_told_by(cell) for block in unknowns.blocks for cell in fit_cells.values):
        raise InputError("identify: nothing to fit: expected an unknown with cells that tell of it")
    check_budget(parse_budget(request.budget), len(folds_of(fit_cells)), request.rounds)
    with only_run_in(request.out):
        driver = Driver(unknowns, request.out / LOGS, jobs=request.jobs)
        runs = []
        for seed in seeds:
            said = partial(_tell_of_seed, tell, seed) if len(seeds) > 1 else tell
            fits = _fits(request, unknowns, fit_cells, driver, seed, said)
            said("Driving what was found ...")
            predictor = Predictor(
                unknowns, targets, fit_cells, driver, trials=request.trials, seed=seed
            )
            found = predictor.predictions(fits)
            runs.append(Identified(seed, unknowns, targets, fit_cells, fits, found))
        _write(request, runs)
        tell(f"{driver.driven_count} trials driven")
        tell(f"Open {write_identification_page(request.out)}")


def _fits(
    request: IdentificationRequest,
    unknowns: Unknowns,
    fit_cells: Targets,
    driver: Driver,
    seed: int,
    tell: Callable[[str], None],
) -> dict[Fold, Fit]:
    """Returns what one seed finds, by what was held out."""
    blocks, pairs = unknowns.blocks, pairs_of(fit_cells.values)

    def drive(first: int, last: int) -> None:
        points = design_points(blocks, last, seed)[first:]
        tried = [(settings_at(blocks, point), pairs) for point in points]
        driver.means_of_each(tried, trials=SEARCH_TRIALS, seed=seed)
        tell(f"{last} settings are driven in {len(pairs)} columns of {len(fit_cells.values)} cells")

    folds = len(folds_of(fit_cells))
    notes = request.out / f"driven_seed{seed}.json"
    count = drive_design(parse_budget(request.budget), folds, request.rounds, drive, notes)
    points = design_points(blocks, count, seed)
    return fits_of(unknowns, fit_cells, driver, points, rounds=request.rounds, seed=seed, tell=tell)


def _tell_of_seed(tell: Callable[[str], None], seed: int, line: str) -> None:
    tell(f"seed {seed}: {line}")


def _write(request: IdentificationRequest, runs: Sequence[Identified]) -> None:
    first = runs[0]
    outcomes = [outcome(run) for run in runs]
    proposed = [
        rows[0]["controller"]
        for rows in zip(*(found["presets"] for found in outcomes), strict=True)
        if all(row["is_better"] for row in rows)
    ]
    propose(first, proposed, request.out / PROPOSED, [f"made by: {request.command}"])
    result = {
        "drake_navbench": __version__,
        "command": request.command,
        "budget": request.budget,
        "seeds": [run.seed for run in runs],
        "trials": request.trials,
        "rounds": request.rounds,
        **problem(first.unknowns, first.targets, first.fit_cells),
        "runs": outcomes,
        "agreement": agreement(runs),
        "proposed": proposed,
    }
    write_text(request.out / RESULT_NAME, json.dumps(result, indent=1) + "\n")
