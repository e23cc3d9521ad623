"""Parameters of controllers with critics: each critic brings the typed model of its own block.

A parameter file gives each critic a block under its name, `PathAlign: {scale: 32.0}`, as Nav2's
does. The class of the critic, built in or a user's, defines the fields of its block by
`Parameters`.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import ConfigDict, ValidationError, model_validator
from pydantic_core import InitErrorDetails

from drake_navbench.controller import ControllerParameters
from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.typed_files.typed_yaml import (
    faults_within,
    found_fault,
    read_block,
    tuples_for_lists,
    unknown_field,
)


class CriticBlock(ControllerParameters):
    """Base of the parameter models of all critics."""


class ParametersWithCritics(ControllerParameters):
    """Base of the parameter models of controllers with critics.

    A subclass has the field `critics`, with the names in the order of evaluation. After validation
    it has a block for each of them, and for other registered critics whose blocks were given.

    CRITICS: the registry of its critics. CRITIC_BLOCK: the base of their parameter models.
    """

    CRITICS: ClassVar[PluginKind]
    CRITIC_BLOCK: ClassVar[type[CriticBlock]] = CriticBlock

    # The blocks of the critics are fields whose names the file chooses; each is validated below.
    model_config = ConfigDict(extra="allow")

    def critic(self, name: str) -> Any:
        """Returns the block of a critic in `critics`, an instance of the critic's `Parameters`."""
        return (self.model_extra or {})[name]

    @classmethod
    @abstractmethod
    def registered_name(cls, name: str, block: Any = None) -> str:
        """Returns the name of the entry point of the critic that a block of this name is for."""

    @classmethod
    def keys_not_read(cls, values: Mapping[str, Any]) -> list[str]:
        """Returns the blocks of critics that are not listed in `critics`, and other releases'."""
        listed = listed_critics(values)
        unlisted = [key for key in values if key not in cls.model_fields and key not in listed]
        return [*unlisted, *super().keys_not_read(values)]

    @model_validator(mode="before")
    @classmethod
    def _read_critic_blocks(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        fields = {name: tuples_for_lists(data[name]) for name in data if name in cls.model_fields}
        blocks = {name: data[name] for name in data if name not in cls.model_fields}
        listed = listed_critics(data)
        faults: list[InitErrorDetails] = []
        for name in dict.fromkeys([*listed, *blocks]):
            block = blocks.get(name, {})
            if isinstance(block, CriticBlock):
                fields[name] = block
                continue
            if name not in listed and cls.registered_name(name) not in cls.CRITICS:
                known = [*cls.model_fields, *cls.CRITICS.names]
                text = f"unknown field{nearest_name_hint(name, known)}"
                faults.append(unknown_field(text, (name,), block))
                continue
            try:
                model = cls._critic_model(name, block)
                fields[name] = read_block(model, block)
            except InputError as error:
                faults.append(found_fault(str(error), ("critics",), name))
            except ValidationError as error:
                unknown = f"critic {name} has no such parameter"
                faults += faults_within((name,), error, model, unknown)
        if faults:
            raise ValidationError.from_exception_data(cls.__name__, faults)
        return fields

    @classmethod
    def _critic_model(cls, name: str, block: Any) -> type[CriticBlock]:
        """Returns the model of a critic's block; raises InputError where there is none."""
        registered = cls.registered_name(name, block)
        model = cls.CRITICS.load(registered).Parameters
        if not (isinstance(model, type) and issubclass(model, cls.CRITIC_BLOCK)):
            raise InputError(
                f"{cls.CRITICS.noun} {registered!r}: its Parameters are no "
                f"{cls.CRITIC_BLOCK.__name__}, as {cls.CRITICS.guide} describes them"
            )
        return model


def listed_critics(values: Mapping[str, Any]) -> list[str]:
    """Returns the entries of `critics` in unvalidated values that are names."""
    critics = values.get("critics")
    critics = critics if isinstance(critics, list | tuple) else ()
    return [name for name in critics if isinstance(name, str)]
