"""Reads Nav2 files that are merged into the sections of their nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from drake_navbench.errors import InputError
from drake_navbench.inputs.check import CheckRow, Status
from drake_navbench.inputs.move_base import MOVE_BASE_FILE, is_of_move_base
from drake_navbench.nav2.node_reader import Rows
from drake_navbench.nav2.parameters import (
    PARAMETERS_KEY,
    Section,
    read_parameter_file,
    read_parameter_text,
)
from drake_navbench.nav2.substitutions import Substitutions


class ReadFiles(NamedTuple):
    """The sections of files that are merged, and the remarks on them."""

    paths: tuple[Path, ...]
    sections: tuple[Section, ...]
    remarks: Rows


def read_sections(
    paths: Sequence[Path], substitutions: Substitutions, texts: Mapping[Path, str] | None = None
) -> ReadFiles:
    """Returns the sections of files; raises InputError.

    texts: contents that replace those of a path.
    """
    sections: list[Section] = []
    rows: Rows = {}
    for path in paths:
        prepare = partial(substitutions.applied_to, path=path)
        if texts and path in texts:
            file = read_parameter_text(prepare(texts[path]), path)
        else:
            file = read_parameter_file(path, prepare)
        if not file.sections:
            what = MOVE_BASE_FILE if is_of_move_base(path) else "expected a Nav2 file"
            raise InputError(f"{path}: no node with {PARAMETERS_KEY}; {what}")
        sections += file.sections
        for number, remark in enumerate(file.remarks):
            row = CheckRow(Status.OTHER_FORM, path.name, "", remark.removeprefix(f"{path}, "))
            rows[path.name, str(number)] = row
    return ReadFiles(tuple(paths), tuple(sections), rows)
