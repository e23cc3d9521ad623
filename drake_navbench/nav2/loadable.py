"""Names that each release of Nav2 loads: of plugins, of tree nodes, and of their libraries.

Source: the plugin descriptions, and nav2_behavior_tree (plugins/, CMakeLists.txt), of the branches
foxy to lyrical of navigation2. Releases before Humble count as Humble, but for the names in OLD.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from drake_navbench.plugins.releases import Release
from drake_navbench.typed_files.name_lists import name_lists, packaged_table

_CLASSES = packaged_table(__package__, "loadable_classes.yaml")
# A class, as "package::kind" -> the first release from Humble on that has it.
CLASSES_SINCE: Mapping[str, Release] = {
    f"{package}::{kind}": Release(release)
    for release, packages in _CLASSES["since"].items()
    for package, kinds in packages.items()
    for kind in kinds
}
# Newer releases that lack a class of an older one.
WITHOUT = frozenset(
    (f"{package}::{kind}", Release(release))
    for release, packages in _CLASSES["without"].items()
    for package, kinds in packages.items()
    for kind in kinds
)
# The behaviour server's name before Humble; no release since then reads its parameters.
OLD_NODE = "recoveries_server"
# A node that is not read, as the pose is exact; but it has to start, too.
AMCL = "amcl"
_TREE_NODES = packaged_table(__package__, "loadable_tree_nodes.yaml")
# A node of behaviour trees -> the first release that has it; nodes of all releases are left out.
TREE_NODES_SINCE: Mapping[str, Release] = {
    node: Release(release) for release, nodes in _TREE_NODES["since"].items() for node in nodes
}
# Newer releases that lack a node of an older one.
TREE_NODES_WITHOUT = frozenset(
    (node, Release(release)) for release, nodes in _TREE_NODES["without"].items() for node in nodes
)
# Packages whose plugins have a slash in their names up to a release, and colons after it.
SLASH_UNTIL = {
    "nav2_behaviors": Release.IRON,
    "nav2_bt_navigator": Release.IRON,
    "nav2_constrained_smoother": Release.LYRICAL,
    "nav2_navfn_planner": Release.IRON,
    "nav2_smac_planner": Release.IRON,
    "nav2_theta_star_planner": Release.IRON,
}
# Names of Galactic and older -> those of Humble and newer.
OLD = {
    "differential": "nav2_amcl::DifferentialMotionModel",
    "omnidirectional": "nav2_amcl::OmniMotionModel",
    "nav2_recoveries/BackUp": "nav2_behaviors/BackUp",
    "nav2_recoveries/Spin": "nav2_behaviors/Spin",
    "nav2_recoveries/Wait": "nav2_behaviors/Wait",
}
# The last part of a parameter that names a plugin's type.
TYPES = ("plugin", "primary_controller")
PLUGIN = re.compile(r"(?P<package>\w+)(?:/|::)(?P<kind>\w+)")
# The libraries of behaviour tree nodes, by the first release from Humble on that has them.
NODES_SINCE: Mapping[str, Release] = {
    f"nav2_{name}_bt_node": Release(release)
    for release, names in name_lists(__package__, "loadable_nodes.yaml").items()
    for name in names
} | {"nav2_path_expiring_timer_condition": Release.HUMBLE}
# An unknown library whose name has words of these alone is one of Nav2's, misspelt.
WORDS = frozenset(word for name in NODES_SINCE for word in name.split("_")) | {"control"}


class Slip(NamedTuple):
    """A plugin's name that a release does not load. parameter: the one that gives the name.

    right: the release's spelling of the name, '' where it has no such class. fault: goes on after
    the name.
    """

    parameter: str
    name: str
    right: str
    fault: str

    @property
    def package(self) -> str:
        """The package of the plugin, such as 'nav2_behaviors'."""
        return self.right.replace("/", "::").partition("::")[0]


def slips_of(
    node: str, parameters: Mapping[str, Any], release: Release, *, is_older: bool
) -> Iterator[Slip]:
    """Yields the names of Nav2's plugins among a node's parameters that a release does not load.

    node: without its namespaces. parameters: values by dotted name. is_older: whether the file is
    of a release before Humble, whose own names are no slips.
    """
    for parameter, name in parameters.items():
        if not isinstance(name, str) or not _names_plugin(node, parameter):
            continue
        # Humble's navigators are no plugins, but files for Humble name some.
        is_idle = release is Release.HUMBLE and name.startswith("nav2_bt_navigator")
        if is_idle or (is_older and name in OLD):
            continue
        right, fault = loadable_name(name, release), fault_of_class(name, release)
        if fault:
            yield Slip(parameter, name, "", fault)
        elif right != name:
            yield Slip(parameter, name, right, f"is called {right} in {release}")


def _names_plugin(node: str, parameter: str) -> bool:
    if node == AMCL:
        return parameter == "robot_model_type"
    return parameter.rpartition(".")[2] in TYPES and node != OLD_NODE


def loadable_name(name: str, release: Release) -> str:
    """Returns a plugin's name as a release loads it; the name itself where no release knows it."""
    name = OLD.get(name, name)
    found = PLUGIN.fullmatch(name)
    if found is None or _with_colons(found) not in CLASSES_SINCE:
        return name
    until = SLASH_UNTIL.get(found["package"])
    has_slash = until is not None and release <= until
    return f"{found['package']}{'/' if has_slash else '::'}{found['kind']}"


