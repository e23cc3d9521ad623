"""The parameters of the Rotation Shim, under Nav2's names and with Nav2's defaults.

Those of the primary controller are a block with its `plugin` since Lyrical; before, they stood
beside the shim's own, and `primary_controller` was the plugin alone. Both forms are accepted.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import (
    Field,
    SerializeAsAny,
    ValidationError,
    model_serializer,
    model_validator,
)
from pydantic_core import InitErrorDetails

from drake_navbench.controller import CONTROLLERS, AskedSpeeds, Controller, ControllerParameters
from drake_navbench.controllers.rotation_shim.releases import RULES
from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.plugins.releases import (
    NEWEST_RELEASE,
    RELEASE_FIELD,
    ReadBy,
    Release,
    release_in,
    since,
)
from drake_navbench.typed_files.quantities import (
    Angle,
    AngularAcceleration,
    AngularSpeed,
    Duration,
    Length,
    Number,
)
from drake_navbench.typed_files.typed_yaml import (
    faults_within,
    found_fault,
    read_block,
    tuples_for_lists,
    unknown_field,
)

NAV2_PLUGIN = "nav2_rotation_shim_controller::RotationShimController"
PRIMARY = "primary_controller"
PLUGIN = "plugin"


class PrimaryController(ControllerParameters):
    """The controller that drives once the robot faces the plan, and its parameters.

    Written as Nav2 has it: the parameters stand beside `plugin`.
    """

    plugin: str = Field(
        description="Controller behind the shim: a registered name, or Nav2's plugin type."
    )
    parameters: SerializeAsAny[ControllerParameters]

    @property
    def controller_class(self) -> type[Controller]:
        """The plugin class."""
        return CONTROLLERS.load(self.plugin)

    @model_serializer
    def _beside_plugin(self) -> dict[str, Any]:
        return {PLUGIN: self.plugin, **self.parameters.model_dump()}


class RotationShimParameters(ControllerParameters):
    """Parameters of nav2_rotation_shim_controller.

    Beside an older file's parameters, where all share one block, a parameter that both controllers
    have goes to both. A parameter that a release does not read has no effect in it.
    """

    PLUGIN_NAMES: ClassVar[tuple[str, ...]] = (PRIMARY, f"{PRIMARY}.{PLUGIN}")
    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "closed_loop": ReadBy(frozenset(Release) - {Release.IRON}),
        "max_cost_threshold": ReadBy(frozenset({Release.JAZZY, Release.LYRICAL})),
        "rotate_to_heading_once": since(Release.JAZZY),
        "use_path_orientations": since(Release.JAZZY),
    }

    primary_controller: PrimaryController = Field(
        description="Controller behind the shim: a block with `plugin` and its parameters; or "
        "the plugin alone, with the parameters beside the shim's own."
    )
    nav2_release: Release = Field(NEWEST_RELEASE, description="Nav2 release whose rules apply.")
    angular_dist_threshold: Angle = Field(
        0.785,
        ge=0.0,
        description="Angle to the plan above which the shim turns the robot in place [rad].",
    )
    angular_disengage_threshold: Angle = Field(
        0.785 / 2.0,
        ge=0.0,
        description="Angle to the plan at which a turn in place ends; Humble: 0.785 [rad].",
    )
    forward_sampling_distance: Length = Field(
        0.5, ge=0.0, description="Distance along the plan at which its heading is taken [m]."
    )
    rotate_to_heading_angular_vel: AngularSpeed = Field(
        1.8, ge=0.0, description="Turn rate in place [rad/s]."
    )
    max_angular_accel: AngularAcceleration = Field(
        3.2, gt=0.0, description="Largest angular acceleration of a turn in place [rad/s^2]."
    )
    max_cost_threshold: Number = Field(
        254.0, ge=0.0, description="Cost under the footprint from which a turn is refused."
    )
    simulate_ahead_time: Duration = Field(
        1.0,
        ge=0.0,
        le=1000.0,
        description="Duration for which a turn is checked for collisions [s].",
    )
    rotate_to_goal_heading: bool = Field(
        False, description="Turn in place to the goal's heading once the goal position is reached."
    )
    rotate_to_heading_once: bool = Field(
        False, description="Turn towards a plan only when its goal is new; no effect in Lyrical."
    )
    closed_loop: bool = Field(
        True, description="Ramp a turn from the measured turn rate, not from the last command."
    )
    use_path_orientations: bool = Field(
        False, description="Turn to the orientation of the plan's pose, not towards its position."
    )

    @classmethod
    def primary_model(cls, values: Mapping[str, Any]) -> type[ControllerParameters] | None:
        """Returns the parameter model of the primary controller that `values` name, or None.

        values: nested, or with dotted names. Another shim, which is refused, counts as none.
        """
        block = values.get(PRIMARY)
        given = block.get(PLUGIN) if isinstance(block, Mapping) else block
        name = registered_name(given if given is not None else values.get(f"{PRIMARY}.{PLUGIN}"))
        model = CONTROLLERS.load(name).Parameters if name is not None else None
        return None if model is not None and issubclass(model, cls) else model

    @classmethod
    def is_without_effect(cls, name: str, values: Mapping[str, Any] | None = None) -> bool:
        """See the base class; also for the primary controller's parameters, by their release."""
        model = cls.primary_model(values or {})
        if model is None or name in cls.model_fields:
            return super().is_without_effect(name, values)
        shared = {RELEASE_FIELD: release_in(values)}
        return model.is_without_effect(name.removeprefix(f"{PRIMARY}."), shared)

    @classmethod
    def doubts(cls, values: Mapping[str, Any]) -> Mapping[str, str]:
        """See the base class; also those about the parameters of the primary controller."""
        model, doubts = cls.primary_model(values), dict(super().doubts(values))
        if model is not None:
            names = {name.removeprefix(f"{PRIMARY}."): name for name in values}
            found = model.doubts({short: values[name] for short, name in names.items()})
            doubts |= {names[short]: doubt for short, doubt in found.items()}
        return doubts

    @classmethod
    def for_original(cls, values: Mapping[str, Any], release: str) -> dict[str, Any]:
        """Returns values with the primary controller's in a block since Lyrical, else beside it."""
        not_shared = {RELEASE_FIELD, PRIMARY}
        own = {name: value for name, value in values.items() if name not in not_shared}
        block = values.get(PRIMARY, {})
        block = dict(block) if isinstance(block, Mapping) else {PLUGIN: block}
        name = registered_name(block.get(PLUGIN))
        if name is not None:
            primary = CONTROLLERS.load(name)
            block = {
                **primary.Parameters.for_original(block, release),
                PLUGIN: primary.nav2_plugin or name,
            }
        if release == NEWEST_RELEASE:
            return own | {PRIMARY: block}
        plugin = block.pop(PLUGIN, None)
        return {**block, **own, PRIMARY: plugin}

    @classmethod
    def keys_not_read(cls, values: Mapping[str, Any]) -> list[str]:
        """See the base class; also the primary controller's, by its own rules."""
        release = release_in(values)
        of_shim = [name for name in values if not cls.is_read(name, release)]
        model = cls.primary_model(values)
        if model is None:
            return of_shim
        block = values[PRIMARY]
        shared = {RELEASE_FIELD: values[RELEASE_FIELD]} if RELEASE_FIELD in values else {}
        if isinstance(block, Mapping):
            own = shared | {name: value for name, value in block.items() if name != PLUGIN}
            return of_shim + [f"{PRIMARY}.{name}" for name in model.keys_not_read(own)]
        beside = shared | {n: v for n, v in values.items() if n not in cls.model_fields}
        return of_shim + model.keys_not_read(beside)

    @classmethod
    def path_handler_fields(cls, given: Mapping[str, Any]) -> dict[str, str]:
        """Returns the path handler's fields by the names of the primary controller's parameters.

        Earlier releases set them there.
        """
        model = cls.primary_model(given)
        if model is None:
            return {}
        of_primary = {name.removeprefix(f"{PRIMARY}."): name for name in given}
        values = {name: given[place] for name, place in of_primary.items()}
        return {of_primary[n]: f for n, f in model.path_handler_fields(values).items()}

    def as_read(self) -> Self:
        """See the base class; also applies to the primary controller."""
        primary = self.primary_controller
        read = primary.model_copy(update={"parameters": primary.parameters.as_read()})
        return super().as_read().model_copy(update={PRIMARY: read})

    def files_read(self) -> Mapping[str, Path]:
        """Returns the files that the primary controller reads or runs."""
        return self.primary_controller.parameters.files_read()

    def asked_speeds(self) -> AskedSpeeds:
        """Returns the primary controller's speeds, and the turn rate of the shim."""
        speeds = self.primary_controller.parameters.asked_speeds()
        if speeds.max_angular_radps is None:
            return speeds
        turning = max(speeds.max_angular_radps, self.rotate_to_heading_angular_vel)
        return speeds._replace(max_angular_radps=turning)

    @model_validator(mode="before")
    @classmethod
    def _read_primary(cls, data: Any) -> Any:
        if not isinstance(data, Mapping) or isinstance(data.get(PRIMARY), PrimaryController):
            return data
        own = {name: tuples_for_lists(data[name]) for name in data if name in cls.model_fields}
        rules = RULES[release_in(own)]
        own.setdefault("angular_disengage_threshold", rules.disengage_threshold)
        block = data.get(PRIMARY)
        if isinstance(block, Mapping):
            values = {name: value for name, value in block.items() if name != PLUGIN}
            place: tuple[str, ...] = (PRIMARY,)
            plugin = block.get(PLUGIN)
            unknown = {name: data[name] for name in data if name not in cls.model_fields}
        else:
            values = {name: value for name, value in data.items() if name != PRIMARY}
            place, plugin, unknown = (), block, {}
        if faults := [_unknown(name, (name,), value, cls) for name, value in unknown.items()]:
            raise ValidationError.from_exception_data(cls.__name__, faults)
        own[PRIMARY] = _primary(
            plugin,
            values,
            place,
            shared=() if place else cls.model_fields,
            release=own.get(RELEASE_FIELD),
        )
        return own


