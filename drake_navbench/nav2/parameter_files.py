"""Files of controllers' parameters: preset files of ours, and Nav2's parameter files."""

from __future__ import annotations

import warnings
from pathlib import Path

from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.presets import Preset, load_preset_file
from drake_navbench.nav2.controllers import SERVER, controller_presets
from drake_navbench.nav2.parameters import PARAMETERS_KEY, read_parameter_file
from drake_navbench.typed_files.typed_yaml import read_yaml


def load_parameter_file(path: Path, release: str | None = None) -> list[Preset]:
    """Returns the columns that a parameter file makes.

    The file is a preset file of ours or a Nav2 parameter file. In a Nav2 file every controller
    plugin of `controller_server` makes a column. It follows the given release of Nav2, else the one
    that the file's own marks tell. Warns of entries that Nav2 accepts although they are probably
    mistakes. Raises InputError.
    """
    file = read_parameter_file(path)
    if not file.sections:
        if SERVER in read_yaml(path):
            raise InputError(f"{path}: {SERVER}: expected a mapping with {PARAMETERS_KEY}")
        return [load_preset_file(path)]
    for remark in file.remarks:
        warnings.warn(remark, InputWarning, stacklevel=2)
    return controller_presets(file.sections, path, release)
