"""Sweeps: the same trials at many values of some fields of controllers, robot and scenario."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from drake_navbench.campaign.sweep_fields import ROBOT, SCENARIO, owner_of
from drake_navbench.errors import InputError
from drake_navbench.inputs.overrides import merged
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot, overridden
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.typed_files.assignments import assignment
from drake_navbench.typed_files.dotted_names import nested
from drake_navbench.typed_files.typed_yaml import parse_yaml, validate

# The most points of a sweep; every controller drives each point in every scenario.
MAX_POINTS = 10_000
RANGE = re.compile(r"([^:,]+):([^:,]+)(?::([^:,]+)(:log)?)?")
WHOLE = re.compile(r"[-+]?\d+")
# Enough digits to tell values apart; more would make names too long to read.
SHOWN_DIGITS = 6


@dataclass(frozen=True)
class Axis:
    """A swept field: `column.parameter`, or a field of the robot or the scenario, and its values.

    text: the user's text, for errors. values: the values of a grid, () where only bounds are given.
    bounds: low and high of a range, None for a list. is_log: spaced by a constant factor.
    """

    text: str
    field: str
    values: tuple[Any, ...]
    bounds: tuple[float, float] | None = None
    is_log: bool = False

    def at(self, share: float) -> Any:
        """Returns the value at a share of the axis, from 0 to below 1."""
        if self.bounds is None:
            return self.values[int(share * len(self.values))]
        low, high = self.bounds
        if self.is_log:
            return _rounded(low * (high / low) ** share)
        return _rounded(low + share * (high - low))


class SweptScenario(NamedTuple):
    """A scenario at one point of a sweep, and the columns that drive in it.

    base: the scenario's own name, by which trials are paired over all points. values: the swept
    values by field. columns: each with the name of the column that it is made from, and its swept
    values.
    """

    scenario: Scenario
    base: str
    values: Mapping[str, Any]
    columns: tuple[tuple[Preset, str, Mapping[str, Any]], ...]


def parse_axis(text: str, option: str = "--sweep") -> Axis:
    """Returns the axis for 'field=1,2,3', 'field=low:high:count[:log]' or 'field=low:high'.

    option: the option that it was given to, for errors. Raises InputError.
    """
    field, values = assignment(text, option, "FIELD=VALUE,VALUE,... or FIELD=LOW:HIGH:N")
    source = f"{option} {text!r}"
    if (found := RANGE.fullmatch(values)) is None:
        parsed = parse_yaml(f"values: [{values}]", source)["values"]
        if len({repr(value) for value in parsed}) != len(parsed):
            raise InputError(f"{source}: expected every value once")
        return Axis(text, field, tuple(parsed))
    low, high = (_number(part, source) for part in found.group(1, 2))
    if not low < high:
        raise InputError(f"{source}: expected a range from a lower to a higher number")
    count = found.group(3)
    if count is None:
        return Axis(text, field, (), (low, high))
    if not count.isdecimal() or not 2 <= int(count) <= MAX_POINTS:
        raise InputError(f"{source}: got {count} values, expected a whole number from 2 on")
    if found.group(4) and low <= 0.0:
        raise InputError(f"{source}: a logarithmic range begins above 0, got {low:g}")
    spread = np.geomspace if found.group(4) else np.linspace
    on_grid = [_rounded(value) for value in spread(low, high, int(count))]
    if all(WHOLE.fullmatch(end) for end in found.group(1, 2)):
        # A parameter that counts takes no 5.0.
        on_grid = [int(value) if value.is_integer() else value for value in on_grid]
    return Axis(text, field, tuple(on_grid), (low, high), bool(found.group(4)))


def _number(text: str, source: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"{source}: got {text!r}, expected a number")
    return number


def _rounded(value: float) -> float:
    return float(f"{value:.{SHOWN_DIGITS}g}")


def swept_points(sweeps: Sequence[str], *, samples: int | None, seed: int) -> list[dict[str, Any]]:
    """Returns the points of the options --sweep and --samples; without a sweep one empty point.

    sweeps: texts as for `parse_axis`. samples: as for `points_of`. Raises InputError.
    """
    if samples is not None and not sweeps:
        raise InputError(f"--samples {samples}: expected --sweep as well")
    return points_of([parse_axis(text) for text in sweeps], samples=samples, seed=seed)


def points_of(
    axes: Sequence[Axis], *, samples: int | None = None, seed: int = 0
) -> list[dict[str, Any]]:
    """Returns the points of a sweep, each a value by field.

    They form the grid of all values, or with `samples` a Latin hypercube of so many points: each of
    `samples` equal parts of an axis holds one. Raises InputError.
    """
    _require_every_field_once(axes)
    if samples is not None:
        return _latin_hypercube(axes, samples, seed)
    for axis in axes:
        if not axis.values:
            raise InputError(
                f"--sweep {axis.text!r}: expected the number of values at the end, as in "
                f"{axis.text}:5, or --samples"
            )
    count = math.prod(len(axis.values) for axis in axes)
    if count > MAX_POINTS:
        raise InputError(f"--sweep: got {count} points, expected at most {MAX_POINTS}")
    fields = [axis.field for axis in axes]
    grid = product(*(axis.values for axis in axes))
    return [dict(zip(fields, values, strict=True)) for values in grid]


def _require_every_field_once(axes: Sequence[Axis]) -> None:
    fields = [axis.field for axis in axes]
    for axis in axes:
        if fields.count(axis.field) > 1:
            raise InputError(f"--sweep {axis.text!r}: {axis.field} is given twice")


def _latin_hypercube(axes: Sequence[Axis], samples: int, seed: int) -> list[dict[str, Any]]:
    from scipy.stats import qmc

    drawn = qmc.LatinHypercube(len(axes), rng=np.random.default_rng(seed)).random(samples)
    return [
        {axis.field: axis.at(share) for axis, share in zip(axes, row, strict=True)} for row in drawn
    ]


def expand(
    points: Sequence[Mapping[str, Any]],
    scenarios: Sequence[Scenario],
    presets: Sequence[Preset],
    robot: str | Robot,
) -> Iterator[SweptScenario]:
    """Yields every scenario at every point, with the columns that drive there.

    A field belongs to the column whose name stands before its first dot, else to the robot or to
    the scenario, whichever has it. Points that differ in a column's parameters alone share their
    scenario. Raises InputError for an unknown field, or a value that its field refuses.
    """
    columns = {preset.name: preset for preset in presets}
    owners = {field: owner_of(field, columns) for point in points[:1] for field in point}
    for scenario in scenarios:
        shared: dict[str, tuple[dict[str, Any], list[Mapping[str, Any]]]] = {}
        for point in points:
            own = {field: value for field, value in point.items() if owners[field] not in columns}
            shared.setdefault(_suffix(own), (own, []))[1].append(point)
        for suffix, (values, members) in shared.items():
            changed = _scenario_at(scenario, values, owners, robot)
            changed = changed.model_copy(
                update={"name": f"{scenario.name}@{suffix}" if suffix else scenario.name}
            )
            driven: dict[str, tuple[Preset, str, Mapping[str, Any]]] = {}
            for member in members:
                for name, preset in columns.items():
                    given = {f: value for f, value in member.items() if owners[f] == name}
                    variant = column_at(preset, given)
                    driven.setdefault(variant.name, (variant, name, given))
            yield SweptScenario(changed, scenario.name, values, tuple(driven.values()))


def _scenario_at(
    scenario: Scenario, values: Mapping[str, Any], owners: Mapping[str, str], robot: str | Robot
) -> Scenario:
    """Returns a scenario whose own fields and robot have these values."""
    source = f"--sweep {_suffix(values)}"
    own, overrides = (
        nested(
            ((_without(owner, field), v) for field, v in values.items() if owners[field] == owner),
            source,
        )
        for owner in (SCENARIO, ROBOT)
    )
    if own:
        directory = scenario.directory
        data = merged(scenario.model_dump(mode="json", exclude_unset=True), own)
        scenario = validate(Scenario, data, source).model_copy(update={"directory": directory})
    if overrides:
        overridden(scenario.load_robot(robot), overrides, source)
        laid_over = merged(scenario.robot_overrides, overrides)
        scenario = scenario.model_copy(update={"robot_overrides": laid_over})
    return scenario


def _without(owner: str, field: str) -> str:
    return field.removeprefix(f"{owner}.")


def column_at(preset: Preset, values: Mapping[str, Any], option: str = "--sweep") -> Preset:
    """Returns a column with these values, named as a variant is named in --controllers.

    option: the option that gave them, for errors. Raises InputError where the column cannot take
    them.
    """
    if not values:
        return preset
    assigned = {_without(preset.name, field): value for field, value in values.items()}
    name = ":".join([preset.name, *(f"{key}={_shown(v)}" for key, v in assigned.items())])
    source = f"{option} {_suffix(values)}"
    laid_over = nested(assigned.items(), source)
    for_radius = preset.values_for_radius
    return replace(
        preset,
        name=name,
        source=source,
        values=merged(preset.values, laid_over),
        values_for_radius=None if for_radius is None else merged(for_radius, laid_over),
    ).checked()


def _suffix(values: Mapping[str, Any]) -> str:
    return ",".join(f"{field}={_shown(value)}" for field, value in values.items())


def _shown(value: Any) -> str:
    return f"{value:.{SHOWN_DIGITS}g}" if isinstance(value, float) else str(value)
