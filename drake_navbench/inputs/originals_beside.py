"""Adds to each column its original from a build of Nav2: `--original NAME`."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

from drake_navbench.controller import ControllerParameters
from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.originals import Original, names_original
from drake_navbench.inputs.presets import Preset, load_preset
from drake_navbench.native.builds import Build, find_build
from drake_navbench.typed_files.dotted_names import nested


def with_originals(columns: Sequence[str | Preset], build_name: str) -> list[str | Preset]:
    """Returns the columns, each followed by its original; warns of columns without one.

    columns: presets and variants by name, and presets out of files. Raises InputError where there
    is no such build, a column is wrong, or none has an original in it.
    """
    build = find_build(build_name)
    beside: list[str | Preset] = []
    reasons = []
    for column in columns:
        beside.append(column)
        if isinstance(column, str):
            if names_original(column) or _reference(column, build) in columns:
                continue
            # An error of the column itself is no sign of a missing original.
            load_preset(column)
        try:
            beside.append(_original_of(column, build))
        except InputError as error:
            reasons.append(str(error))
    if reasons and len(beside) == len(columns):
        raise InputError(
            f"--original {build.name}: no column has an original: {'; '.join(reasons)}"
        )
    for reason in reasons:
        warnings.warn(
            f"--original: {reason}; this column drives without its original",
            InputWarning,
            stacklevel=2,
        )
    return beside


def _original_of(column: str | Preset, build: Build) -> Preset:
    """Returns the column of an original; raises InputError where the build has none."""
    if isinstance(column, Preset):
        return _original_of_preset(column, build)
    return load_preset(_reference(column, build))


def _reference(column: str, build: Build) -> str:
    name, colon, assignments = column.partition(":")
    return f"{name}@{build.name}{colon}{assignments}"


def _original_of_preset(preset: Preset, build: Build) -> Preset:
    """Returns the original of a column that a file defines.

    The original gets all parameters of a Nav2 file, also those that the port does not know. Those
    that the original does not declare are reported when the run starts.
    """
    original = Original(preset.name, build, ())
    plugin = preset.nav2_plugin
    if plugin is None:
        raise InputError(f"controller {preset.name}: its file names no Nav2 plugin")
    model: type[ControllerParameters] = preset.controller_class.Parameters
    given = nested(plugin.parameters.items(), preset.source)
    return Preset(
        f"{preset.name}@{build.name}",
        "external",
        original.description,
        original.hosted(plugin.type, model.for_original(given, build.release)),
        preset.source,
        path_handler=preset.path_handler,
    ).checked()
