"""What a visit without a patch tells its user to do next."""

from __future__ import annotations

import pytest
from fake_drives import CAUSE, PROBES, Rows, judged, tried

from drake_navbench.studies.doctor import experiment
from drake_navbench.studies.doctor.alike import Told
from drake_navbench.studies.doctor.first_look import Look
from drake_navbench.studies.doctor.next_step import next_step
from drake_navbench.studies.doctor.page import page
from drake_navbench.studies.doctor.reading import Suspicion, findings_of
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.tried import Verdict
from drake_navbench.studies.doctor.visit import visit
from drake_navbench.studies.doctor.visited import Visit
from drake_navbench.studies.doctor.words import verdict

SNAKE = Told("it swings left and right on straight ways, like a snake")


def test_where_another_symptom_is_treated_the_complaint_gets_its_first_advice(patient, monkeypatch):
    monkeypatch.setattr(experiment, "MOST_CHANGES", 9)
    # The words tell a wobble; every trial spins, with each change as well.
    found = visit(patient, None, SNAKE, Rows(["spins"], ["spins"]), seed=0)
    assert found.treated is Symptom.SPINS
    assert found.complaint is Symptom.WOBBLE_STRAIGHT
    told = verdict(found)
    assert told.startswith("No probe shows what your words may tell (wobble_straight")
    assert told.endswith(" Below: 3 changes to try on the robot for wobble_straight.")
    # The question is about the complaint, not about what is treated.
    alone = visit(patient, None, SNAKE, Rows([], []), seed=0)
    assert found.alike == alone.alike
    assert found.alike


@pytest.mark.parametrize("lacking", [0, 3])
def test_what_the_time_cut_short_goes_on_before_anything_is_changed(patient, lacking):
    found = Visit(patient.facts(), probes=PROBES, suspicions=[Suspicion(CAUSE, 1.0, ("Why.",))])
    found.look = Look([], 6, lacking)
    told = next_step(found)
    assert told.startswith("Next: give the same command again") == (lacking > 0)
    if not lacking:
        flag = "set FollowPath.CostCritic.consider_footprint to true"
        assert told == f"Next, on the robot: {flag}, and nothing else."
    assert f"<b>{told}</b>" in page(found, patient)


def test_what_the_file_itself_shows_is_mended_before_anything_is_guessed(patient):
    guess = Suspicion(CAUSE._replace(place="controller.wz_std"), 1.0, ("Why.",))
    found = Visit(patient.facts(), suspicions=[guess], findings=findings_of(patient.facts()))
    assert [finding.rule.name for finding in found.findings] == ["mppi-centre-alone"]
    assert next_step(found).startswith(
        "Next: mend what the file itself shows: set FollowPath.CostCritic.consider_footprint to tru"
    )


def test_with_a_patch_the_patch_is_the_next_step(patient):
    found = Visit(patient.facts(), probes=PROBES, treated=Symptom.COLLISION)
    found.judged = [judged(patient, ["collision"], [], Symptom.COLLISION)]
    assert next_step(found) == ""
    found.judged, found.tried = [], [tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)]
    assert next_step(found).startswith("Next: weigh the price of FollowPath.CostCritic.consider")


def test_without_words_and_symptoms_the_user_is_asked_for_them(patient):
    assert next_step(Visit(patient.facts())).endswith("by --symptom or --told.")
