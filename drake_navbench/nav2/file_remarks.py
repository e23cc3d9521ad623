"""Remarks of the check that take a whole file, or a file and its robot."""

from __future__ import annotations

from drake_navbench.inputs.check import CheckRow, Status
from drake_navbench.nav2.controllers import listed_plugins
from drake_navbench.nav2.loadable import slips_of, told_of_libraries
from drake_navbench.nav2.node_reader import Rows
from drake_navbench.nav2.parameters import Node
from drake_navbench.plugins.releases import Release

# Twice Nav2's default of xy_goal_tolerance, m.
WIDE_M = 0.5
TOLERANCES = ("xy_goal_tolerance", "coarse_xy_goal_tolerance")
LIBRARIES = "plugin_lib_names"
# Parameters of these statuses name a class that is used here.
IN_USE = (Status.USED, Status.OTHER_FORM)


def note_unloadable(rows: Rows, node: Node, release: Release, *, is_older: bool) -> None:
    """Notes the plugins and libraries that a node names and its release does not load.

    With such a name the node of Nav2 does not start. is_older: whether the file is of a release
    before Humble, whose own names are right.
    """
    full, base = node.name.lstrip("/"), node.name.rpartition("/")[2]
    values = {name: parameter.value for name, parameter in node.parameters.items()}

    def note(parameter: str, remark: str) -> None:
        line = node.parameters[parameter].line
        rows[full, parameter] = CheckRow(Status.STAND_IN, full, parameter, remark, line)

    for slip in slips_of(base, values, release, is_older=is_older):
        row = _row_about(rows, full, slip.parameter)
        # What is replaced anyway, or in a block that nothing lists, is told as such.
        if row is None or row.status in (*IN_USE, Status.NO_MEANING):
            used = "; used here all the same" if row is not None and row.status in IN_USE else ""
            remark = f"{slip.name} {slip.fault}: this node of Nav2 does not start{used}"
            note(slip.parameter, remark)
    libraries = told_of_libraries(values.get(LIBRARIES), release)
    if libraries:
        note(LIBRARIES, libraries)


def note_wide_tolerance(rows: Rows, server: Node, checker: object, radius_m: float) -> None:
    """Notes a goal checker's tolerance with which the robot arrives beside its goal.

    server: the controller server. checker: the parameters of its goal checker. radius_m: of the
    circle around the robot's outline.
    """
    name = next((name for name in TOLERANCES if hasattr(checker, name)), None)
    tolerance_m = getattr(checker, name) if name is not None else 0.0
    if name is None or tolerance_m <= max(WIDE_M, radius_m):
        return
    node, controllers = server.name.lstrip("/"), listed_plugins(server)
    for place, row in rows.items():
        block, _, last = row.parameter.rpartition(".")
        if row.node == node and last == name and block not in controllers:
            remark = (
                f"{tolerance_m:g} m: the robot counts as arrived where none of it, up to "
                f"{radius_m:.2g} m from its base frame, is at the goal"
            )
            rows[place] = row._replace(status=Status.DOUBTFUL, remark=remark)


def _row_about(rows: Rows, node: str, parameter: str) -> CheckRow | None:
    """Returns the row of a parameter, else that of its block; None without one."""
    block = parameter.partition(".")[0]
    return rows.get((node, parameter)) or rows.get((node, block))
