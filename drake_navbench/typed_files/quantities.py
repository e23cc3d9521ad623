"""Numbers with physical bounds, for the fields of input files.

A value beyond them is a slip of the keyboard or of the unit, and would end in sums without
significant digits, or in grids that no memory holds. The bounds leave room for every robot that
drives on the ground; where less makes sense, the field says so itself, and both hold. SI units,
radians.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BaseModel, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema


@dataclass(frozen=True)
class Within:
    """Bounds of a number, besides those of its field: pydantic would keep only one of two `ge`."""

    low: float
    high: float

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_after_validator_function(self._checked, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        shown = handler(schema)
        if shown.get("minimum", self.low) <= self.low and "exclusiveMinimum" not in shown:
            shown["minimum"] = self.low
        if shown.get("maximum", self.high) >= self.high and "exclusiveMaximum" not in shown:
            shown["maximum"] = self.high
        return shown

    def _checked(self, value: float) -> float:
        if not self.low <= value <= self.high:
            raise ValueError(f"expected {self.low:g} to {self.high:g}")
        return value


# Lengths: positions, extents, ranges.
MAX_LENGTH_M = 1e4
# The least size of a body; a smaller one cannot be told from a gap.
MIN_SIZE_M = 1e-4

Length = Annotated[float, Within(-MAX_LENGTH_M, MAX_LENGTH_M)]
Size = Annotated[float, Within(MIN_SIZE_M, MAX_LENGTH_M)]
# The size of a cell in grids and paths: 1 mm and up.
CellSize = Annotated[float, Within(1e-3, 1e2)]
# Angles: up to 159 turns, either way.
Angle = Annotated[float, Within(-1e3, 1e3)]
# Places on the floor: x, y [m]; and with a heading [rad].
Point = tuple[Length, Length]
Pose = tuple[Length, Length, Angle]
# Durations: a day and some more; where a negative time means "none", -1 is allowed.
Duration = Annotated[float, Within(-1e5, 1e5)]
# Periods between two samples: from 1 ms to an hour.
Period = Annotated[float, Within(1e-3, 3600.0)]
# Rates: down to once a day.
Frequency = Annotated[float, Within(1e-5, 1e3)]
Speed = Annotated[float, Within(-1e2, 1e2)]
AngularSpeed = Annotated[float, Within(-1e2, 1e2)]
Acceleration = Annotated[float, Within(-1e3, 1e3)]
AngularAcceleration = Annotated[float, Within(-1e3, 1e3)]
# Masses: up to 1000 t, and the forces that move them.
Mass = Annotated[float, Within(0.0, 1e6)]
Force = Annotated[float, Within(0.0, 1e7)]
# Plain numbers: weights, costs, shares, factors.
Number = Annotated[float, Within(-1e12, 1e12)]
# Counts of samples, steps, cells, attempts; a negative one may mean any number. The bounds are
# those of an int in C++, whose largest value often means any number, too.
MIN_COUNT, MAX_COUNT = -(2**31), 2**31 - 1
Count = Annotated[int, Within(MIN_COUNT, MAX_COUNT)]


def require_order(model: BaseModel, low: str, high: str, *, may_be_equal: bool = True) -> None:
    """Raises ValueError unless one field of a model is at most, or less than, another."""
    least, most = getattr(model, low), getattr(model, high)
    if least > most or (least == most and not may_be_equal):
        relation = "at most" if may_be_equal else "less than"
        raise ValueError(f"{low}: got {least}, expected {relation} {high} {most}")
