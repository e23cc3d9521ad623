"""A Nav2 file that takes the robot for smaller than its own model, and the cure."""

import pytest
import yaml
from doctor_texts import RPP, RPP_BLOCK, nav2_text

from drake_navbench.commands.doctor import main
from drake_navbench.studies.doctor.alike import Told
from drake_navbench.studies.doctor.change_words import change_told
from drake_navbench.studies.doctor.cures import trials_of
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.reading import findings_of, suspicions_of
from drake_navbench.studies.doctor.symptoms import Symptom

RULE = "outline-smaller-than-the-model"
# The base is at the rear axle: the body reaches 0.5 m ahead of it.
LONG = "footprint: [[-0.1, -0.25], [0.5, -0.25], [0.5, 0.25], [-0.1, 0.25]]"
ROUND = "robot_radius: 0.3"


@pytest.fixture
def patient(tmp_path):
    """A function from the user's own body and the file's radius to the doctor's patient."""

    def of(body, radius_m):
        robot, path = tmp_path / "own.yaml", tmp_path / "nav2.yaml"
        robot.write_text(f"description: own\n{body}\n")
        content = yaml.safe_load(nav2_text(RPP_BLOCK, plugin=RPP))
        local = content["local_costmap"]["local_costmap"]["ros__parameters"]
        del local["footprint"]
        local["robot_radius"] = radius_m
        content["global_costmap"] = {"global_costmap": {"ros__parameters": dict(local)}}
        path.write_text(yaml.safe_dump(content))
        return Patient((path,), str(robot), {}, "jazzy")

    return of


def first_change(own):
    facts = own.facts()
    first = suspicions_of(facts, Symptom.COLLISION, Told(""))[0]
    (change, *_) = trials_of(first.cause, facts, own.columns().setup)
    own.before_and_after(change.changes)
    return {
        f"{place.node.partition('/')[0]}.{place.name}": v for place, v in change.changes.items()
    }


def test_a_body_longer_than_the_circle_becomes_the_footprint_of_both_costmaps(patient):
    own = patient(LONG, 0.25)
    (finding,) = [f for f in findings_of(own.facts()) if f.rule.name == RULE]
    # With the padding of 0.01 m the circle ends at 0.26 m, the corner lies at (0.5, 0.25):
    # sqrt(0.5^2 + 0.25^2) = 0.559, less 0.26 m.
    assert "robot_radius is 0.25 m" in finding.seen
    assert "x = -0.10 to 0.50 m and from y = -0.25 to 0.25 m about its base, 0.30 m" in finding.seen
    footprint = "[[-0.1, -0.25], [0.5, -0.25], [0.5, 0.25], [-0.1, 0.25]]"
    assert first_change(own) == {
        "local_costmap.footprint": footprint,
        "global_costmap.footprint": footprint,
    }
    # A line of progress has no room for all corners.
    first = suspicions_of(own.facts(), Symptom.COLLISION, Told(""))[0]
    (change, *_) = trials_of(first.cause, own.facts(), own.columns().setup)
    assert change_told(change) == (
        "local_costmap: footprint = [[-0.1, -0.25], ...] and "
        "global_costmap: footprint = [[-0.1, -0.25], ...]"
    )
    # It is one finding, not a second one of the check's doubt.
    assert "probably-a-mistake" not in {f.rule.name for f in findings_of(own.facts())}


def test_a_round_body_gets_a_larger_radius(patient):
    assert first_change(patient(ROUND, 0.2)) == {
        "local_costmap.robot_radius": pytest.approx(0.3),
        "global_costmap.robot_radius": pytest.approx(0.3),
    }


def test_a_body_within_the_files_outline_is_no_finding(patient):
    # 0.559 m are within 0.56 m.
    assert RULE not in {f.rule.name for f in findings_of(patient(LONG, 0.56).facts())}


@pytest.mark.parametrize(("front_m", "told"), [(0.42, None), (0.45, 0.45)])
def test_an_outline_that_is_too_short_ahead_keeps_its_room_behind(patient, front_m, told):
    """The file's outline reaches from -0.6 to 0.4 m, padded to 0.41 m; cells have 0.05 m."""
    side = 0.25
    own = patient(
        f"footprint: [[-0.1, -{side}], [{front_m}, -{side}], [{front_m}, {side}], [-0.1, {side}]]",
        0.25,
    )
    content = yaml.safe_load(own.paths[0].read_text())
    for costmap in ("local_costmap", "global_costmap"):
        block = content[costmap][costmap]["ros__parameters"]
        del block["robot_radius"]
        block["footprint"] = f"[[-0.6, -{side}], [0.4, -{side}], [0.4, {side}], [-0.6, {side}]]"
    own.paths[0].write_text(yaml.safe_dump(content))
    own = Patient(own.paths, own.robot, {}, "jazzy")
    # Of 0.01 m beyond the outline, less than half a cell, no costmap knows anything.
    assert (RULE in {f.rule.name for f in findings_of(own.facts())}) == (told is not None)
    if told is not None:
        corners = yaml.safe_load(first_change(own)["local_costmap.footprint"])
        assert sorted(corners) == [[-0.6, -side], [-0.6, side], [told, -side], [told, side]]


@pytest.mark.parametrize("front_m", [0.5, 0.5004])
def test_the_cure_has_no_corner_between_two_others_on_one_line(patient, front_m):
    """The corner at x = 0.2 m lies 0.4 mm off the left side, which is less than is written."""
    own = patient(
        f"footprint: [[-0.1, -0.25], [{front_m}, -0.25], [{front_m}, 0.25], [0.2, 0.2504], "
        "[-0.1, 0.25]]",
        0.25,
    )
    content = yaml.safe_load(own.paths[0].read_text())
    for costmap in ("local_costmap", "global_costmap"):
        block = content[costmap][costmap]["ros__parameters"]
        del block["robot_radius"]
        block["footprint"] = "[[-0.2, -0.25], [0.1, -0.25], [0.1, 0.25], [-0.2, 0.25]]"
    own.paths[0].write_text(yaml.safe_dump(content))
    own = Patient(own.paths, own.robot, {}, "jazzy")
    corners = yaml.safe_load(first_change(own)["local_costmap.footprint"])
    assert sorted(corners) == [[-0.2, -0.25], [-0.2, 0.25], [0.5, -0.25], [0.5, 0.25]]


def test_a_model_is_read_with_the_packages_of_another_folder(patient, tmp_path, capsys):
    parts = tmp_path / "ws" / "parts"
    parts.mkdir(parents=True)
    (parts / "package.xml").write_text("<package><name>parts</name></package>")
    (parts / "body.xacro").write_text(
        '<robot><link name="base_link"><collision><geometry><box size="1.2 0.5 0.2"/></geometry>'
        "</collision></link></robot>"
    )
    (tmp_path / "robot").mkdir()
    model = tmp_path / "robot" / "cart.urdf.xacro"
    model.write_text(
        '<robot name="cart" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        '<xacro:include filename="$(find parts)/body.xacro"/></robot>'
    )
    (file,) = patient(LONG, 0.25).paths
    asked = [str(file), "--robot", str(model), "--read-only"]
    assert main(asked) == 2
    assert "left out what the package parts describes: not found" in capsys.readouterr().err
    assert main([*asked, "--packages", str(tmp_path / "ws")]) == 0
    assert "from x = -0.60 to 0.60 m" in capsys.readouterr().out
