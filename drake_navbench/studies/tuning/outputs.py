"""Files of a column: a Nav2 parameter file to drive with, and a preset to benchmark with."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import yaml

from drake_navbench.inputs.presets import Preset
from drake_navbench.logs.results import write_text
from drake_navbench.plugins.names import flattened, nested
from drake_navbench.releases import RELEASE_FIELD

PLUGIN = "FollowPath"


def write_nav2_file(preset: Preset, path: Path, remarks: Sequence[str]) -> None:
    """Writes the controller server's part of a Nav2 parameter file; remarks: its first lines.

    It contains the parameters that the preset sets, not those at Nav2's defaults. A controller that
    follows a release gets its release written, too: the rest of the file may not tell it.
    """
    plugin = preset.controller_class.nav2_plugin
    values = nested(flattened(preset.values), preset.source)
    release = getattr(preset.parameters, RELEASE_FIELD, None)
    if release is not None:
        values = {RELEASE_FIELD: str(release)} | values
    server = {"controller_plugins": [PLUGIN], PLUGIN: {"plugin": plugin} | values}
    text = yaml.safe_dump({"controller_server": {"ros__parameters": server}}, sort_keys=False)
    write_text(path, _commented(remarks) + text)


def write_preset_file(preset: Preset, path: Path, remarks: Sequence[str]) -> None:
    """Writes a preset file with the preset's parameters; remarks: its first lines."""
    content = {
        "controller": preset.controller,
        "description": preset.description,
        "parameters": nested(flattened(preset.values), preset.source),
    }
    if preset.values_for_radius is not None:
        instead = nested(flattened(preset.values_for_radius), preset.source)
        content["parameters_for_radius"] = instead
    if preset.path_handler:
        content["path_handler"] = dict(preset.path_handler)
    write_text(path, _commented(remarks) + yaml.safe_dump(content, sort_keys=False))


def _commented(remarks: Sequence[str]) -> str:
    return "".join(f"# {line}\n" for line in remarks)
