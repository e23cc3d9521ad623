"""What is held out in turn, and the fits without it, all from the same trials."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.errors import InputError
from drake_navbench.identification.design import point_of, settings_at
from drake_navbench.identification.driving import Driver
from drake_navbench.identification.emulator import (
    Driven,
    Emulator,
    Places,
    driven_of,
    emulator_of,
    kernels_of,
    places_of,
)
from drake_navbench.identification.gaussian_process import Kernel
from drake_navbench.identification.minimum import least_error_point
from drake_navbench.identification.targets import Cell, Pair, Targets, pairs_of
from drake_navbench.identification.unknowns import Block, Settings, Unknowns

Array = NDArray[np.float64]

# Of a search: the same for all that it drives, so that they differ by their values alone.
SEARCH_TRIALS = (0,)
FIRST_SWEEPS, SWEEPS = 3, 1


class Fold(NamedTuple):
    """Cells that are held out: of a scenario, of a controller, or none (both '')."""

    scenario: str = ""
    controller: str = ""

    def is_held_out(self, cell: Cell | Pair) -> bool:
        """Whether a fit of this fold must not see a cell."""
        return cell.scenario == self.scenario or cell.controller == self.controller


@dataclass(frozen=True)
class Fit:
    """Settings that were found without the cells that were held out.

    blocks: that some of its cells tell of; the settings have values for these alone. cells: that
    counted. error: their mean error, as driven. point: (D,) of all unknowns, where that was.
    emulator: of all that it knows.
    """

    settings: Settings
    blocks: tuple[Block, ...]
    cells: tuple[Cell, ...]
    error: float
    point: Array
    emulator: Emulator


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


class Context(NamedTuple):
    """What the searches have in common; kernels, places: by cell, see the emulator."""

    kernels: Mapping[Cell, Kernel]
    places: Mapping[Cell, Places]
    targets: Targets
    seed: int


class Search:
    """Of one fold: what it may know, and where the error of its cells is least by that.

    cells: that may be fitted to at all. design: what was driven for all folds.
    """

    def __init__(
        self,
        fold: Fold,
        blocks: Sequence[Block],
        cells: Sequence[Cell],
        design: Driven,
        context: Context,
    ) -> None:
        self.fold = fold
        self.cells = tuple(cell for cell in cells if not fold.is_held_out(cell))
        self.pairs = pairs_of(self.cells)
        self.blocks = tuple(b for b in blocks if any(map(b.is_told_by, self.cells)))
        self._all_blocks = tuple(blocks)
        self._context = context
        self._told = {
            (block.kind, block.name): [cell for cell in self.cells if block.is_told_by(cell)]
            for block in blocks
        }
        own = {cell: design.deviations[cell] for cell in self.cells}
        self._driven = Driven(design.points, own)
        self._emulator = emulator_of(self._driven, context.kernels, context.places)
        self._round = 0

    def proposal(self) -> Settings:
        """Returns the settings that it would have driven next."""
        errors = self._emulator.expected_errors(self._driven.points, self.cells)
        point = least_error_point(
            self._errors_in_block,
            self._all_blocks,
            self._driven.points[int(np.argmin(errors))],
            sweeps=SWEEPS if self._round else FIRST_SWEEPS,
            seed=self._context.seed + 1000 * self._round,
        )
        self._round += 1
        return settings_at(self._all_blocks, point)

    def learn(self, settings: Settings, numbers: Mapping[Cell, float]) -> None:
        """Takes note of what its proposal has come to."""
        context = self._context
        point = point_of(self._all_blocks, settings)[None]
        self._driven = self._driven.and_also(
            driven_of(point, [numbers], self.cells, context.targets)
        )
        self._emulator = emulator_of(self._driven, context.kernels, context.places)

    def fit(self) -> Fit:
        """Returns the best that was driven; of unknowns that no cell tells of it has no value."""
        errors = self._driven.errors(self.cells)
        best = int(np.argmin(errors))
        everything = settings_at(self._all_blocks, self._driven.points[best])
        settings = Settings()
        for block in self.blocks:
            settings = settings.with_block(block, everything.of_block(block))
        point, error = self._driven.points[best], float(errors[best])
        return Fit(settings, self.blocks, self.cells, error, point, self._emulator)

    def _errors_in_block(self, points: Array, block: Block) -> Array:
        told = self._told[block.kind, block.name]
        return self._emulator.expected_errors(points, told) if told else np.zeros(len(points))


def fits_of(
    unknowns: Unknowns,
    fit_cells: Targets,
    driver: Driver,
    points: Array,
    *,
    rounds: int,
    seed: int,
    tell: Callable[[str], None],
) -> dict[Fold, Fit]:
    """Returns the fit of every fold.

    points: (N, D) that all folds learn from, see the design; then each has `rounds` settings of its
    own driven, which the others do not hear of: they were chosen by cells that may be held out
    there. tell: is given each line for the user. Raises InputError where a scenario could be driven
    with none of the points.
    """
    blocks, cells = unknowns.blocks, tuple(fit_cells.values)
    places = places_of(blocks, cells)
    settings = [settings_at(blocks, point) for point in points]
    found = driver.means_of_each(
        [(s, pairs_of(cells)) for s in settings], trials=SEARCH_TRIALS, seed=seed
    )
    _require_driven(found, cells)
    driven_points = np.array([point_of(blocks, s) for s in settings])
    design = driven_of(driven_points, found, cells, fit_cells)
    tell(f"{len(points)} settings are driven; learning what each cell hangs on ...")
    context = Context(kernels_of(design, places), places, fit_cells, seed)
    searches = [Search(fold, blocks, cells, design, context) for fold in folds_of(fit_cells)]
    for number in range(rounds):
        proposals = [search.proposal() for search in searches]
        found = driver.means_of_each(
            [(s, search.pairs) for s, search in zip(proposals, searches, strict=True)],
            trials=SEARCH_TRIALS,
            seed=seed,
        )
        for search, proposed, numbers in zip(searches, proposals, found, strict=True):
            search.learn(proposed, numbers)
        whole = searches[0].fit()
        tell(f"round {number + 1} of {rounds}: mean error {whole.error:.3f} of all cells")
    return {search.fold: search.fit() for search in searches}


def _require_driven(found: Sequence[Mapping[Cell, float]], cells: Sequence[Cell]) -> None:
    for cell in cells:
        if not any(cell in numbers for numbers in found):
            raise InputError(
                f"identify: {cell.controller} in {cell.scenario}: none of {len(found)} settings "
                "can be driven; expected ranges of unknowns that the scenario allows"
            )
