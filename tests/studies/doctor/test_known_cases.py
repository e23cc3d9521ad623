"""Known cases: a culprit in the right direction is a hit, in the wrong one it is none."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest
import yaml
from doctor_texts import MPPI, MPPI_BLOCK, nav2_text

from drake_navbench.commands.doctor import main
from drake_navbench.studies.doctor.alike import Told
from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.known_cases import Case, is_hit, read_cases, score_case, score_of
from drake_navbench.studies.doctor.partial_files import facts_of_values
from drake_navbench.studies.doctor.reading import suspicions_of
from drake_navbench.studies.doctor.symptoms import Symptom

LISTS = Path(__file__).parents[3] / "studies" / "doctor_cases"
CASE = {
    "id": "A1",
    "link": "somebody/robot#1",
    "release": "jazzy",
    "controller": "MPPI",
    "robot": "diff",
    "symptom_class": "wobble_straight",
    "symptom": "weaves",
    "parameters": {"wz_std": 0.9},
    "culprits": {"wz_std": "down (0.3)"},
    "reproducible": "partial",
}


def case(**changed):
    return Case.model_validate(CASE | changed)


@pytest.mark.parametrize(
    ("cure", "direction", "to", "is_right"),
    [
        ("down (0.3)", Direction.DOWN, None, True),
        ("down (0.3)", Direction.UP, None, False),
        ("up", Direction.UP, 0.4, True),
        (0.3, Direction.DOWN, None, True),
        (1.5, Direction.DOWN, None, False),
    ],
)
def test_the_direction_of_the_cure_decides(cure, direction, to, is_right):
    facts = facts_of_values("MPPI", "jazzy", {"wz_std": 0.9})
    cause = Cause("controller.wz_std", direction, to)
    assert is_hit(cause, case(culprits={"wz_std": cure}), facts) is is_right


@pytest.mark.parametrize(("cure", "is_right"), [("set (Pose)", True), ("set (Simple)", False)])
def test_a_plugin_may_be_named_without_its_package(cure, is_right):
    known = case(culprits={"progress_checker.plugin": cure})
    cause = Cause("progress_checker.plugin", Direction.SET, "nav2_controller::Pose")
    assert is_hit(cause, known, facts_of_values("MPPI", "jazzy", {})) is is_right


def test_a_critics_weight_is_not_another_critics():
    facts = facts_of_values("MPPI", "jazzy", {})
    cause = Cause("controller.PathAlignCritic.cost_weight", Direction.UP)
    assert is_hit(cause, case(culprits={"PathAlignCritic.cost_weight": "up"}), facts)
    assert not is_hit(cause, case(culprits={"PathAngleCritic.cost_weight": "up"}), facts)


def test_outside_and_release_count_where_they_are_right():
    facts = facts_of_values("DWB", "humble", {})
    computer, newer = Cause("outside.compute", Direction.DOWN), Cause("release", Direction.UPGRADE)
    assert is_hit(computer, case(culprits={"compute": "release build"}), facts)
    assert not is_hit(computer, case(culprits={"wz_std": "down"}), facts)
    assert is_hit(newer, case(culprits={"release": "with the fix"}), facts)
    assert not is_hit(newer, case(culprits={"wz_std": "down"}), facts)


def test_a_whole_file_counts_instead_of_the_named_values(tmp_path):
    (tmp_path / "A1.yaml").write_text(nav2_text(MPPI_BLOCK | {"wz_std": 0.9}, plugin=MPPI))
    found = score_case(case(parameters={"wz_std": 0.01}), tmp_path)
    assert found.has_file
    assert found.rank == 1


def test_a_symptom_that_nobody_knows_is_a_miss_and_told():
    found = score_case(case(symptom_class="purple"), None)
    assert found.rank is None
    assert "purple" in found.skipped
    assert score_of("one", [found]).first == 0


def test_the_command_prints_the_score_and_writes_the_page(tmp_path, capsys):
    cases, page = tmp_path / "cases.yaml", tmp_path / "score.md"
    cases.write_text(
        yaml.safe_dump({"known": [CASE, CASE | {"id": "A2", "culprits": {"x": "up"}}]})
    )
    assert main(["--score", str(cases), "--page", str(page)]) == 0
    told = capsys.readouterr().out
    assert page.read_text() in told
    # One of two is hit.
    assert "| all | 2 | 1 | 1 | 50% | 50% |" in told
    assert "A2** wobble_straight, MPPI, named values: missed" in told
    # Every miss is explained: nobody has a parameter x.
    assert re.search(r"why not first: the cure is none of the \d+ causes", told)
    assert len(read_cases(cases)) == 2
    # No folder: a file in the place of one.
    assert main(["--score", str(cases), "--page", str(cases / "score.md")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line == f"{cases}/score.md: cannot be written: File exists"


def test_a_cure_in_the_other_direction_is_told_apart_from_an_unknown_one():
    # A robot that wobbles: the doctor knows wz_max as too high alone.
    found = score_case(case(culprits={"wz_max": "up"}), None)
    assert found.rank is None
    assert found.why.endswith("but in the other direction")


def test_the_command_reads_a_file(tmp_path, capsys):
    path = tmp_path / "nav2.yaml"
    path.write_text(nav2_text(MPPI_BLOCK, plugin=MPPI))
    assert main([str(path), "--read-only", "--symptom", "collision"]) == 0
    told = capsys.readouterr().out
    assert "mppi-centre-alone" in told
    assert "1. set FollowPath.CostCritic.consider_footprint to true" in told
    assert max(map(len, told.splitlines())) <= 80


def read(tmp_path, capsys, *arguments):
    """Returns what the command prints about a file of MPPI."""
    path = tmp_path / "nav2.yaml"
    path.write_text(nav2_text(MPPI_BLOCK, plugin=MPPI))
    assert main([str(path), "--read-only", *arguments]) == 0
    told = capsys.readouterr().out
    assert max(map(len, told.splitlines())) <= 80
    return told


def test_own_words_tell_the_class_of_the_symptom(tmp_path, capsys):
    told = read(tmp_path, capsys, "--symptom", "it crashes into walls")
    assert told.startswith("Symptom: your words are taken as collision; the next likeliest")
    assert "What may cause collision" in told


@pytest.mark.parametrize("words", ["it crashes into walls", "a heavy robot in a hospital"])
def test_words_that_may_be_about_the_robot_take_no_class_but_name_the_likeliest(
    words, tmp_path, capsys
):
    told = read(tmp_path, capsys, "--told", words)
    assert told.startswith("Symptom: none is given. Your words may tell ")
    assert "What may cause" not in told


def test_words_like_no_known_complaint_name_no_class(tmp_path, capsys):
    assert read(tmp_path, capsys, "--told", "purple").startswith("Read: ")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([], "expected a Nav2 file"),
        (["{file}", "--read-only", "--symptom", "purple"], "expected one of wobble_straight"),
        (["{file}", "--read-only", "--controller", "X"], "expected one of FollowPath"),
        (["{file}", "--page", "x.md"], "--page: goes with --score"),
        (["missing.yaml", "--read-only"], "missing.yaml"),
    ],
)
def test_wrong_input_is_one_line(arguments, told, tmp_path, capsys):
    path = tmp_path / "nav2.yaml"
    path.write_text(nav2_text(MPPI_BLOCK, plugin=MPPI))
    assert main([text.format(file=path) for text in arguments]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1


def ranked(**changed):
    return [s.cause for s in score_case(case(**changed), None).causes]


def test_names_of_ros_1_stand_for_nav2s():
    old = {"release": "ROS 1 kinetic", "controller": "DWA", "symptom_class": "spins"}
    found = facts_of_values("DWA", "ROS 1 kinetic", {"max_rot_vel": 6.0, "odom_alpha1": 1.5})
    assert found["controller.max_vel_theta"] == 6.0
    assert found["amcl.alpha1"] == 1.5
    first = ranked(**old, parameters={"max_rot_vel": 6.0}, culprits={})[0]
    assert first.key == ("controller.max_vel_theta", Direction.DOWN)


def test_a_costmaps_parameter_needs_no_costmap_before_its_name():
    found = facts_of_values("DWB", "humble", {"min_obstacle_height": 0.25})
    assert found["local_costmap.min_obstacle_height"] == 0.25


def test_a_value_that_the_user_names_is_a_cause_without_a_suspect_of_it():
    # No suspect of near_miss is about k_phi; 9.0 is 4.5 times Nav2's 2.0.
    named = {"controller": "Graceful", "symptom_class": "near_miss", "symptom": "is too bold"}
    places = [c.key for c in ranked(**named, parameters={"k_phi": 9.0}, culprits={})]
    assert ("controller.k_phi", Direction.DOWN) in places
    places = [c.key for c in ranked(**named, parameters={}, culprits={})]
    assert ("controller.k_phi", Direction.DOWN) not in places


def test_a_bare_plugin_is_the_controllers():
    given = facts_of_values("RPP", "humble", {"plugin": "dwb_core::DWBLocalPlanner"}).given
    assert given == {"controller.plugin"}


def test_what_the_user_tried_in_vain_counts_less():
    slow = {"symptom_class": "too_slow", "parameters": {"vx_max": 1.0}, "culprits": {}}
    plain = ranked(**slow, symptom="drives slowly")
    assert plain[0].place == "controller.vx_max"
    told = ranked(**slow, symptom="drives slowly; raising vx_max changes nothing")
    assert "controller.vx_max" not in [cause.place for cause in told]


def test_a_parameter_that_is_told_to_be_missing_is_to_be_set():
    weaves = {"controller": "RPP", "symptom": "weaves", "culprits": {}}
    missing = {"controller_server.odom_topic": "missing"}
    assert ranked(**weaves, parameters=missing)[0].key == (
        "controller_server.odom_topic",
        Direction.SET,
    )


def test_a_robot_that_is_too_slow_is_not_made_slower():
    # 56 steps of 0.05 s at 3 m/s reach 8.4 m, beyond half the window: as a rule, slower helps.
    fast = {"vx_max": 3.0}
    found = facts_of_values("MPPI", "jazzy", fast)
    scores = {
        symptom: {s.cause.key: s.score for s in suspicions_of(found, symptom)}
        for symptom in (Symptom.TOO_SLOW, Symptom.STOP_START_JERK)
    }
    key = ("controller.vx_max", Direction.DOWN)
    assert scores[Symptom.TOO_SLOW][key] < 0.5 * scores[Symptom.STOP_START_JERK][key]


def test_a_simulation_is_no_word_about_an_imu():
    sim = suspicions_of(facts_of_values("TEB", "ROS 1", {}), Symptom.SPINS, Told("a simulation"))
    imu = suspicions_of(facts_of_values("TEB", "ROS 1", {}), Symptom.SPINS, Told("an IMU"))
    plain, told = ({s.cause.place: s.score for s in found} for found in (sim, imu))
    assert plain["outside.imu_frame"] < told["outside.imu_frame"]


def test_a_rule_that_fires_on_bringups_own_values_weighs_less():
    # raytrace_max_range 3.0 beside obstacle_max_range 2.5 is bringup's own; so told it is evidence.
    names = {"obstacle_max_range": 2.5, "raytrace_max_range": 3.0}
    key = ("local_costmap.raytrace_max_range", Direction.SET)

    def score(values):
        found = facts_of_values("DWB", "jazzy", values)
        return {s.cause.key: s.score for s in suspicions_of(found, Symptom.COLLISION)}[key]

    assert score({}) < 0.5 * score(names)


def test_a_plugin_that_a_release_has_not_is_not_proposed():
    def proposed(release):
        found = facts_of_values("DWB", release, {})
        causes = [s.cause for s in suspicions_of(found, Symptom.FALSE_ABORT)]
        return "nav2_controller::PoseProgressChecker" in [cause.to for cause in causes]

    assert proposed("humble")
    assert not proposed("galactic")


def test_the_public_cases_are_read_and_no_owner_is_in_both_halves():
    development, test = (read_cases(LISTS / f"{half}.yaml") for half in ("development", "test"))
    assert (len(development), len(test)) == (40, 31)
    owners = [{case.link.partition("/")[0] for case in half} for half in (development, test)]
    assert not owners[0] & owners[1]
    for case in (*development, *test):
        assert case.symptom_class in list(Symptom)
        assert case.culprits


def test_the_fresh_cases_have_the_form_of_the_others_and_owners_of_their_own():
    # Not scored here: the doctor reads them once, in a study.
    names = ("development", "test", "thirty_eight")
    older = {owner_of(case) for name in names for case in read_cases(LISTS / f"{name}.yaml")}
    listed = yaml.safe_load((LISTS / "fresh.yaml").read_text(encoding="utf-8"))
    fresh = read_cases(LISTS / "fresh.yaml")
    owners = Counter(owner_of(case) for case in fresh)
    assert len({case.id for case in fresh}) == len(fresh) == 40
    assert max(owners.values()) <= 4
    assert not older & set(owners)
    for case, entry in zip(fresh, listed["known"], strict=True):
        assert case.symptom_class in list(Symptom)
        assert case.symptom
        assert 1 <= len(case.culprits) <= 4
        assert entry["file"]["commit"] == case.link.partition("@")[2]
        assert entry["file"]["paths"]


def owner_of(case):
    return case.link.partition("/")[0].lower()
