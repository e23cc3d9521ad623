"""The source of a scenario's plan: the global planner, or the file itself."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from drake_navbench.navigation.smoother_settings import SmootherSettings
from drake_navbench.typed_files.quantities import (
    CellSize,
    Length,
    Point,
    Size,
)
from drake_navbench.typed_files.typed_yaml import FrozenModel

# A smaller turn is none, deg.
LEAST_ARC_DEG = 1e-6


class Straight(FrozenModel):
    """A straight piece of a given plan."""

    straight_m: Length = Field(gt=0.0, description="Length of the straight piece [m].")


class Arc(FrozenModel):
    """A circular piece of a given plan."""

    arc_deg: float = Field(
        ge=-360.0, le=360.0, description="Turn of the arc, positive to the left [deg]."
    )
    radius_m: Size = Field(description="Radius of the arc [m].")

    @field_validator("arc_deg")
    @classmethod
    def _turns(cls, value: float) -> float:
        if abs(value) < LEAST_ARC_DEG:
            raise ValueError("expected a turn; a straight piece is straight_m")
        return value


class GridPlan(FrozenModel):
    """The plan comes from the global planner, whose settings are the robot's."""

    type: Literal["planner"]
    smoother: SmootherSettings | None = Field(
        None, description="Smoother of the planner's path; null: none."
    )

    @field_validator("smoother", mode="before")
    @classmethod
    def _accept_name(cls, value: Any) -> Any:
        """Accepts a smoother's plugin type, or 'none', in place of a block."""
        if value == "none":
            return None
        return {"plugin": value} if isinstance(value, str) else value


class ElementsPlan(FrozenModel):
    """The plan is given as straights and arcs from the start pose."""

    type: Literal["elements"]
    elements: list[Straight | Arc] = Field(
        min_length=1, description="Pieces of the plan, in order."
    )
    spacing_m: CellSize = Field(0.05, description="Distance between plan poses [m].")


class PolylinePlan(FrozenModel):
    """The plan is given as corner points; the first should be the start."""

    type: Literal["polyline"]
    points: list[Point] = Field(min_length=2, description="Corners of the plan [m].")
    spacing_m: CellSize = Field(0.05, description="Distance between plan poses [m].")

    @field_validator("points")
    @classmethod
    def _leads_somewhere(cls, value: list[Point]) -> list[Point]:
        if len(set(value)) < 2:
            raise ValueError("expected two different corners or more")
        return value


Plan = Annotated[GridPlan | ElementsPlan | PolylinePlan, Field(discriminator="type")]
