"""The tuned presets that come with the package touch nothing."""

from __future__ import annotations

import pytest

from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.rows_of_trials import measure
from drake_navbench.studies.tuning.guards import random_world, touches_of
from drake_navbench.trial.trial import run_trial

TUNED = ("dwb_tuned", "mppi_tuned")
CLOSED = (
    "restricted_small",
    "restricted_large",
    "restricted_small_noisy",
    "restricted_large_noisy",
)
# No search with seed 0 of less than 1000 fresh trials has driven these.
WORLDS = range(1000, 2000)


@pytest.mark.long
@pytest.mark.parametrize("preset", TUNED)
def test_a_tuned_preset_stops_in_front_of_a_wall_that_closes_its_way(preset):
    assert run_trial("restricted_small", preset).outcome == "aborted"


@pytest.mark.long
@pytest.mark.parametrize("preset", TUNED)
def test_a_tuned_preset_touches_nothing_where_the_way_is_closed(preset):
    planned = plan_campaign(CLOSED, [preset], trials=12, seed=4002, keeps_costmaps=False)
    assert touches_of(measure(planned.specs, jobs=2)) == {}


@pytest.mark.long
@pytest.mark.parametrize("preset", TUNED)
def test_a_tuned_preset_touches_nothing_in_a_thousand_random_worlds(preset):
    worlds = [random_world(number) for number in WORLDS]
    planned = plan_campaign(worlds, [preset], trials=1, keeps_costmaps=False)
    assert touches_of(measure(planned.specs, jobs=2)) == {}
