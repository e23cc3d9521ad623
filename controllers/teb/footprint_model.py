"""The `footprint_model` of both TEBs: teb_local_planner's names for the robot's shape, as discs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from drake_navbench.controller import ROBOT_OUTLINE, ControllerParameters
from drake_navbench.kernels.arrays import Array
from drake_navbench.typed_files.quantities import Length
from drake_navbench.typed_files.typed_yaml import parse_yaml, tuples_for_lists

Point = Annotated[tuple[Length, Length], BeforeValidator(tuples_for_lists)]
FootprintType = Literal["from_footprint", "point", "circular", "two_circles", "line", "polygon"]

FEWEST_VERTICES = 3
# Between two discs of a line an obstacle 0.25 m away seems farther by 3 cm at most.
LINE_DISC_SPACING_M = 0.25


def _parsed_vertices(value: Any) -> Any:
    """Returns the list that Nav2 writes as a string, as in "[[0.3, 0.2], [0.3, -0.2]]"."""
    if isinstance(value, str):
        value = parse_yaml(f"vertices: {value}", "footprint_model")["vertices"]
    return tuples_for_lists(value)


class FootprintModel(ControllerParameters):
    """The robot as the optimiser sees it; the feasibility check always uses the true outline."""

    type: FootprintType = Field(
        "point",
        description="Shape of the robot. from_footprint, which teb_local_planner lacks, takes "
        "the robot's own outline.",
    )
    radius: Length = Field(0.2, ge=0.0, description="circular: radius [m].")
    front_offset: Length = Field(
        0.2, description="two_circles: distance of the front circle ahead of the base [m]."
    )
    front_radius: Length = Field(
        0.2, ge=0.0, description="two_circles: radius of the front circle [m]."
    )
    rear_offset: Length = Field(
        0.2, description="two_circles: distance of the rear circle behind the base [m]."
    )
    rear_radius: Length = Field(
        0.2, ge=0.0, description="two_circles: radius of the rear circle [m]."
    )
    line_start: Point | None = Field(None, description="line: start point in the base frame [m].")
    line_end: Point | None = Field(None, description="line: end point in the base frame [m].")
    vertices: Annotated[tuple[Point, ...] | None, BeforeValidator(_parsed_vertices)] = Field(
        None, description="polygon: corners in the base frame [m]."
    )

    @model_validator(mode="after")
    def _check_shape_is_given(self) -> FootprintModel:
        if self.type == "line" and (self.line_start is None or self.line_end is None):
            raise ValueError(
                "line_start and line_end: got none, expected two numbers each for type line"
            )
        if self.type == "polygon" and len(self.vertices or ()) < FEWEST_VERTICES:
            raise ValueError(
                f"vertices: got {len(self.vertices or ())}, expected at least {FEWEST_VERTICES} "
                "for type polygon"
            )
        return self

    def circles(self) -> Array | None:
        """Returns (K, 2) offset along x and radius, m, of a shape made of circles, else None."""
        if self.type == "point":
            return np.array([[0.0, 0.0]])
        if self.type == "circular":
            return np.array([[0.0, self.radius]])
        if self.type == "two_circles":
            return np.array(
                [[self.front_offset, self.front_radius], [-self.rear_offset, self.rear_radius]]
            )
        return None

    def outline(self, footprint: Array) -> Array:
        """Returns (K, 2) m, the vertices of a line or polygon.

        footprint: (V, 2) m, the robot's own outline, for from_footprint.
        """
        if self.type == "line":
            return np.array([self.line_start, self.line_end], dtype=np.float64)
        if self.type == "polygon":
            return np.array(self.vertices, dtype=np.float64)
        return footprint


def footprint_of_original(values: Mapping[str, Any]) -> dict[str, Any]:
    """Returns a given `footprint_model` as teb_local_planner reads it.

    It has no type from_footprint: this becomes a polygon of the same corners. The corners of a
    polygon become one text.
    """
    if values.get("type") == "from_footprint":
        return {"type": "polygon", "vertices": ROBOT_OUTLINE}
    own = dict(values)
    if isinstance(own.get("vertices"), list | tuple):
        own["vertices"] = str([[float(x), float(y)] for x, y in own["vertices"]])
    return own


def footprint_discs(footprint: Array) -> Array:
    """Returns (D, 2) m: offset along x and radius of the discs that stand for a footprint.

    One disc for an outline no longer than wide, else two of half the width that touch front, rear
    and sides (TEB's two_circles). They leave out the corners, by (sqrt(2) - 1) radii; the
    feasibility check with the true outline does not.
    """
    rear, front = float(footprint[:, 0].min()), float(footprint[:, 0].max())
    radius = 0.5 * float(footprint[:, 1].max() - footprint[:, 1].min())
    if front - rear <= 2.0 * radius:
        centre = 0.5 * (front + rear)
        reach = np.hypot(footprint[:, 0] - centre, footprint[:, 1])
        return np.array([[centre, float(reach.max())]])
    return np.array([[rear + radius, radius], [front - radius, radius]])


def line_discs(ends: Array) -> Array:
    """Returns (D, 2) m: discs on the robot's axis that stand for a line, ends (2, 2) m.

    Their radius is how far the line is from the axis; they lie no farther apart than
    LINE_DISC_SPACING_M.
    """
    rear, front = float(ends[:, 0].min()), float(ends[:, 0].max())
    count = math.ceil((front - rear) / LINE_DISC_SPACING_M) + 1
    offsets = np.linspace(rear, front, count)
    return np.column_stack([offsets, np.full(count, float(np.abs(ends[:, 1]).max()))])
