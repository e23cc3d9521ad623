"""The release of Nav2 that a parameter file is written for, and what it changes.

A file seldom says its release, but names plugins that only some releases load, and parameters that
only some read. Source: the branches humble, iron, jazzy, kilted and lyrical of navigation2.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from drake_navbench.inputs.check import CheckRow, Status
from drake_navbench.inputs.navigation_settings import ControllerServerSettings
from drake_navbench.kernels.grid import INSCRIBED
from drake_navbench.nav2.loadable import OLD_NODE, SLASH_UNTIL, came_with
from drake_navbench.nav2.parameters import Section
from drake_navbench.navigation.behavior_tree.settings import BehaviorTreeSettings
from drake_navbench.plugins.releases import NEWEST_RELEASE, RELEASE_FIELD, Release, defaults_in
from drake_navbench.typed_files.name_lists import packaged_table

# The marks that tell a release, the most decisive first:
#
# 1. a path in the installation of a release, which names it;
# 2. names of plugins: a server does not start if it names one that its release lacks;
# 3. parameters that came with a release, of which the newest counts: what is left over from older
#    releases is not read, and stays in many files;
# 4. parameters that went with a release, Humble where they went before it.
#
# Files in use on Humble are often newer ones whose plugins alone were named anew. So between Humble
# and Iron, which name plugins alike, it is Iron only where all of 3 and 4 agree on it.

_MARKS = packaged_table(__package__, "release_marks.yaml")
# Parameters that only releases before Humble read.
BEFORE_HUMBLE: tuple[str, ...] = tuple(_MARKS["before_humble"])
# These and further parameters that Humble does not read; newer releases read some of them again.
READ_BEFORE_HUMBLE = frozenset((*BEFORE_HUMBLE, *_MARKS["read_before_humble"]))
# The last part of a parameter's name -> the first, or the last, release that reads it.
SINCE, UNTIL = (
    {name: Release(release) for release, names in _MARKS[mark].items() for name in names}
    for mark in ("since", "until")
)
UNTIL |= dict.fromkeys(BEFORE_HUMBLE, Release.HUMBLE)
# Nodes and packages of plugins that came with Humble: a file with one of them is no older one.
CAME_WITH_HUMBLE: tuple[str, ...] = tuple(_MARKS["came_with_humble"])
INSTALLATION = re.compile(rf"/opt/ros/({'|'.join(Release)})(?=/)")
# Packages whose plugins have a slash in their names up to Iron, and colons from Jazzy on. A
# navigator's name tells nothing: Humble reads none, but files for Humble have some.
_PACKAGES = sorted(
    {p for p, last in SLASH_UNTIL.items() if last is Release.IRON} - {"nav2_bt_navigator"}
)
RENAMED = re.compile(rf"(?:{'|'.join(_PACKAGES)})(/|::)\w+")
# From Jazzy on the navigator loads these libraries by itself, and refuses to load them twice.
LISTED_LIBRARIES = frozenset(
    {"nav2_compute_path_to_pose_action_bt_node", "nav2_follow_path_action_bt_node"}
)
LAST_OF_OLD_NAMES, FIRST_OF_NEW_NAMES = Release.IRON, Release.JAZZY


# The option that sets the release, and what stands for a mark where the file has none.
OPTION, NO_MARK = "--nav2-release", ""


class Found(NamedTuple):
    """A release, and the mark in the file that told it."""

    release: Release
    mark: str


class _Marks(NamedTuple):
    """The names and values in a file that tell its release, each list in the file's order.

    paths: values with a path in a release's installation, found by INSTALLATION. plugins: names of
    plugins; LAST_OF_OLD_NAMES or FIRST_OF_NEW_NAMES for each. since: parameters that a release was
    the first to read, by SINCE, and classes that it was the first to have. until: the parameters
    that a release was the last to read, by UNTIL and OLD_NODE.
    """

    paths: list[Found]
    plugins: list[Found]
    since: list[Found]
    until: list[Found]
    came_with_humble: list[Found]


def release_of(sections: Iterable[Section], given: str | None) -> Found:
    """Returns the given release, else the one that the marks in the files tell.

    A path in a release's installation counts most, then the names of plugins. Then counts the
    newest release that first read some parameter of the file. If no parameter tells that, the
    oldest release that was the last to read one counts.
    """
    if given is not None:
        return Found(Release(given), OPTION)
    paths, plugins, since, until, _ = marks = _marks(sections)
    if paths:
        return paths[0]
    # If a file has plugins of both kinds, the more frequent kind counts: the others are slips.
    counts = Counter(map(_release, plugins))
    newest = max(plugins, key=lambda f: (counts[f.release], f.release), default=None)
    if newest is not None and newest.release is LAST_OF_OLD_NAMES:
        return _humble_or_iron(marks)
    # `max` takes the first of equals, in the order of the file.
    needed = [*since, *(() if newest is None else (newest,))]
    if needed:
        return max(needed, key=_release)
    if until:
        oldest = min(until, key=_release)
        return _humble(marks) if oldest.release is Release.HUMBLE else oldest
    return Found(NEWEST_RELEASE, NO_MARK)


def _release(found: Found) -> Release:
    return found.release


def _humble_or_iron(marks: _Marks) -> Found:
    """Returns the release, Humble or Iron, of a file whose plugins are named as in both of them.

    A parameter of Humble decides for Humble; parameters of Iron alone decide for Iron; else Humble.
    """
    if any(found.release is Release.HUMBLE for found in marks.until):
        return _humble(marks)
    if marks.since and all(found.release is Release.IRON for found in marks.since):
        return marks.since[0]
    return Found(Release.HUMBLE, marks.plugins[0].mark)


def _humble(marks: _Marks) -> Found:
    """Returns Humble and a mark, an older release's if nothing in the file came with Humble."""
    of_humble = [found for found in marks.until if found.release is Release.HUMBLE]
    older = [found for found in of_humble if is_before_humble(found.mark)]
    newer = [found for found in of_humble if not is_before_humble(found.mark)]
    if marks.came_with_humble or marks.since:
        return (newer or marks.came_with_humble or marks.plugins)[0]._replace(
            release=Release.HUMBLE
        )
    return (older or newer)[0]


