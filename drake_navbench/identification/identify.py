"""Identification from a request to its files: searches, held-out predictions, page."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from drake_navbench import __version__
from drake_navbench.analysis.identification_page import RESULT_NAME, write_identification_page
from drake_navbench.errors import InputError
from drake_navbench.identification.budget import parse_budget
from drake_navbench.identification.driving import Driver
from drake_navbench.identification.folds import Fitter, folds_of, shares_of
from drake_navbench.identification.outcome import Identified, as_plain, outcome, propose
from drake_navbench.identification.prediction import Predictor
from drake_navbench.identification.search import SOBOL_POINTS, Searches
from drake_navbench.identification.targets import published_targets, read_targets
from drake_navbench.identification.unknowns import load_unknowns
from drake_navbench.results import only_run_in, write_text
from drake_navbench.tuning.study import import_optuna

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
    import_optuna()
    budget = parse_budget(request.budget)
    source = published_targets() if request.tables is None else read_targets(request.tables)
    targets = source.only(request.scenarios, request.controllers)
    fit_cells = targets.without(request.leave_out)
    if not fit_cells.values:
        raise InputError("identify: every cell is left out; expected some to fit to")
    unknowns = load_unknowns(request.unknowns, targets, request.robot)
    shares = shares_of(unknowns, fit_cells, budget, rounds=request.rounds)
    with only_run_in(request.out):
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
        identified = Identified(unknowns, targets, fit_cells, fits, found)
        _write(request, identified)
        tell(f"{driver.driven_count} trials driven")
        tell(f"Open {write_identification_page(request.out)}")


def _write(request: IdentificationRequest, identified: Identified) -> None:
    remarks = [f"made by: {request.command}"]
    result = {
        "drake_navbench": __version__,
        "command": request.command,
        "budget": request.budget,
        "seed": request.seed,
        "trials": request.trials,
        "rounds": request.rounds,
        "sobol_points": SOBOL_POINTS,
        **outcome(identified),
        "proposed": as_plain(propose(identified, request.out / PROPOSED, remarks)),
    }
    write_text(request.out / RESULT_NAME, json.dumps(result, indent=1) + "\n")
