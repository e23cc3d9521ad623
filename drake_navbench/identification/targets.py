"""The numbers that settings are searched for: cells of tables such as the published ones."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.concordance import EXCLUDED_METRICS
from drake_navbench.analysis.published import PUBLISHED_METRICS
from drake_navbench.analysis.tables import published_table, published_units
from drake_navbench.errors import InputError, nearest_name_hint, one_line

SEPARATOR = "/"
COLUMNS = ("scenario", "metric", "unit")
METRICS = tuple(entry.name for entry in PUBLISHED_METRICS if entry.name not in EXCLUDED_METRICS)


class Cell(NamedTuple):
    """One number of the tables, by where it stands."""

    scenario: str
    metric: str
    controller: str

    def __str__(self) -> str:
        return SEPARATOR.join(self)


class Pair(NamedTuple):
    """A controller in a scenario: what has to be driven for its cells."""

    scenario: str
    controller: str


@dataclass(frozen=True)
class Targets:
    """Tables of numbers.

    values: by cell. printed_units: of the last printed digit, by scenario and metric.
    """

    values: dict[Cell, float]
    printed_units: dict[tuple[str, str], float]

    @cached_property
    def scenarios(self) -> tuple[str, ...]:
        """In the order of the tables."""
        return tuple(dict.fromkeys(cell.scenario for cell in self.values))

    @cached_property
    def controllers(self) -> tuple[str, ...]:
        """In the order of the tables."""
        return tuple(dict.fromkeys(cell.controller for cell in self.values))

    @cached_property
    def scales(self) -> dict[Cell, float]:
        """What the error of a cell is relative to: its size; where that is 0, its row's largest."""
        largest: dict[tuple[str, str], float] = {}
        for cell, value in self.values.items():
            row = cell[:2]
            largest[row] = max(largest.get(row, 0.0), abs(value))
        return {
            cell: abs(value) or largest[cell[:2]] or self.printed_units[cell[:2]]
            for cell, value in self.values.items()
        }

    def only(self, scenarios: Sequence[str], controllers: Sequence[str]) -> Targets:
        """Returns the part for some scenarios and controllers; raises InputError."""
        for option, given, known in (
            ("--scenarios", scenarios, self.scenarios),
            ("--controllers", controllers, self.controllers),
        ):
            for name in given:
                if name not in known:
                    hint = nearest_name_hint(name, known)
                    raise InputError(f"{option} {name}: is not in the tables{hint}")
        return Targets(
            {
                cell: value
                for cell, value in self.values.items()
                if cell.scenario in (scenarios or self.scenarios)
                and cell.controller in (controllers or self.controllers)
            },
            self.printed_units,
        )

    def without(self, patterns: Iterable[str]) -> Targets:
        """Returns the part that no pattern names, see `matching`; raises InputError."""
        out = {cell for pattern in patterns for cell in self.matching(pattern)}
        return Targets({c: v for c, v in self.values.items() if c not in out}, self.printed_units)

    def matching(self, pattern: str) -> list[Cell]:
        """Returns the cells of SCENARIO/METRIC/CONTROLLER, of which each may be *.

        Raises InputError where there is none.
        """
        parts = pattern.split(SEPARATOR)
        if len(parts) != 3:
            raise InputError(
                f"--leave-out {pattern!r}: expected SCENARIO/METRIC/CONTROLLER, each of which may "
                "be *"
            )
        found = [
            c for c in self.values if all(p in ("*", n) for p, n in zip(parts, c, strict=True))
        ]
        if found:
            return found
        for place, name in enumerate(parts):
            known = dict.fromkeys(cell[place] for cell in self.values)
            if name != "*" and name not in known:
                hint = nearest_name_hint(name, known)
                raise InputError(f"--leave-out {pattern!r}: {name!r} is not in the tables{hint}")
        raise InputError(f"--leave-out {pattern!r}: the tables have no such cell")


def published_targets() -> Targets:
    """Returns the published tables, without the metrics that imply no order."""
    return _targets(published_table(), published_units(), "the published tables")


def read_targets(path: Path) -> Targets:
    """Returns the tables of a CSV file: scenario, metric, unit, then one column a controller.

    Empty cells are left out. Raises InputError.
    """
    try:
        text = pd.read_csv(path, dtype=str, keep_default_na=False)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (UnicodeDecodeError, ValueError) as error:
        raise InputError(f"{path}: no table of numbers: {one_line(error)}") from error
    controllers = [str(name) for name in text.columns if name not in COLUMNS]
    if tuple(text.columns[: len(COLUMNS)]) != COLUMNS or not controllers:
        raise InputError(
            f"{path}: expected the columns {', '.join(COLUMNS)} and one a controller, got "
            f"{', '.join(map(str, text.columns))}"
        )
    units = {}
    for row in text.to_dict("records"):
        digits = max(len(row[name].partition(".")[2]) for name in controllers)
        units[row["scenario"], row["metric"]] = 10.0**-digits
        for name in controllers:
            _require_number(row[name], f"{path}: {row['scenario']}/{row['metric']}/{name}")
    numbers = text.copy()
    for name in controllers:
        numbers[name] = pd.to_numeric(text[name])
    return _targets(numbers, units, str(path))


def _require_number(text: str, where: str) -> None:
    if text == "":
        return
    try:
        is_number = math.isfinite(float(text))
    except ValueError:
        is_number = False
    if not is_number:
        raise InputError(f"{where}: expected a finite number, got {text!r}")


def _targets(table: pd.DataFrame, units: dict[tuple[str, str], float], source: str) -> Targets:
    known = {*METRICS, *EXCLUDED_METRICS}
    values = {}
    for row in table.to_dict("records"):
        scenario, metric = str(row["scenario"]), str(row["metric"])
        if metric not in known:
            hint = nearest_name_hint(metric, known)
            raise InputError(f"{source}: metric {metric!r} is not a published one{hint}")
        if metric in EXCLUDED_METRICS:
            continue
        for controller in table.columns[len(COLUMNS) :]:
            if math.isfinite(row[controller]):
                values[Cell(scenario, metric, str(controller))] = float(row[controller])
    return Targets(values, units)


def pairs_of(cells: Iterable[Cell]) -> tuple[Pair, ...]:
    """Returns what has to be driven for some cells."""
    return tuple(dict.fromkeys(Pair(cell.scenario, cell.controller) for cell in cells))
