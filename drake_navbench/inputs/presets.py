"""Presets: a controller with a parameter file, each a column of the tables."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import yaml
from pydantic import AliasChoices, Field

from drake_navbench.controller import Controller, ControllerParameters, Registry
from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.inputs.robot import Robot, merged
from drake_navbench.typed_yaml import FrozenModel, parse_yaml, read_yaml, validate

# The columns of the default benchmark; the others run when named.
DEFAULT_PRESETS = ("dwb", "rpp", "teb", "mppi", "mppi_nav2")
NAV2_SERVER = "controller_server"


class PresetFile(FrozenModel):
    """The contents of a preset file."""

    controller: str = Field(description="Name of a registered controller.")
    description: str = Field(min_length=1, description="One line for --list.")
    parameters: dict[str, Any] = Field(
        default_factory=dict, description="Parameters that differ from the controller's defaults."
    )
    parameters_for_radius: dict[str, Any] = Field(
        default_factory=dict,
        description="Parameters that replace those for a robot given by robot_radius, such as a "
        "critic's consider_footprint, which Nav2 refuses there.",
    )
    path_handler: dict[str, Any] = Field(
        default_factory=dict,
        description="Fields of the robot's path_handler that this controller needs otherwise, such "
        "as a longer prune_distance.",
    )


@dataclass(frozen=True, eq=False)
class Preset:
    """One column: what it is called, which controller, with which parameters.

    source: where the parameters came from, for errors.
    values: the parameters as given, before defaults.
    ignored: parameters that the controller accepts without effect, and those of a Nav2 file that it
    does not have; Nav2 ignores the latter, too.
    values_for_radius: in place of `values` for a robot given by a radius; None where they serve it.
    path_handler: fields that replace those of the robot's path handler.
    """

    name: str
    controller: str
    description: str
    values: Mapping[str, Any]
    source: str
    ignored: tuple[str, ...] = ()
    values_for_radius: Mapping[str, Any] | None = None
    path_handler: Mapping[str, Any] = field(default_factory=dict)

    @property
    def controller_class(self) -> type[Controller]:
        """The plugin class."""
        return _registry().load(self.controller)

    @property
    def parameters(self) -> ControllerParameters:
        """The typed parameters; raises InputError where a value is wrong."""
        return validate(self.controller_class.Parameters, self.values, self.source)

    def for_robot(self, robot: Robot) -> Preset:
        """Returns the column with the parameters that it has for a robot."""
        if not robot.is_circle or self.values_for_radius is None:
            return self
        return replace(self, values=self.values_for_radius, values_for_radius=None)

    def robot(self, robot: Robot) -> Robot:
        """Returns a robot as this column drives it; raises InputError where a field is wrong."""
        if not self.path_handler:
            return robot
        data = robot.model_dump(mode="json")
        handler = data["navigation"]["path_handler"]
        data["navigation"]["path_handler"] = merged(handler, self.path_handler)
        changed = validate(type(robot), data, self.source)
        return changed.model_copy(update={"directory": robot.directory})

    def checked(self) -> Preset:
        """Returns itself; raises InputError where a parameter is wrong."""
        _ = self.parameters
        if self.values_for_radius is not None:
            validate(self.controller_class.Parameters, self.values_for_radius, self.source)
        return self


def _preset_of(
    content: PresetFile, name: str, source: str, assigned: Mapping[str, Any] | None = None
) -> Preset:
    """Returns the preset of a file's content; assigned: parameters laid over all of its own."""
    assigned = assigned or {}
    values, for_radius = merged(content.parameters, assigned), None
    if content.parameters_for_radius:
        for_radius = merged(merged(content.parameters, content.parameters_for_radius), assigned)
    without_effect = _registry().load(content.controller).Parameters.WITHOUT_EFFECT
    return Preset(
        name,
        content.controller,
        content.description,
        values,
        source,
        ignored=tuple(key for key in values if key in without_effect),
        values_for_radius=for_radius,
        path_handler=content.path_handler,
    )


@cache
def _registry() -> Registry:
    return Registry()


@cache
def _loaded_controllers() -> Mapping[str, type[Controller]]:
    """Returns the controllers that can be loaded, by name; warns of the others, once."""
    registry = _registry()
    loaded = {}
    for name in registry.names:
        try:
            loaded[name] = registry.load(name)
        except InputError as error:
            # A plugin that is broken must not keep the others from running.
            warnings.warn(str(error), stacklevel=1)
    return loaded


def preset_files() -> dict[str, Path]:
    """Returns the preset files that come with the installed controllers, by name."""
    found: dict[str, Path] = {}
    for controller in _loaded_controllers().values():
        folder = Path(inspect.getfile(controller)).parent / "presets"
        for path in sorted(folder.glob("*.yaml")):
            # Controllers of one package share its presets.
            if found.get(path.stem, path) != path:
                raise InputError(
                    f"{path}: a preset {path.stem!r} exists already: {found[path.stem]}"
                )
            found[path.stem] = path
    return found


