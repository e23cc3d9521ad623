"""Plugins are found by entry point; a broken one is named and leaves the others alone."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from drake_navbench.analysis.metrics.registry import (
    BUILTIN_THEMES,
    METRICS,
    installed_metrics,
    packaged_metrics,
)
from drake_navbench.commands.listing import print_listing
from drake_navbench.controller import CONTROLLERS
from drake_navbench.controllers.dwb.critics.registry import CRITICS as DWB_CRITICS
from drake_navbench.controllers.mppi.critics.registry import CRITICS as MPPI_CRITICS
from drake_navbench.errors import InputError
from drake_navbench.inputs.navigation_settings import NavigationSettings
from drake_navbench.kernels.grid import Costmap
from drake_navbench.navigation.behavior import BEHAVIORS
from drake_navbench.navigation.behavior_tree.settings import TREE_NODES
from drake_navbench.navigation.costmaps.layer_plugin import COSTMAP_LAYERS
from drake_navbench.navigation.goal_checkers import GOAL_CHECKERS
from drake_navbench.navigation.planner_settings import PLANNERS, make_planner
from drake_navbench.navigation.progress_checkers import PROGRESS_CHECKERS
from drake_navbench.navigation.smoother_settings import SMOOTHERS
from drake_navbench.plugins.python_file import module_of
from drake_navbench.typed_files.typed_yaml import validate

KINDS = {
    "controllers": CONTROLLERS,
    "DWB's critics": DWB_CRITICS,
    "MPPI's critics": MPPI_CRITICS,
    "metrics": METRICS,
    "planners": PLANNERS,
    "smoothers": SMOOTHERS,
    "goal checkers": GOAL_CHECKERS,
    "progress checkers": PROGRESS_CHECKERS,
    # Ours have names of their own in a robot file.
    "costmap layers": COSTMAP_LAYERS,
    "behaviors": BEHAVIORS,
    "nodes": TREE_NODES,
}
WITHOUT_OURS = (BEHAVIORS, TREE_NODES)
CLASSES = {name: kind for name, kind in KINDS.items() if kind is not METRICS}
OF_THE_STACK = {name: kind for name, kind in CLASSES.items() if kind.parameters is not None}


@pytest.fixture
def install(install_package) -> Iterator[Callable[..., None]]:
    """A function that installs a package with one plugin."""

    def install_plugin(package: str, group: str, name: str, code: str) -> None:
        install_package(package, code, {group: {name: f"{package}.{package}:plugin"}})
        packaged_metrics.cache_clear()

    yield install_plugin
    packaged_metrics.cache_clear()


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_every_built_in_plugin_can_be_loaded(kind, recwarn):
    assert list(kind.load_all()) == kind.names
    assert bool(kind.names) is (kind not in WITHOUT_OURS)
    assert not recwarn.list


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_a_plugin_that_breaks_when_imported_is_named_with_its_package(kind, install):
    built_in = kind.names
    install("theirs", kind.group, "broken", "1 / 0")
    with pytest.warns(UserWarning, match=f"^{kind.noun} 'broken' of package 'theirs': ") as warned:
        assert list(kind.load_all()) == built_in
    (warning,) = warned
    assert str(warning.message).endswith("cannot be loaded: ZeroDivisionError: division by zero")


@pytest.mark.parametrize("kind", CLASSES.values(), ids=CLASSES)
def test_a_plugin_of_another_contract_is_told_what_it_lacks(kind, install):
    install("theirs", kind.group, "odd", "class plugin: pass")
    lacks = re.escape(", ".join(kind.members))
    with pytest.raises(
        InputError, match=rf"'odd' of package 'theirs': .* is not a class with {lacks}"
    ):
        kind.load("odd")


@pytest.mark.parametrize("kind", OF_THE_STACK.values(), ids=OF_THE_STACK)
def test_a_plugin_that_lacks_one_method_is_told_which(kind, install):
    members = [f"{member} = None" for member in kind.members[:-1]]
    install("theirs", kind.group, "odd", "class plugin:\n    " + "\n    ".join(members))
    with pytest.raises(InputError) as raised:
        kind.load("odd")
    assert str(raised.value) == (
        f"{kind.noun} 'odd' of package 'theirs': theirs.theirs:plugin is not a class with "
        f"{kind.members[-1]}, as docs/plugins.md describes it"
    )


@pytest.mark.parametrize("kind", OF_THE_STACK.values(), ids=OF_THE_STACK)
def test_parameters_that_are_no_model_of_ours_are_refused(kind, install):
    members = [f"{member} = dict" for member in kind.members]
    head, base = "", ""
    if kind is TREE_NODES:
        head = "from drake_navbench.navigation.behavior_tree.leaves import Leaf\n"
        base = "(Leaf)"
    install(
        "theirs", kind.group, "odd", f"{head}class plugin{base}:\n    " + "\n    ".join(members)
    )
    with pytest.raises(InputError, match=rf"Parameters of .* are no {kind.parameters.__name__}, "):
        kind.load("odd")


def test_a_node_must_be_a_leaf(install):
    code = "class plugin:\n    Parameters = dict\n    update = None"
    install("theirs", TREE_NODES.group, "odd", code)
    with pytest.raises(InputError, match=r"'theirs': .* is not a subclass of Leaf, as docs"):
        TREE_NODES.load("odd")


def test_a_leaf_that_does_not_say_what_it_does_lacks_update(install):
    code = """
    from drake_navbench.navigation.behavior_tree.leaves import Leaf
    class plugin(Leaf):
        Parameters = dict
    """
    install("theirs", TREE_NODES.group, "odd", code)
    with pytest.raises(InputError, match=r"theirs:plugin is not a class with update, as docs"):
        TREE_NODES.load("odd")


def test_a_name_of_ours_that_a_package_registers_as_well_is_refused(install):
    name = "nav2_navfn_planner::NavfnPlanner"
    install("theirs", PLANNERS.group, name, "class plugin: pass")
    both = f"^planner '{name}': registered by package 'drake-navbench' and package 'theirs'; "
    with pytest.raises(InputError, match=both):
        PLANNERS.load(name)
    assert PLANNERS.load("nav2_smac_planner::SmacPlanner2D")


def test_two_packages_with_one_name_are_refused(install):
    install("mine", BEHAVIORS.group, "dance", "class plugin: pass")
    install("theirs", BEHAVIORS.group, "dance", "class plugin: pass")
    both = "registered by package 'mine' and package 'theirs'; expected one of this name"
    with pytest.raises(InputError, match=f"^behavior 'dance': {both}"):
        BEHAVIORS.load("dance")


def test_the_planner_of_the_guide_plans(install):
    guide = (Path(__file__).parents[1] / "docs" / "plugins.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", guide, re.DOTALL)
    install("my_package", PLANNERS.group, "my_package::Beeline", f"{code}\nplugin = Beeline")
    chosen = {"plugin": "my_package::Beeline", "spacing_m": 0.5}
    settings = validate(NavigationSettings, {"planner": chosen}, "robot.yaml").planner
    free = Costmap(np.zeros((40, 40), np.uint8), 0.0, 0.0, 0.1)
    path = make_planner(settings, footprint=None).plan(free, [1.0, 1.0, 0.0], [2.0, 1.0, 0.3])
    expected = [[1.0, 1.0, 0.0], [4 / 3, 1.0, 0.0], [5 / 3, 1.0, 0.0], [2.0, 1.0, 0.3]]
    np.testing.assert_allclose(path, expected)


def test_list_shows_what_others_have_installed_and_imports_none_of_it(install, capsys):
    install("theirs", BEHAVIORS.group, "theirs::Dance", "1 / 0")
    print_listing(Console(width=100))
    told = capsys.readouterr().out.partition("behaviors of other packages")[2]
    assert told.split() == ["theirs::Dance", "theirs", "1.0"]


def test_a_name_registered_twice_is_refused_by_the_names_of_both_packages(install):
    install("theirs", CONTROLLERS.group, "rpp", "class plugin: pass")
    with pytest.raises(InputError, match=r"^controller 'rpp': registered by package 'drake-navbe"):
        CONTROLLERS.load("rpp")
    assert CONTROLLERS.load("dwb").nav2_plugin == "dwb_core::DWBLocalPlanner"


def test_a_misspelt_name_gets_the_nearest():
    with pytest.raises(InputError, match=r"^controller 'rppp' is not registered; did you mean 'r"):
        CONTROLLERS.load("rppp")


METRIC = """
from drake_navbench.analysis.metrics import metric

