"""What is to have all kernels compiled calls the controllers, too."""

from __future__ import annotations

import pytest

from drake_navbench.campaign.warm_up import warm_up_specs
from drake_navbench.trial.trial import simulate


@pytest.mark.parametrize("spec", warm_up_specs("rpp"), ids=lambda spec: spec.scenario.name)
def test_the_controller_is_asked_in_every_trial_that_warms_up(spec):
    assert simulate(spec).samples["cycle_count"].max() > 0