def load_preset(text: str) -> Preset:
    """Returns the preset for `name` or for a variant `name:param=value[:param=value...]`.

    Raises InputError where the name or a parameter is not known, or a value is wrong.
    """
    name, *assignments = text.split(":")
    files = preset_files()
    if name not in files:
        raise InputError(f"controller {name!r} is not known{nearest_name_hint(name, files)}")
    content = validate(PresetFile, read_yaml(files[name]), str(files[name]))
    source = f"controller {text}" if assignments else str(files[name])
    assigned: Mapping[str, Any] = {}
    for assignment in assignments:
        assigned = merged(assigned, _parse_assignment(assignment, text))
    return _preset_of(content, text, source, assigned).checked()


def _parse_assignment(assignment: str, text: str) -> dict[str, Any]:
    """Returns {'a': {'b': value}} for 'a.b=value'."""
    key, equals, value = assignment.partition("=")
    if not key or not equals or not value:
        raise InputError(f"controller {text!r}: got {assignment!r}, expected param=value")
    parsed = parse_yaml(f"value: {value}", f"controller {text!r}")["value"]
    for part in reversed(key.split(".")):
        parsed = {part: parsed}
    return parsed


def load_parameter_file(path: Path) -> list[Preset]:
    """Returns the columns that a parameter file makes.

    The file is either a preset file of ours or a Nav2 parameter file; of the latter, every
    controller plugin of `controller_server` makes a column. Raises InputError.
    """
    data = read_yaml(path)
    if NAV2_SERVER in data:
        return _nav2_presets(data, path)
    content = validate(PresetFile, data, str(path))
    return [_preset_of(content, path.stem, str(path)).checked()]


def _nav2_presets(data: Mapping[str, Any], path: Path) -> list[Preset]:
    server = data[NAV2_SERVER]
    parameters = server.get("ros__parameters") if isinstance(server, dict) else None
    if not isinstance(parameters, dict):
        raise InputError(f"{path}: {NAV2_SERVER}: expected a mapping with ros__parameters")
    where = f"{path}: {NAV2_SERVER}.ros__parameters"
    plugins = parameters.get("controller_plugins", ["FollowPath"])
    if not isinstance(plugins, list) or not all(isinstance(name, str) for name in plugins):
        raise InputError(f"{where}.controller_plugins: expected a list of names, got {plugins!r}")
    presets = []
    for plugin in plugins:
        block = parameters.get(plugin)
        if not isinstance(block, dict) or "plugin" not in block:
            raise InputError(
                f"{where}.{plugin}: missing, but listed in controller_plugins; "
                "expected a mapping with a plugin type"
            )
        if not isinstance(block["plugin"], str):
            raise InputError(
                f"{where}.{plugin}.plugin: expected a plugin type, got {block['plugin']!r}"
            )
        values = {key: value for key, value in block.items() if key != "plugin"}
        presets.append(_nav2_preset(block["plugin"], values, f"{path.stem}/{plugin}", path))
    return presets


def _nav2_preset(plugin_type: str, values: dict[str, Any], name: str, path: Path) -> Preset:
    controllers = _loaded_controllers()
    by_type = {c.nav2_plugin: key for key, c in controllers.items() if c.nav2_plugin}
    if plugin_type not in by_type:
        raise InputError(
            f"{path}: plugin {plugin_type!r} has no counterpart here"
            f"{nearest_name_hint(plugin_type, by_type)}"
        )
    controller = by_type[plugin_type]
    known_names = _parameter_names(controllers[controller].Parameters)
    ignored = tuple(key for key in values if key.partition(".")[0] not in known_names)
    used = {key: value for key, value in values.items() if key not in ignored}
    description = f"{plugin_type} from {path.name}"
    return Preset(name, controller, description, used, str(path), ignored).checked()


def _parameter_names(model: type[ControllerParameters]) -> set[str]:
    """Returns every name under which a model takes a value at its top level."""
    names = set(model.model_fields)
    for model_field in model.model_fields.values():
        alias = model_field.validation_alias
        choices = alias.choices if isinstance(alias, AliasChoices) else [alias]
        names.update(choice for choice in choices if isinstance(choice, str))
    return names


def default_presets() -> list[str]:
    """Returns the names of the default columns among the installed presets."""
    files = preset_files()
    return [name for name in DEFAULT_PRESETS if name in files]


def as_yaml(preset: Preset) -> str:
    """Returns the preset with every parameter resolved, as the text of a preset file."""
    return yaml.safe_dump(
        {
            "controller": preset.controller,
            "description": preset.description,
            "parameters": preset.parameters.model_dump(mode="json"),
            "path_handler": dict(preset.path_handler),
        },
        sort_keys=False,
    )
