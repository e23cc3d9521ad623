"""Presets: a controller with a parameter file, each a column of the tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import Field

from drake_navbench.controller import CONTROLLERS, Controller, ControllerParameters
from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.inputs.controller_file import (
    ControllerFile,
    find_controller_file,
    names_file,
    split_reference,
)
from drake_navbench.inputs.named_files import YAML_SUFFIXES
from drake_navbench.inputs.originals import is_plugin_type, names_original, original_of
from drake_navbench.inputs.overrides import merged
from drake_navbench.inputs.robot import Robot
from drake_navbench.typed_files.assignments import assignment
from drake_navbench.typed_files.dotted_names import flattened, nested
from drake_navbench.typed_files.file_kinds import PRESET, require_kind
from drake_navbench.typed_files.input_file import file_digest
from drake_navbench.typed_files.typed_yaml import FrozenModel, parse_yaml, read_yaml, validate
from drake_navbench.typed_files.yaml_loader import dump_yaml

# The columns of the default benchmark; other presets run only when named.
DEFAULT_PRESETS = ("dwb", "rpp", "teb", "teb_upstream", "mppi", "mppi_nav2")
# The largest file that a controller reads or runs.
MAX_READ_BYTES = 2**30


class PresetFile(FrozenModel):
    """The contents of a preset file."""

    controller: str = Field(
        description="Controller: a registered name, or file.py:Class relative to this file."
    )
    description: str = Field(
        min_length=1, description="Description of the preset in one line, for --list."
    )
    parameters: dict[str, Any] = Field(
        default_factory=dict, description="Parameters that differ from the controller's defaults."
    )
    parameters_for_radius: dict[str, Any] = Field(
        default_factory=dict,
        description="Parameters that replace those for a robot with robot_radius, such as a "
        "critic's consider_footprint, which Nav2 refuses there.",
    )
    path_handler: dict[str, Any] = Field(
        default_factory=dict,
        description="Fields of the robot's path_handler that this controller needs to be "
        "different, such as a longer prune_distance.",
    )


class Nav2Plugin(NamedTuple):
    """A controller's block in a Nav2 file: its type, and its parameters by dotted names."""

    type: str
    parameters: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class Preset:
    """One column: its name, its controller, and the controller's parameters.

    source: origin of the parameters, for errors. values: the parameters as given, before defaults,
    nested by block. ignored: dotted names of given parameters without effect, because
    the controller accepts and drops them or, in a Nav2 file, does not know them. values_for_radius:
    replace `values` for a robot given by a radius; None where `values` fit it. path_handler: fields
    that replace those of the robot's path handler. file: the file of the controller's class, if it
    has one of its own. nav2_plugin: the controller's block in the Nav2 file that the column is
    from. stack: the robot of a whole Nav2 file, with its costmaps, planner and all other servers,
    that this column drives in place of the run's robot; None for the run's. read_as: a remark with
    the release of Nav2 that it follows, and how that was found; may be ''.
    """

    name: str
    controller: str
    description: str
    values: Mapping[str, Any]
    source: str
    ignored: tuple[str, ...] = ()
    values_for_radius: Mapping[str, Any] | None = None
    path_handler: Mapping[str, Any] = field(default_factory=dict)
    file: ControllerFile | None = None
    nav2_plugin: Nav2Plugin | None = None
    read_as: str = ""
    stack: Robot | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Returns the fields alone: cached parameters may be of a class that pickle lacks."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    @property
    def controller_class(self) -> type[Controller]:
        """The plugin class."""
        return CONTROLLERS.load(self.controller) if self.file is None else self.file.load()

    @property
    def is_running_stack(self) -> bool:
        """Whether it is a whole navigation stack that runs outside, not a controller in ours."""
        return getattr(self.controller_class, "is_running_stack", False)

    @cached_property
    def parameters(self) -> ControllerParameters:
        """The typed parameters, validated once; raises InputError where a value is wrong."""
        return validate(self.controller_class.Parameters, self.values, self.source)

    @property
    def file_hashes(self) -> dict[str, str]:
        """The SHA-256 of the controller's own file and of the files that it reads, by name.

        Raises InputError where one cannot be read.
        """
        own = {} if self.file is None else {self.file.path.name: self.file.sha256}
        try:
            read = {
                name: file_digest(path, max_bytes=MAX_READ_BYTES)
                for name, path in self.parameters.files_read().items()
            }
        except InputError as error:
            raise InputError(f"{self.source}: {error}") from error
        return own | read

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
    content: PresetFile,
    name: str,
    source: str,
    assigned: Mapping[str, Any] | None = None,
    *,
    folder: Path = Path(),
) -> Preset:
    """Returns the preset of a file's content.

    assigned: parameters that replace the file's. folder: searched for a controller's file.
    """
    values, for_radius = _given(content, assigned or {}, source)
    file = None
    if names_file(content.controller):
        file = find_controller_file(content.controller, folder)
    model = (CONTROLLERS.load(content.controller) if file is None else file.load()).Parameters
    return Preset(
        name,
        content.controller,
        content.description,
        values,
        source,
        ignored=tuple(
            name for name, _ in flattened(values) if model.is_without_effect(name, values)
        ),
        values_for_radius=for_radius,
        path_handler=content.path_handler,
        file=file,
    ).checked()


def _given(
    content: PresetFile, assigned: Mapping[str, Any], source: str
) -> tuple[dict[str, Any], dict[str, Any] | None]:
    """Returns a file's parameters nested by block, and those for a robot with a radius, if any.

    assigned: parameters that replace the file's.
    """
    own = nested(flattened(content.parameters), source)
    instead = nested(flattened(content.parameters_for_radius), source)
    return merged(own, assigned), merged(merged(own, instead), assigned) if instead else None


