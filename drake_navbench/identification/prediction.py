"""What settings predict of cells that they were found without."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from drake_navbench.identification.driving import Driver, Metrics, means_of
from drake_navbench.identification.folds import Fit, Fold
from drake_navbench.identification.scores import Score, agreements, ceiling, score
from drake_navbench.identification.targets import Cell, Pair, Targets, pairs_of
from drake_navbench.identification.unknowns import Settings, Unknowns

Numbers = dict[Cell, float]

SHIPPED, FITTED, LEFT_OUT = "shipped", "fitted", "left_out"
SCENARIO, BLIND, CONTROLLER, BOTH = "scenario", "controller_blind", "controller", "both"
# Trials that judge are not those that were searched with.
FURTHER_SEED = 1
TOGETHER = ""
SCENARIO_PLACE, CONTROLLER_PLACE = Cell._fields.index("scenario"), Cell._fields.index("controller")


@dataclass(frozen=True)
class Predictions:
    """Numbers of ours by what they were found without, see the names above.

    others: numbers for the other controllers of a row, where only one of them was predicted.
    halves: of the fitted settings, two runs of their own; fixed: in which nothing is random.
    """

    numbers: Mapping[str, Numbers]
    others: Mapping[str, Numbers]
    halves: tuple[Numbers, Numbers]
    fixed: frozenset[Pair]


@dataclass(frozen=True)
class Predictor:
    """Drives what was found; every kind with the same trials."""

    unknowns: Unknowns
    targets: Targets
    fit_cells: Targets
    driver: Driver
    trials: int
    seed: int

    def predictions(self, fits: Mapping[Fold, Fit]) -> Predictions:
        """Returns everything that is predicted, and what was fitted and is shipped beside it."""
        pairs = pairs_of(self.targets.values)
        whole = fits[Fold()].settings
        rows = self._rows(whole, pairs, 2 * self.trials)
        halves = (_means(rows, 0, self.trials), _means(rows, self.trials, 2 * self.trials))
        fitted = self._known(halves[0])
        numbers = {
            SHIPPED: self._known(_means(self._rows(Settings(), pairs, self.trials), 0)),
            FITTED: {c: v for c, v in fitted.items() if c in self.fit_cells.values},
            LEFT_OUT: {c: v for c, v in fitted.items() if c not in self.fit_cells.values},
        }
        held_out: dict[str, list[tuple[Settings, list[Pair]]]] = {}
        for fold, fit in fits.items():
            own = [pair for pair in pairs if fold.is_held_out(pair)]
            if fold.scenario:
                held_out.setdefault(SCENARIO, []).append((fit.settings, own))
            if fold.controller:
                name = fold.controller
                blind = self.unknowns.file.controllers[name].blind
                instead = replace(fit.settings, presets={name: blind})
                held_out.setdefault(BLIND, []).append((instead, own))
                held_out.setdefault(CONTROLLER, []).append((fit.settings, own))
        for pair in pairs:
            by_scenario, by_controller = Fold(scenario=pair[0]), Fold(controller=pair[1])
            if by_scenario in fits and by_controller in fits:
                mixed = _without_both(pair, fits[by_scenario], fits[by_controller])
                held_out.setdefault(BOTH, []).append((mixed, [pair]))
        for kind, parts in held_out.items():
            numbers[kind] = {}
            for settings, own in parts:
                found = _means(self._rows(settings, own, self.trials), 0)
                numbers[kind] |= self._known(found)
        fixed = frozenset(pair for pair, found in rows.items() if _is_repeated(found))
        others = {kind: fitted for kind in (BLIND, CONTROLLER, LEFT_OUT) if kind in numbers}
        return Predictions({k: v for k, v in numbers.items() if v}, others, halves, fixed)

    def _rows(
        self, settings: Settings, pairs: Sequence[Pair], count: int
    ) -> dict[Pair, list[Metrics]]:
        return self.driver.rows(
            settings, pairs, trials=tuple(range(count)), seed=self.seed + FURTHER_SEED
        )

    def _known(self, numbers: Numbers) -> Numbers:
        """Keeps the cells of the tables; what has no value here is NaN."""
        own = {Pair(cell.scenario, cell.controller) for cell in numbers}
        return {
            cell: numbers.get(cell, math.nan)
            for cell in self.targets.values
            if Pair(cell.scenario, cell.controller) in own
        }


def scores_by(
    found: Predictions, kind: str, targets: Targets, *, place: int | None
) -> dict[str, Score]:
    """Returns the scores of a kind: by scenario (0), by controller (2), or of all (None)."""
    numbers = found.numbers[kind]
    # A column alone has no orderings: those with the other columns of its kind count.
    others = found.others.get(kind, {}) or (numbers if place == CONTROLLER_PLACE else {})
    names = [TOGETHER] if place is None else list(dict.fromkeys(cell[place] for cell in numbers))
    return {
        name: score(cells, numbers, targets, _beside(cells, others))
        for name in names
        for cells in [[cell for cell in numbers if place is None or cell[place] == name]]
    }


def ceilings(found: Predictions, targets: Targets) -> dict[str, Score]:
    """Returns how far two runs of ours agree, by scenario and of all ('')."""

    def part(half: Numbers, scenario: str) -> Numbers:
        return {
            cell: value
            for cell, value in half.items()
            if cell in targets.values and scenario in (TOGETHER, cell.scenario)
        }

    first, second = found.halves
    return {
        name: ceiling(part(first, name), part(second, name), targets, found.fixed)
        for name in (TOGETHER, *targets.scenarios)
    }


def agreements_of(
    found: Predictions, kind: str, targets: Targets
) -> dict[tuple[Cell, Cell], float]:
    """Returns of every ordering that counts for a kind how far it agrees, as `agreements` does."""
    numbers = found.numbers[kind]
    return agreements(numbers, numbers, targets, _beside(numbers, found.others.get(kind, {})))


def _beside(cells: Collection[Cell], others: Mapping[Cell, float]) -> Numbers:
    """Returns numbers of the others, for orderings with what is not among some cells."""
    own = set(cells)
    return {cell: value for cell, value in others.items() if cell not in own}


def _without_both(pair: Pair, by_scenario: Fit, by_controller: Fit) -> Settings:
    """Returns settings for which no cell of a controller in a scenario counted.

    Its own settings and the base are from the other scenarios, the layout is from the other
    controllers.
    """
    layouts = by_controller.settings.layouts
    return Settings(
        base=by_scenario.settings.base,
        layouts={pair.scenario: layouts[pair.scenario]} if pair.scenario in layouts else {},
        own=by_scenario.settings.own,
    )


def _means(rows: Mapping[Pair, list[Metrics]], begin: int, end: int | None = None) -> Numbers:
    return means_of({pair: found[begin:end] for pair, found in rows.items()})


def _is_repeated(rows: Sequence[Metrics]) -> bool:
    return all(
        row[name] == value or (math.isnan(row[name]) and math.isnan(value))
        for row in rows[1:]
        for name, value in rows[0].items()
    )
