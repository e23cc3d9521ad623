"""What is fitted, and on which cells: the searches of a fit, also of one with cells held out."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

from drake_navbench import __version__
from drake_navbench.errors import InputError
from drake_navbench.identification.budget import Budget, Share, shares
from drake_navbench.identification.driving import Driver
from drake_navbench.identification.scores import mean_error
from drake_navbench.identification.search import Evaluation, Searches, best_of
from drake_navbench.identification.targets import Cell, Pair, Targets, pairs_of
from drake_navbench.identification.unknowns import OWN, Block, Settings, Unknowns

# Of a search: the same for all its evaluations, so that they differ by their values alone.
SEARCH_TRIALS = (0,)


class Fold(NamedTuple):
    """Cells that are held out: of a scenario, of a controller, or none (both '')."""

    scenario: str = ""
    controller: str = ""

    def is_held_out(self, cell: Cell | Pair) -> bool:
        """Whether a fit of this fold must not see a cell."""
        return cell.scenario == self.scenario or cell.controller == self.controller


class Searched(NamedTuple):
    """A search that is over."""

    block: Block
    cells: int
    evaluations: list[Evaluation]


@dataclass(frozen=True)
class Fit:
    """Settings that were found without the cells that were held out.

    searched: the searches that found them, those of the last round.
    """

    settings: Settings
    searched: list[Searched]


class Task(NamedTuple):
    """A search that will be done: a block, and the cells that count for it.

    round: that it is done in, from 0 on. fold: whose it is alone; in the first round, in which
    nothing was found before, nobody's.
    """

    block: Block
    cells: tuple[Cell, ...]
    round: int
    fold: Fold


class Signature(NamedTuple):
    """What tells a task from others before anything is driven."""

    kind: str
    name: str
    cells: tuple[Cell, ...]
    round: int
    fold: Fold


def folds_of(targets: Targets) -> list[Fold]:
    """Returns the fold without anything held out, then those that leave one out.

    With one scenario alone, or one controller, nothing would be left to fit to.
    """
    scenarios = targets.scenarios if len(targets.scenarios) > 1 else ()
    controllers = targets.controllers if len(targets.controllers) > 1 else ()
    return [
        Fold(),
        *(Fold(scenario=s) for s in scenarios),
        *(Fold(controller=c) for c in controllers),
    ]


def tasks_of(
    fold: Fold, unknowns: Unknowns, fit_cells: Targets, *, rounds: int = 1
) -> Iterator[Task]:
    """Yields the searches of a fold in their order.

    Layouts come first, each by the cells of its scenario; then the base by all; last each
    controller's own by its column. A controller that is held out has no cell for its own. A further
    round searches all of them again, now beside what the others have come to.
    """
    cells = [cell for cell in fit_cells.values if not fold.is_held_out(cell)]
    for number, block in product(range(rounds), unknowns.blocks):
        # Where a controller is held out, layouts and base are wanted: the others' own settings
        # count for a further round only.
        if fold.controller and block.kind == OWN and number == rounds - 1:
            continue
        chosen = tuple(filter(block.is_told_by, cells))
        if chosen:
            # Of own settings the cells do not tell whose layouts they were found beside.
            is_shared = number == 0 and not (fold.controller and block.kind == OWN)
            yield Task(block, chosen, number, Fold() if is_shared else fold)


def shares_of(
    unknowns: Unknowns, fit_cells: Targets, budget: Budget, *, rounds: int = 1
) -> dict[Signature, Share]:
    """Returns the share of every search; one that two folds have in common counts once.

    Raises InputError where the budget is too small or there is nothing to search.
    """
    weights: dict[Signature, int] = {}
    for fold in folds_of(fit_cells):
        for task in tasks_of(fold, unknowns, fit_cells, rounds=rounds):
            weights[_signature(task)] = len(pairs_of(task.cells))
    if not weights:
        raise InputError("identify: nothing to fit: expected an unknown with cells that tell of it")
    return dict(zip(weights, shares(budget, list(weights.values())), strict=True))


class Fitter:
    """Fits folds; a search that two of them have in common is done once.

    fit_cells: those that may be fitted to at all. shares: as from `shares_of`.
    """

    def __init__(
        self,
        unknowns: Unknowns,
        fit_cells: Targets,
        targets: Targets,
        driver: Driver,
        searches: Searches,
        *,
        shares: Mapping[Signature, Share],
        rounds: int,
        seed: int,
        tell: Callable[[str], None],
    ) -> None:
        self._unknowns, self._fit_cells, self._targets = unknowns, fit_cells, targets
        self._driver, self._searches = driver, searches
        self._shares, self._seed, self._tell = shares, seed, tell
        self._rounds = rounds
        self._done: set[str] = set()

    def fit(self, fold: Fold) -> Fit:
        """Returns what is found without the fold's cells."""
        settings = Settings()
        searched = {}
        tasks = tasks_of(fold, self._unknowns, self._fit_cells, rounds=self._rounds)
        for task in tasks:
            found = self._search(task, settings)
            searched[task.block.kind, task.block.name] = found
            settings = settings.with_block(task.block, best_of(found.evaluations).values)
        return Fit(settings, list(searched.values()))

    def _search(self, task: Task, settings: Settings) -> Searched:
        block, cells = task.block, task.cells
        pairs = pairs_of(cells)

        def errors_of(candidates: Sequence[Mapping[str, Any]]) -> list[float | None]:
            tried = [settings.with_block(block, values) for values in candidates]
            found = self._driver.means_of_each(tried, pairs, trials=SEARCH_TRIALS, seed=self._seed)
            return [
                None if ours is None else mean_error(cells, ours, self._targets) for ours in found
            ]

        share = self._shares[_signature(task)]
        key = self._key(task, settings)
        evaluations = self._searches.run(key, block, share, errors_of)
        if key not in self._done:
            self._done.add(key)
            self._tell(
                f"{len(self._done)} of {len(self._shares)}: {block.title}, {len(cells)} cells of "
                f"{len(pairs)} columns: mean error {best_of(evaluations).error:.3f} after "
                f"{len(evaluations)} evaluations"
            )
        return Searched(block, len(cells), evaluations)

    def _key(self, task: Task, settings: Settings) -> str:
        """Returns what tells a search from all that could go otherwise."""
        pairs = pairs_of(task.cells)
        data = settings.as_data()
        own = {c: v for c, v in data["own"].items() if any(p.controller == c for p in pairs)}
        layouts = {s: v for s, v in data["layouts"].items() if any(p.scenario == s for p in pairs)}
        everything = {
            "drake_navbench": __version__,
            "block": [task.block.kind, task.block.name, *map(str, task.block.dimensions)],
            "cells": [[*cell, self._targets.values[cell]] for cell in task.cells],
            "settings": {"base": data["base"], "layouts": layouts, "own": own},
            "presets": {c: told.preset for c, told in self._unknowns.file.controllers.items()},
            "robot": self._unknowns.robot_name,
            "seed": self._seed,
            "round": task.round,
        }
        text = json.dumps(everything, sort_keys=True)
        return (
            f"{task.block.kind}-{task.block.name}-{hashlib.sha256(text.encode()).hexdigest()[:16]}"
        )


def _signature(task: Task) -> Signature:
    return Signature(task.block.kind, task.block.name, task.cells, task.round, task.fold)