def load_preset_file(path: Path) -> Preset:
    """Returns the preset that a file describes; raises InputError."""
    data = read_yaml(path)
    require_kind(data, PRESET, path)
    content = validate(PresetFile, data, str(path))
    return _preset_of(content, path.stem, str(path), folder=path.parent)


@cache
def installed_controllers() -> Mapping[str, type[Controller]]:
    """Returns the controllers that can be loaded, by name; warns of the others, once."""
    return CONTROLLERS.load_all()


def preset_files() -> dict[str, Path]:
    """Returns the preset files that come with the installed controllers, by name."""
    found: dict[str, Path] = {}
    for name in CONTROLLERS.names:
        folder = CONTROLLERS.folder(name)
        for path in sorted((folder / "presets").glob("*.yaml")) if folder else ():
            # Controllers of one package share its presets.
            if found.get(path.stem, path) != path:
                raise InputError(
                    f"{path}: a preset {path.stem!r} exists already: {found[path.stem]}"
                )
            found[path.stem] = path
    return found


def load_preset(text: str) -> Preset:
    """Returns the preset for `name` or for a variant `name:param=value[:param=value...]`.

    A controller's own name stands for the controller with its defaults if no preset has that name.
    `path/to/file.py:Class` names a controller that is in no package; `name@build` names the
    preset's original from a build of Nav2, with the preset's parameters. Raises InputError where
    the name or a parameter is not known, or a value is wrong.
    """
    if names_original(text):
        return _original_preset(text)
    if names_file(text):
        name, assignments = split_reference(text)
        content = PresetFile(controller=name, description=f"the controller in {name}")
        source = f"controller {text}"
    else:
        name, *assignments = text.split(":")
        content, source = _named_content(name)
        if assignments:
            source = f"controller {text}"
    return _preset_of(content, text, source, _assigned(assignments, text))


def _original_preset(text: str) -> Preset:
    """Returns the column of `name@build[:param=value...]`: the plugin, hosted by `external`."""
    original = original_of(text)
    model: type[ControllerParameters] = ControllerParameters
    if is_plugin_type(original.name):
        content = PresetFile(controller="external", description=original.description)
    else:
        content, _ = _named_content(original.name)
        model = CONTROLLERS.load(content.controller).Parameters
    plugin = original_plugin(original.name)

    def hosted(given: Mapping[str, Any]) -> dict[str, Any]:
        return original.hosted(plugin, model.for_original(given, original.build.release))

    values, for_radius = _given(content, _assigned(original.assignments, text), text)
    return Preset(
        text,
        "external",
        original.description,
        hosted(values),
        f"controller {text}",
        values_for_radius=None if for_radius is None else hosted(for_radius),
        path_handler=content.path_handler,
    ).checked()


def original_plugin(name: str) -> str | None:
    """Returns Nav2's plugin type of a preset, None where it is no port.

    Of a plugin type it returns the type itself.
    """
    if is_plugin_type(name):
        return name
    content, _ = _named_content(name)
    controller = CONTROLLERS.load(content.controller)
    own: str | None = getattr(controller, "original_plugin", None)
    return own or controller.nav2_plugin


def _assigned(assignments: Sequence[str], text: str) -> Mapping[str, Any]:
    assigned: Mapping[str, Any] = {}
    for part in assignments:
        assigned = merged(assigned, _parse_assignment(part, text))
    return assigned


def _named_content(name: str) -> tuple[PresetFile, str]:
    """Returns the preset file's content for a preset or a controller, and its source."""
    files = preset_files()
    if name in files:
        return validate(PresetFile, read_yaml(files[name]), str(files[name])), str(files[name])
    if name in CONTROLLERS:
        return PresetFile(controller=name, description=f"{name} as it is"), f"controller {name}"
    if Path(name).suffix in YAML_SUFFIXES:
        raise InputError(
            f"controller {name}: expected a name; a file of parameters is for --params"
        )
    known = {*files, *CONTROLLERS.names}
    hint = nearest_name_hint(name, known, listed_by="drake-navbench list")
    raise InputError(f"controller {name!r} is not known{hint}")


def _parse_assignment(part: str, text: str) -> dict[str, Any]:
    """Returns {'a': {'b': value}} for 'a.b=value'."""
    key, value = assignment(part, f"controller {text!r}: got", "param=value")
    parsed = parse_yaml(f"value: {value}", f"controller {text!r}")["value"]
    for name in reversed(key.split(".")):
        parsed = {name: parsed}
    return parsed


def default_presets() -> list[str]:
    """Returns the names of the default columns among the installed presets."""
    files = preset_files()
    return [name for name in DEFAULT_PRESETS if name in files]


def resolved_parameters(name: str) -> dict[str, Any]:
    """Returns every parameter of an installed preset as plain values; raises InputError."""
    return load_preset(name).parameters.model_dump(mode="json")


def as_yaml(preset: Preset) -> str:
    """Returns the preset with every parameter resolved, as the text of a preset file.

    Parameters that were not given have the defaults of the column's release in the text, as a
    reader takes all parameters for given.
    """
    return dump_yaml(
        {
            "controller": preset.controller,
            "description": preset.description,
            "parameters": preset.parameters.as_read().model_dump(mode="json"),
            "path_handler": dict(preset.path_handler),
        },
        sort_keys=False,
    )
