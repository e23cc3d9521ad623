"""The search space of a tuning study: parameters and ranges; and a column as files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import Field, ValidationError

from drake_navbench.campaign.sweep import Axis, column_at, parse_axis
from drake_navbench.controller import CONTROLLERS
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import Preset
from drake_navbench.plugins.releases import RELEASE_FIELD
from drake_navbench.typed_files.dotted_names import flattened
from drake_navbench.typed_files.output_file import write_text
from drake_navbench.typed_files.typed_yaml import FrozenModel, read_yaml, validate
from drake_navbench.typed_files.yaml_loader import dump_yaml

if TYPE_CHECKING:
    from optuna.trial import Trial

FILE_NAME = "tuning.yaml"
LOGARITHMIC = ":log"
DIGITS = 4
# The name of the controller in a Nav2 file that is written.
PLUGIN = "FollowPath"


class _SpaceFile(FrozenModel):
    """The contents of a controller's tuning.yaml."""

    parameters: dict[str, str] = Field(
        min_length=1, description="LOW:HIGH, LOW:HIGH:log or a list A,B,C by parameter."
    )


@dataclass(frozen=True)
class Dimension:
    """A searched parameter: one of `choices`, or a number between `low` and `high`.

    is_whole: whether the number is a whole one. is_logarithmic: whether factors count.
    """

    name: str
    choices: tuple[Any, ...] = ()
    low: float = 0.0
    high: float = 0.0
    is_whole: bool = False
    is_logarithmic: bool = False

    @property
    def ends(self) -> tuple[Any, ...]:
        """The choices, or the lowest and the highest value."""
        as_given = int if self.is_whole else float
        return self.choices or (as_given(self.low), as_given(self.high))

    def suggest(self, trial: Trial) -> Any:
        """Returns a value that a study's trial proposes."""
        if self.choices:
            return trial.suggest_categorical(self.name, self.choices)
        suggest = trial.suggest_int if self.is_whole else trial.suggest_float
        return suggest(self.name, *self.ends, log=self.is_logarithmic)


@dataclass(frozen=True)
class SearchSpace:
    """The searched parameters of a column; all others stay as they are."""

    baseline: Preset
    dimensions: tuple[Dimension, ...]

    def suggest(self, trial: Trial) -> dict[str, Any]:
        """Returns the values that a study proposes, by parameter."""
        return plain_values({entry.name: entry.suggest(trial) for entry in self.dimensions})

    def candidate(self, values: Mapping[str, Any]) -> Preset:
        """Returns the column with these values; raises InputError where they do not go together."""
        return column_at(self.baseline, values, "--parameter")

    def write(
        self, column: Preset, values: Mapping[str, Any], stem: Path, remarks: Sequence[str]
    ) -> None:
        """Writes a preset with a column's values and, if Nav2 has the plugin, a Nav2 file."""
        write_preset_file(column, stem.with_name(f"{stem.name}.preset.yaml"), remarks)
        if column.controller_class.nav2_plugin is not None:
            write_nav2_file(column, stem.with_name(f"{stem.name}.nav2.yaml"), remarks)