def _marks(sections: Iterable[Section]) -> _Marks:
    marks = _Marks([], [], [], [], [])
    for section in sections:
        node = section.name.rpartition("/")[2]
        if node == OLD_NODE:
            marks.until.append(Found(Release.HUMBLE, OLD_NODE))
        if node in CAME_WITH_HUMBLE:
            marks.came_with_humble.append(Found(Release.HUMBLE, node))
        for place, parameter in section.parameters.items():
            name = place.rpartition(".")[2]
            if name in SINCE:
                marks.since.append(Found(SINCE[name], name))
            if name in UNTIL:
                marks.until.append(Found(UNTIL[name], name))
            values = parameter.value if isinstance(parameter.value, list) else [parameter.value]
            marks.paths.extend(filter(None, map(_by_path, values)))
            marks.plugins.extend(filter(None, map(_by_plugin, values)))
            marks.since.extend(filter(None, map(_by_class, values)))
            marks.came_with_humble.extend(
                Found(Release.HUMBLE, value)
                for value in values
                if isinstance(value, str) and re.split("::|/", value)[0] in CAME_WITH_HUMBLE
            )
    return marks


def _by_path(value: Any) -> Found | None:
    """Returns the release in whose installation a value's path lies; None for other values."""
    path = INSTALLATION.search(value) if isinstance(value, str) else None
    return None if path is None else Found(Release(path[1]), path[0])


def _by_plugin(value: Any) -> Found | None:
    """Returns the release to which a plugin's or library's name points; None for other values."""
    if not isinstance(value, str):
        return None
    if value in LISTED_LIBRARIES:
        return Found(LAST_OF_OLD_NAMES, value)
    renamed = RENAMED.fullmatch(value)
    if renamed is None:
        return None
    return Found(LAST_OF_OLD_NAMES if renamed[1] == "/" else FIRST_OF_NEW_NAMES, value)


def _by_class(value: Any) -> Found | None:
    """Returns the release that was the first to have a class; None up to Humble, and for others.

    A navigator's name tells nothing: Humble reads none, but files for Humble have some.
    """
    since = came_with(value) if isinstance(value, str) else None
    if since is None or since is Release.HUMBLE or value.startswith("nav2_bt_navigator"):
        return None
    return Found(since, value)


def navigation_of(release: Release) -> dict[str, Any]:
    """Returns the values of `NavigationSettings` whose default in a release differs from ours."""
    tree = {RELEASE_FIELD: release, **defaults_in(BehaviorTreeSettings, release)}
    server = {RELEASE_FIELD: release, **defaults_in(ControllerServerSettings, release)}
    return {"behavior_tree": tree, "controller_server": server}


def tree_of(release: Release, tree: Mapping[str, Any]) -> dict[str, Any]:
    """Returns a tree, as plain values, whose nodes have the defaults of a release.

    Up to Kilted a RoundRobin always went on with its first child after the last. In Kilted a path
    is not valid from a cost of 253 on, whatever the outline.
    """
    children = tuple(tree_of(release, child) for child in tree.get("children", ()))
    attributes = dict(tree.get("attributes", {}))
    if tree["node"] == "RoundRobin" and release < Release.LYRICAL:
        attributes["wrap_around"] = "true"
    if tree["node"] == "IsPathValid" and release is Release.KILTED:
        attributes.setdefault("max_cost", str(INSCRIBED))
    return {**tree, "attributes": attributes, "children": children}


def has_node(tree: Mapping[str, Any], node: str) -> bool:
    """Returns whether a tree, as plain values, has a node of a kind."""
    return tree["node"] == node or any(has_node(child, node) for child in tree.get("children", ()))


def is_before_humble(mark: str) -> bool:
    """Returns whether a mark is of a release that is older than all that are known here."""
    return mark == OLD_NODE or mark in BEFORE_HUMBLE


def told_by(mark: str) -> str:
    """Returns in words how the release was found."""
    if mark == NO_MARK:
        return "the newest, as nothing in the file tells the release"
    if is_before_humble(mark):
        return f"the oldest release known here; {mark} shows that the file is of an older one"
    return f"{'set' if mark == OPTION else 'recognised'} by {mark}"


def release_row(found: Found) -> CheckRow:
    """Returns the row of the check that names the release and the mark that told it."""
    return CheckRow(Status.OTHER_FORM, "nav2_release", found.release, told_by(found.mark))
