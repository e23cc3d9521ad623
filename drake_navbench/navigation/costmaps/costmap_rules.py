"""The rules of a costmap that hold for all of its layers, under the names of Nav2's parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar

from pydantic import Field

from drake_navbench.plugins.releases import NEWEST_RELEASE, ReadBy, Release, since
from drake_navbench.typed_files.quantities import Frequency
from drake_navbench.typed_files.typed_yaml import FrozenModel
from drake_navbench.typed_files.usual_values import as_byte, clamped


class CostmapRules(FrozenModel):
    """The rate of a costmap, its reading of maps, and the release whose rules it follows."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "inscribed_obstacle_cost_value": since(Release.LYRICAL),
    }

    nav2_release: Release = Field(
        NEWEST_RELEASE,
        description="Nav2 release whose rules apply: up to Kilted inflation spreads from cell to "
        "cell, and a rolling window is offset by a quarter of a cell.",
    )
    track_unknown_space: bool = Field(
        False, description="Mark cells that no sensor has seen as unknown instead of free."
    )
    update_frequency: Frequency = Field(5.0, description="Updates [Hz].")
    lethal_cost_threshold: Annotated[int, clamped(0, 100)] = Field(
        100, ge=0, le=100, description="Occupancy from which a map cell is lethal [%]."
    )
    trinary_costmap: bool = Field(
        True, description="Read map cells as free or lethal only, without costs between."
    )
    unknown_cost_value: Annotated[int, as_byte()] = Field(
        255, ge=0, le=255, description="Byte that means unknown in a map."
    )
    inscribed_obstacle_cost_value: Annotated[int, as_byte()] = Field(
        99, ge=0, le=255, description="Byte that means inscribed in a map."
    )
    use_maximum: bool = Field(False, description="Let the map keep larger costs of earlier layers.")

    @property
    def is_before_lyrical(self) -> bool:
        """Whether the rules up to Kilted hold."""
        return self.nav2_release < Release.LYRICAL
