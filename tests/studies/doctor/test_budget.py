"""`--budget` ends a visit: a clock that is handed in goes on by 10 s with each trial."""

from __future__ import annotations

import pytest
from fake_drives import PROBES, tried

from drake_navbench.studies.doctor import driving
from drake_navbench.studies.doctor.alike import NOTHING_TOLD
from drake_navbench.studies.doctor.change import judge
from drake_navbench.studies.doctor.driving import Driver
from drake_navbench.studies.doctor.page import write_outputs
from drake_navbench.studies.doctor.probes import nearest_first
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.tried import Verdict
from drake_navbench.studies.doctor.visit import visit
from drake_navbench.studies.doctor.visited import Visit
from drake_navbench.studies.doctor.words import verdict

TRIAL_S = 10.0


class Clock:
    """Returns the time, s. driven: the probes of the trials, by whether the file was changed."""

    def __init__(self):
        self.time_s, self.driven = 0.0, []

    def __call__(self):
        return self.time_s

    def drive_each(self, specs, kept_of, *, jobs, on_row):
        """Every trial of the unchanged file wobbles, and none of a change."""
        for spec in specs:
            self.time_s += TRIAL_S
            is_changed = spec.preset.name == "after"
            self.driven.append((is_changed, spec.scenario.name.removeprefix("probe_")))
            on_row(spec, {
                "scenario": spec.scenario.name,
                "severity": {} if is_changed else {"wobble_straight": 2.0},
                "outcome": "succeeded", "reason": "", "end": [float(is_changed)],
            })  # fmt: skip


@pytest.fixture
def drivers(monkeypatch, tmp_path):
    """A function that returns a clock, and a driver with a budget, s."""

    def of(budget_s):
        clock = Clock()
        monkeypatch.setattr(driving, "drive_each", clock.drive_each)
        return clock, Driver(
            tmp_path, "wheelchair", jobs=1, budget_s=budget_s, tell=lambda line: None, clock=clock
        )

    return of


@pytest.fixture
def visited(patient, drivers):
    """A function that visits a robot that wobbles; returns clock, findings and driver."""

    def of(budget_s):
        clock, driver = drivers(budget_s)
        return clock, visit(patient, Symptom.WOBBLE_STRAIGHT, NOTHING_TOLD, driver, seed=0), driver

    return of


@pytest.mark.parametrize("budget_s", [1.0, pytest.param(45.0, marks=pytest.mark.long), 700.0])
def test_no_trial_begins_after_the_budget(visited, budget_s):
    clock, found, _ = visited(budget_s)
    assert clock.time_s < budget_s + TRIAL_S
    assert verdict(found)


def test_half_of_a_short_budget_goes_to_the_probes_nearest_to_the_symptom(visited):
    """100 of 200 s are 10 trials, of 34: the first seed of the probes made for a wobble first."""
    clock, found, _ = visited(200.0)
    made = ["straight", "straight_rough", "corridor"]
    assert [name for _, name in clock.driven[:3]] == made
    assert (found.look.planned, found.look.lacking) == (34, 24)
    assert len(found.undriven) == 7
    told = "The first look had time for 10 of 34 trials (not driven: "
    assert told in verdict(found)
    assert verdict(found).startswith("In 10 of 10 probes (")


def test_a_slow_first_trial_leaves_no_probe_made_for_the_symptom_out(visited):
    """Half of 35 s are two trials of 10 s; the third is driven from the other half."""
    made = ["straight", "straight_rough", "corridor"]
    clock, found, _ = visited(35.0)
    assert [name for _, name in clock.driven[:3]] == made
    assert len(found.rows) == 3


def test_a_budget_too_small_for_the_probes_of_a_symptom_names_one_that_suffices(
    visited, monkeypatch
):
    """In 15 s two trials begin; three of 10 s fit into half of 60 s."""
    told = []
    monkeypatch.setattr(
        Driver, "tell", property(lambda _: told.append, lambda *_: None), raising=False
    )
    clock, *_ = visited(15.0)
    assert len(clock.driven) == 2
    assert (
        "  the budget is too small for the 3 probes made for wobble_straight: the same command "
        "with --budget 1m drives them all"
    ) in told


def test_the_same_command_goes_on_with_what_was_left_out(visited):
    visited(200.0)
    clock, found, _ = visited(1500.0)
    # 24 trials of the first look, 12 of the search that the first visit could not all drive.
    assert found.look.lacking == 0
    assert [is_changed for is_changed, _ in clock.driven[:24]] == [False] * 24
    assert "had time for" not in verdict(found)


def test_the_search_leaves_time_for_the_judgement(visited):
    """34 trials of the first look, 12 of the search, and the changes until the time is kept."""
    clock, found, _ = visited(1500.0)
    assert found.cure is not None
    assert found.cure.lacking == 0
    assert clock.time_s <= 1500.0


@pytest.mark.parametrize(
    ("budget_s", "trials", "lacking", "undriven"),
    [
        # Eight fresh seeds of one probe and two of the others, before and after: 24 trials.
        (240.0, 12, 0, ()),
        (205.0, 10, 2, ()),
        (185.0, 9, 3, ("door",)),
        (165.0, 8, 4, ("corridor", "door")),
    ],
)
def test_a_judgement_that_is_cut_short_says_what_it_lacks(
    patient, drivers, budget_s, trials, lacking, undriven
):
    shown = [tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)]
    _, driver = drivers(budget_s)
    symptom = Symptom.WOBBLE_STRAIGHT
    (found,) = judge(patient, shown, symptom, PROBES, ["straight"], driver, seed=0)
    assert (found.trials, found.lacking, found.undriven) == (trials, lacking, undriven)
    visit = Visit(patient.facts(), probes=PROBES, treated=symptom)
    visit.seen, visit.tried, visit.judged = {symptom: ["straight"]}, shown, [found]
    told = verdict(visit)
    names = f"; not driven with the change: {', '.join(undriven)}" * bool(undriven)
    assert (
        f"There was no time for {lacking} further trials of this judgement{names}." in told
    ) == (lacking > 0)
    assert ("of all probes that did" in told) == (not undriven)


def test_without_time_for_a_whole_seed_nothing_is_judged(patient, drivers):
    shown = [tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)]
    _, driver = drivers(25.0)
    # The time allows three trials, and two probes before and after take four.
    own = ["straight", "door"]
    assert list(judge(patient, shown, Symptom.WOBBLE_STRAIGHT, PROBES, own, driver, seed=0)) == []


def test_the_users_map_comes_after_what_was_made_for_the_symptom():
    names = ["bends", "door", "straight", "map_1", "corridor"]
    assert nearest_first(names, [Symptom.WOBBLE_STRAIGHT]) == [
        "straight", "corridor", "map_1", "bends", "door",
    ]  # fmt: skip
    assert nearest_first(names, [])[0] == "map_1"
    assert nearest_first(names, [Symptom.COLLISION])[:2] == ["door", "corridor"]


def test_no_replay_is_driven_after_the_budget(visited, patient, tmp_path):
    clock, found, driver = visited(45.0)
    clock.time_s = 45.0
    assert Symptom.WOBBLE_STRAIGHT in found.seen
    written = write_outputs(found, patient, tmp_path, driver)
    assert not [path for path in written if path.name.startswith("seen_")]
