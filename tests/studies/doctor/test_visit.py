"""What a visit looks for, treats and says."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from doctor_texts import MPPI, MPPI_BLOCK, nav2_text
from fake_drives import CAUSE, PROBES, TRIAL, Counted, Rows, judged, tried

from drake_navbench.commands.doctor import main
from drake_navbench.inputs.robot import load_robot
from drake_navbench.nav2.patch import Place
from drake_navbench.studies.doctor import visit as visits
from drake_navbench.studies.doctor.alike import NOTHING_TOLD, Told
from drake_navbench.studies.doctor.candidates import BEYOND, HALF
from drake_navbench.studies.doctor.causes import Direction
from drake_navbench.studies.doctor.change_words import change_told
from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.detectors import detectors_digest
from drake_navbench.studies.doctor.differences import with_differences
from drake_navbench.studies.doctor.driving import SEARCH_SEED, Driver
from drake_navbench.studies.doctor.experiment import TOGETHER
from drake_navbench.studies.doctor.first_look import unsure_of
from drake_navbench.studies.doctor.page import write_outputs
from drake_navbench.studies.doctor.patches import patch_of
from drake_navbench.studies.doctor.probes import LONGEST_S, MAKERS, ROUGH, probes_for
from drake_navbench.studies.doctor.reading import findings_of, suspicions_of
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.tried import NO_TIME, Rarity, Verdict
from drake_navbench.studies.doctor.words import verdict


def test_a_change_of_one_costmap_is_told_from_that_of_the_other():
    def told(node):
        return change_told(Trial(CAUSE, {Place(node, "inflation_layer.inflation_radius"): 0.3}))

    assert told("local_costmap/local_costmap") == (
        "local_costmap: inflation_layer.inflation_radius = 0.3"
    )
    assert told("global_costmap/global_costmap").startswith("global_costmap: ")
    assert change_told(TRIAL) == "FollowPath.CostCritic.consider_footprint = true"


@pytest.mark.parametrize(("severity", "bar"), [(1.1, 1.0), (0.7, 0.5), (0.4, None)])
def test_a_weak_sign_of_the_complaint_is_treated_and_called_weak(patient, severity, bar):
    class Weak(Counted):
        def drive(self, preset, probes, trials, *, seed):
            rows = super().drive(preset, probes, trials, seed=seed)
            if preset.name == "before":
                rows = [row | {"severity": {"wobble_straight": severity}} for row in rows]
            return rows

    driver = Weak(9.5, 0.0)
    found = visits.Visit(patient.facts(), asked=Symptom.WOBBLE_STRAIGHT, probes=PROBES)
    before = patient.chosen(patient.columns())
    found.rows = driver.drive(before, PROBES.values(), 2, seed=0)
    found.seen = visits.seen_in(found.rows)
    visits._treat(found, patient, NOTHING_TOLD, driver, seed=0)
    # Above half of the threshold the sign is enough, below it there is none.
    assert (found.treated is None) == (bar is None)
    assert ("a weak sign" in verdict(found)) == (bar == 0.5)
    if bar is not None:
        assert found.bar == bar
        assert found.cure.after_target == 0


def test_what_was_tried_until_ctrl_c_is_kept(patient):
    class Stopped(Counted):
        batches = 0

        def drive_together(self, presets, probes, trials, *, seed):
            # The third batch of trials is of the second dozen of changes.
            if trials == 1 and len(probes) == 1:
                self.batches += 1
                if self.batches == 2:
                    raise KeyboardInterrupt
            return super().drive_together(presets, probes, trials, seed=seed)

    found = visits.Visit(patient.facts(), asked=Symptom.WOBBLE_STRAIGHT, probes=PROBES)
    found.rows = Counted(9.5, 1.9).drive(
        patient.chosen(patient.columns()), PROBES.values(), 2, seed=0
    )
    found.seen = {Symptom.WOBBLE_STRAIGHT: list(PROBES)}
    with pytest.raises(KeyboardInterrupt):
        visits._treat(found, patient, NOTHING_TOLD, Stopped(9.5, 1.9), seed=0)
    assert len([entry for entry in found.tried if entry.pairs]) >= TOGETHER


def test_the_page_begins_with_the_verdict_and_the_patch_applies(patient, tmp_path):
    found = visits.Visit(patient.facts(), probes=PROBES, treated=Symptom.COLLISION)
    found.seen = {Symptom.COLLISION: ["straight"]}
    found.judged = [judged(patient, ["collision"], [], Symptom.COLLISION)]
    found.tried = [entry.tried for entry in found.judged]
    written = {path.name for path in write_outputs(found, patient, tmp_path)}
    assert written == {"doctor.html", "patched.yaml", "change.patch"}
    page = (tmp_path / "doctor.html").read_text()
    assert page.index('class="verdict"') < page.index("<h2>")
    assert "8 of 8 trials showed it before and 0 after" in page
    # Each removed and each added line is marked, the names of the files are not.
    assert "<del>-        consider_footprint: false</del>\n<ins>+        consider" in page
    assert (page.count("<del>"), page.count("<ins>")) == (1, 1)
    assert "consider_footprint: true" in (tmp_path / "patched.yaml").read_text()
    patch = (tmp_path / "change.patch").read_text()
    assert "-        consider_footprint: false\n+        consider_footprint: true\n" in patch


def test_the_patch_of_a_file_without_a_last_end_of_line_applies():
    file = Path("nav2.yaml")
    patient = SimpleNamespace(
        texts={file: "a: 1\nb: 2"}, patched_texts=lambda changes: {file: "a: 1\nb: 3"}
    )
    patch = patch_of(patient, SimpleNamespace(changes={}))
    assert patch.splitlines() == [
        "--- nav2.yaml", "+++ nav2.yaml", "@@ -1,2 +1,2 @@", " a: 1",
        "-b: 2", "\\ No newline at end of file", "+b: 3", "\\ No newline at end of file",
    ]  # fmt: skip


def test_what_a_rule_leads_to_is_treated_before_what_weighs_more_and_after_a_touch(patient):
    # The rule about the outline leads to corners cut, and to no robot that does not start.
    found = visits.Visit(patient.facts(), findings=findings_of(patient.facts()))
    assert [finding.rule.name for finding in found.findings] == ["mppi-centre-alone"]
    found.seen = {Symptom.NO_START: ["door"], Symptom.CORNER_CUTTING: ["bends"]}
    assert visits._to_treat(found) == [Symptom.CORNER_CUTTING, Symptom.NO_START]
    found.seen[Symptom.COLLISION] = ["door"]
    assert visits._to_treat(found)[0] is Symptom.COLLISION
    found.asked = Symptom.NO_START
    assert visits._to_treat(found) == [Symptom.NO_START]
    # Who complains of touches is helped where the robot passes too closely.
    found.asked, found.seen = Symptom.COLLISION, {Symptom.NEAR_MISS: ["door"]}
    assert visits._to_treat(found) == [Symptom.NEAR_MISS]
    found.asked = Symptom.NO_START
    assert visits._to_treat(found) == []


def test_a_touch_is_treated_where_no_probe_shows_what_was_asked_for(patient):
    # The unchanged file touches something in every trial; the change takes that away.
    driver = Rows([Symptom.COLLISION], [])
    found = visits.visit(patient, Symptom.SPINS, Told("it spins on the spot"), driver, seed=0)
    assert found.treated is Symptom.COLLISION
    told = verdict(found)
    assert told.startswith("No probe shows spins. In 17 of 17 probes")
    assert told.endswith(" Below: 3 changes to try on the robot for spins.")


def test_who_asks_for_near_misses_is_told_of_touches(patient):
    driver = Rows([Symptom.NEAR_MISS, Symptom.COLLISION], [])
    asked = {
        symptom: verdict(visits.visit(patient, symptom, NOTHING_TOLD, driver, seed=0))
        for symptom in (Symptom.NEAR_MISS, Symptom.COLLISION)
    }
    told = " Worse, it touches something in 17 of 17 probes (a door 0.2 m wider than the robot; "
    assert told in asked[Symptom.NEAR_MISS]
    assert "--symptom collision treats that." in asked[Symptom.NEAR_MISS]
    assert "Worse, it touches" not in asked[Symptom.COLLISION]


def test_what_the_words_tell_is_treated_before_what_rules_lead_to_and_after_a_touch(patient):
    found = visits.Visit(patient.facts(), findings=findings_of(patient.facts()))
    found.told = [Symptom.GOAL_OVERSHOOT, Symptom.WOBBLE_STRAIGHT]
    found.seen = {s: ["door"] for s in (Symptom.CORNER_CUTTING, Symptom.NO_START)}
    found.treated = Symptom.CORNER_CUTTING
    found.probes = PROBES
    assert visits._to_treat(found)[0] is Symptom.CORNER_CUTTING
    assert verdict(found).startswith(
        "No probe shows what your words may tell (goal_overshoot, wobble_straight). In 1 of 3"
    )
    found.seen |= {s: ["door"] for s in (Symptom.WOBBLE_STRAIGHT, Symptom.COLLISION)}
    assert visits._to_treat(found)[:2] == [Symptom.COLLISION, Symptom.WOBBLE_STRAIGHT]
    assert verdict(found).startswith("In 1 of 3")


def test_a_complaint_that_no_probe_shows_is_not_called_nothing_to_improve(patient):
    # Every trial arrives without a symptom.
    told = Told("it swings left and right on straight ways, like a snake")
    found = visits.visit(patient, None, told, Rows([], []), seed=0)
    assert found.told[0] is Symptom.WOBBLE_STRAIGHT
    assert "Your words may tell wobble_straight. Below: 3 changes to try" in verdict(found)
    silent = visits.visit(patient, None, Told(), Rows([], []), seed=0)
    assert verdict(silent) == "Nothing to improve: no probe shows a symptom."


@pytest.mark.parametrize(
    ("after", "reason", "is_out_of_time", "told"),
    [
        (
            0.0,
            NO_TIME,
            True,
            "(shown above 1) falls from 2.00 to 0.00 in 3 pairs, too few to show it",
        ),
        # 10% less is no promise, and with all the time it is only not shown.
        (1.8, NO_TIME, True, "No cause found: no change that was tried removes the symptom."),
        (0.0, "others do more in the first pairs", True, "No cause found"),
        (0.0, "", False, "No cause found"),
    ],
)
def test_a_change_that_the_end_of_the_time_cut_off_is_named(
    patient, after, reason, is_out_of_time, told
):
    found = visits.Visit(patient.facts(), treated=Symptom.COLLISION, probes=PROBES)
    found.seen = {Symptom.COLLISION: ["door"]}
    found.is_out_of_time = is_out_of_time
    found.tried = [tried(2.0, after, 1.0, pairs=3, reason=reason)]
    assert told in verdict(found)


def test_causes_are_tried_where_a_probe_was_made_for_the_symptom(patient):
    found = visits.Visit(patient.facts())
    found.seen = {Symptom.DOOR_STOP: ["dead_end", "door"], Symptom.SPINS: ["dead_end"]}
    assert visits._most_severe(found, Symptom.DOOR_STOP) == ["door"]
    assert visits._most_severe(found, Symptom.SPINS) == ["dead_end"]


@pytest.mark.parametrize("asked", [Symptom.COLLISION, None])
def test_a_symptom_that_is_too_rare_for_the_search_gives_way_to_the_next(patient, asked):
    """Of two symptoms one is in a trial of 24: 13 of 48 are needed, so 312 pairs."""

    class Both(Rows):
        def drive(self, preset, probes, trials, *, seed):
            rows = super().drive(preset, probes, trials, seed=seed)
            if preset.name == "before":
                rows = [row | {"severity": {"near_miss": 2.0}} for row in rows]
                rows[:1] = [row | {"severity": both} for row in rows[:1]]
            return rows

    both = {"near_miss": 2.0, "collision": 2.0}
    driver = Both([], [])
    found = visits.Visit(patient.facts(), asked=asked, probes=PROBES)
    found.rows = driver.drive(patient.chosen(patient.columns()), PROBES.values(), 2, seed=0)
    found.seen = {s: list(PROBES) for s in (Symptom.COLLISION, Symptom.NEAR_MISS)}
    visits._treat(found, patient, NOTHING_TOLD, driver, seed=0)
    assert found.rare == {Symptom.COLLISION: (1, 24)}
    assert found.treated is Symptom.NEAR_MISS
    told = (
        "collision is too rare to find its cause: 1 of 24 further trials of the unchanged file "
        "have any of it. A change is shown to help by 13 pairs of trials in which it falls, and "
        "at most 48 pairs are driven; here they need about 312 pairs."
    )
    assert told in verdict(found)
    assert "try for" not in verdict(found)
    assert found.cure.after_target == 0


def test_if_what_is_seen_is_too_rare_no_change_is_tried(patient):
    driver = Rows(["wobble_straight"], [], seldom=())
    found = visits.Visit(patient.facts(), asked=Symptom.WOBBLE_STRAIGHT, probes=PROBES)
    found.seen = {Symptom.WOBBLE_STRAIGHT: ["straight"]}
    visits._treat(found, patient, NOTHING_TOLD, driver, seed=0)
    assert found.rare == {found.treated: (0, 24)}
    assert found.tried == []
    assert verdict(found).endswith("at most 48 pairs are driven. So no change was tried.")


def test_causes_are_tried_on_the_probes_that_always_show_the_symptom(patient, monkeypatch):
    driven = set()
    monkeypatch.setitem(visits.MADE_FOR, Symptom.WOBBLE_STRAIGHT, tuple(PROBES))

    class Noted(Rows):
        def drive(self, preset, probes, trials, *, seed):
            if seed == SEARCH_SEED:
                driven.update(probe.name for probe in probes)
            return super().drive(preset, probes, trials, seed=seed)

    driver = Noted(["wobble_straight"], [])
    found = visits.Visit(patient.facts(), asked=Symptom.WOBBLE_STRAIGHT, probes=PROBES)
    found.rows = driver.drive(patient.chosen(patient.columns()), PROBES.values(), 2, seed=0)
    # In one of two trials the door does not show it.
    next(row for row in found.rows if row["scenario"] == "probe_door")["severity"] = {}
    found.seen = {Symptom.WOBBLE_STRAIGHT: list(PROBES)}
    visits._treat(found, patient, NOTHING_TOLD, driver, seed=0)
    # The judgement has all three.
    assert driven == {"probe_straight", "probe_corridor"}
    assert set(found.cure.showing) == set(PROBES)


@pytest.mark.parametrize(
    ("price", "driven"), [("spins", [BEYOND, HALF]), ("collision", [HALF]), ("", [])]
)
def test_what_takes_the_symptom_away_at_a_price_is_tried_in_further_steps(
    patient, monkeypatch, price, driven
):
    steps = []

    class Steps:
        rarity = Rarity(12, 12)

        def further(self, entry, shares):
            steps.extend(shares)
            return []

    found = visits.Visit(patient.facts(), asked=Symptom.WOBBLE_STRAIGHT, probes=PROBES)
    found.rows = Rows(["wobble_straight"], []).drive(
        patient.chosen(patient.columns()), PROBES.values(), 2, seed=0
    )
    found.seen = {Symptom.WOBBLE_STRAIGHT: ["straight"]}
    found.tried = [tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)]
    monkeypatch.setattr(visits, "_try_causes", lambda *arguments, **named: Steps())
    driver = Rows(["wobble_straight"], [price] if price else [])
    visits._treat(found, patient, NOTHING_TOLD, driver, seed=0)
    assert steps == driven


def test_a_symptom_that_one_of_two_trials_shows_is_looked_at_again():
    def row(probe, *symptoms):
        return {"scenario": f"probe_{probe}", "severity": {s: 2.0 for s in symptoms}}

    rows = [row("door", "spins"), row("door"), row("bends", "spins"), row("bends", "spins")]
    assert unsure_of(rows) == ["door"]
    # Of four trials one shows it: less than half.
    assert visits.seen_in([*rows, row("door"), row("door")]) == {Symptom.SPINS: ["bends"]}
    # What every trial shows is sure, and what none shows as well.
    assert unsure_of(rows[2:]) == []


def test_a_value_otherwise_than_nav2s_is_tried_after_the_suspects(patient):
    facts = patient.facts()
    known = suspicions_of(facts, Symptom.GOAL_OVERSHOOT)
    more = [s for s in with_differences(known, facts) if s not in known]
    told = {s.cause.place: (s.cause.direction, s.cause.to) for s in more}
    # The file has 20 s, Nav2 10 s.
    assert told["progress_checker.movement_time_allowance"] == (Direction.DOWN, 10.0)


def test_a_speed_beyond_what_the_file_lets_through_is_a_difference(patient):
    def speeds(**velocity_smoother):
        text = nav2_text(MPPI_BLOCK, plugin=MPPI, velocity_smoother=velocity_smoother)
        patient.paths[0].write_text(text)
        facts = replace(patient).facts()
        found = with_differences([], facts)
        return [s.cause.to for s in found if s.cause.place == "controller.vx_max"]

    # The controller asks for 0.5 m/s.
    assert speeds(max_velocity=[0.25, 0.0, 1.0], min_velocity=[-0.25, 0.0, -1.0]) == [0.25]
    assert speeds(max_velocity=[0.5, 0.0, 1.0], min_velocity=[-0.5, 0.0, -1.0]) == []


def test_a_check_that_nav2_has_off_is_not_turned_off(patient):
    def switches(is_on):
        block = MPPI_BLOCK | {"CostCritic": {"consider_footprint": is_on, "enabled": False}}
        patient.paths[0].write_text(nav2_text(block, plugin=MPPI))
        found = with_differences([], replace(patient).facts())
        return {s.cause.place for s in found if s.cause.direction is Direction.SET}

    # Nav2 has the outline's check off and the critic on.
    assert switches(is_on=True) == switches(is_on=False) == {"controller.CostCritic.enabled"}


def test_a_limit_of_motion_is_tried_before_unusual_values_if_it_is_far_else_when_all_else_was(
    patient,
):
    critic = MPPI_BLOCK | {"CostCritic": {"consider_footprint": True, "enabled": False}}
    patient.paths[0].write_text(nav2_text(critic | {"wz_max": 0.3, "vx_max": 0.35}, plugin=MPPI))
    found = with_differences([], patient.facts())
    by_place = {s.cause.place: s for s in found}
    switch, limit = by_place["controller.CostCritic.enabled"], by_place["controller.wz_max"]
    assert (switch.cause.direction, switch.cause.to) == (Direction.SET, True)
    # Nav2 has 1.9 rad/s.
    assert (limit.cause.direction, limit.cause.to) == (Direction.UP, 1.9)
    assert limit.score == switch.score
    # 0.35 m/s is not far from Nav2's 0.5.
    assert by_place["controller.vx_max"].score == min(s.score for s in found) < limit.score


def test_nothing_seen_is_a_verdict(patient):
    found = visits.Visit(patient.facts(), probes=PROBES)
    assert verdict(found) == "Nothing to improve: no probe shows a symptom."
    asked = visits.Visit(patient.facts(), probes=PROBES, asked=Symptom.SPINS)
    assert verdict(asked).startswith("No cause found: no probe shows spins")


@pytest.mark.parametrize("robot", ["wheelchair", "turtlebot4", "jackal"])
def test_every_probe_can_be_planned_for_a_robots_outline(robot):
    loaded = load_robot(robot)
    probes = probes_for(loaded, loaded.drive.max_linear_velocity_mps)
    assert {f"{name}_rough" for name in ROUGH} <= set(probes)
    assert set(MAKERS) - {"slow_zone"} <= set(probes)
    for probe in probes.values():
        assert probe.timeout_s <= LONGEST_S


def test_the_person_walks_into_no_robot_that_goes_around():
    (person,) = probes_for(load_robot("turtlebot4"), 0.3)["person_crossing"].world.moving_obstacles
    # It comes from the side and stays on the path.
    assert [waypoint.position[1] for waypoint in person.waypoints] == [-2.0, -0.1]


def test_a_journal_with_a_torn_line_goes_on(tmp_path):
    entry = {"identity": "a", "detectors": detectors_digest(), "row": {"severity": {}}}
    # Severities of other detectors would be compared with those of today's.
    older = json.dumps(entry | {"identity": "c", "detectors": "older"})
    (tmp_path / "journal.jsonl").write_text(f'{json.dumps(entry)}\n{older}\n{{"identity": "b", "ro')
    driver = Driver(tmp_path, "wheelchair", jobs=1, budget_s=1.0, tell=print)
    assert set(driver._rows) == {"a"}


@pytest.mark.long
def test_the_wall_is_found_and_cured(tmp_path, capsys):
    """MPPI with the wheelchair drives into walls; to look at its outline cures it.

    The file is read as for Iron, which looks at an outline within the inflation alone: both change.
    """
    path = tmp_path / "nav2.yaml"
    local = {
        "footprint": "[[0.85, 0.30], [0.85, -0.30], [-0.25, -0.30], [-0.25, 0.30]]",
        "width": 6,
        "height": 6,
    }
    critics = {"critics": [*MPPI_BLOCK["critics"], "GoalAngleCritic", "PathAngleCritic"]}
    path.write_text(nav2_text(MPPI_BLOCK | critics, plugin=MPPI, local_costmap=local))
    out = tmp_path / "out"
    arguments = [str(path), "--symptom", "collision", "--out", str(out), "--budget", "2h"]
    assert main(arguments) == 0
    assert "consider_footprint: true" in (out / "patched.yaml").read_text()
    told = " ".join(capsys.readouterr().out.split())
    assert "CostCritic.consider_footprint = true and local_costmap: inflation_layer" in told
