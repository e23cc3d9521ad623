"""What is to have all kernels compiled calls the controllers, too."""

from __future__ import annotations

import pytest

from drake_navbench.campaign.warm_up import WARM_UP_PRESETS, warm_up_specs
from drake_navbench.controller import CONTROLLERS
from drake_navbench.inputs.presets import default_presets, load_preset
from drake_navbench.plugins import is_ours
from drake_navbench.trial.trial import simulate


@pytest.mark.parametrize("spec", warm_up_specs("rpp"), ids=lambda spec: spec.scenario.name)
def test_the_controller_is_asked_in_every_trial_that_warms_up(spec):
    assert simulate(spec).samples["cycle_count"].max() > 0


def test_every_built_in_controller_is_warmed_up():
    driven = {load_preset(name).controller for name in (*default_presets(), *WARM_UP_PRESETS)}
    assert {name for name in CONTROLLERS.names if is_ours(_module(name))} == driven


def _module(controller):
    return CONTROLLERS.load(controller).__module__


def test_the_rotation_shim_is_warmed_up_turning_too():
    branches = set()
    for spec in warm_up_specs("rotation_shim"):
        branches |= {note.get("branch") for _, note in simulate(spec).diagnostics}
    assert "rotate_to_path" in branches