def registered_name(plugin: Any) -> str | None:
    """Returns the name of the controller that a name or a plugin type of Nav2 stands for."""
    if not isinstance(plugin, str):
        return None
    if plugin in CONTROLLERS:
        return plugin
    for name, loaded in CONTROLLERS.load_all().items():
        if loaded.nav2_plugin == plugin:
            return name
    return None


def _primary(
    plugin: Any,
    values: Mapping[str, Any],
    place: tuple[str, ...],
    *,
    shared: Collection[str],
    release: Any,
) -> PrimaryController:
    """Returns the primary controller; raises ValidationError with places in the shim's block.

    shared: names of the shim's own parameters among `values`, which the primary controller need not
    have. release: the shim's where it was given, for a primary controller that follows it.
    """
    where = (PRIMARY, PLUGIN) if place else (PRIMARY,)
    name = registered_name(plugin)
    if name is None:
        hint = nearest_name_hint(str(plugin), CONTROLLERS.names)
        text = f"expected a controller's name or plugin type{hint}"
        raise ValidationError.from_exception_data(PRIMARY, [found_fault(text, where, plugin)])
    try:
        controller = CONTROLLERS.load(name)
    except InputError as error:
        faults = [found_fault(str(error), where, plugin)]
        raise ValidationError.from_exception_data(PRIMARY, faults) from error
    if issubclass(controller.Parameters, RotationShimParameters):
        faults = [found_fault("expected a controller other than a rotation shim", where, plugin)]
        raise ValidationError.from_exception_data(PRIMARY, faults)
    model = controller.Parameters
    known = {field for name, info in model.model_fields.items() for field in _names(name, info)}
    offered = {n: v for n, v in values.items() if n not in shared or n in known}
    if release in set(Release) and RELEASE_FIELD in known:
        offered.setdefault(RELEASE_FIELD, release)
    try:
        parameters = read_block(model, offered)
    except ValidationError as error:
        faults = faults_within(place, error, model)
        raise ValidationError.from_exception_data(PRIMARY, faults) from error
    return PrimaryController.model_construct(plugin=name, parameters=parameters)


def _names(name: str, info: Any) -> list[str]:
    """Returns all names by which a field can be given."""
    return [name, *getattr(info.validation_alias, "choices", ())]


def _unknown(
    name: str, location: tuple[int | str, ...], found: Any, model: type[ControllerParameters]
) -> InitErrorDetails:
    text = f"unknown field{nearest_name_hint(name, model.model_fields)}"
    return unknown_field(text, location, found)