def came_with(name: str) -> Release | None:
    """Returns the first release from Humble on that has a class, spelled either way.

    None where no release knows it.
    """
    found = PLUGIN.fullmatch(OLD.get(name, name))
    return None if found is None else CLASSES_SINCE.get(_with_colons(found))


def fault_of_class(name: str, release: Release) -> str:
    """Returns why a release has no class of Nav2's; '' where it has it, or no release knows it.

    The reason goes on after the class's name.
    """
    since = came_with(name)
    if since is not None and since > release:
        return f"exists from {since} on, not in {release}"
    is_lacking = (OLD.get(name, name).replace("/", "::"), release) in WITHOUT
    return f"does not exist in {release}" if is_lacking else ""


def fault_of_tree_node(node: str, release: Release) -> str:
    """Returns why a release has no such node of Nav2's trees; '' where it has it, or nobody does.

    The reason goes on after the node's name.
    """
    since = TREE_NODES_SINCE.get(node, Release.HUMBLE)
    if since > release:
        return f"exists from {since} on, not in {release}"
    return f"does not exist in {release}" if (node, release) in TREE_NODES_WITHOUT else ""


def _with_colons(found: re.Match[str]) -> str:
    return f"{found['package']}::{found['kind']}"


def faults_of_libraries(names: list[str], release: Release) -> dict[str, str]:
    """Returns by name why the navigator does not start with a library in `plugin_lib_names`.

    The reason goes on after "the file lists NAME, which".

    From Jazzy on it loads all of Nav2's libraries by itself, and none of them twice.
    """
    faults = {}
    for name in dict.fromkeys(names):
        since = NODES_SINCE.get(name)
        if names.count(name) > 1:
            faults[name] = "is listed twice, but bt_navigator loads no library twice"
        elif since is not None and since <= release and release >= Release.JAZZY:
            faults[name] = f"{release}'s bt_navigator loads by itself and cannot load a second time"
        elif since is not None and since > release:
            faults[name] = f"exists from {since} on, not in {release}"
        elif since is None and name.startswith("nav2_") and WORDS.issuperset(name.split("_")):
            faults[name] = "exists in no release of Nav2"
    return faults


def told_of_libraries(names: Any, release: Release) -> str:
    """Returns the first fault of the names in `plugin_lib_names`, how many more, and the effect.

    names: the parameter's value. '' without a fault.
    """
    listed = names if isinstance(names, list) else []
    faults = faults_of_libraries([name for name in listed if isinstance(name, str)], release)
    if not faults:
        return ""
    (name, fault), *others = faults.items()
    more = f" (and {len(others)} more names are wrong)" if others else ""
    return f"lists {name}, which {fault}{more}: bt_navigator does not start"
