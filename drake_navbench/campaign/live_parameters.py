"""The parameters that a live trial can change by sliders, and the change of one."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from drake_navbench.controller import ControllerParameters
from drake_navbench.inputs.overrides import merged
from drake_navbench.inputs.presets import Preset
from drake_navbench.typed_files.dotted_names import SEPARATOR, nested

# The end of a field's description with a unit: 'Cruise speed [m/s].'
UNIT = re.compile(r"\[([^\[\]]+)\][.;]?")
FEWEST_STEPS = 100


class Slider(NamedTuple):
    """A slider of one parameter, given by its dotted name."""

    name: str
    unit: str
    low: float
    high: float
    value: float

    @property
    def label(self) -> str:
        """The text beside it."""
        return f"{self.name} [{self.unit}]"

    @property
    def step(self) -> float:
        """The least change: a power of ten, so that values are round."""
        return float(10.0 ** math.floor(math.log10((self.high - self.low) / FEWEST_STEPS)))


class Change(NamedTuple):
    """A moved slider: the time of the first control cycle that drove with the new value, s."""

    time_s: float
    name: str
    value: float

    def as_plain(self) -> dict[str, Any]:
        """Returns the change as the log keeps it."""
        return {"time_s": self.time_s, "name": self.name, "value": self.value}


def sliders_of(preset: Preset) -> tuple[Slider, ...]:
    """Returns a slider for each entry of SLIDERS that the column has as a parameter.

    A range without the present value is widened to contain it. A critic that the column does not
    use has no slider.
    """
    parameters = preset.parameters
    found = []
    for name, (low, high) in type(parameters).SLIDERS.items():
        *blocks, last = name.split(SEPARATOR)
        owner: Any = parameters
        for block in blocks:
            owner = getattr(owner, block, None)
        if owner is None or not _judges(parameters, blocks):
            continue
        value = float(getattr(owner, last))
        text = type(owner).model_fields[last].description or ""
        unit = UNIT.search(text)
        found.append(
            Slider(name, unit[1] if unit else "-", min(low, value), max(high, value), value)
        )
    return tuple(found)


def _judges(parameters: ControllerParameters, blocks: Sequence[str]) -> bool:
    """Whether a block is that of a listed critic, or of no critic."""
    critics = getattr(parameters, "critics", None)
    return critics is None or not blocks or blocks[0] in critics


def with_values(preset: Preset, values: dict[str, float]) -> Preset:
    """Returns a column with other values by dotted name; raises InputError where one is wrong."""
    source = (
        f"{preset.name} with {', '.join(f'{name}={value:g}' for name, value in values.items())}"
    )
    whole = merged(preset.values, nested(values.items(), source))
    return replace(preset, values=whole, source=source).checked()
