"""Metrics are found by entry point, and all of them are documented."""

from __future__ import annotations

import math
from types import ModuleType

import pytest
from catalogue import REPLACED_BY, section
from synthetic_logs import straight_log

from drake_navbench.analysis.metrics import Undefined, metric
from drake_navbench.analysis.metrics.registry import (
    BUILTIN_THEMES,
    all_metrics,
    installed_metrics,
    measure_all,
    metrics_in,
    unrepeatable_names,
)
from drake_navbench.errors import InputError


@metric(unit="m", better="higher")
def last_x_m(log):
    """Where it ended.

    Formula: x.
    """
    return log.samples["x_m"].iloc[-1]


def test_every_built_in_theme_is_installed():
    assert set(BUILTIN_THEMES) <= set(installed_metrics())


def test_an_entry_point_may_name_a_single_metric_or_a_module_of_them():
    assert metrics_in(last_x_m, "mine") == (last_x_m,)
    module = ModuleType(__name__)
    module.last_x_m = last_x_m
    assert metrics_in(module, "mine") == (last_x_m,)


def test_an_entry_point_without_metrics_is_refused_by_name():
    with pytest.raises(
        InputError, match=r"metric 'mine': .* drake_navbench\.metrics .*expected a function"
    ):
        metrics_in(ModuleType("empty"), "mine")


def test_a_metric_can_be_called_on_a_log():
    assert last_x_m(straight_log()) == pytest.approx(5.0)
    assert last_x_m.summary == "Where it ended."


def test_nan_never_passes_for_a_number():
    broken = metric(unit="", better="lower")(lambda log: math.nan)
    with pytest.raises(Undefined, match="gave nan"):
        broken(straight_log())


def test_a_broken_metric_leaves_an_empty_cell_with_the_reason():
    broken = metric(unit="", better="lower")(lambda log: log.samples["nothing"])
    measured = broken.measure(straight_log())
    assert math.isnan(measured.value)
    assert measured.reason == "KeyError: 'nothing'"


def test_every_undefined_value_has_a_reason():
    for name, measured in measure_all(straight_log(outcome="aborted")).items():
        assert math.isnan(measured.value) == bool(measured.reason), name


def test_only_compute_times_depend_on_the_machine():
    compute = {entry.name for entry in installed_metrics()["compute"]}
    assert set(unrepeatable_names()) == compute


@pytest.mark.parametrize("entry", all_metrics(), ids=lambda entry: entry.name)
def test_every_metric_has_a_summary_and_a_formula(entry):
    assert entry.summary.endswith("."), entry.name
    assert section(entry, "Formula"), entry.name


def test_a_line_of_a_formula_may_begin_with_a_word_and_a_colon():
    (jerk,) = (entry for entry in all_metrics() if entry.name == "rms_linear_jerk")
    assert section(jerk, "Formula").endswith("shrinks: comparable at the published 0.115 s only.")


def test_corrected_forms_exist():
    names = {entry.name for entry in all_metrics()}
    assert set(REPLACED_BY) | set(REPLACED_BY.values()) <= names
