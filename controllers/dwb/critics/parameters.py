"""The parameters that every critic of DWB has."""

from __future__ import annotations

from pydantic import ConfigDict, Field

from drake_navbench.controllers.critic_parameters import CriticBlock
from drake_navbench.typed_files.quantities import Number


class CriticParameters(CriticBlock):
    """The parameters that every DWB critic has; a critic with more parameters subclasses it."""

    model_config = ConfigDict(
        validate_by_name=True, validate_by_alias=True, serialize_by_alias=True
    )

    critic_class: str | None = Field(
        None,
        alias="class",
        description="Name of the registered critic; null: the name of the block.",
    )
    scale: Number = Field(
        1.0,
        ge=0.0,
        description="Factor on the critic's score in the total; 0 switches the critic off.",
    )
