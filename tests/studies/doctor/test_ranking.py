"""The score of a cause: the parts of the evidence for it, and their weights."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from drake_navbench.studies.doctor.alike import Told
from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.complaints import terms_of
from drake_navbench.studies.doctor.partial_files import facts_of_values
from drake_navbench.studies.doctor.ranking import Evidence, likeness_to_texts
from drake_navbench.studies.doctor.reading import suspicions_of
from drake_navbench.studies.doctor.symptoms import Symptom

STUDY = Path(__file__).parents[3] / "studies" / "doctor_reading.py"
SLOW = Told("drives slowly; raising controller_frequency changes nothing; vx_std is 0.1")


@pytest.fixture(scope="module")
def study():
    """The module of the study, which is no part of the package."""
    spec = importlib.util.spec_from_file_location("doctor_reading", STUDY)
    sys.modules[spec.name] = module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def slow():
    """The causes of a robot that is too slow, by place and direction."""
    facts = facts_of_values("MPPI", "jazzy", {"vx_max": 0.3})
    return {s.cause.key: s for s in suspicions_of(facts, Symptom.TOO_SLOW, SLOW)}


def test_the_unit_of_a_score_is_the_weight_of_a_suspect():
    assert Evidence().score == 0.0
    assert Evidence(suspect=0.4).score == pytest.approx(0.4)


def test_a_score_is_the_sum_of_its_parts():
    parts = Evidence(rule=1.0), Evidence(suspect=0.5), Evidence(named=1.0), Evidence(words=0.2)
    together = Evidence(rule=1.0, suspect=0.5, named=1.0, words=0.2)
    assert together.score == pytest.approx(sum(part.score for part in parts))
    assert all(part.score > 0.0 for part in parts)


def test_each_cause_has_the_evidence_that_its_score_is_made_of(slow):
    named = slow["controller.vx_max", Direction.UP]
    assert named.evidence.named == 1.0
    assert named.score == named.evidence.score
    # Named in words alone, without a number in the file.
    assert slow["controller.vx_std", Direction.UP].evidence.named == 1.0


def test_words_are_like_the_texts_of_the_cause_that_they_tell_of():
    terms = terms_of("the top speed is too low, drives slowly")
    faster, other = (
        likeness_to_texts(terms, Cause(place, Direction.UP))
        for place in ("controller.max_vel_x", "amcl.alpha1")
    )
    assert 2.0 >= faster > other >= 0.0
    assert likeness_to_texts(frozenset(), Cause("controller.max_vel_x", Direction.UP)) == 0.0


def test_the_fit_gives_weight_to_the_part_that_tells_cures_apart(study):
    # In three cases the cure has the rule; the suspects' weights are the same or against it.
    rows = np.array([[1.0, 0.2, 0.0, 0.1], [0.0, 0.4, 0.0, 0.1], [0.0, 0.2, 1.0, 0.3]])
    cure = np.array([True, False, False])
    cases = [study.Choice(None, name, [], rows, cure) for name in "abc"]
    rule, suspect, named, words = study.fitted(cases)
    assert rule > 0.0 > suspect
    assert named < 0.0
    assert words < 0.0


def test_a_thread_of_a_host_and_a_note_are_owners_of_their_own(study):
    assert study.owner_of("Maker/robot@0123abc") == "maker"
    assert study.owner_of("ros-navigation/navigation2#12") == "ros-navigation/navigation2#12"
    assert study.owner_of('note "Faults", 3') == study.owner_of('note "Faults", 1')
