"""Checks every parameter of the controllers in a whole Nav2 file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from drake_navbench.inputs.check import CheckRow, Status
from drake_navbench.inputs.presets import Preset
from drake_navbench.nav2.controllers import NoCounterpart, plugin_type_of
from drake_navbench.nav2.node_reader import similar_name_hint
from drake_navbench.nav2.parameters import Node
from drake_navbench.plugins.releases import RELEASE_FIELD, Release, release_in
from drake_navbench.typed_files.dotted_names import flattened, nested

# The block in which a rotation shim has its primary controller's parameters since Lyrical.
PRIMARY = "primary_controller."


def column_rows(server: Node, columns: Mapping[str, Preset | NoCounterpart]) -> list[CheckRow]:
    """Returns a row for each parameter of a server's controllers.

    columns: by the controller's name in the file, as `controllers.server_columns` returns them.
    """
    rows: list[CheckRow] = []
    for plugin, preset in columns.items():
        if isinstance(preset, NoCounterpart):
            named = plugin_type_of(server, plugin)
            remark = f"{named}: no such controller here, no column{preset.hint}"
            rows.append(_row(Status.STAND_IN, server, f"{plugin}.plugin", remark))
        else:
            rows += _rows(server, plugin, preset)
    return rows


def _rows(server: Node, plugin: str, preset: Preset) -> list[CheckRow]:
    model = preset.controller_class.Parameters
    names = {*model.model_fields, *(name for name, _ in flattened(preset.values))}
    release = release_in(preset.values)
    given = server.below(plugin)
    others_count = model.keys_not_read(_nested(given, release))
    doubts = model.doubts(given)
    rows = []
    for name in given:
        full = f"{plugin}.{name}"
        bare = name.removeprefix(PRIMARY)
        if name in doubts and name not in preset.ignored:
            rows.append(_row(Status.DOUBTFUL, server, full, doubts[name]))
        elif given[name] and bare in model.STOOD_IN_FOR:
            remark = f"{given[name]}: {model.STOOD_IN_FOR[bare]}"
            rows.append(_row(Status.STAND_IN, server, full, remark))
        elif name == "plugin" or name not in preset.ignored:
            rows.append(_row(Status.USED, server, full))
        elif not model.is_read(bare, release):
            rows.append(_row(Status.UNREAD, server, full, f"{release} does not read it"))
        elif name in others_count and name in model.model_fields:
            remark = "the parameter's older name overrides it"
            if release < Release.LYRICAL:
                remark = f"{release} does not read it"
            rows.append(_row(Status.UNREAD, server, full, remark))
        elif model.is_without_effect(name, preset.values) or bare == "transform_tolerance":
            rows.append(_row(Status.NO_MEANING, server, full))
        elif condition := model.READ_WITH.get(bare.partition(".")[0]):
            rows.append(_row(Status.UNREAD, server, full, f"only {condition} reads it"))
        else:
            what = (
                "unknown, or of a critic or plugin that is not listed" if "." in bare else "unknown"
            )
            remark = f"{what}{similar_name_hint(name, names)}"
            rows.append(_row(Status.UNREAD, server, full, remark))
    return rows


def _nested(given: Mapping[str, Any], release: str) -> dict[str, Any]:
    """Returns a plugin's parameters, nested, in the form that its model validates."""
    plain = {name: value for name, value in given.items() if name != "plugin"}
    return {RELEASE_FIELD: release, **nested(plain.items(), "")}


def _row(status: Status, server: Node, name: str, remark: str = "") -> CheckRow:
    parameter = server.parameters.get(name)
    return CheckRow(status, server.name.lstrip("/"), name, remark, parameter and parameter.line)
