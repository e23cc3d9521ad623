"""Probes that are driven on for a robot that gives up, and a touch whose milder form is faint."""

from __future__ import annotations

import pytest
from fake_drives import PROBES, Fake

from drake_navbench.studies.doctor import visit as visits
from drake_navbench.studies.doctor.alike import NOTHING_TOLD
from drake_navbench.studies.doctor.driven_on import driven_on
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.words import verdict


class Patience(Fake):
    """A robot that stands in the door and gives up after so many seconds."""

    def __init__(self, patience_s):
        self.patience_s, self.driven = patience_s, []

    def drive(self, preset, probes, trials, *, seed):
        self.driven += [(probe.name, probe.timeout_s) for probe in probes]
        return [self.row(preset, probe) for _ in range(trials) for probe in probes]

    def row(self, preset, probe):
        stands = probe.name == "probe_door" and preset.name == "before"
        gives_up = stands and probe.timeout_s > self.patience_s
        return {
            "scenario": probe.name,
            "outcome": "aborted" if gives_up else "timed_out" if stands else "succeeded",
            "reason": "",
            "end": [9.0 if stands else 9.5],
            "severity": {"false_abort": 2.0} if gives_up else {},
        }


def seen_by(patient, driver, asked):
    found = visits.Visit(patient.facts(), asked=asked, probes=PROBES)
    found.rows = driver.drive(patient.chosen(patient.columns()), PROBES.values(), 2, seed=0)
    found.seen = visits.seen_in(found.rows)
    visits._treat(found, patient, NOTHING_TOLD, driver, seed=0)
    return found


def test_what_ended_by_time_is_driven_on_for_the_patience_of_the_file(patient):
    # 20 s of the probe, 20 s of patience, 5 s for the end of the task.
    driver = Patience(38.0)
    found = seen_by(patient, driver, Symptom.FALSE_ABORT)
    assert driver.driven[: len(PROBES) + 1] == [
        *((f"probe_{name}", 20.0) for name in PROBES),
        ("probe_door", 45.0),
    ]
    assert found.seen[Symptom.FALSE_ABORT] == ["door"]
    assert found.probes["door"].timeout_s == 45.0
    # The search and the judgement have the longer probe.
    assert ("probe_door", 20.0) not in driver.driven[len(PROBES) :]
    assert found.cure is not None
    assert "driven on to 45 s" in verdict(found)


@pytest.mark.parametrize("asked", [Symptom.FALSE_ABORT, Symptom.DOOR_STOP])
def test_a_robot_that_never_gives_up_keeps_its_probes(patient, asked):
    driver = Patience(100.0)
    found = seen_by(patient, driver, asked)
    assert found.treated is None
    assert found.probes == PROBES
    # Only who complains of a robot that gives up waits for it.
    assert (("probe_door", 45.0) in driver.driven) is (asked is Symptom.FALSE_ABORT)


def test_a_way_that_is_closed_is_not_driven_on(patient):
    closed = PROBES["door"].model_copy(update={"expected_outcome": "aborted"})
    rows = [{"scenario": "probe_door", "outcome": "timed_out"}]
    assert set(driven_on(PROBES, rows, patient.facts())) == {"door"}
    assert driven_on(PROBES | {"door": closed}, rows, patient.facts()) == {}


@pytest.mark.parametrize(("near_miss", "is_treated"), [(0.8, True), (0.4, False)])
def test_who_complains_of_touches_is_helped_where_the_robot_nearly_passes_too_closely(
    patient, near_miss, is_treated
):
    class Near(Patience):
        def row(self, preset, probe):
            shown = near_miss if preset.name == "before" else 0.0
            return super().row(preset, probe) | {"severity": {"near_miss": shown}}

    found = seen_by(patient, Near(100.0), Symptom.COLLISION)
    assert (found.treated is Symptom.NEAR_MISS) is is_treated
    told = "No probe shows collision. In 3 of 3 probes"
    assert verdict(found).startswith(told) is is_treated
    assert ("a weak sign (50% of the threshold)" in verdict(found)) is is_treated
