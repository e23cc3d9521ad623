"""What a visit without a patch leaves in its user's hand: changes to try, each with its label."""

from __future__ import annotations

from dataclasses import replace

import pytest
from doctor_texts import MPPI, MPPI_BLOCK, nav2_text
from fake_drives import CAUSE, PROBES, Rows, judged, tried

from drake_navbench.nav2.patch import Place
from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.labels import cure_label, offer_label, told_of_offers
from drake_navbench.studies.doctor.next_step import next_step
from drake_navbench.studies.doctor.offer import Kind
from drake_navbench.studies.doctor.offers import offers_of
from drake_navbench.studies.doctor.page import page, write_outputs
from drake_navbench.studies.doctor.reading import Suspicion
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.tried import Verdict
from drake_navbench.studies.doctor.visited import Visit

WOBBLE = Symptom.WOBBLE_STRAIGHT
# In the order of the suspicions: what is read to be likeliest comes first.
READ = [
    Suspicion(CAUSE, 0.9, ("The outline is not looked at.",)),
    Suspicion(Cause("controller.wz_std", Direction.DOWN, 0.2), 0.8, ("It swings.",)),
    Suspicion(Cause("controller.vx_max", Direction.DOWN, 0.3), 0.7, ("It is fast.",)),
    Suspicion(Cause("controller.batch_size", Direction.UP, 2000), 0.6, ("It is coarse.",)),
]


def visited(patient, **known):
    """A visit of a robot that wobbles, which no probe shows, unless more is known."""
    values = {"asked": WOBBLE, "probes": PROBES, "suspicions": READ, "of_complaint": READ}
    return Visit(patient.facts(), **(values | known))


def offered(patient, visit, driver=None, **options):
    visit.offers = list(offers_of(visit, patient, driver or Rows([], []), [WOBBLE], **options))
    return visit.offers


def places(offers):
    return [next(iter(offer.trial.changes)).name.rpartition(".")[2] for offer in offers]


def test_a_complaint_that_no_probe_shows_leaves_the_three_likeliest_changes_to_try(patient):
    found = visited(patient)
    first, *_ = offers = offered(patient, found)
    assert places(offers) == ["consider_footprint", "wz_std", "vx_max"]
    assert {offer.kind for offer in offers} == {Kind.READ}
    # Three probes in two seeds; no trial of the changed file ends where the other one does.
    assert offer_label(first) == (
        "Not shown by driving. By reading: The outline is not looked at. Harmless in 6 trials of "
        "the probes: no touch more, no symptom in two more."
    )
    lines = told_of_offers(found)
    assert lines[2] == "  try_1.patch: FollowPath.CostCritic.consider_footprint = true"
    assert max(map(len, lines)) <= 80
    assert next_step(found) == (
        "Next, on the robot: try_1.patch (FollowPath.CostCritic.consider_footprint = true), and "
        "nothing else."
    )


def test_an_abnormal_value_counts_among_the_changes_to_try(patient):
    # Nav2's gamma is 0.015: ten times that weighs as much as the suspect does. Of the file's other
    # abnormal values patience, twice Nav2's, comes before the radius of progress by its name.
    patient.paths[0].write_text(nav2_text(MPPI_BLOCK | {"gamma": 0.15}, plugin=MPPI))
    (suspect,) = READ[3:]
    offers = offered(patient, visited(replace(patient), of_complaint=[suspect]))
    assert places(offers) == ["gamma", "batch_size", "movement_time_allowance"]
    # Three far values more, and being far from Nav2's tells nothing.
    far = {"gamma": 0.15, "temperature": 3.0, "vx_std": 2.0, "wz_std": 4.0}
    patient.paths[0].write_text(nav2_text(MPPI_BLOCK | far, plugin=MPPI))
    offers = offered(patient, visited(replace(patient), of_complaint=[suspect]))
    assert places(offers) == ["batch_size"]


def test_the_complaints_own_number_is_told_although_it_is_below_its_threshold(patient):
    class Slight(Rows):
        values = (0.4, 0.1)

        def drive(self, preset, probes, trials, *, seed):
            value = self.values[preset.name != "before"]
            rows = super().drive(preset, probes, trials, seed=seed)
            return [row | {"severity": {"wobble_straight": value}, "end": [9.0]} for row in rows]

    first, *_ = offered(patient, visited(patient, of_complaint=READ[:1]), Slight([], []))
    assert offer_label(first).endswith(
        " The mean severity of wobble_straight, a symptom above 1, goes from 0.40 to 0.10."
    )
    Slight.values = (0.001, 0.002)  # Told with two digits: 0.00, of which nothing is to be said.
    hardly, *_ = offered(patient, visited(patient, of_complaint=READ[:1]), Slight([], []))
    assert "severity" not in offer_label(hardly)
    still, *_ = offered(patient, visited(patient, of_complaint=READ[:1]), Same([], []))
    assert "Nothing changes in 6 trials, to the last digit" in offer_label(still)


class Same(Rows):
    """A driver of trials that no change alters."""

    def drive(self, preset, probes, trials, *, seed):
        rows = super().drive(preset, probes, trials, seed=seed)
        return [row | {"severity": {}, "end": [9.0]} for row in rows]


class First(Rows):
    """A driver with which the first changed file shows symptoms, and no other one. seeds: of it."""

    first, seeds = None, 0

    def drive(self, preset, probes, trials, *, seed):
        rows = super().drive(preset, probes, trials, seed=seed)
        if preset.name == "after":
            self.first = self.first or preset
        if preset is not self.first:
            return rows
        self.seeds = trials
        return [row | {"severity": {self.symptom: 2.0}} for row in rows]


