"""Known complaints: which of them a user's words are like, and what they say of the cure."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest
import yaml

from drake_navbench.errors import InputError
from drake_navbench.studies.doctor import complaints
from drake_navbench.studies.doctor.complaints import (
    OTHER_SYMPTOM,
    causes_by_words,
    known_complaints,
    terms_of,
)
from drake_navbench.studies.doctor.partial_files import facts_of_values
from drake_navbench.studies.doctor.symptoms import Symptom

ENTRY = {
    "says": "violet wheels hum at standstill",
    "symptoms": ["no_start"],
    "cures": {"amcl.alpha1 up": 1.0, "release upgrade": 0.5},
    "why": "an example",
}
OTHER = {**ENTRY, "says": "yellow wheels rattle downhill", "cures": {"amcl.alpha2 up": 1.0}}


@pytest.fixture
def causes(tmp_path, monkeypatch) -> Iterator:
    """The weights of causes by place, where the table of complaints has these entries alone."""

    def of(words, *entries, symptom=Symptom.NO_START, controller="RPP", release="jazzy"):
        file = {"source": "this test", "complaints": list(entries)}
        (tmp_path / "one.yaml").write_text(yaml.safe_dump(file))
        facts = facts_of_values(controller, release, {})
        return {c.place: weight for weight, c in causes_by_words(facts, symptom, words)}

    monkeypatch.setattr(complaints, "FOLDER", tmp_path)
    for cached in (known_complaints, complaints._weights):
        cached.cache_clear()
    yield of
    for cached in (known_complaints, complaints._weights):
        cached.cache_clear()


def test_terms_are_stems_and_pairs_of_them():
    assert terms_of("Oscillating robots, oscillated") == {"oscillat", "oscillat oscillat"}
    assert terms_of("BaseObstacle hits") == {
        "base",
        "obstacle",
        "hit",
        "base obstacle",
        "obstacle hit",
    }


def test_the_weight_is_the_cosine_with_rare_terms_counting_more(causes, monkeypatch):
    monkeypatch.setattr(complaints, "FEW_WORDS", 0.0)
    # "violet" is in one of two entries, "wheel" in both, and "wheel violet" in none.
    rare, common = math.log(1.0 + 2.0) ** 2, math.log(1.0 + 1.0) ** 2
    # violet, hum, standstill, and three pairs of words are in this entry alone, "wheel" in both.
    cosine = (rare + common) / math.sqrt((rare + common) * (6 * rare + common))
    weights = causes("wheels violet", ENTRY, OTHER)
    assert weights["amcl.alpha1"] == pytest.approx(cosine)
    assert weights["release"] == pytest.approx(0.5 * cosine)
    assert weights["amcl.alpha2"] < 0.5 * cosine


def test_a_single_word_counts_little(causes):
    # The word's squared weight is log(2)^2 = 0.48, the least squared length 250.
    assert causes("violet", ENTRY)["amcl.alpha1"] < math.sqrt(0.5 / 250.0)


def test_a_complaint_of_another_symptom_counts_less(causes):
    told = causes("violet hum", ENTRY)["amcl.alpha1"]
    other = causes("violet hum", ENTRY, symptom=Symptom.SPINS)["amcl.alpha1"]
    assert other == pytest.approx(OTHER_SYMPTOM * told)


@pytest.mark.parametrize(
    ("bound", "release", "counts"),
    [
        ({"until": "iron"}, "iron", True),
        ({"until": "iron"}, "jazzy", False),
        ({"since": "jazzy"}, "iron", False),
        ({"since": "jazzy"}, "kilted", True),
        ({"controllers": ["mppi"]}, "jazzy", False),
        ({"controllers": ["rpp"]}, "jazzy", True),
    ],
)
def test_release_and_controller_of_the_file_must_fit(causes, bound, release, counts):
    assert bool(causes("violet hum", ENTRY | bound, release=release)) is counts


def test_the_reason_of_a_complaint_is_given_for_its_likeliest_cure_alone(causes):
    causes("violet hum", ENTRY)
    ((first, _), (second, _)) = known_complaints()[0].causes
    assert (first.why, second.why) == ("an example", complaints.ALSO)


def test_words_that_no_complaint_has_say_nothing(causes):
    assert causes("something else entirely", ENTRY) == {}


@pytest.mark.parametrize(
    ("wrong", "told"),
    [({"cures": {"amcl.alpha1": 1.0}}, "expected `place direction`"), ({"says": ""}, "says")],
)
def test_a_wrong_entry_is_one_line(causes, wrong, told):
    with pytest.raises(InputError, match=told):
        causes("violet", ENTRY | wrong)


def test_each_symptom_has_known_complaints():
    counts = {s: sum(s in k.complaint.symptoms for k in known_complaints()) for s in Symptom}
    assert min(counts.values()) >= 10, counts
