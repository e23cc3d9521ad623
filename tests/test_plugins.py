"""Plugins are found by entry point; a broken one is named and leaves the others alone."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import pytest

from drake_navbench.analysis.metrics.registry import BUILTIN_THEMES, METRICS, installed_metrics
from drake_navbench.controller import CONTROLLERS
from drake_navbench.controllers.dwb.critics.registry import CRITICS as DWB_CRITICS
from drake_navbench.controllers.mppi.critics.registry import CRITICS as MPPI_CRITICS
from drake_navbench.errors import InputError

KINDS = {
    "controllers": CONTROLLERS,
    "DWB's critics": DWB_CRITICS,
    "MPPI's critics": MPPI_CRITICS,
    "metrics": METRICS,
}


@pytest.fixture
def install(install_package) -> Iterator[Callable[..., None]]:
    """A function that installs a package with one plugin."""

    def install_plugin(package: str, group: str, name: str, code: str) -> None:
        install_package(package, code, {group: {name: f"{package}.{package}:plugin"}})
        installed_metrics.cache_clear()

    yield install_plugin
    installed_metrics.cache_clear()


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_every_built_in_plugin_can_be_loaded(kind, recwarn):
    assert list(kind.load_all()) == kind.names
    assert kind.names
    assert not recwarn.list


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_a_plugin_that_breaks_when_imported_is_named_with_its_package(kind, install):
    built_in = kind.names
    install("theirs", kind.group, "broken", "1 / 0")
    with pytest.warns(UserWarning, match=f"^{kind.noun} 'broken' of package 'theirs': ") as warned:
        assert list(kind.load_all()) == built_in
    (warning,) = warned
    assert str(warning.message).endswith("cannot be loaded: ZeroDivisionError: division by zero")


@pytest.mark.parametrize("kind", [CONTROLLERS, DWB_CRITICS, MPPI_CRITICS], ids=lambda k: k.group)
def test_a_plugin_of_another_contract_is_told_what_it_lacks(kind, install):
    install("theirs", kind.group, "odd", "class plugin: pass")
    lacks = re.escape(", ".join(kind.members))
    with pytest.raises(
        InputError, match=rf"'odd' of package 'theirs': .* is no class with {lacks}"
    ):
        kind.load("odd")


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