@pytest.mark.parametrize("symptom", [Symptom.COLLISION, Symptom.SPINS])
def test_a_change_that_makes_something_worse_is_left_out(patient, symptom):
    driver = First([], [])
    driver.symptom = symptom
    # The touch or the spin is there in the first seed: there is no second one.
    assert places(offered(patient, visited(patient), driver)) == ["wz_std", "vx_max", "batch_size"]
    assert driver.seeds == 1


@pytest.mark.parametrize(("left_s", "drives"), [(0.0, True), (100.0, False)])
def test_without_time_or_after_ctrl_c_the_changes_are_offered_as_not_driven(
    patient, left_s, drives
):
    driver = First([], [])
    driver.symptom, driver.left_s = Symptom.COLLISION, left_s
    offers = offered(patient, visited(patient), driver, drives=drives)
    assert driver.seeds == 0
    assert len(offers) == 3
    assert offer_label(offers[0]).endswith("There was no time to see if it makes something worse.")


def test_a_change_on_which_no_trial_depends_is_offered_as_that(patient):
    patient.paths[0].write_text(nav2_text(MPPI_BLOCK, plugin=MPPI, amcl={"max_particles": 800}))
    particles = Suspicion(Cause("amcl.max_particles", Direction.UP, 2000), 1.0, ("Too few.",))
    first, *_ = offered(patient, visited(patient, of_complaint=[particles]))
    assert offer_label(first) == (
        "Not shown by driving. By reading: Too few. No trial of this program depends on it, so "
        "none was driven."
    )


def test_a_cure_with_a_price_is_offered_first_with_both_figures(patient):
    shown = judged(patient, ["wobble_straight"], [], WOBBLE)
    priced = replace(shown, after=shown.after | {"spins": 3})
    assert not priced.helps
    found = visited(patient, treated=WOBBLE, seen={WOBBLE: ["straight"]}, judged=[priced])
    found.tried, found.suspicions = [shown.tried], []
    first, *_ = offered(patient, found)
    assert first.kind is Kind.TRADE
    assert offer_label(first) == (
        "Shown by driving, at a price: of 8 fresh trials 8 showed wobble_straight before the "
        "change, 0 with it; but the robot spins or circles (spins) in 3 trials, before the change "
        "in 0."
    )
    assert next_step(found).startswith("Next: weigh the price of try_1.patch (FollowPath.CostC")
    # A touch is no price that anybody pays, and what is offered as a cure is not offered again.
    found.judged = [replace(priced, after=shown.after | {"collision": 1})]
    assert Kind.TRADE not in {offer.kind for offer in offered(patient, found)}
    found.judged = [shown]
    assert offered(patient, found) == []


def test_what_helped_in_the_search_comes_before_what_is_only_read_and_what_did_not_not_at_all(
    patient,
):
    def entry(suspicion, name, value, after, **more):
        trial = Trial(suspicion.cause, {Place("controller_server", f"FollowPath.{name}"): value})
        return tried(2.0, after, 1.0, suspicion=suspicion, trial=trial, **more)

    found = visited(patient, treated=WOBBLE, seen={WOBBLE: ["straight"]})
    found.tried = [
        entry(READ[2], "vx_max", 0.3, 1.0),
        # 5% less in twelve pairs is nothing.
        entry(READ[1], "wz_std", 0.2, 1.9),
    ]
    offers = offered(patient, found)
    assert places(offers) == ["vx_max", "consider_footprint", "batch_size"]
    assert offer_label(offers[0]).startswith(
        "It helped in the search (its severity falls from 2.00 to 1.00 in 12 pairs), which is too "
        "little to show it. By reading: It is fast. Harmless in 6 trials"
    )
    found.tried = [entry(READ[2], "vx_max", 0.3, 0.0, verdict=Verdict.SHOWN)]
    found.suspicions = READ[:1]
    told = offer_label(offered(patient, found)[0])
    assert told.startswith("Shown in the search (its severity falls from 2.00 to 0.00 in 12 pairs)")
    # One that adds touches is not offered, whatever it cures.
    found.tried = [entry(READ[0], "CostCritic.consider_footprint", True, 0.0, touches=1)]
    assert "consider_footprint" not in places(offered(patient, found))


def test_patches_and_page_bear_the_label_and_an_older_visits_files_go(patient, tmp_path):
    found = visited(patient)
    offered(patient, found, drives=False)
    for name in ("change.patch", "patched.yaml", "seen_spins.html", "mine.yaml"):
        (tmp_path / name).write_text("older")
    written = {path.name for path in write_outputs(found, patient, tmp_path)}
    tries = {f"try_{n}.{kind}" for n in (1, 2, 3) for kind in ("yaml", "patch")}
    assert written == {"doctor.html", *tries}
    assert {path.name for path in tmp_path.iterdir()} == {*written, "mine.yaml", "nav2.yaml"}
    assert "consider_footprint: true" in (tmp_path / "try_1.yaml").read_text()
    head, _, body = (tmp_path / "try_1.patch").read_text().partition("--- nav2.yaml\n")
    assert head.startswith("# drake-navbench doctor: FollowPath.CostCritic.consider_footprint = tr")
    assert " ".join(head.replace("# ", "").split()).endswith(offer_label(found.offers[0]))
    assert "+        consider_footprint: true\n" in body
    assert page(found, patient).count("Not shown by driving.") == 3
    # What Ctrl-C cuts short takes nothing away.
    found.is_interrupted, found.offers = True, []
    write_outputs(found, patient, tmp_path)
    assert (tmp_path / "try_1.patch").exists()


def test_the_patch_of_a_cure_says_what_was_shown(patient):
    found = judged(patient, ["wobble_straight"], [], WOBBLE)
    assert cure_label(found) == (
        "Shown by driving: of 8 fresh trials 8 showed wobble_straight before the change, 0 with "
        "it; no other symptom became worse."
    )