@metric(unit="m", better="higher")
def {name}(log):
    '''A number.

    Formula: 1.
    '''
    return 1.0

plugin = {name}
"""


def test_a_metric_with_a_name_that_exists_leaves_the_built_in_ones_alone(install):
    taken = installed_metrics()["efficiency"][0].name
    install("theirs", METRICS.group, "mine", METRIC.format(name=taken))
    with pytest.warns(UserWarning, match=f"metric '{taken}' of theme 'mine' is defined by 'effic"):
        themes = installed_metrics()
    assert list(themes) == list(BUILTIN_THEMES)


def test_a_metric_of_an_installed_package_follows_the_built_in_themes(install):
    install("theirs", METRICS.group, "mine", METRIC.format(name="my_number"))
    assert list(installed_metrics()) == [*BUILTIN_THEMES, "mine"]


def test_an_interrupt_while_a_file_of_the_user_loads_is_an_interrupt(tmp_path):
    content = b"raise KeyboardInterrupt"
    with pytest.raises(KeyboardInterrupt):
        module_of(tmp_path / "slow.py", content, 64 * "0", "metric", "slow.py")
    with pytest.raises(InputError, match=r"slow\.py: cannot be loaded: .*line 1"):
        module_of(tmp_path / "slow.py", b"raise SystemExit(3)", 64 * "0", "metric", "slow.py")
