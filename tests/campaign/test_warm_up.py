"""What is to have all kernels compiled calls the controllers, too."""

from __future__ import annotations

import pytest

from drake_navbench.campaign.warm_up import WARM_UP_PRESETS, warm_up_specs
from drake_navbench.inputs.presets import default_presets, load_preset
from drake_navbench.trial.trial import simulate


@pytest.mark.parametrize("spec", warm_up_specs("rpp"), ids=lambda spec: spec.scenario.name)
def test_the_controller_is_asked_in_every_trial_that_warms_up(spec):
    assert simulate(spec).samples["cycle_count"].max() > 0


def test_the_controllers_that_no_default_column_drives_are_warmed_up_too():
    driven = {load_preset(name).controller for name in (*default_presets(), *WARM_UP_PRESETS)}
    assert driven >= {"dwb", "graceful", "mppi", "rotation_shim", "rpp", "teb", "vector_pursuit"}


def test_the_rotation_shim_is_warmed_up_turning_too():
    branches = set()
    for spec in warm_up_specs("rotation_shim"):
        branches |= {note.get("branch") for _, note in simulate(spec).diagnostics}
    assert "rotate_to_path" in branches