def plain_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the values rounded to as many digits as one would write into a file."""
    return {
        name: float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value
        for name, value in values.items()
    }


def search_space(baseline: Preset, axes: Sequence[str] = ()) -> SearchSpace:
    """Returns the search space around a preset; raises InputError.

    axes: NAME=LOW:HIGH, NAME=LOW:HIGH:log or NAME=A,B,C. If it is empty, the space is the one in
    the controller's own tuning.yaml, which must then exist.
    """
    texts = list(axes) or own_texts(baseline)
    resolved = dict(flattened(baseline.parameters.model_dump(mode="json")))
    dimensions = tuple(parse_dimension(text, resolved) for text in texts)
    require_each_once([entry.name for entry in dimensions])
    space = SearchSpace(baseline, dimensions)
    for entry in dimensions:
        # Whether the parameter exists and allows both ends is checked before anything is driven.
        for value in entry.ends:
            _require_taken(space, entry.name, value)
    return space


def require_each_once(names: Sequence[str]) -> None:
    """Raises InputError where two dimensions are of one parameter."""
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"--parameter {name}: is given twice")


def _require_taken(space: SearchSpace, name: str, value: Any) -> None:
    known = dict(flattened(space.baseline.parameters.model_dump(mode="json")))
    try:
        space.candidate({name: value})
    except InputError as error:
        # A value that is valid by itself may be wrong together with the present values of the
        # others.
        if name not in known or _is_fault_of(error.__cause__, name):
            raise


def _is_fault_of(error: BaseException | None, name: str) -> bool:
    """Returns whether a parameter was refused for its own value, not for a conflict with others."""
    if not isinstance(error, ValidationError):
        return False
    last = name.rpartition(".")[2]
    return any(fault["loc"][-1:] == (last,) for fault in error.errors(include_url=False))


def own_texts(baseline: Preset) -> list[str]:
    """Returns the dimensions, as texts, in the tuning.yaml of a preset's controller.

    Raises InputError where there is no such file.
    """
    folder = None if baseline.file is not None else CONTROLLERS.folder(baseline.controller)
    path = None if folder is None else folder / FILE_NAME
    if path is None or not path.is_file():
        raise InputError(
            f"{baseline.name}: its controller has no {FILE_NAME}; "
            "expected --parameter NAME=LOW:HIGH"
        )
    content = validate(_SpaceFile, read_yaml(path), str(path))
    return [f"{name}={values}" for name, values in content.parameters.items()]


def parse_dimension(text: str, resolved: Mapping[str, Any]) -> Dimension:
    """Returns the dimension NAME=LOW:HIGH, NAME=LOW:HIGH:log or NAME=A,B,C; raises InputError.

    resolved: the present values by name. If the present value is an integer, only integers are
    searched.
    """
    is_logarithmic = text.endswith(LOGARITHMIC)
    axis: Axis = parse_axis(text.removesuffix(LOGARITHMIC), option="--parameter")
    if axis.bounds is None:
        if len(axis.values) < 2 or is_logarithmic:
            raise InputError(f"--parameter {text!r}: expected LOW:HIGH, or several values")
        return Dimension(axis.field, choices=axis.values)
    if axis.values:
        raise InputError(f"--parameter {text!r}: expected LOW:HIGH without a count")
    low, high = axis.bounds
    if is_logarithmic and low <= 0.0:
        raise InputError(f"--parameter {text!r}: a logarithmic range begins above 0, got {low:g}")
    now = resolved.get(axis.field)
    is_whole = isinstance(now, int) and not isinstance(now, bool)
    if is_whole and not (low.is_integer() and high.is_integer()):
        raise InputError(f"--parameter {text!r}: expected whole numbers")
    return Dimension(
        axis.field, low=low, high=high, is_whole=is_whole, is_logarithmic=is_logarithmic
    )


def write_nav2_file(preset: Preset, path: Path, remarks: Sequence[str]) -> None:
    """Writes the controller server's part of a Nav2 parameter file; remarks: its first lines.

    It contains the parameters that the preset sets, not those at Nav2's defaults. A controller that
    follows a release gets its release written, too: the rest of the file may not tell it.
    """
    plugin = preset.controller_class.nav2_plugin
    values = dict(preset.values)
    release = getattr(preset.parameters, RELEASE_FIELD, None)
    if release is not None:
        values = {RELEASE_FIELD: str(release)} | values
    server = {"controller_plugins": [PLUGIN], PLUGIN: {"plugin": plugin} | values}
    text = dump_yaml({"controller_server": {"ros__parameters": server}}, sort_keys=False)
    write_text(path, _commented(remarks) + text)


def write_preset_file(preset: Preset, path: Path, remarks: Sequence[str]) -> None:
    """Writes a preset file with the parameters that the preset sets; remarks: its first lines."""
    content = {
        "controller": preset.controller,
        "description": preset.description,
        "parameters": dict(preset.values),
    }
    if preset.values_for_radius is not None:
        # Without its own copy YAML would write the blocks that both have as anchors.
        content["parameters_for_radius"] = deepcopy(dict(preset.values_for_radius))
    if preset.path_handler:
        content["path_handler"] = dict(preset.path_handler)
    write_text(path, _commented(remarks) + dump_yaml(content, sort_keys=False))


def _commented(remarks: Sequence[str]) -> str:
    return "".join(f"# {line}\n" for line in remarks)
