"""Trials give the same bytes on every processor that has the baseline."""

import numpy as np
import pytest
from digests import QUICK, SLOW, digest, kept

from drake_navbench import run_trial
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS
from drake_navbench.processes.instruction_set import BASELINE, instruction_set

needs_baseline = pytest.mark.skipif(
    instruction_set() != BASELINE, reason=f"this processor is not held to {BASELINE}"
)


def differing(presets):
    """Returns the trials whose digests differ from those that are kept."""
    driven = kept()
    assert tuple(driven) == PUBLISHED_SCENARIOS
    return [
        f"{preset} in {scenario}"
        for scenario, digests in driven.items()
        for preset in presets
        if digest(run_trial(scenario, preset)) != digests[preset]
    ]


@needs_baseline
def test_the_analytic_controllers_drive_the_bytes_that_are_kept():
    assert differing(QUICK) == []


@needs_baseline
@pytest.mark.long
def test_all_other_controllers_drive_the_bytes_that_are_kept():
    assert differing(SLOW) == []


@needs_baseline
@pytest.mark.long
def test_where_nothing_moves_harmony_stops_for_nothing():
    stopping = "harmony:stop_for_moving=true"
    driven = {name: digest(run_trial(name, stopping)) for name in PUBLISHED_SCENARIOS}
    assert driven == {name: digests["harmony"] for name, digests in kept().items()}


def test_a_digest_changes_with_the_last_bit_of_one_sample_but_not_with_compute_times():
    log = run_trial("restricted_small", "rpp")
    before = digest(log)
    log.samples["compute_time_ms"] += 1.0
    assert digest(log) == before
    log.samples.loc[1, "x_m"] = np.nextafter(log.samples.loc[1, "x_m"], 9.0)
    assert digest(log) != before
