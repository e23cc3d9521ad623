"""The presets of nav2_bringup look at the centre alone; the front of the wheelchair touches."""

from __future__ import annotations

import pytest

from drake_navbench import run_trial
from drake_navbench.inputs.presets import load_preset
from drake_navbench.logs.outcome import Outcome


@pytest.mark.parametrize(
    ("preset", "why"),
    [
        ("dwb_bringup", "BaseObstacle"),
        pytest.param("mppi_bringup", "consider_footprint", marks=pytest.mark.long),
    ],
)
def test_a_bringup_preset_touches_the_wall_and_says_so(preset, why):
    assert run_trial("restricted_small", preset).outcome is Outcome.COLLIDED
    described = load_preset(preset).description
    assert why in described
    assert "hits the wall in restricted_small and restricted_large" in described


@pytest.mark.long
@pytest.mark.parametrize("preset", ["dwb_bringup", "mppi_bringup"])
def test_it_touches_the_farther_wall_too(preset):
    assert run_trial("restricted_large", preset).outcome is Outcome.COLLIDED
