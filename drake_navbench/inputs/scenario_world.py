"""The description of a world in a scenario file, and of the floors of a building."""

from __future__ import annotations

from typing import Any

from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    field_validator,
    model_serializer,
    model_validator,
)

from drake_navbench.inputs.moving_obstacles import MAX_MOVING, MovingObstacle
from drake_navbench.inputs.people import People
from drake_navbench.inputs.world import Obstacle
from drake_navbench.navigation.costmaps.filter_masks import FilterDescription
from drake_navbench.typed_files.quantities import Point
from drake_navbench.typed_files.typed_yaml import FrozenModel


class WorldDescription(FrozenModel):
    """The contents of a world: the occupied cells of a map, shapes, and moving bodies."""

    map: str | None = Field(
        None, description="Path of the map file (Nav2's map_server) from the scenario's folder."
    )
    map_stands: bool = Field(
        True,
        description="Whether the occupied cells of the map stand in the world; false: the "
        "obstacles are the world, and the map is what the robot knows of it.",
    )
    obstacles: list[Obstacle] = Field(default_factory=list, description="Standing obstacles.")
    moving_obstacles: list[MovingObstacle] = Field(
        default_factory=list,
        max_length=MAX_MOVING,
        description="Objects that move along timed waypoints, whatever the robot does; no map "
        "shows them.",
    )
    people: People | None = Field(
        None, description="People, who walk by a model or as they were recorded."
    )

    @model_serializer(mode="wrap")
    def _as_plain(self, plain: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leaves out moving obstacles and people where there are none, and a true `map_stands`."""
        values: dict[str, Any] = plain(self)
        if self.map_stands:
            values.pop("map_stands", None)
        if not self.moving_obstacles:
            values.pop("moving_obstacles", None)
        if self.people is None:
            values.pop("people", None)
        return values


def require_one_of_each(filters: list[FilterDescription]) -> list[FilterDescription]:
    """Returns the filters; raises ValueError for two speed_filters or two binary_filters."""
    names = [entry.filter_name for entry in filters]
    for name in ("speed_filter", "binary_filter"):
        if names.count(name) > 1:
            raise ValueError(
                f"expected one {name} at most, found {names.count(name)}; give it several areas"
            )
    return filters


class Floor(FrozenModel):
    """One floor of a building, or one of the maps that a building is split into."""

    name: str = Field(min_length=1, description="Name of the floor in the mission and the lifts.")
    world: WorldDescription = Field(
        default_factory=WorldDescription, description="World of the floor, in its map's frame."
    )
    filters: list[FilterDescription] = Field(
        default_factory=list,
        description="Areas of keepout, of limited speed or with a binary state.",
    )
    origin: Point | None = Field(
        None,
        description="Position of the map's frame in the building [m], for maps that meet on "
        "one storey; null: a storey of its own.",
    )
    storey: str = Field(
        "",
        description="Name of the storey that the floor belongs to, where a storey is split "
        "into several maps.",
    )

    @model_validator(mode="after")
    def _check_storey(self) -> Floor:
        if self.storey and self.origin is None:
            raise ValueError(
                f"storey: expected an origin as well, where in {self.storey} its map lies"
            )
        return self

    @field_validator("filters")
    @classmethod
    def _check_one_of_each(cls, filters: list[FilterDescription]) -> list[FilterDescription]:
        return require_one_of_each(filters)
